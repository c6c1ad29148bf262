//! Stick–slip friction, tracked in time \[K02 §4.4.2; Hayward and Armstrong 2000, "HA00"\].
//!
//! Each contact keeps an *adhesion*: the point w of b at which it holds, and the point x of a that holds there. The strain
//! is z = x − w in the tangent plane. Each tick, for every contact of every cluster:
//!
//! 1. *Find* the contact's adhesion of the last tick: the one of the same two pieces (of several, the nearest); else the
//!    nearest one within reach whose normal is not opposed, whose strain it takes over (a probe that slides from one piece
//!    onto the next keeps its friction); else a new one without strain.
//! 2. *Carry* it: x moves with a, w rests on b, and z is their difference in the cluster's tangent plane. The normal part
//!    is no strain; w follows it.
//! 3. *Stick or slide*: z_max = μ F_n / k_t for a cluster alone, with μ static while sticking. Beyond it the contact slides, and w
//!    is dragged so that ‖z‖ is z_max; x comes to the present contact point in the same measure. μ falls to the dynamic one
//!    evenly over a slip of the static z_max (*slip weakening*, Ida 1972), so that nothing snaps, and contacts of one body that
//!    reach their limit one after the other still hold with the static μ together. A sliding contact sticks again, with all of
//!    its strength, as soon as it is no longer dragged.
//! 4. *Force* on a: −k_t z at x. While it sticks, that is the gradient of ½ k_t z²: at any other point, as at the contact's, which
//!    moves while a block rocks, it would feed a swing.
//!
//! **Twist.** A flat contact is one contact, however large, but its parts lie apart and hold against twisting about the
//! normal as well. With the lever R = [`FRICTION_LEVER`] · extent, at which all of the load would resist a twist as the evenly
//! loaded patch does, a twist by φ since the adhesion began is a strain R φ beside z: ‖(z, R φ)‖ is what sticks or slides, the
//! torque on a is −k_t R² φ along the normal. So friction and torque lie within the ellipsoid |F|² + (τ/R)² ≤ (μ F_n)², which
//! stands for the patch's true limit surface (Goyal, Ruina, Papadopoulos 1991; the ellipsoid is Howe and Cutkosky's, 1996).
//! Both slide together: a block that is pushed along turns easily. φ is a function of two stored attitudes, like z of points.
//!
//! Strain is a function of two stored points, not a sum of velocities: while it sticks, a contact that returns to its
//! place returns to its force, after any number of ticks.
//!
//! **Clusters.** The normal force belongs to a cluster, whose members share it in proportion to their engagement:
//! s_i = w_i / Σ w. Each member's load and tangential stiffness are the cluster's times s_i, so its z_max is the cluster's
//! own, μ F_n / k_t, and the friction of the members together is at most μ F_n of the cluster, in its tangent plane, for any
//! number of members. That many members also give a cluster a resistance to spinning about its normal, as far as they lie
//! apart.
//!
//! **Several clusters** share in the same way. The one that is pressed hardest (before smooth clustering leaves it a part) has all of
//! k_t, any other as much of it as of that load: k_t F_n / F_most. All have one z_max, μ F_most / k_t, so that a block slides as a
//! whole when it pulls with more than μ times its whole load, however that is spread; with a k_t for each, lightly loaded
//! contacts would let go one by one, at less. And a cluster that enters without load enters without stiffness.
//!
//! Deviations from HA00: static and dynamic coefficients, with the slip between (their elasto-plastic transition blends them); and
//! both points are taken along, strain kept, where the contact wanders farther than the reach from x (the probe rolls).

use glam::{DQuat, DVec3};

use super::{Cluster, Contact};
use crate::algebra::Pose;
use crate::algebra::tolerance::{FRICTION_HEIR, FRICTION_HELD, FRICTION_LEVER, FRICTION_LOOKS};

/// How surfaces hold each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionSettings {
    /// μ of a contact that sticks; at least the dynamic one.
    pub static_coefficient: f64,
    /// μ of a contact that slides.
    pub dynamic_coefficient: f64,
    /// k_t, N/m: of a cluster that sticks and is pressed as hard as any.
    pub tangential_stiffness: f64,
}

