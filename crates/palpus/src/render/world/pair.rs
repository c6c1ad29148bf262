//! Two bodies of a world: their contacts, the forces between them, and their terms in the implicit
//! step.
//!
//! Each pair has its own query, clusters, load shares and friction. So the forces between its two
//! bodies are equal and opposite, whatever else either body touches. All results of a pair are in
//! the world's frame.

use std::sync::Arc;

use glam::DVec3;

use super::super::contact_rows::ContactRows;
use super::super::reach::{Clearance, PlaneClearance};
use super::super::surfaces::Surfaces;
use super::super::{Forces, Motion, Scratch, Settings, VirtualCoupling, force};
use crate::algebra::tolerance::START_EASE;
use crate::algebra::{Clock, Pose, Quota, SpatialMatrix, Twist, Wrench};
use crate::body::{Body, FeaturePair};
use crate::detect::{Contact, ContactQuery, Helper, QueryCounters, QuerySettings};
use crate::force::{Centers, FrictionSettings, NetWrench, ShadingSettings};

/// Pose of one body of a pair, and its velocity for damping.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'b> {
    pub(super) body: &'b Body,
    pub(super) pose: Pose,
    /// Centre of mass in the world.
    pub(super) center: DVec3,
    /// Twist of the centre of mass if it is known before the step; otherwise zero.
    pub(super) twist: Twist,
}

/// Which contacts a step needs: those that push now, and those that may push at its end.
#[derive(Clone, Copy, Debug)]
pub(super) struct LookAhead {
    /// Contacts are searched below this separation, m.
    pub(super) within: f64,
    /// The bodies may turn relative to each other by this angle, rad; see [`QuerySettings::turn`].
    pub(super) turn: f64,
}

/// See the module's description. The first body is a, the second b.
#[derive(Clone, Debug)]
pub(super) struct Pair {
    /// Indices of the bodies.
    pub(super) bodies: [usize; 2],
    settings: Settings,
    /// Pose of a in b's frame in the current step.
    pose_ba: Pose,
    /// The current step searches contacts below this separation, m.
    within: f64,
    /// Data for shading; may exist while shading is off.
    surfaces: Option<Surfaces>,
    query: ContactQuery,
    scratch: Scratch,
    pub(super) contacts: Vec<Contact>,
    /// Forces between the bodies. `net` is about each body's own centre of mass.
    pub(super) forces: Forces,
    rows: ContactRows,
    /// Part of the overlap of the bodies at their start that contacts do not resist yet, m.
    eased: f64,
    /// True until a query has examined the whole start.
    starts: bool,
    pub(super) counters: QueryCounters,
    /// The last step in which the pair was queried.
    pub(super) looked_at: Option<u64>,
    /// The group of moved bodies to which the pair's contacts belong.
    pub(super) group: u32,
}

impl Pair {
    /// Returns a pair of two bodies with `settings` for their contacts. `has_tool` is true if a
    /// body is a tool. The memory of the query is then used at once. Few pairs of objects ever
    /// touch, and together these pairs are many; so their queries are small.
    pub(super) fn new(bodies: [usize; 2], [a, b]: [Arc<Body>; 2], settings: Settings, has_tool: bool) -> Self {
        let capacity = settings.capacity;
        let asked = QuerySettings {
            tolerance: settings.contact_tolerance,
            contact_offset: Some(settings.contact_offset()),
            capacity,
            patch_angle: settings.patch_angle,
            guard: true,
            holding: true,
            ..QuerySettings::default()
        };
        let surfaces = settings.shading.map(|shading| Surfaces::new(&a, &b, shading.crease_angle));
        let mut query = if has_tool { ContactQuery::new(a, b, asked) } else { ContactQuery::small(a, b, asked) };
        if has_tool {
            query.use_all_memory();
        }
        Self {
            bodies,
            pose_ba: Pose::IDENTITY,
            within: settings.contact_tolerance,
            surfaces,
            query,
            scratch: if has_tool { Scratch::new(capacity) } else { Scratch::of_objects(capacity) },
            contacts: Vec::with_capacity(capacity),
            forces: Forces::new(capacity),
            rows: ContactRows::new(capacity),
            eased: 0.0,
            starts: true,
            settings,
            counters: QueryCounters::default(),
            looked_at: None,
            group: u32::MAX,
        }
    }

