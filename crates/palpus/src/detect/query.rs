//! The public interface of contact determination: two bodies, and their contacts at any pose.

use std::sync::Arc;

use super::plane::SeparatingPlane;
use super::query_input::QueryInput;
use super::search::Search;
use super::{Contact, Helper, QueryCounters, QuerySettings};
use crate::algebra::{Clock, NoClock, Pose, Quota, Work};
use crate::body::Body;

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
    search: Search,
    counters: QueryCounters,
}

impl ContactQuery {
    /// Returns a query for the two bodies, with all memory that its queries need.
    pub fn new(a: Arc<Body>, b: Arc<Body>, settings: QuerySettings) -> Self {
        let search = Search::new(&a, &b, &settings);
        Self { a, b, settings, search, counters: QueryCounters::default() }
    }

    /// Returns a query as [`Self::new`] does, for two of many bodies that probably never touch. It
    /// has less memory, and only one part.
    pub(crate) fn small(a: Arc<Body>, b: Arc<Body>, settings: QuerySettings) -> Self {
        let search = Search::small(&a, &b, &settings);
        Self { a, b, settings, search, counters: QueryCounters::default() }
    }

    /// Writes to the memory for pairs of pieces, which is most of the query's memory, so that the
    /// system provides it now. Most systems provide memory when it is first used. Call this before
    /// a loop that must not wait for the system. Two finely tessellated bodies take up to 0.2 GB.
    pub fn use_all_memory(&mut self) {
        self.search.use_all_memory();
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
        let input = QueryInput::new(&self.a, &self.b, pose_ba, &self.settings);
        self.counters = self.search.run(&input, quota, clock);
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
        let input = QueryInput::new(&self.a, &self.b, pose_ba, &self.settings);
        self.search.nearest(&input, &mut self.counters)
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

    /// Returns a lower bound of the separation of the skipped pairs that were beyond the tolerance
    /// at their last visit, from what is known of these pairs and from the distance of the convex
    /// hulls. Pairs within the tolerance, whose contacts are extrapolated or dropped, do not count.
    pub fn unexamined_separation(&self) -> f64 {
        self.search.unexamined_separation()
    }

    /// Returns a plane between both bodies, if the last query skipped pairs and the convex hulls of
    /// the bodies are apart. Then all skipped pairs are apart along its normal, too.
    pub(crate) fn separating_plane(&self) -> Option<SeparatingPlane> {
        self.search.plane.found
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

    /// Sets [`QuerySettings::turn`] (rad) from the next query on.
    pub fn set_turn(&mut self, turn: f64) {
        self.settings.turn = turn;
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

    /// Returns a helper for the queries from now on. It has nothing to do if the queries are not
    /// divided, nor in the queries of a clone.
    pub fn helper(&self) -> Helper {
        Helper::of(self.search.parts())
    }

    /// Drops all cached data: the next query runs like the first one.
    pub fn clear(&mut self) {
        self.search.clear();
    }
}