/// Where a contact holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adhesion {
    /// Piece of a.
    pub piece_a: u32,
    /// Piece of b.
    pub piece_b: u32,
    /// x: the point of a that holds, in a's frame.
    pub holding_a: DVec3,
    /// w: the point of b at which it holds, in b's frame.
    pub held_b: DVec3,
    /// a's attitude in b's frame at which it holds without twist.
    pub untwisted: DQuat,
    /// Midpoint of the contact when last seen, in b's frame.
    pub midpoint: DVec3,
    /// Normal of its cluster when last seen, in b's frame.
    pub normal: DVec3,
    /// It was being dragged.
    pub sliding: bool,
    /// m: how far, since it stuck last.
    pub slipped: f64,
}

/// One tick's clusters and what holds them together.
#[derive(Clone, Copy, Debug)]
pub struct Grasp<'a> {
    /// All contacts, in b's frame.
    pub contacts: &'a [Contact],
    /// Indices into `contacts`, cluster after cluster.
    pub members: &'a [u32],
    /// The clusters, naming ranges of `members`.
    pub clusters: &'a [Cluster],
    /// N: the normal force of each cluster.
    pub normal_forces: &'a [f64],
    /// t, m.
    pub tolerance: f64,
    /// m: how far a contact may be from its predecessor or from its own holding point.
    pub reach: f64,
    /// a placed in b's frame.
    pub pose_ba: Pose,
}

/// How one member of a cluster is held: a spring across its normal and one about it; in b's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Grip {
    /// x, where the force acts.
    pub point: DVec3,
    /// N, on a: −stiffness · z.
    pub force: DVec3,
    /// N·m, on a: −stiffness · lever² · φ along the normal.
    pub torque: DVec3,
    /// N/m: what is felt of k_t here.
    pub stiffness: f64,
    /// m: R.
    pub lever: f64,
    /// The most that both springs together hold, for each newton of the cluster's normal force; a torque counts over the lever.
    pub coefficient: f64,
    /// It is being dragged: neither spring gets longer.
    pub sliding: bool,
}

/// What happened to the adhesions in one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrictionCounters {
    /// Contacts that slide.
    pub sliding: u32,
    /// Contacts that took over the strain of another one.
    pub inherited: u32,
    /// Contacts that began without strain.
    pub fresh: u32,
    /// New contacts whose predecessor was not looked for, since the tick's budget was spent.
    pub unsought: u32,
}

impl std::ops::AddAssign for FrictionCounters {
    fn add_assign(&mut self, other: Self) {
        let Self { sliding, inherited, fresh, unsought } = other;
        self.sliding += sliding;
        self.inherited += inherited;
        self.fresh += fresh;
        self.unsought += unsought;
    }
}

/// Adhesions of the last tick, by pieces. An adhesion ends with its contact.
#[derive(Clone, Debug)]
pub struct FrictionTracker {
    capacity: usize,
    previous: Vec<Adhesion>,
    current: Vec<Adhesion>,
    grips: Vec<Grip>,
}

impl FrictionTracker {
    /// Memory for `capacity` contacts.
    pub fn new(capacity: usize) -> Self {
        Self {
            capacity,
            previous: Vec::with_capacity(capacity),
            current: Vec::with_capacity(capacity),
            grips: Vec::with_capacity(capacity),
        }
    }

    /// Forgets every adhesion: the next tick begins without strain.
    pub fn clear(&mut self) {
        self.previous.clear();
        self.grips.clear();
    }

    /// Adhesions after the last tick, sorted by pieces.
    pub fn adhesions(&self) -> &[Adhesion] {
        &self.previous
    }

    /// Friction of the last tick on a, in b's frame, parallel to the members.
    pub fn grips(&self) -> &[Grip] {
        &self.grips
    }