    /// Prepares shading at this crease angle (rad), so that it can be turned on later.
    pub(super) fn prepare_surfaces(&mut self, crease_angle: f64) {
        self.surfaces.get_or_insert_with(|| Surfaces::new(self.query.a(), self.query.b(), crease_angle));
    }

    /// Changes the settings. The capacity must stay the same.
    pub(super) fn set_settings(&mut self, settings: Settings) {
        self.settings = settings;
        self.query.set_patch_angle(self.settings.patch_angle);
        self.query.set_contact_offset(Some(self.settings.contact_offset()));
        if self.settings.friction.is_none() {
            self.scratch.clear();
        }
    }

    /// Returns a helper for the pair's queries.
    pub(super) fn helper(&self) -> Helper {
        self.query.helper()
    }

    /// Returns the settings of the pair's contacts.
    pub(super) fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Drops all state.
    pub(super) fn clear(&mut self) {
        self.query.clear();
        self.scratch.clear();
        self.rows.clear();
        self.looked_at = None;
        (self.eased, self.starts) = (0.0, true);
        self.rest();
    }

    /// Ends all contacts, because the bodies are too far apart for a query.
    pub(super) fn part(&mut self) {
        self.scratch.clear();
        self.rows.clear();
        self.rest();
    }

    /// Removes the results of the last step.
    fn rest(&mut self) {
        self.contacts.clear();
        self.forces.clear();
        self.counters = QueryCounters::default();
    }

    /// Returns true if a contact is near enough to act in this step.
    pub(super) fn is_touching(&self) -> bool {
        !self.forces.clusters.is_empty()
    }

    /// Returns a lower bound of the separation of all parts that the query did not examine, m.
    pub(super) fn unseen_separation(&self) -> f64 {
        self.query.unseen_separation()
    }

    /// Returns true if the last query reached its work limit, or if there was no query.
    pub(super) fn is_cut(&self) -> bool {
        self.unseen_separation() < f64::INFINITY
    }

    /// Returns what is known of the parts that the query did not examine, for a motion of body `of`
    /// (0 or 1). `pose_b` is the pose of b.
    pub(super) fn clearance(&self, of: usize, pose_b: &Pose) -> Clearance {
        let offset = self.settings.contact_offset();
        let plane = self.query.separating_plane().map(|plane| {
            let away = pose_b.vector(plane.normal);
            PlaneClearance { away: if of == 0 { away } else { -away }, clear: plane.gap - offset }
        });
        Clearance { all: self.query.unexamined_separation() - offset, plane }
    }

    /// Sets the relative pose in the last step, if the pair was last queried in an earlier step.
    pub(super) fn came_from(&mut self, pose_ba: &Pose) {
        self.query.came_from(pose_ba);
    }

    /// Finds the contacts that `ahead` includes.
    pub(super) fn query(
        &mut self,
        a: &Place<'_>,
        b: &Place<'_>,
        ahead: LookAhead,
        quota: &Quota<'_>,
        clock: &impl Clock,
    ) {
        self.pose_ba = relative(&a.pose, &b.pose);
        self.within = ahead.within;
        self.query.set_tolerance(ahead.within);
        self.query.set_turn(ahead.turn);
        self.counters = *self.query.run_within(&self.pose_ba, quota, clock);
        self.contacts.clear();
        self.contacts.extend(self.query.found().iter().take(self.settings.capacity));
    }

    /// Sets how much of the overlap of the bodies at their start the contacts do not resist in
    /// this step of `dt` s: first all of it, and less in each step. Contacts are stiff, and would
    /// throw a free body away.
    pub(super) fn ease_start(&mut self, dt: f64) {
        let overlap = self.contacts.iter().fold(0.0, |most, contact| (-contact.separation).max(most));
        let left = if self.starts { overlap } else { self.eased - START_EASE * dt };
        self.eased = left.clamp(0.0, overlap);
        self.starts &= self.is_cut();
    }

