//! Stick–slip friction, tracked in time \[K02 §4.4.2; Hayward and Armstrong 2000, "HA00"\].
//!
//! Friction is a spring between a point x of a and a point w of b. This pair of points is the
//! contact's *adhesion*. The strain of the spring is z = x − w in the tangent plane. Each tick, for
//! every contact of every cluster:
//!
//! 1. *Find* the contact's adhesion of the last tick: the nearest adhesion of the same two pieces.
//!    If it is beyond reach, as where another corner of the pieces lands, the contact takes over
//!    its strain only, and friction acts at the contact's own point. If these pieces had no
//!    contact, the contact takes over the strain of the nearest adhesion within reach that has a
//!    similar normal. So a probe that slides from one piece onto the next keeps its friction. If no
//!    adhesion is found, the contact begins without strain.
//! 2. *Move*: x moves with a, and w stays on b. Compute z in the cluster's tangent plane. Then move
//!    w along the normal, so that x − w = z.
//! 3. *Stick or slide*: the contact slides if ‖z‖ exceeds z_max = μ F_n / k_t (for several
//!    clusters, see below). Then shorten z to z_max by moving w, and move x toward the present
//!    contact point. The contact sticks again in the first tick in which ‖z‖ does not exceed z_max.
//! 4. *Force* on a: −k_t z at x. While the contact sticks, this force is minus the gradient of ½
//!    k_t z². The same force at another point could add energy. For example, the contact's point
//!    moves while a block rocks.
//!
//! **Static and dynamic friction.** μ falls from its static to its dynamic value in proportion to
//! the distance slipped (*slip weakening*, Ida 1972). The whole fall takes the first static z_max
//! of slip. So the force does not drop suddenly, and contacts of one body that reach z_max one
//! after the other still hold together with the static μ. Behind a coupling, contacts are so stiff
//! that z_max is a few micrometres, which a tool slips within a tick. Then the fall also takes a
//! share ([`FRICTION_WEAKENS`](crate::algebra::tolerance::FRICTION_WEAKENS)) of the stretch of the
//! coupling under this friction. While a contact sticks, μ rises to its static value again in a
//! fixed time (*healing*, Dieterich 1979;
//! [`FRICTION_HEALS`](crate::algebra::tolerance::FRICTION_HEALS)). If μ rose at once, a tool with
//! two contacts could stick at one and slide at the other, in turns from tick to tick.
//!
//! **Twist.** A flush patch has one contact at each of its corners. Friction acts at each corner,
//! so the corners together resist a twist about the normal. The friction acts at points nearer to
//! the patch's middle than the corners are
//! ([`FRICTION_SPREAD`](crate::algebra::tolerance::FRICTION_SPREAD)). So friction brakes a spinning
//! block like an evenly loaded patch, not like a loaded rim. Friction force and friction torque of
//! sliding corners are coupled as on the limit surface of the patch (Goyal, Ruina, Papadopoulos
//! 1991).
//!
//! Strain is a function of two stored points, not a sum of velocities. If the points of a sticking
//! contact return to earlier positions, the earlier force returns too, after any number of ticks.
//!
//! **Clusters.** The members of a cluster share its normal force in proportion to engagement times
//! tilt share: s_i = α_i w_i / Σ α w. Each member has the load and the tangential stiffness of the
//! cluster times s_i, so all members have the z_max of the cluster. For any number of members,
//! their total friction is at most the cluster's μ F_n, in its tangent plane. Members at different
//! points also resist spinning of the cluster about its normal.
//!
//! **Several clusters.** The tangential stiffness of a cluster is in proportion to its load: k_t
//! F_n / F_most. F_most is the largest load that a cluster would have alone, before load sharing.
//! So all clusters have the same z_max = μ F_most / k_t. A block slides as a whole when the pull
//! exceeds μ times its whole load, however the load is distributed. If each cluster had the full
//! k_t, lightly loaded contacts would slip one by one at a smaller pull. A new cluster without load
//! has no stiffness.
//!
//! **Implicit step.** Behind a coupling, the tool's implicit step finds the loads. A contact
//! without load at the beginning of a step may have a load at its end. For example, a tool that
//! slides over the edge of a facet lifts off and presses again in the same step. So the step gives
//! each contact at least its share of the load at the end of the last step. The contacts that share
//! a load are together as stiff as one contact. A contact with little or no load keeps its strain,
//! and its stiffness grows with the load that the step gives it.
//!
//! Deviations from HA00: static and dynamic coefficients with slip weakening between them replace
//! the elasto-plastic transition. If the contact point moves farther than the reach from x (the
//! probe rolls), x and w move with it, and the strain stays unchanged.

use glam::DVec3;

use super::Cluster;
use crate::algebra::Pose;
use crate::algebra::tolerance::{FRICTION_HEALS, FRICTION_HELD, FRICTION_LOOKS, FRICTION_SUCCESSOR, FRICTION_WEAKENS};
use crate::detect::Contact;

