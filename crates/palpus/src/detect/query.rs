//! The public interface of contact determination: two bodies, and their contacts at any pose.

use std::sync::Arc;

use super::search::{Asked, PairSearch};
use super::{Contact, QueryCounters};
use crate::algebra::{Clock, NoClock, Pose, Quota, Work};
use crate::body::Body;

/// Selects whether depths are proven.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Proof {
    /// The walk gives the depth without a proof. The depth is a local minimum, as in \[K02 §3.3\].
    /// Servo loops use this.
    #[default]
    None,
    /// The depth of every overlapping pair of pieces is proven globally least.
    Prove,
}

/// Settings of a [`ContactQuery`]. The query allocates its memory for these settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuerySettings {
    /// Contacts are nearer than this, model units; 0 finds overlaps only.
    pub tolerance: f64,
    /// Contacts press below this separation, model units; `None`: below the tolerance. If so many
    /// pairs touch that only a sample is measured, a pair outside the sample is measured only if it
    /// presses harder than the sample.
    pub contact_offset: Option<f64>,
    /// Largest number of contacts of one query, at least one. If there are more, the deepest are
    /// kept.
    pub capacity: usize,
    /// Selects whether depths are proven globally least.
    pub proof: Proof,
    /// Contacts at the corners of flush pieces' patches, for tilts up to this angle (rad, above 0
    /// and below a right angle); `None`: one exact contact for each pair of pieces. See
    /// [`Patch`](crate::depth::Patch).
    pub patch_angle: Option<f64>,
    /// If true, the query guards against tunnelling: a fast body does not pass a thin part between
    /// two queries.
    pub guard: bool,
    /// If true, the query keeps contacts from query to query, for pairs that a work quota leaves
    /// out: see [`ContactQuery::run_within`].
    pub holding: bool,
}

impl Default for QuerySettings {
    /// Returns settings for contacts within 1 mm (if the model unit is the metre), at most 4096 of
    /// them. Depths are not proven. The poses may be in any order.
    fn default() -> Self {
        Self {
            tolerance: 1e-3,
            contact_offset: None,
            capacity: 4096,
            proof: Proof::None,
            patch_angle: None,
            guard: false,
            holding: false,
        }
    }
}

/// Finds the contacts of a body a with a body b. The value contains both bodies, the settings,
/// working memory, and data that are cached from query to query.
///
/// Queries at poses near the last one are fast, but any pose may follow any other. Only
/// [`Self::new`] allocates memory.
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

    /// Finds the contacts as [`Self::contacts`] does, measures its stages with `clock`, and returns
    /// the cost.
    pub fn run(&mut self, pose_ba: &Pose, clock: &impl Clock) -> &QueryCounters {
        self.run_within(pose_ba, &Work::unlimited().all(), clock)
    }

    /// Runs a query like [`Self::run`], but does at most about `quota` of work. Pairs that are not
    /// reached get their contacts from the last query, and come first in the next query.
    ///
    /// If [`QuerySettings::holding`] is true, contacts of the last query are *held*: they move with
    /// the bodies, and their separation is computed along their normals. This extrapolation is
    /// correct to first order in the motion. Pairs that were not in contact may now be nearer than
    /// the tolerance, but not nearer than [`Self::unseen_separation`]. Hulls of whole parts never
    /// make contacts: the hull of a cup is solid, and a spoon in the cup would be pushed out.
    pub fn run_within(&mut self, pose_ba: &Pose, quota: &Quota<'_>, clock: &impl Clock) -> &QueryCounters {
        let asked = Asked::new(&self.a, &self.b, pose_ba, &self.settings);
        self.counters = self.search.run(&asked, quota, clock);
        &self.counters
    }

    /// Runs the query, and returns the nearest pair of points of the two bodies at any distance. If
    /// the bodies overlap, returns the deepest contact. `None` if a body has no pieces.
    ///
    /// A distance, its points and its normal are those of the triangles of the meshes, up to
    /// rounding. Separations in [`Self::found`] are those of the pieces, which differ from the
    /// triangles by the flatness of the bodies ([`BodySettings`](crate::body::BodySettings)).
    pub fn nearest(&mut self, pose_ba: &Pose) -> Option<Contact> {
        self.run(pose_ba, &NoClock);
        let asked = Asked::new(&self.a, &self.b, pose_ba, &self.settings);
        self.search.nearest(&asked, &mut self.counters)
    }

    /// Returns the contacts of the last query.
    pub fn found(&self) -> &[Contact] {
        self.search.contacts()
    }

    /// Returns the counters of the last query.
    pub fn counters(&self) -> &QueryCounters {
        &self.counters
    }

    /// Returns a lower bound of the separation (model units) of all pairs that the last query
    /// skipped because its quota was spent. Infinite if the query skipped no pair; minus infinity
    /// if the query has no earlier results.
    ///
    /// Pairs with extrapolated contacts do not count as skipped; nor do pairs whose closest points
    /// were on virtual features at their last visit.
    pub fn unseen_separation(&self) -> f64 {
        self.search.unseen_separation()
    }

    /// Returns the least separation of the skipped pairs that were beyond the tolerance at their
    /// last visit. Pairs within the tolerance, whose contacts are extrapolated or dropped, do not
    /// count.
    pub fn unexamined_separation(&self) -> f64 {
        self.search.unexamined_separation()
    }

    /// Returns body a, whose pose is given to each query.
    pub fn a(&self) -> &Arc<Body> {
        &self.a
    }

    /// Returns body b, in whose frame the contacts are.
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

    /// Sets [`QuerySettings::contact_offset`] from the next query on.
    pub fn set_contact_offset(&mut self, offset: Option<f64>) {
        self.settings.contact_offset = offset;
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

    /// Drops all cached data: the next query runs like the first one.
    pub fn clear(&mut self) {
        self.search.clear();
    }
}