    /// Computes the wrenches of the found contacts on both bodies in a tick of `dt` s. `implicit`
    /// is true if an implicit step moves one of the bodies under these contacts.
    pub(super) fn force(&mut self, a: &Place<'_>, b: &Place<'_>, dt: f64, implicit: bool) {
        if self.contacts.is_empty() {
            self.scratch.clear();
            self.rows.clear();
            self.forces.clear();
            return;
        }
        let pose_ba = self.pose_ba;
        let is_placed = b.pose != Pose::IDENTITY;
        let centers = [a, b].map(|place| place.body.mass().center_of_mass);
        let centers = Centers { a: pose_ba.point(centers[0]), b: centers[1] };
        let mut twist = relative_twist(&a.twist, &b.twist, a.center - b.center);
        if is_placed {
            let inverse = b.pose.inverse();
            twist = Twist { angular: inverse.vector(twist.angular), linear: inverse.vector(twist.linear) };
        }
        let pressed = if implicit { self.rows.pressed(self.settings.stiffness) } else { 0.0 };
        let motion = Motion { pose_ba, centers, twist, pressed, step: if implicit { dt } else { 0.0 }, elapsed: dt };
        let shading = self.surfaces.as_ref().zip(self.settings.shading);
        let direction = |contact: &Contact| match shading {
            Some((surfaces, ShadingSettings { most_turn, .. })) => {
                surfaces.direction(contact, [a.body, b.body], &pose_ba, most_turn)
            }
            None => contact.normal,
        };
        let contact_tolerance = self.within.max(self.settings.contact_tolerance);
        let settings = Settings { contact_tolerance, ..self.settings };
        widen(&mut self.contacts, self.eased);
        force(&self.contacts, &motion, &settings, direction, &mut self.scratch, &mut self.forces);
        widen(&mut self.contacts, -self.eased);
        if is_placed {
            for contact in &mut self.contacts {
                *contact = placed(contact, &b.pose);
            }
            self.forces.place(&b.pose);
        }
        if implicit {
            self.rows.gather(&self.contacts, &self.forces, a.center, &self.settings);
        } else {
            self.rows.clear();
        }
    }

    /// Calls `press` with the normal on a and the point of each pressing contact. a's centre of
    /// mass is at `center`. `implicit` is true if an implicit step has moved one of the bodies.
    pub(super) fn each_pressing(&self, center: DVec3, implicit: bool, mut press: impl FnMut(DVec3, DVec3)) {
        if implicit {
            self.rows.pressing().for_each(|(normal, offset)| press(normal, center + offset));
            return;
        }
        for (cluster, &force) in self.forces.clusters.iter().zip(&self.forces.normal_forces) {
            if force > 0.0 {
                press(cluster.normal, cluster.midpoint);
            }
        }
    }

    /// Returns damping over stiffness of the contacts, s. Contacts that share a stiffness share the
    /// damping in the same ratio.
    fn lag(&self) -> f64 {
        self.settings.damping / self.settings.stiffness
    }

    /// Adds the contact forces to the system of a step of `h` s for body a.
    pub(super) fn add_to(&self, system: &mut SpatialMatrix, load: &mut Wrench, h: f64) {
        self.rows.add_to(system, load, h, self.lag());
    }

    /// Returns the impulse of the contacts on a (N·s, and N·m·s about a's centre of mass) in a
    /// step of `h` s. The step's solution is the `twist` of a relative to b.
    pub(super) fn impulse(&self, twist: &Twist, h: f64) -> Wrench {
        self.rows.impulse(twist, h, self.lag())
    }

    /// Returns the impulse of the contacts on a, as in [`Self::impulse`], with the forces that were
    /// last predicted, for this `twist`.
    pub(super) fn predicted_impulse(&self, twist: &Twist, h: f64) -> Wrench {
        self.rows.predicted_impulse(twist, h)
    }