/// Parameters of friction between two surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct FrictionSettings {
    /// μ of a contact that sticks; at least the dynamic coefficient.
    pub static_coefficient: f64,
    /// μ of a contact that slides.
    pub dynamic_coefficient: f64,
    /// k_t, N/m: stiffness of the most loaded cluster while it sticks.
    pub tangential_stiffness: f64,
}

/// The two points between which a contact's friction acts, and its state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adhesion {
    /// Piece of a.
    pub piece_a: u32,
    /// Piece of b.
    pub piece_b: u32,
    /// x: the point of a, in a's frame.
    pub holding_a: DVec3,
    /// w: the point of b, in b's frame.
    pub held_b: DVec3,
    /// Midpoint of the contact at the last tick, in b's frame.
    pub midpoint: DVec3,
    /// Normal of its cluster at the last tick, in b's frame.
    pub normal: DVec3,
    /// True if the contact slid in the last tick.
    pub sliding: bool,
    /// Distance slipped, m. While the contact sticks, it returns to 0.
    pub slipped: f64,
}

/// Input of the friction of one tick.
#[derive(Clone, Copy, Debug)]
pub struct FrictionInput<'a> {
    /// All contacts, in b's frame.
    pub contacts: &'a [Contact],
    /// Indices into `contacts`, cluster after cluster.
    pub members: &'a [u32],
    /// The clusters; each has a range of `members`.
    pub clusters: &'a [Cluster],
    /// Weights of the members in their clusters, m.
    pub weights: &'a [f64],
    /// Points at which the friction of the members acts, in b's frame.
    pub holds: &'a [DVec3],
    /// Normal force of each cluster that limits its friction, N.
    pub loads: &'a [f64],
    /// F_most: the largest normal force that a cluster would have alone, before load sharing, N.
    pub most: f64,
    /// Largest distance of a contact from the adhesion that it takes over, and from its own point
    /// x, m.
    pub reach: f64,
    /// Compliance of the coupling, which is in series with the contacts, m/N; 0 without coupling.
    pub compliance: f64,
    /// Duration of the tick, s.
    pub elapsed: f64,
    /// a placed in b's frame.
    pub pose_ba: Pose,
}

/// Friction of one member of a cluster: a spring in the tangent plane, in b's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Grip {
    /// x, where the force acts.
    pub point: DVec3,
    /// z, the strain, m.
    pub strain: DVec3,
    /// Force on a, N: −stiffness · z.
    pub force: DVec3,
    /// Effective tangential stiffness at this contact, N/m.
    pub stiffness: f64,
    /// Stiffness for each newton of the cluster's load, 1/m; 0 if no cluster has a load.
    pub stiffening: f64,
    /// Largest friction force of this member for each newton of the cluster's normal force.
    pub coefficient: f64,
    /// True if the contact slides: its spring has the greatest length.
    pub sliding: bool,
}

/// Counts of the adhesions in one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrictionCounters {
    /// Number of contacts that slide.
    pub sliding: u32,
    /// Number of contacts that took over the strain of another one.
    pub inherited: u32,
    /// Number of contacts that began without strain.
    pub fresh: u32,
    /// Number of new contacts for which no adhesion was searched, because the budget of the tick
    /// was spent.
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

/// Adhesions of the last tick, sorted by pieces. An adhesion is dropped when its contact ends.
#[derive(Clone, Debug)]
pub struct FrictionTracker {
    capacity: usize,
    previous: Vec<Adhesion>,
    current: Vec<Adhesion>,
    grips: Vec<Grip>,
}

impl FrictionTracker {
    /// Allocates memory for `capacity` contacts.
    pub fn new(capacity: usize) -> Self {
        Self {
            capacity,
            previous: Vec::with_capacity(capacity),
            current: Vec::with_capacity(capacity),
            grips: Vec::with_capacity(capacity),
        }
    }

    /// Removes all adhesions: the next tick begins without strain.
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

