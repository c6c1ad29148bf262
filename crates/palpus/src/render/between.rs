//! What two tools do to each other: query and force stage of the pair, in the second one's frame, and what came of them in the environment's.
//!
//! Every pair of bodies has clusters, shares and friction of its own. So what the one tool gives the other takes, whatever else either of
//! them touches; and a front, a grip or a piece's index never meets one of another pair.

use std::sync::Arc;

use glam::DVec3;

use super::renderer::{Surfaces, query};
use super::touches::Touches;
use super::{Forces, Motion, Scratch, Settings, VirtualCoupling, force};
use crate::algebra::{Clock, Pose, Quota, Twist};
use crate::body::{Body, FeaturePair};
use crate::detect::{Contact, ContactQuery, QueryCounters};
use crate::force::{Centers, FrictionSettings, NetWrench, ShadingSettings};

/// Two tools against each other: the first is a, the second b.
#[derive(Clone, Debug)]
pub(super) struct Between {
    settings: Settings,
    surfaces: Option<Surfaces>,
    query: ContactQuery,
    scratch: Scratch,
    /// Of the last tick, in the environment's frame.
    pub(super) contacts: Vec<Contact>,
    /// Of the last tick, in the environment's frame; `net` is on the first and on the second tool.
    pub(super) forces: Forces,
    pub(super) touches: Touches,
}

impl Between {
    /// Memory for what the settings of both ask.
    pub(super) fn new([first, second]: [&Arc<Body>; 2], settings: &[Settings; 2]) -> Self {
        let settings = common(settings);
        let capacity = settings.capacity;
        Self {
            surfaces: settings.shading.map(|shading| Surfaces::new(first, second, shading.crease_angle)),
            query: query(first, second, &settings),
            scratch: Scratch::new(capacity),
            contacts: Vec::with_capacity(capacity),
            forces: Forces::new(capacity),
            touches: Touches::new(capacity),
            settings,
        }
    }

    /// Able to take up shading later on.
    pub(super) fn prepare_surfaces(&mut self, crease_angle: f64) {
        self.surfaces.get_or_insert_with(|| Surfaces::new(self.query.a(), self.query.b(), crease_angle));
    }

    /// Goes on with what the settings of both ask; they are of the memory that there is.
    pub(super) fn set_settings(&mut self, settings: &[Settings; 2]) {
        self.settings = common(settings);
        self.query.set_patch_angle(self.settings.patch_angle);
        if self.settings.friction.is_none() {
            self.scratch.clear();
        }
    }

    /// What holds between the two.
    pub(super) fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Forgets the past.
    pub(super) fn clear(&mut self) {
        self.query.clear();
        self.scratch.clear();
        self.rest();
    }

    /// Nothing touches.
    pub(super) fn rest(&mut self) {
        self.contacts.clear();
        self.forces.clear();
    }

    /// Least distance of what was not looked at.
    pub(super) fn unseen_separation(&self) -> f64 {
        self.query.unseen_separation()
    }

    /// m beyond the skin: the same of what may have come near since it was last looked at.
    pub(super) fn unlooked(&self) -> f64 {
        self.query.unlooked_separation() - self.settings.skin()
    }

    /// All contacts of the two nearer than `within` (m).
    pub(super) fn query(
        &mut self,
        motions: &[Motion; 2],
        within: f64,
        quota: &Quota<'_>,
        clock: &impl Clock,
    ) -> QueryCounters {
        self.query.set_tolerance(within);
        let counters = *self.query.run_within(&in_second(motions), quota, clock);
        self.contacts.clear();
        self.contacts.extend(self.query.found().iter().take(self.settings.capacity));
        counters
    }

    /// The wrenches on both, of contacts nearer than `within` (m); what it leaves is in the environment's frame.
    pub(super) fn force(&mut self, motions: &[Motion; 2], within: f64) {
        let [first, second] = motions;
        let pose_ba = in_second(motions);
        let inverse = second.pose_ba.inverse();
        let apart = first.centers.a - second.centers.a;
        let motion = Motion {
            pose_ba,
            centers: Centers { a: inverse.point(first.centers.a), b: inverse.point(second.centers.a) },
            twist: Twist {
                angular: inverse.vector(first.twist.angular - second.twist.angular),
                linear: inverse.vector(first.twist.linear - second.twist.at(apart)),
            },
            pressed: 0.0,
        };
        let bodies: [&Body; 2] = [self.query.a(), self.query.b()];
        let shading = self.surfaces.as_ref().zip(self.settings.shading);
        let direction = |contact: &Contact| match shading {
            Some((surfaces, ShadingSettings { most_turn, .. })) => {
                surfaces.direction(contact, bodies, &pose_ba, most_turn)
            }
            None => contact.normal,
        };
        let contact_tolerance = within.max(self.settings.contact_tolerance);
        let settings = Settings { contact_tolerance, ..self.settings };
        force(&self.contacts, &motion, &settings, direction, &mut self.scratch, &mut self.forces);
        for contact in &mut self.contacts {
            *contact = placed(contact, &second.pose_ba);
        }
        self.forces.place(&second.pose_ba);
        let skin = self.settings.skin();
        self.touches.gather(&self.forces, first.centers.a, skin);
    }
}

