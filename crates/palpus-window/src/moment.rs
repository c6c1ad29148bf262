//! The visible state of one tick, in the environment's frame.
//!
//! All lists get their full capacity at creation, so [`Moment::fill`] does not allocate on the
//! servo thread. Items beyond the capacity are dropped.

use std::ops::Range;

use glam::DVec3;
use palpus::algebra::{Pose, Wrench};
use palpus::render::Tick;

/// A contact as a dot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownContact {
    /// Middle of the two witness points.
    pub point: DVec3,
    /// Separation, m; negative where the bodies overlap.
    pub separation: f64,
}

/// A cluster as an arrow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownCluster {
    /// Point at which the force acts.
    pub point: DVec3,
    /// Force on the probe, N.
    pub force: DVec3,
    /// Separation of its deepest contact, m; negative where the bodies overlap.
    pub separation: f64,
}

/// A point of the probe at which friction acts, and the anchor of this friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownAnchor {
    /// The point of the probe.
    pub held: DVec3,
    /// Anchor of the friction.
    pub anchor: DVec3,
    /// True if the anchor slides.
    pub sliding: bool,
}

/// A tick to be shown. See the module's description for frames.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Time since the run began, s.
    pub time: f64,
    /// Pose of the probe according to the device.
    pub device: Pose,
    /// Pose for which contacts were computed: the proxy's with a coupling, else the device's.
    pub tool: Pose,
    /// Poses of the other bodies: first the other tools, then the objects.
    pub others: Vec<Pose>,
    /// Position of the grip on the proxy.
    pub grip: DVec3,
    /// Position of the grip at the pose of the hand.
    pub hand: DVec3,
    /// Commanded wrench about the grip.
    pub wrench: Wrench,
    /// Number of all contacts, including contacts beyond the capacity.
    pub contact_count: usize,
    /// Contacts, drawn as dots.
    pub contacts: Vec<ShownContact>,
    /// Clusters, drawn as arrows.
    pub clusters: Vec<ShownCluster>,
    /// Points with friction.
    pub anchors: Vec<ShownAnchor>,
}

impl Moment {
    /// Creates an empty moment with the capacity `capacity` for each list.
    pub fn new(capacity: usize) -> Self {
        Self {
            time: 0.0,
            device: Pose::IDENTITY,
            tool: Pose::IDENTITY,
            others: Vec::with_capacity(capacity),
            grip: DVec3::ZERO,
            hand: DVec3::ZERO,
            wrench: Wrench::ZERO,
            contact_count: 0,
            contacts: Vec::with_capacity(capacity),
            clusters: Vec::with_capacity(capacity),
            anchors: Vec::with_capacity(capacity),
        }
    }

    /// Fills the moment from the tick at `time` seconds since the beginning. `grip_a` is the grip
    /// in the probe's frame. Does not allocate.
    pub fn fill(&mut self, tick: &Tick, time: f64, grip_a: DVec3) {
        self.time = time;
        self.device = tick.probe.pose_ba;
        self.tool = tick.tool_ba;
        self.others.clear();
        self.grip = tick.tool_ba.point(grip_a);
        self.hand = tick.probe.pose_ba.point(grip_a);
        self.wrench = tick.commanded;
        self.contact_count = tick.contacts.len();
        self.contacts.clear();
        self.clusters.clear();
        self.anchors.clear();
        self.show(tick, &(0..0));
    }

    /// Stores the poses of the other bodies. Does not allocate.
    pub fn place_others(&mut self, poses: impl Iterator<Item = Pose>) {
        append(&mut self.others, poses, |pose| pose);
    }

    /// Adds another tool in the same tick: its pose and its contacts. The first `known` of its
    /// contacts with tools are contacts with tools that were added before. Does not allocate.
    pub fn join(&mut self, tick: &Tick, known: usize) {
        self.place_others(std::iter::once(tick.tool_ba));
        let own = tick.contacts.len() - tick.contacts_between as usize;
        let known = own..own + known.min(tick.contacts_between as usize);
        self.contact_count += tick.contacts.len() - known.len();
        self.show(tick, &known);
    }

    /// Appends the contacts of the tick, except the contacts `known`.
    fn show(&mut self, tick: &Tick, known: &Range<usize>) {
        let contacts = tick.contacts.iter().enumerate().filter(|(k, _)| !known.contains(k));
        append(&mut self.contacts, contacts, |(_, contact)| ShownContact {
            point: contact.midpoint(),
            separation: contact.separation,
        });
        let forces = &tick.forces;
        let clusters = forces.clusters.iter().filter(|cluster| !known.contains(&(cluster.deepest as usize)));
        append(&mut self.clusters, clusters.zip(&forces.normal_forces), |(cluster, size)| ShownCluster {
            point: cluster.midpoint,
            force: *size * cluster.normal,
            separation: cluster.separation,
        });
        let grips =
            forces.grips.iter().zip(&forces.members).filter(|(_, member)| !known.contains(&(**member as usize)));
        append(&mut self.anchors, grips, |(grip, _)| {
            // The force is −stiffness times the vector from the anchor to the point of the probe.
            let strain = if grip.stiffness > 0.0 { grip.force / grip.stiffness } else { DVec3::ZERO };
            ShownAnchor { held: grip.point, anchor: grip.point + strain, sliding: grip.sliding }
        });
    }
}

/// Appends to `list` within its capacity.
fn append<T, S>(list: &mut Vec<T>, from: impl Iterator<Item = S>, shown: impl Fn(S) -> T) {
    let room = list.capacity() - list.len();
    list.extend(from.take(room).map(shown));
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpus::body::{Feature, FeaturePair};
    use palpus::detect::Contact;

    #[test]
    fn moment_stays_within_its_capacity() {
        let contact = Contact {
            piece_a: 0,
            piece_b: 0,
            features: FeaturePair { a: Feature::Vertex(0), b: Feature::Vertex(0) },
            point_a: DVec3::ZERO,
            point_b: DVec3::Z,
            normal: -DVec3::Z,
            separation: 1.0,
            slope: 0.0,
            count: 1.0,
            inside: false,
        };
        let mut tick = Tick::new(100);
        tick.contacts.resize(100, contact);
        let mut moment = Moment::new(7);
        let room = moment.contacts.capacity();
        moment.fill(&tick, 0.25, DVec3::X);
        assert_eq!((moment.contact_count, moment.contacts.len(), moment.contacts.capacity()), (100, room, room));
        assert_eq!(moment.contacts[0], ShownContact { point: DVec3::Z * 0.5, separation: 1.0 });
        assert_eq!((moment.time, moment.grip), (0.25, DVec3::X));
    }
}