    /// Computes the friction of one tick; the result is in [`Self::grips`]. The number of members
    /// is at most the capacity.
    pub fn update(&mut self, input: &FrictionInput<'_>, settings: &FrictionSettings) -> FrictionCounters {
        debug_assert!(input.members.len() <= self.capacity);
        let mut counters = FrictionCounters::default();
        let mut looks = FRICTION_LOOKS;
        self.current.clear();
        self.grips.clear();
        let most = input.most;
        for (cluster, load) in input.clusters.iter().zip(input.loads) {
            let stiffening = if most > 0.0 { settings.tangential_stiffness / most } else { 0.0 };
            let load = Load { most, stiffness: stiffening * load };
            for k in cluster.members() {
                let contact = &input.contacts[input.members[k] as usize];
                let place = input.holds[k];
                let mut adhesion = self.find(contact, place, cluster.normal, input, &mut looks, &mut counters);
                let mut strain = carry(&mut adhesion, place, cluster.normal, input);
                let coefficient = stick_or_slide(&mut adhesion, &mut strain, &load, input, settings);
                let point = input.pose_ba.point(adhesion.holding_a);
                let share = input.share_of(k, cluster);
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

    /// Step 1: the adhesion of the last tick, or a new one.
    fn find(
        &self,
        contact: &Contact,
        midpoint: DVec3,
        normal: DVec3,
        input: &FrictionInput<'_>,
        looks: &mut usize,
        counters: &mut FrictionCounters,
    ) -> Adhesion {
        let pieces = (contact.piece_a, contact.piece_b);
        let first = self.previous.partition_point(|adhesion| (adhesion.piece_a, adhesion.piece_b) < pieces);
        let same = self.previous[first..].iter().take_while(|a| (a.piece_a, a.piece_b) == pieces);
        let nearer = |x: &&Adhesion, y: &&Adhesion| {
            x.midpoint.distance_squared(midpoint).total_cmp(&y.midpoint.distance_squared(midpoint))
        };
        let is_near = |a: &Adhesion| a.midpoint.distance_squared(midpoint) < input.reach * input.reach;
        let of_pieces = same.min_by(nearer);
        if let Some(adhesion) = of_pieces.filter(|adhesion| is_near(adhesion)) {
            return *adhesion;
        }
        let mut fresh = Adhesion {
            piece_a: contact.piece_a,
            piece_b: contact.piece_b,
            holding_a: input.pose_ba.inverse().point(midpoint),
            held_b: midpoint,
            midpoint,
            normal,
            sliding: false,
            slipped: 0.0,
        };
        let predecessor = match of_pieces {
            Some(_) => of_pieces,
            None if *looks >= self.previous.len() => {
                *looks -= self.previous.len();
                let within = |a: &&Adhesion| is_near(a) && a.normal.dot(normal) >= FRICTION_SUCCESSOR;
                self.previous.iter().filter(within).min_by(nearer)
            }
            None => {
                counters.unsought += 1;
                None
            }
        };
        if let Some(old) = predecessor {
            fresh.held_b -= input.pose_ba.point(old.holding_a) - old.held_b;
            (fresh.sliding, fresh.slipped) = (old.sliding, old.slipped);
            counters.inherited += 1;
        } else {
            counters.fresh += 1;
        }
        fresh
    }
}

impl FrictionInput<'_> {
    /// Returns the share of the cluster's load that member `k` bears; 1 if it is the only one.
    fn share_of(&self, k: usize, cluster: &Cluster) -> f64 {
        if cluster.member_count == 1 {
            return 1.0;
        }
        self.weights[k] / cluster.weight
    }
}

/// Load and stiffness of a cluster.
#[derive(Clone, Copy, Debug)]
struct Load {
    /// Largest friction force F_most, N.
    most: f64,
    /// Tangential stiffness of all members of this cluster together, N/m.
    stiffness: f64,
}

/// Step 2: moves `adhesion` to this tick and returns its strain. Friction of the contact acts at
/// `place` (in b's frame).
fn carry(adhesion: &mut Adhesion, place: DVec3, normal: DVec3, input: &FrictionInput<'_>) -> DVec3 {
    let x = input.pose_ba.point(adhesion.holding_a);
    let strain = (x - adhesion.held_b).reject_from_normalized(normal);
    adhesion.midpoint = place;
    adhesion.normal = normal;
    let away = x - place;
    let too_far = away.length() > input.reach;
    hold(adhesion, if too_far { place + away.clamp_length_max(input.reach) } else { x }, strain, input);
    strain
}

/// Step 3: shortens `strain` to z_max, and returns the μ of this limit.
fn stick_or_slide(
    adhesion: &mut Adhesion,
    strain: &mut DVec3,
    load: &Load,
    input: &FrictionInput<'_>,
    settings: &FrictionSettings,
) -> f64 {
    let FrictionSettings { static_coefficient, dynamic_coefficient, tangential_stiffness } = *settings;
    let compliance = 1.0 / tangential_stiffness + FRICTION_WEAKENS * input.compliance;
    let weakening = static_coefficient * load.most * compliance;
    let weakened = if adhesion.slipped > 0.0 { (adhesion.slipped / weakening).min(1.0) } else { 0.0 };
    let coefficient = static_coefficient + (dynamic_coefficient - static_coefficient) * weakened;
    let (length, most) = (strain.length(), coefficient * load.most / tangential_stiffness);
    adhesion.sliding = length > if adhesion.sliding { most * (1.0 + FRICTION_HELD) } else { most };
    if !adhesion.sliding {
        adhesion.slipped = (adhesion.slipped.min(weakening) - weakening * (input.elapsed / FRICTION_HEALS)).max(0.0);
    }
    if length > most {
        *strain *= most / length;
        adhesion.slipped += length - most;
        let x = input.pose_ba.point(adhesion.holding_a);
        let renewed = if most > 0.0 { ((length - most) / most).min(1.0) } else { 1.0 };
        hold(adhesion, x.lerp(adhesion.midpoint, renewed), *strain, input);
    }
    coefficient
}

/// Sets the points of `adhesion`: x to `x` (in b's frame) and w to `x − strain`.
fn hold(adhesion: &mut Adhesion, x: DVec3, strain: DVec3, input: &FrictionInput<'_>) {
    adhesion.held_b = x - strain;
    if x != input.pose_ba.point(adhesion.holding_a) {
        adhesion.holding_a = input.pose_ba.inverse().point(x);
    }
}

#[cfg(test)]
mod tests;