    /// One tick; the answer is in [`Self::grips`]. There are at most as many members as the capacity.
    pub fn update(&mut self, grasp: &Grasp<'_>, settings: &FrictionSettings) -> FrictionCounters {
        debug_assert!(grasp.members.len() <= self.capacity);
        let mut counters = FrictionCounters::default();
        let mut looks = FRICTION_LOOKS;
        self.current.clear();
        self.grips.clear();
        let most = grasp.most_pressed();
        for (cluster, &normal_force) in grasp.clusters.iter().zip(grasp.normal_forces) {
            let stiffness = if most > 0.0 { settings.tangential_stiffness * normal_force / most } else { 0.0 };
            let load = Load { normal: cluster.normal, most, stiffness };
            for &i in &grasp.members[cluster.members()] {
                let contact = &grasp.contacts[i as usize];
                let mut adhesion = self.find(contact, cluster.normal, grasp, &mut looks, &mut counters);
                let mut strain = carry(&mut adhesion, contact, cluster.normal, grasp);
                let coefficient = stick_or_slide(&mut adhesion, &mut strain, &load, grasp, settings);
                let point = grasp.pose_ba.point(adhesion.holding_a);
                let share = (grasp.tolerance - contact.separation) / cluster.weight;
                let coefficient = share * coefficient;
                self.grips.push(Grip { point, coefficient, sliding: adhesion.sliding, ..strain.grip(share, &load) });
                counters.sliding += u32::from(adhesion.sliding);
                self.current.push(adhesion);
            }
        }
        self.current.sort_unstable_by(|first, second| {
            let numbers = |a: &Adhesion| (a.piece_a, a.piece_b);
            let (p, q) = (first.midpoint.to_array(), second.midpoint.to_array());
            let by_place = || p.iter().zip(&q).map(|(x, y)| x.total_cmp(y)).find(|order| order.is_ne());
            numbers(first).cmp(&numbers(second)).then_with(|| by_place().unwrap_or(std::cmp::Ordering::Equal))
        });
        std::mem::swap(&mut self.previous, &mut self.current);
        counters
    }

    /// Step 1.
    fn find(
        &self,
        contact: &Contact,
        normal: DVec3,
        grasp: &Grasp<'_>,
        looks: &mut usize,
        counters: &mut FrictionCounters,
    ) -> Adhesion {
        let midpoint = contact.midpoint();
        let pieces = (contact.piece_a, contact.piece_b);
        let first = self.previous.partition_point(|adhesion| (adhesion.piece_a, adhesion.piece_b) < pieces);
        let same = self.previous[first..].iter().take_while(|a| (a.piece_a, a.piece_b) == pieces);
        let nearer = |x: &&Adhesion, y: &&Adhesion| {
            x.midpoint.distance_squared(midpoint).total_cmp(&y.midpoint.distance_squared(midpoint))
        };
        if let Some(adhesion) = same.min_by(nearer) {
            return *adhesion;
        }
        let mut fresh = Adhesion {
            piece_a: contact.piece_a,
            piece_b: contact.piece_b,
            holding_a: grasp.pose_ba.inverse().point(midpoint),
            held_b: midpoint,
            untwisted: grasp.pose_ba.rotation,
            midpoint,
            normal,
            sliding: false,
            slipped: 0.0,
        };
        let mut heir_of = None;
        if *looks >= self.previous.len() {
            *looks -= self.previous.len();
            let within = |a: &&Adhesion| {
                a.midpoint.distance_squared(midpoint) < grasp.reach * grasp.reach
                    && a.normal.dot(normal) >= FRICTION_HEIR
            };
            heir_of = self.previous.iter().filter(within).min_by(nearer);
        } else {
            counters.unsought += 1;
        }
        if let Some(old) = heir_of {
            fresh.held_b -= grasp.pose_ba.point(old.holding_a) - old.held_b;
            fresh.untwisted = old.untwisted;
            (fresh.sliding, fresh.slipped) = (old.sliding, old.slipped);
            counters.inherited += 1;
        } else {
            counters.fresh += 1;
        }
        fresh
    }
}

impl Grasp<'_> {
    /// N: the largest normal force that a cluster has, before the crowd leaves it a share of it.
    fn most_pressed(&self) -> f64 {
        let alone = |(cluster, &force): (&Cluster, &f64)| {
            let share = cluster.engagement / (self.tolerance - cluster.separation);
            if share > 0.0 { force / share } else { 0.0 }
        };
        self.clusters.iter().zip(self.normal_forces).map(alone).fold(0.0, f64::max)
    }
}

/// What a cluster's friction rests on.
#[derive(Clone, Copy, Debug)]
struct Load {
    normal: DVec3,
    /// N: of the cluster that is pressed hardest.
    most: f64,
    /// N/m: of all members of this one together.
    stiffness: f64,
}

