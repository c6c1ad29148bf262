//! Computes the wrenches on both bodies from their contacts \[K02 §4.2–4.4\].
//!
//! 1. *Cluster* the contacts by their midpoints and force directions.
//! 2. *Represent* each cluster by one contact. With smooth clustering, each contact is a cluster.
//! 3. *Normal forces*: compute the normal force of each cluster, at its midpoint. With smooth
//!    clustering, the contacts share one stiffness (`LoadSharing`).
//! 4. *Friction*: compute the friction of each member. The corners of a patch represent an evenly
//!    loaded patch. So their friction acts nearer to the patch's middle, at [`FRICTION_SPREAD`]
//!    times the distance of the corner from the middle.
//!
//! Everything is in b's frame. Sums run in the canonical order of the clusters and of their
//! members.

use glam::DVec3;

use super::{Clustering, Scratch, Settings};
use crate::algebra::tolerance::FRICTION_SPREAD;
use crate::algebra::{Pose, Twist};
use crate::detect::Contact;
use crate::force::{
    Centers, Cluster, FrictionCounters, FrictionInput, Grip, LinkageCounters, NetWrench, Tilted, normal_force,
    represent,
};

/// Pose of the bodies and motion of the probe, in b's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// a placed in b's frame.
    pub pose_ba: Pose,
    /// Centres of mass of both bodies.
    pub centers: Centers,
    /// Velocity of a relative to b; the linear part is the velocity of a's centre of mass.
    pub twist: Twist,
    /// Largest force that a contact would have alone at the end of the last step, before load
    /// sharing, N. 0 if that step was not implicit.
    pub pressed: f64,
    /// Duration of the implicit step that follows, s; 0 if no such step follows.
    pub step: f64,
    /// Duration of the tick, s.
    pub elapsed: f64,
}

impl Motion {
    /// Returns the separation (m) that the contact will have at the end of the step if the bodies
    /// move on with their velocities.
    fn expected(&self, contact: &Contact) -> f64 {
        let velocity = self.twist.at(contact.midpoint() - self.centers.a);
        contact.separation + velocity.dot(contact.normal) * self.step
    }
}

/// Clusters, their forces and the net wrenches of one tick, in b's frame.
#[derive(Clone, Debug)]
pub struct Forces {
    /// Representative contacts.
    pub clusters: Vec<Cluster>,
    /// Indices into the contacts, cluster after cluster.
    pub members: Vec<u32>,
    /// Midpoints of the members.
    pub places: Vec<DVec3>,
    /// Separations of the members, m.
    pub separations: Vec<f64>,
    /// Unit force directions of the members: their normals, or the shaded normals.
    pub directions: Vec<DVec3>,
    /// Weights of the members in their clusters, m, as given to [`represent`].
    pub weights: Vec<f64>,
    /// Points at which the friction of the members acts; empty without friction.
    pub holds: Vec<DVec3>,
    /// Normal force on a of each cluster, N; not negative.
    pub normal_forces: Vec<f64>,
    /// Stiffness of each cluster, N/m: derivative of its normal force with respect to engagement.
    pub stiffnesses: Vec<f64>,
    /// Friction of each member; empty without friction.
    pub grips: Vec<Grip>,
    /// Largest load that a cluster would have alone, before load sharing, N.
    pub most_load: f64,
    /// Wrenches on both bodies.
    pub net: NetWrench,
    /// Counts of the contacts.
    pub linkage: LinkageCounters,
    /// Counts of the adhesions.
    pub adhesion: FrictionCounters,
    /// Number of clusters whose normals cancelled, so that the normal of the deepest member was
    /// used.
    pub cancelled_normals: u32,
}

impl Forces {
    /// Allocates memory for `capacity` contacts.
    pub fn new(capacity: usize) -> Self {
        Self {
            clusters: Vec::with_capacity(capacity),
            members: Vec::with_capacity(capacity),
            places: Vec::with_capacity(capacity),
            separations: Vec::with_capacity(capacity),
            directions: Vec::with_capacity(capacity),
            weights: Vec::with_capacity(capacity),
            holds: Vec::with_capacity(capacity),
            normal_forces: Vec::with_capacity(capacity),
            stiffnesses: Vec::with_capacity(capacity),
            grips: Vec::with_capacity(capacity),
            most_load: 0.0,
            net: NetWrench::default(),
            linkage: LinkageCounters::default(),
            adhesion: FrictionCounters::default(),
            cancelled_normals: 0,
        }
    }

