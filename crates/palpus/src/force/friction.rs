//! Stick–slip friction, tracked in time \[K02 §4.4.2; Hayward and Armstrong 2000, "HA00"\].
//!
//! Each contact keeps an *adhesion*: the point w of b at which it holds, and the point x of a that
//! holds there. The strain is z = x − w in the tangent plane. Each tick, for every contact of every
//! cluster:
//!
//! 1. *Find* the contact's adhesion of the last tick: the adhesion of the same two pieces, or the
//!    nearest of several. If there is none, the contact takes over the strain of the nearest
//!    adhesion within reach whose normal is not opposed. So a probe that slides from one piece onto
//!    the next keeps its friction. Otherwise the contact begins without strain.
//! 2. *Carry* it: x moves with a, w rests on b, and z is their difference in the cluster's tangent
//!    plane. The normal part is no strain; w follows it.
//! 3. *Stick or slide*: z_max = μ F_n / k_t for a cluster alone, with μ static while sticking.
//!    Beyond it the contact slides, and w is dragged so that ‖z‖ is z_max; x comes to the present
//!    contact point in the same measure. μ falls to the dynamic one evenly over a slip of the
//!    static z_max (*slip weakening*, Ida 1972), so that nothing snaps, and contacts of one
//!    body that reach their limit one after the other still hold with the static μ together. A
//!    sliding contact sticks again, with all of its strength, as soon as it is no longer dragged.
//! 4. *Force* on a: −k_t z at x. While the contact sticks, this force is the gradient of ½ k_t z².
//!    At any other point it could add energy: the contact's point, for example, moves while a block
//!    rocks.
//!
//! **Twist.** A flush contact has one contact for each corner of its patch. Each holds at its own
//! place, so together they resist a twist about the normal. Their friction acts at points nearer to
//! the patch's middle ([`FRICTION_SPREAD`](crate::algebra::tolerance::FRICTION_SPREAD)), so that a
//! spinning block is braked as by an evenly loaded patch and not as by its rim. Sliding corners
//! share one limit: friction force and friction torque are coupled as on the limit surface of the
//! patch (Goyal, Ruina, Papadopoulos 1991).
//!
//! Strain is a function of two stored points, not a sum of velocities. A sticking contact whose
//! points return to their places has its old force again, after any number of ticks.
//!
//! **Clusters.** The normal force belongs to a cluster, whose members share it in proportion to
//! their engagement and tilt share: s_i = α_i w_i / Σ α w. Each member's load and tangential
//! stiffness are the cluster's times s_i, so its z_max is the cluster's own, μ F_n / k_t, and the
//! friction of the members together is at most μ F_n of the cluster, in its tangent plane, for any
//! number of members. Members that lie apart also resist spinning of the cluster about its normal.
//!
//! **Several clusters** share k_t in the same way. The cluster that is pressed hardest has all of
//! k_t (F_most is its load before smooth clustering reduces it). Any other cluster has a part in
//! proportion to its load: k_t F_n / F_most. All clusters have the same z_max, μ F_most / k_t. So a
//! block slides as a whole when it is pulled with more than μ times its whole load, no matter how
//! the load is spread. If each cluster had all of k_t, lightly loaded contacts would slip one by
//! one at a smaller pull. A new cluster without load has no stiffness.
//!
//! **An implicit step** (behind a coupling) presses contacts that did not touch at its beginning: a
//! tool that slides over the edge of a facet is off the surface for a tick, and pressed all the
//! same. So there the load of a contact is at least its share of the load at the end of the last
//! step; the step itself finds the load that the contact can hold. Contacts that share a load are
//! together as stiff as one contact. A contact without load holds as soon as the step presses it:
//! it keeps its strain, and is as stiff as the load that it comes to bear.
//!
//! Deviations from HA00: there are static and dynamic coefficients, with slip weakening between
//! them (HA00 has an elasto-plastic transition). If the contact moves farther than the reach from x
//! (the probe rolls), both points move with it, and the strain is kept.

use glam::DVec3;

use super::Cluster;
use crate::algebra::Pose;
use crate::algebra::tolerance::{FRICTION_HEIR, FRICTION_HELD, FRICTION_LOOKS};
use crate::detect::Contact;

/// How surfaces hold each other.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct FrictionSettings {
    /// μ of a contact that sticks; at least the dynamic one.
    pub static_coefficient: f64,
    /// μ of a contact that slides.
    pub dynamic_coefficient: f64,
    /// k_t, N/m: of a cluster that sticks and is pressed as hard as any.
    pub tangential_stiffness: f64,
}

/// Anchor of a contact.
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
    /// Weights of the members in their clusters, m.
    pub weights: &'a [f64],
    /// Anchors of the members, in b's frame.
    pub holds: &'a [DVec3],
    /// N: the normal force that the friction of each cluster rests on.
    pub loads: &'a [f64],
    /// N: the largest normal force that a cluster would have alone, before others that push the
    /// same way leave it a share.
    pub most: f64,
    /// m: how far a contact may be from its predecessor or from its own holding point.
    pub reach: f64,
    /// a placed in b's frame.
    pub pose_ba: Pose,
}