/// The first tool placed in the second one's frame.
fn in_second([first, second]: &[Motion; 2]) -> Pose {
    second.pose_ba.inverse() * first.pose_ba
}

/// What holds between two tools of these settings: the first one's, as soft as the softer of the two and within the lesser tolerance, so
/// that both are looked after by one law.
fn common(settings: &[Settings; 2]) -> Settings {
    let [first, second] = settings.each_ref().map(Settings::held);
    let [first, second] = [&first, &second];
    let lesser = |of: fn(&Settings) -> f64| of(first).min(of(second));
    let skin = first.skin().min(second.skin());
    Settings {
        contact_tolerance: lesser(|settings| settings.contact_tolerance),
        stiffness: lesser(|settings| settings.stiffness),
        damping: lesser(|settings| settings.damping),
        shading: first.shading.or(second.shading),
        friction: first.friction.zip(second.friction).map(|(one, other)| FrictionSettings {
            tangential_stiffness: one.tangential_stiffness.min(other.tangential_stiffness),
            ..one
        }),
        // Read for its skin alone.
        coupling: first.coupling.or(second.coupling).map(|coupling| VirtualCoupling { skin, ..coupling }),
        time_budget: first.time_budget.or(second.time_budget),
        capacity: first.capacity.max(second.capacity),
        ..*first
    }
}

/// `contact` in the frame in which `pose` places its own.
fn placed(contact: &Contact, pose: &Pose) -> Contact {
    Contact {
        point_a: pose.point(contact.point_a),
        point_b: pose.point(contact.point_b),
        normal: pose.vector(contact.normal),
        ..*contact
    }
}

/// `contact` as the other body sees it.
pub(super) fn mirrored(contact: &Contact) -> Contact {
    Contact {
        piece_a: contact.piece_b,
        piece_b: contact.piece_a,
        features: FeaturePair { a: contact.features.b, b: contact.features.a },
        point_a: contact.point_b,
        point_b: contact.point_a,
        normal: -contact.normal,
        ..*contact
    }
}

impl Forces {
    /// Writes everything in the frame in which `pose` places the present one.
    fn place(&mut self, pose: &Pose) {
        for cluster in &mut self.clusters {
            cluster.midpoint = pose.point(cluster.midpoint);
            cluster.normal = pose.vector(cluster.normal);
        }
        for place in &mut self.places {
            *place = pose.point(*place);
        }
        for direction in &mut self.directions {
            *direction = pose.vector(*direction);
        }
        for hold in &mut self.holds {
            *hold = pose.point(*hold);
        }
        for grip in &mut self.grips {
            grip.point = pose.point(grip.point);
            grip.force = pose.vector(grip.force);
        }
        let NetWrench { on_a, on_b } = self.net;
        self.net = NetWrench { on_a: on_a.rotated(pose), on_b: on_b.rotated(pose) };
    }

    /// Adds the clusters and the wrench of another pair of bodies, whose contacts stand from `contacts` on; `turned`: the body which this is
    /// about is that pair's b. The wrench on the environment stays as it is.
    pub(super) fn append(&mut self, other: &Self, contacts: usize, turned: bool) {
        let sign = if turned { -1.0 } else { 1.0 };
        let (first_member, first_contact) = (self.members.len() as u32, contacts as u32);
        self.clusters.extend(other.clusters.iter().map(|cluster| {
            let mut cluster = *cluster;
            cluster.normal *= sign;
            cluster.first_member += first_member;
            cluster.deepest += first_contact;
            cluster
        }));
        self.members.extend(other.members.iter().map(|i| i + first_contact));
        self.places.extend_from_slice(&other.places);
        self.separations.extend_from_slice(&other.separations);
        self.directions.extend(other.directions.iter().map(|direction: &DVec3| *direction * sign));
        self.weights.extend_from_slice(&other.weights);
        self.holds.extend_from_slice(&other.holds);
        self.normal_forces.extend_from_slice(&other.normal_forces);
        self.stiffnesses.extend_from_slice(&other.stiffnesses);
        self.grips.extend(other.grips.iter().map(|grip| {
            let mut grip = *grip;
            grip.force *= sign;
            grip
        }));
        self.net.on_a = self.net.on_a + if turned { other.net.on_b } else { other.net.on_a };
    }
}