    /// Removes all contacts and forces.
    pub fn clear(&mut self) {
        self.clusters.clear();
        self.members.clear();
        self.places.clear();
        self.separations.clear();
        self.directions.clear();
        self.weights.clear();
        self.holds.clear();
        self.normal_forces.clear();
        self.stiffnesses.clear();
        self.grips.clear();
        self.most_load = 0.0;
        self.net = NetWrench::default();
        self.linkage = LinkageCounters::default();
        self.adhesion = FrictionCounters::default();
        self.cancelled_normals = 0;
    }
}

/// Runs the force stage of one tick. `direction` returns the unit direction in which a contact
/// pushes a: its normal, or the shaded normal.
///
/// `settings` must be valid, and `scratch` and `forces` must have memory for their capacity.
pub fn force(
    contacts: &[Contact],
    motion: &Motion,
    settings: &Settings,
    direction: impl FnMut(&Contact) -> DVec3,
    scratch: &mut Scratch,
    forces: &mut Forces,
) {
    forces.clear();
    let mut linkage = settings.linkage();
    linkage.most = linkage.most.min(scratch.most);
    forces.linkage = scratch.linkage.run(contacts, &linkage, |contact| motion.expected(contact), direction);
    forces.members.extend_from_slice(scratch.linkage.members());
    for contact in forces.members.iter().map(|&i| &contacts[i as usize]) {
        forces.places.push(contact.midpoint());
        forces.separations.push(contact.separation);
    }
    forces.directions.extend_from_slice(scratch.linkage.directions());
    share(contacts, settings, scratch, forces);
    for k in 0..scratch.linkage.len() {
        let range = scratch.linkage.range(k);
        let smooth = settings.clustering == Clustering::Smooth;
        let (members, directions) = (&forces.members[range.clone()], &forces.directions[range.clone()]);
        let (weights, first) = (&forces.weights[range.clone()], range.start as u32);
        let cluster = represent(contacts, members, directions, weights, first, settings.contact_offset());
        let share = if smooth { scratch.sharing.shares()[k] } else { 1.0 };
        forces.stiffnesses.push(settings.stiffness * share);
        forces.cancelled_normals += u32::from(cluster.cancelled);
        add_normal_force(&cluster, motion, share, settings, forces);
        forces.clusters.push(cluster);
    }
    add_friction(contacts, motion, settings, scratch, forces);
}

/// Computes the weights of members in their clusters. With smooth clustering, also computes the
/// load shares.
fn share(contacts: &[Contact], settings: &Settings, scratch: &mut Scratch, forces: &mut Forces) {
    let Scratch { linkage, tilted, sharing, tilts, .. } = scratch;
    let (contact_offset, tolerance) = (settings.contact_offset(), settings.contact_tolerance);
    let members = forces.members.iter().map(|&i| &contacts[i as usize]);
    tilted.clear();
    match settings.clustering {
        Clustering::Smooth => {
            tilted.extend(members.zip(&forces.directions).map(|(contact, &direction)| {
                let engagement = (contact_offset - contact.separation).max(0.0);
                Tilted { direction, engagement, ..Tilted::unloaded(contact) }
            }));
            sharing.run(tilted, linkage.tilt_shares(), AHEAD * contact_offset);
            forces.weights.extend(tilted.iter().map(|corner| tolerance - corner.separation));
        }
        Clustering::Linkage => {
            tilted.extend(members.map(Tilted::unloaded));
            for patch in patches(contacts, &forces.members) {
                let corners = &tilted[patch];
                let shares = tilts.run(corners).iter().zip(corners);
                forces.weights.extend(shares.map(|(share, corner)| share * (tolerance - corner.separation)));
            }
        }
    }
}

/// If no contact pushes yet, the coming load is shared by contacts up to this distance beyond the
/// nearest contact, relative to the contact offset.
const AHEAD: f64 = 0.5;