/// How one member of a cluster is held: a spring across its normal; in b's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Grip {
    /// x, where the force acts.
    pub point: DVec3,
    /// z, m.
    pub strain: DVec3,
    /// N, on a: −stiffness · z.
    pub force: DVec3,
    /// Effective tangential stiffness at this contact, N/m.
    pub stiffness: f64,
    /// 1/m: what each newton of the cluster's load adds to the stiffness; 0 if nothing is pressed.
    pub stiffening: f64,
    /// The most that it holds, for each newton of the cluster's normal force.
    pub coefficient: f64,
    /// It is being dragged: the spring gets no longer.
    pub sliding: bool,
}

/// Counts of the adhesions in one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrictionCounters {
    /// Contacts that slide.
    pub sliding: u32,
    /// Contacts that took over the strain of another one.
    pub inherited: u32,
    /// Contacts that began without strain.
    pub fresh: u32,
    /// New contacts whose predecessor was not searched, because the tick's budget was spent.
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

    /// One tick; the answer is in [`Self::grips`]. There are at most as many members as the
    /// capacity.
    pub fn update(&mut self, grasp: &Grasp<'_>, settings: &FrictionSettings) -> FrictionCounters {
        debug_assert!(grasp.members.len() <= self.capacity);
        let mut counters = FrictionCounters::default();
        let mut looks = FRICTION_LOOKS;
        self.current.clear();
        self.grips.clear();
        let most = grasp.most;
        for (cluster, load) in grasp.clusters.iter().zip(grasp.loads) {
            let stiffening = if most > 0.0 { settings.tangential_stiffness / most } else { 0.0 };
            let load = Load { most, stiffness: stiffening * load };
            for k in cluster.members() {
                let contact = &grasp.contacts[grasp.members[k] as usize];
                let place = grasp.holds[k];
                let mut adhesion = self.find(contact, place, cluster.normal, grasp, &mut looks, &mut counters);
                let mut strain = carry(&mut adhesion, place, cluster.normal, grasp);
                let coefficient = stick_or_slide(&mut adhesion, &mut strain, &load, grasp, settings);
                let point = grasp.pose_ba.point(adhesion.holding_a);
                let share = grasp.share_of(k, cluster);
                let stiffness = load.stiffness * share;
                self.grips.push(Grip {
                    point,
                    strain,
                    force: -stiffness * strain,
                    stiffness,
                    stiffening: stiffening * share,
                    coefficient: share * coefficient,
                    sliding: adhesion.sliding,
                });
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
        midpoint: DVec3,
        normal: DVec3,
        grasp: &Grasp<'_>,
        looks: &mut usize,
        counters: &mut FrictionCounters,
    ) -> Adhesion {
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
            (fresh.sliding, fresh.slipped) = (old.sliding, old.slipped);
            counters.inherited += 1;
        } else {
            counters.fresh += 1;
        }
        fresh
    }
}

impl Grasp<'_> {
    /// The share of the cluster's load that member `k` bears; 1 if it is the only one.
    fn share_of(&self, k: usize, cluster: &Cluster) -> f64 {
        if cluster.member_count == 1 {
            return 1.0;
        }
        self.weights[k] / cluster.weight
    }
}

/// Load that a cluster's friction rests on.
#[derive(Clone, Copy, Debug)]
struct Load {
    /// N: of the cluster that is pressed hardest.
    most: f64,
    /// N/m: of all members of this one together.
    stiffness: f64,
}

/// Step 2: the strain of `adhesion` now, whose contact holds at `place`.
fn carry(adhesion: &mut Adhesion, place: DVec3, normal: DVec3, grasp: &Grasp<'_>) -> DVec3 {
    let x = grasp.pose_ba.point(adhesion.holding_a);
    let strain = (x - adhesion.held_b).reject_from_normalized(normal);
    adhesion.midpoint = place;
    adhesion.normal = normal;
    let away = x - place;
    let too_far = away.length() > grasp.reach;
    hold(adhesion, if too_far { place + away.clamp_length_max(grasp.reach) } else { x }, strain, grasp);
    strain
}

/// Step 3: shortens `strain` to the limit of friction, and returns the μ of that limit.
fn stick_or_slide(
    adhesion: &mut Adhesion,
    strain: &mut DVec3,
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
        *strain *= most / length;
        adhesion.slipped += length - most;
        let x = grasp.pose_ba.point(adhesion.holding_a);
        let renewed = if most > 0.0 { ((length - most) / most).min(1.0) } else { 1.0 };
        hold(adhesion, x.lerp(adhesion.midpoint, renewed), *strain, grasp);
    }
    coefficient
}

/// Has `adhesion` hold at `x`, in b's frame, at the given strain.
fn hold(adhesion: &mut Adhesion, x: DVec3, strain: DVec3, grasp: &Grasp<'_>) {
    adhesion.held_b = x - strain;
    if x != grasp.pose_ba.point(adhesion.holding_a) {
        adhesion.holding_a = grasp.pose_ba.inverse().point(x);
    }
}

#[cfg(test)]
mod tests;