/// How far a contact is from where it would not be held.
#[derive(Clone, Copy, Debug)]
struct Strain {
    /// z, m.
    along: DVec3,
    /// φ, rad about the normal.
    twist: f64,
    /// R, m.
    lever: f64,
}

impl Strain {
    fn length(&self) -> f64 {
        self.along.length().hypot(self.lever * self.twist)
    }

    fn scaled(&self, factor: f64) -> Self {
        Self { along: self.along * factor, twist: self.twist * factor, ..*self }
    }

    /// Step 4.
    fn grip(&self, share: f64, load: &Load) -> Grip {
        let Self { along, twist, lever } = *self;
        let stiffness = load.stiffness * share;
        let torque = load.normal * (-stiffness * lever * lever * twist);
        Grip { force: -stiffness * along, torque, stiffness, lever, ..Grip::default() }
    }
}

/// Step 2: the strain of `adhesion` now.
fn carry(adhesion: &mut Adhesion, contact: &Contact, normal: DVec3, grasp: &Grasp<'_>) -> Strain {
    let midpoint = contact.midpoint();
    let x = grasp.pose_ba.point(adhesion.holding_a);
    let strain = Strain {
        along: (x - adhesion.held_b).reject_from_normalized(normal),
        twist: twist(grasp.pose_ba.rotation * adhesion.untwisted.conjugate(), normal),
        lever: FRICTION_LEVER * contact.extent,
    };
    adhesion.midpoint = midpoint;
    adhesion.normal = normal;
    let away = x - midpoint;
    let too_far = away.length() > grasp.reach;
    hold(adhesion, if too_far { midpoint + away.clamp_length_max(grasp.reach) } else { x }, &strain, grasp);
    strain
}

/// The angle about `axis` (unit) of a rotation, between −π and π: of all turns about the axis, it is the nearest to it.
fn twist(rotation: DQuat, axis: DVec3) -> f64 {
    let upright = if rotation.w < 0.0 { -rotation } else { rotation };
    2.0 * upright.xyz().dot(axis).atan2(upright.w)
}

/// Step 3: shortens `strain` to what is held, and answers the μ that it is held with.
fn stick_or_slide(
    adhesion: &mut Adhesion,
    strain: &mut Strain,
    load: &Load,
    grasp: &Grasp<'_>,
    settings: &FrictionSettings,
) -> f64 {
    let FrictionSettings { static_coefficient, dynamic_coefficient, tangential_stiffness } = *settings;
    let strain_at = |coefficient: f64| coefficient * load.most / tangential_stiffness;
    let weakening = strain_at(static_coefficient);
    let coefficient = if adhesion.slipped < weakening {
        static_coefficient + (dynamic_coefficient - static_coefficient) * (adhesion.slipped / weakening)
    } else if adhesion.sliding {
        dynamic_coefficient
    } else {
        static_coefficient
    };
    let (length, most) = (strain.length(), strain_at(coefficient));
    adhesion.sliding = length > if adhesion.sliding { most * (1.0 + FRICTION_HELD) } else { most };
    if !adhesion.sliding {
        adhesion.slipped = 0.0;
    }
    if length > most {
        *strain = strain.scaled(most / length);
        adhesion.slipped += length - most;
        adhesion.untwisted = DQuat::from_axis_angle(adhesion.normal, -strain.twist) * grasp.pose_ba.rotation;
        let x = grasp.pose_ba.point(adhesion.holding_a);
        let renewed = if most > 0.0 { ((length - most) / most).min(1.0) } else { 1.0 };
        hold(adhesion, x.lerp(adhesion.midpoint, renewed), strain, grasp);
    }
    coefficient
}

/// Has `adhesion` hold at `x`, in b's frame, at the given strain.
fn hold(adhesion: &mut Adhesion, x: DVec3, strain: &Strain, grasp: &Grasp<'_>) {
    adhesion.held_b = x - strain.along;
    if x != grasp.pose_ba.point(adhesion.holding_a) {
        adhesion.holding_a = grasp.pose_ba.inverse().point(x);
    }
}

#[cfg(test)]
mod tests;