    /// Predicts the contact forces if a moves with `twist` relative to b. Returns true if the
    /// set of pressing contacts or a friction force has changed. For `follows` see
    /// [`ContactRows::revise`].
    pub(super) fn revise(&mut self, twist: &Twist, h: f64, follows: bool) -> bool {
        let lag = self.lag();
        self.rows.revise(twist, h, lag, follows)
    }

    /// Returns true if a contact pushes at the end of the step.
    pub(super) fn is_pressing(&self) -> bool {
        self.rows.pressing().next().is_some()
    }

    /// Returns the number of clusters that lose contact within the step.
    pub(super) fn released(&self) -> u32 {
        self.rows.released()
    }
}

/// Adds `by` (m) to the separations of the contacts.
fn widen(contacts: &mut [Contact], by: f64) {
    if by != 0.0 {
        contacts.iter_mut().for_each(|contact| contact.separation += by);
    }
}

/// Returns the pose of a in b's frame.
pub(super) fn relative(a: &Pose, b: &Pose) -> Pose {
    // There is no multiplication by the identity, because its rounding would change bits.
    if *b == Pose::IDENTITY { *a } else { b.inverse() * *a }
}

/// Returns a's twist relative to b about a's centre of mass. `shift` is the vector from b's
/// centre of mass to a's.
pub(super) fn relative_twist(a: &Twist, b: &Twist, shift: DVec3) -> Twist {
    if *b == Twist::default() {
        return *a;
    }
    Twist { angular: a.angular - b.angular, linear: a.linear - b.at(shift) }
}

/// Returns the settings of the contacts of two tools: the first tool's settings, with the lower
/// stiffness and the smaller tolerance of both.
pub(super) fn common(settings: [&Settings; 2]) -> Settings {
    let [first, second] = settings.map(Settings::held);
    let [first, second] = [&first, &second];
    let lesser = |of: fn(&Settings) -> f64| of(first).min(of(second));
    let contact_offset = first.contact_offset().min(second.contact_offset());
    Settings {
        contact_tolerance: lesser(|settings| settings.contact_tolerance),
        stiffness: lesser(|settings| settings.stiffness),
        damping: lesser(|settings| settings.damping),
        shading: first.shading.or(second.shading),
        material: first.material.or(second.material),
        friction: first.friction.zip(second.friction).map(|(one, other)| FrictionSettings {
            tangential_stiffness: one.tangential_stiffness.min(other.tangential_stiffness),
            ..one
        }),
        // Only the contact offset of this coupling is used.
        coupling: first.coupling.or(second.coupling).map(|coupling| VirtualCoupling { contact_offset, ..coupling }),
        time_budget: first.time_budget.or(second.time_budget),
        capacity: first.capacity.max(second.capacity),
        ..*first
    }
}

/// Returns `contact`, transformed by `pose`.
fn placed(contact: &Contact, pose: &Pose) -> Contact {
    Contact {
        point_a: pose.point(contact.point_a),
        point_b: pose.point(contact.point_b),
        normal: pose.vector(contact.normal),
        ..*contact
    }
}

/// Returns `contact` with a and b exchanged.
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
    /// Transforms all vectors by `pose`.
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
            grip.strain = pose.vector(grip.strain);
            grip.force = pose.vector(grip.force);
        }
        let NetWrench { on_a, on_b } = self.net;
        self.net = NetWrench { on_a: on_a.rotated(pose), on_b: on_b.rotated(pose) };
    }

    /// Adds the wrenches of another pair of bodies. If `turned`, bodies a and b are exchanged in
    /// the other pair.
    pub(super) fn append_net(&mut self, other: &Self, turned: bool) {
        let (own, others) = if turned { (other.net.on_b, other.net.on_a) } else { (other.net.on_a, other.net.on_b) };
        self.net = NetWrench { on_a: self.net.on_a + own, on_b: self.net.on_b + others };
    }

    /// Adds the wrenches, clusters and friction of another pair of bodies. The contacts of that
    /// pair have the indices from `contacts` on. For `turned` see [`Self::append_net`].
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
            grip.strain *= sign;
            grip.force *= sign;
            grip
        }));
        self.append_net(other, turned);
    }
}
