//! The public face of contact determination: two bodies, and their contacts at any pose.

use std::sync::Arc;

use super::search::{Asked, PairSearch};
use super::{Contact, QueryCounters};
use crate::algebra::{Clock, NoClock, Pose, Quota, Work};
use crate::body::Body;

/// Selects whether depths are proven.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Proof {
    /// The walk alone: the depth is locally least, as \[K02 §3.3\] has it. What a servo loop uses.
    #[default]
    None,
    /// The depth of every overlapping pair of pieces is proven globally least.
    Prove,
}

/// Settings of a [`ContactQuery`], which obtains its memory for them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuerySettings {
    /// Contacts are nearer than this, model units; 0 finds overlaps only.
    pub tolerance: f64,
    /// The most contacts of one query, at least one; of more, the deepest are kept.
    pub capacity: usize,
    /// Selects whether depths are proven globally least.
    pub proof: Proof,
    /// Contacts at the corners of flush pieces' patches, for tilts up to this angle (rad, above 0
    /// and below a right angle); `None`: one exact contact for each pair of pieces. See
    /// [`Patch`](crate::depth::Patch).
    pub patch_angle: Option<f64>,
    /// Guards against tunnelling: a fast body does not jump over a thin part between two queries.
    pub guard: bool,
    /// Keeps contacts from query to query, for pairs that a quota of work leaves out: see
    /// [`ContactQuery::run_within`].
    pub holding: bool,
}

impl Default for QuerySettings {
    /// Contacts within 1 mm, if the model unit is the metre; at most 4096, not proven, for single
    /// poses in any order.
    fn default() -> Self {
        Self { tolerance: 1e-3, capacity: 4096, proof: Proof::None, patch_angle: None, guard: false, holding: false }
    }
}

/// The contacts of a body a with a body b: both bodies, what is looked for, the memory that it
/// takes, and what is remembered from query to query.
///
/// Queries at poses near the last one are fast, but any pose may follow any other. Only
/// [`Self::new`] obtains memory.
///
/// ```
/// use glam::DVec3;
/// use palpus::{algebra::Pose, body::Body, detect::{ContactQuery, QuerySettings}};
/// use std::sync::Arc;
///
/// let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(DVec3::from_array);
/// let body = Arc::new(Body::from_convex(&corners)?);
/// let mut query = ContactQuery::new(body.clone(), body, QuerySettings::default());
/// for contact in query.contacts(&Pose::from_translation(DVec3::new(0.0, 0.0, 0.9))) {
///     println!("{} deep along {}", -contact.separation, contact.normal);
/// }
/// # assert!((query.found()[0].separation + 0.1 / 3f64.sqrt()).abs() < 1e-12);
/// # Ok::<(), palpus::body::BodyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct ContactQuery {
    a: Arc<Body>,
    b: Arc<Body>,
    settings: QuerySettings,
    search: PairSearch,
    counters: QueryCounters,
}

impl ContactQuery {
    /// Returns a query for the two bodies, with all memory that its queries need.
    pub fn new(a: Arc<Body>, b: Arc<Body>, settings: QuerySettings) -> Self {
        let search = PairSearch::new(&a, &b, &settings);
        Self { a, b, settings, search, counters: QueryCounters::default() }
    }

    /// Returns every contact nearer than the tolerance; `pose_ba` places a in b's frame, and
    /// contacts are in b's frame.
    pub fn contacts(&mut self, pose_ba: &Pose) -> &[Contact] {
        self.run(pose_ba, &NoClock);
        self.found()
    }

    /// Finds the contacts as [`Self::contacts`] does, times its stages by `clock`, and returns what
    /// it cost.
    pub fn run(&mut self, pose_ba: &Pose, clock: &impl Clock) -> &QueryCounters {
        self.run_within(pose_ba, &Work::unlimited().all(), clock)
    }

    /// The same with at most about `quota` of work: pairs that were not reached are answered from
    /// the last query and come first in the next.
    ///
    /// A contact of the last query is *held*, if the settings ask for holding: extrapolated along
    /// with the bodies, its separation measured anew along its normal, which is right to first
    /// order in the motion. Pairs that were not in contact may be nearer by now than the tolerance,
    /// but not nearer than [`Self::unseen_separation`]. No contact is made of the hulls of whole
    /// parts: that of a cup is full, and a spoon in it would be thrown out.
    pub fn run_within(&mut self, pose_ba: &Pose, quota: &Quota<'_>, clock: &impl Clock) -> &QueryCounters {
        let asked = Asked::new(&self.a, &self.b, pose_ba, self.settings.tolerance);
        self.counters = self.search.run(&asked, quota, clock);
        &self.counters
    }

    /// Runs the query, and returns the nearest pair of points of the two bodies, whatever the
    /// distance; when bodies overlap, the deepest contact. `None` if a body has no pieces.
    pub fn nearest(&mut self, pose_ba: &Pose) -> Option<Contact> {
        self.run(pose_ba, &NoClock);
        let asked = Asked::new(&self.a, &self.b, pose_ba, self.settings.tolerance);
        self.search.nearest(&asked, &mut self.counters)
    }

    /// The contacts of the last query.
    pub fn found(&self) -> &[Contact] {
        self.search.contacts()
    }

    /// Returns the counters of the last query.
    pub fn counters(&self) -> &QueryCounters {
        &self.counters
    }

    /// Pairs that the last query skipped since its quota was spent are at least this far apart,
    /// model units. Infinite if it skipped none; minus infinite if it had just begun.
    ///
    /// Pairs with extrapolated contacts do not count as skipped; nor do pairs whose closest points
    /// were on virtual features at their last visit.
    pub fn unseen_separation(&self) -> f64 {
        self.search.unseen_separation()
    }

    /// The least separation of the skipped pairs that were beyond the tolerance at their last
    /// visit. Pairs within tolerance, with contacts that are extrapolated or dropped, do not count.
    pub fn unlooked_separation(&self) -> f64 {
        self.search.unlooked_separation()
    }

    /// The body whose poses are asked for.
    pub fn a(&self) -> &Arc<Body> {
        &self.a
    }

    /// The body in whose frame contacts are.
    pub fn b(&self) -> &Arc<Body> {
        &self.b
    }

    /// Returns the settings of the next query.
    pub fn settings(&self) -> &QuerySettings {
        &self.settings
    }

    /// Sets [`QuerySettings::tolerance`] from the next query on.
    pub fn set_tolerance(&mut self, tolerance: f64) {
        self.settings.tolerance = tolerance;
    }

    /// Sets [`QuerySettings::patch_angle`] from the next query on.
    pub fn set_patch_angle(&mut self, angle: Option<f64>) {
        self.settings.patch_angle = angle;
        self.search.set_patch_angle(angle);
    }

    /// Tells the query that the bodies were far from each other for some time, and lay at `pose_ba`
    /// just before the next query. Cached contacts are dropped, and the motion from `pose_ba` on
    /// counts as continuous.
    pub fn came_from(&mut self, pose_ba: &Pose) {
        self.search.came_from(pose_ba);
    }

    /// Forgets the past: the next query is as the first was.
    pub fn clear(&mut self) {
        self.search.clear();
    }
}