/// Returns the range of each patch's corners in `members`, where they are adjacent.
fn patches(contacts: &[Contact], members: &[u32]) -> impl Iterator<Item = std::ops::Range<usize>> {
    let mut start = 0;
    let alike = |i: u32, j: u32| contacts[i as usize].shares_patch(&contacts[j as usize]);
    members.chunk_by(move |&i, &j| alike(i, j)).map(move |chunk| {
        let range = start..start + chunk.len();
        start = range.end;
        range
    })
}

/// Step 3: adds the normal force of a cluster.
fn add_normal_force(cluster: &Cluster, motion: &Motion, share: f64, settings: &Settings, forces: &mut Forces) {
    let velocity = motion.twist.at(cluster.midpoint - motion.centers.a);
    let size = normal_force(cluster, share, velocity.dot(cluster.normal), &settings.penalty());
    forces.normal_forces.push(size);
    forces.net.add(size * cluster.normal, cluster.midpoint, &motion.centers); // Eq. 6
}

/// Step 4: adds the friction of all members.
fn add_friction(
    contacts: &[Contact],
    motion: &Motion,
    settings: &Settings,
    scratch: &mut Scratch,
    forces: &mut Forces,
) {
    let Some(friction) = &settings.friction else { return };
    let Forces { members, holds, .. } = forces;
    let Scratch { tilted, tilts, sharing, .. } = &mut *scratch;
    let smooth = settings.clustering == Clustering::Smooth;
    for patch in patches(contacts, members) {
        let corners = &tilted[patch.clone()];
        let known = if smooth { sharing.tilts_of_patch(patch) } else { None };
        let shares = known.unwrap_or_else(|| tilts.run(corners));
        let (weight, sum) = shares
            .iter()
            .zip(corners)
            .fold((0.0, DVec3::ZERO), |(weight, sum), (share, corner)| (weight + share, sum + corner.place * *share));
        holds.extend(corners.iter().map(|corner| (sum / weight).lerp(corner.place, FRICTION_SPREAD)));
    }
    let most = friction_loads(motion, settings, scratch, forces);
    forces.most_load = most;
    let input = FrictionInput {
        contacts,
        members: &forces.members,
        weights: &forces.weights,
        holds: &forces.holds,
        clusters: &forces.clusters,
        loads: &scratch.loads,
        most,
        reach: settings.cluster_radius.max(settings.contact_tolerance),
        compliance: settings.coupling.map_or(0.0, |coupling| 1.0 / coupling.stiffness),
        elapsed: motion.elapsed,
        pose_ba: motion.pose_ba,
    };
    forces.adhesion = scratch.friction.update(&input, friction);
    forces.grips.extend_from_slice(scratch.friction.grips());
    for grip in &forces.grips {
        forces.net.add(grip.force, grip.point, &motion.centers);
    }
}

/// Writes the load of each cluster (N), which limits its friction, to `scratch.loads`. Returns the
/// largest load that a cluster would have alone, before load sharing (N).
///
/// After an implicit step, the load of a contact is at least its share of the total load at the
/// end of that step. At rest this share equals the contact's force, so all contacts start to slip
/// at the same time.
fn friction_loads(motion: &Motion, settings: &Settings, scratch: &mut Scratch, forces: &Forces) -> f64 {
    let Forces { clusters, normal_forces, stiffnesses, .. } = forces;
    let hard = settings.stiffness;
    let alone = |(&force, &stiffness): (&f64, &f64)| if stiffness > 0.0 { force * (hard / stiffness) } else { 0.0 };
    let most = normal_forces.iter().zip(stiffnesses).map(alone).fold(motion.pressed, f64::max);
    let Scratch { tilted, sharing, loads, .. } = scratch;
    loads.clear();
    if motion.pressed <= 0.0 {
        loads.extend_from_slice(normal_forces);
        return most;
    }
    let nearest = clusters.iter().map(|cluster| cluster.separation).fold(f64::INFINITY, f64::min);
    let pressed = nearest + motion.pressed / hard;
    let bears = |engagement: f64, separation: f64| engagement.max(pressed - separation);
    match settings.clustering {
        Clustering::Smooth => loads.extend(sharing.loads(tilted, bears).map(|load| hard * load)),
        Clustering::Linkage => {
            let own =
                |(cluster, &force): (&Cluster, &f64)| force.max(hard * bears(cluster.engagement, cluster.separation));
            loads.extend(clusters.iter().zip(normal_forces).map(own));
        }
    }
    most
}
