//! The penetration depth of two solids of any shape, as a pair of proven bounds. The depth is the
//! length of the shortest translation that separates the solids.
//!
//! Let A (at a pose) and B be the solids. A translation t is *free* if A moved by t and B have no
//! inner point in common. The depth is the least |t| of all free t. The straight motion of A by t
//! may pass through B. The result satisfies lower ≤ depth ≤ upper:
//!
//! 1. *Blocked translations*. If a convex set P in A and a convex set Q in B overlap at t, then t
//!    is not free. These t form a convex set, an [obstacle](obstacle). The [interior](interior) of
//!    each solid is filled with large convex cells, and pairs of cells give the obstacles. If one
//!    body lies in the other and the surfaces do not cross, no translation shorter than the
//!    distance of the surfaces is free. The shorter translations then form a ball, which is another
//!    obstacle.
//! 2. *Free translations*. A translation is free if the surfaces have no common point and no
//!    part of one surface lies in the other body ([surfaces](surfaces)). The test uses exact
//!    predicates on the triangles and does not depend on the cells.
//! 3. *Search* ([cones](cones)). A surface around the origin encloses only blocked translations.
//!    The surface grows where it is nearest to the origin. If the surface cannot grow at this
//!    place, the search either finds a free translation or subdivides the surface.
//!
//! A surface that is not closed bounds no solid, so a body with an open surface has no inside. A
//! translation is then free if the body's triangles neither cross the other surface nor lie in the
//! other solid. If a closed surface crosses itself, a point is inside if the surface winds around
//! it at least once.
//!
//! `docs/global-depth.md` has the proofs and figures.

mod cell;
mod cones;
mod containment;
mod containment_query;
mod convex;
mod half_spaces;
mod interior;
mod lens;
mod obstacle;
mod scene;
mod slabs;
mod surfaces;
#[cfg(test)]
mod tests;
mod way_out;

use std::collections::BTreeMap;
use std::ops::Range;

use glam::DVec3;

use crate::algebra::tolerance::{
    DEPTH_BUDGET, DEPTH_GAP, DEPTH_HAIR, DEPTH_LISTED, DEPTH_NEAR, DEPTH_REACH, DEPTH_ROUNDING,
};
use crate::algebra::{Pose, Workers, map_in_order};
use crate::body::Body;
use cell::Cell;
use cones::{Goal, Search};
pub use containment::Containment;
pub use containment_query::ContainmentQuery;
use convex::{ConvexMemory, ConvexPair, convex_pair};
pub use interior::Interior;
use obstacle::Gate;
use scene::{Key, Leaf, Ray, Scene};
use way_out::{project, slide};

/// Bounds the penetration depth of two bodies.
#[derive(Clone, Copy, Debug)]
pub struct GlobalDepth<'a> {
    a: &'a Body,
    interior_a: &'a Interior,
    b: &'a Body,
    interior_b: &'a Interior,
}

/// The wanted gap of the bounds, and the budget.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlobalSettings {
    /// The search ends if upper − lower is at most this value (model units).
    pub gap: f64,
    /// The search ends after about this many evaluations. One evaluation is a detailed test of an
    /// obstacle or a comparison of triangles.
    pub budget: u64,
    /// If true, a translation counts as free only if body a can then leave b along a straight line
    /// without rotating. The lower bound is still valid for all free translations.
    pub outside: bool,
}

impl GlobalSettings {
    /// Returns settings with a gap of 1 % of the smaller body's size, and with a budget that is
    /// enough for most poses.
    pub fn new(a: &Body, b: &Body) -> Self {
        Self { gap: DEPTH_GAP * a.size().min(b.size()), budget: DEPTH_BUDGET, outside: false }
    }
}

/// Proven bounds of the depth at one pose, in b's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthBracket {
    /// No translation shorter than this separates the bodies (model units). 0 if the bodies are
    /// separate.
    pub lower: f64,
    /// The length of `translation` (model units).
    pub upper: f64,
    /// Moving body a by this translation separates the bodies. The query verifies the separation on
    /// the triangles.
    pub translation: DVec3,
    /// True if the gap between the bounds is as small as requested.
    pub certified: bool,
    /// States which body lies in the other, if any.
    pub containment: Containment,
    /// The distance of the surfaces (model units) if the bodies are separate or one lies in the
    /// other.
    pub distance: Option<f64>,
    /// Number of evaluations that the search used.
    pub evaluations: u64,
}

impl DepthBracket {
    /// Returns the result for bodies that are separate.
    fn free(distance: f64) -> Self {
        Self {
            lower: 0.0,
            upper: 0.0,
            translation: DVec3::ZERO,
            certified: true,
            containment: Containment::Neither,
            distance: Some(distance),
            evaluations: 1,
        }
    }
}

/// The previous answer of a search, with the cones and obstacles that proved it. The search at the
/// next pose starts from this memory. The memory affects the time of the search, but not the
/// validity of the bounds.
#[derive(Clone, Debug, Default)]
pub struct GlobalMemory {
    translation: Option<DVec3>,
    pose_ba: Option<Pose>,
    /// Pose at which the candidates of the leaves were listed.
    listed_ba: Option<Pose>,
    leaves: Vec<Leaf>,
    kept: Vec<(Cell, Cell)>,
    gates: BTreeMap<Ray, Gate>,
    /// Number of leaves after the last search without memory.
    fresh: usize,
    /// The leaves of the last search without memory, without the added obstacles. Cones are cut but
    /// never merged, so a search sometimes starts from these leaves again.
    base: Vec<Leaf>,
    /// True if the last search started from `base`.
    rebased: bool,
    convex: Option<Box<ConvexMemory>>,
}

impl<'a> GlobalDepth<'a> {
    /// Prepares the depth query of `a` and `b`. Each interior must belong to its body.
    pub fn new(a: &'a Body, interior_a: &'a Interior, b: &'a Body, interior_b: &'a Interior) -> Self {
        Self { a, interior_a, b, interior_b }
    }

    /// Number of consecutive poses per worker task; see [`Self::run_all`].
    pub const RUN: usize = 25;

    /// Divides the poses 0 to `count` − 1 into runs of [`Self::RUN`] consecutive poses. Calls
    /// `answer` for each run, with an empty memory. Returns the answers in order. The answers are
    /// the same for any number of workers. Calls `progress` with the finished fraction.
    pub fn run_all<T: Send + Sync>(
        count: usize,
        workers: &dyn Workers,
        progress: &mut dyn FnMut(f64),
        answer: impl Fn(Range<usize>, &mut GlobalMemory) -> T + Sync,
    ) -> Vec<T> {
        let of_run = |run: usize| {
            let begin = run * Self::RUN;
            answer(begin..(begin + Self::RUN).min(count), &mut GlobalMemory::default())
        };
        map_in_order(workers, count.div_ceil(Self::RUN), 1, of_run, progress)
    }

    /// Returns bounds of the depth with body a at `pose_ba` in b's frame.
    pub fn run(&self, pose_ba: &Pose, settings: &GlobalSettings, memory: &mut GlobalMemory) -> DepthBracket {
        let size = self.a.size().min(self.b.size());
        let convex = convex_pair(self, pose_ba, &mut memory.convex);
        if let Some(ConvexPair::Apart(distance)) = convex {
            return DepthBracket::free(distance);
        }
        if let Some(ConvexPair::Overlap { lower, free, partly: true, evaluations }) = convex {
            return self.bracket(lower, free, settings, (Containment::Neither, None), evaluations);
        }
        let mut scene = Scene::new(self, pose_ba, DEPTH_HAIR * size, settings.outside);
        let (mut containment, mut distance) = (Containment::Neither, None);
        if scene.surfaces.crossings(DVec3::ZERO, 1).is_empty() {
            distance = Some(scene.surfaces.distance(DVec3::ZERO));
            if !scene.surfaces.nested(DVec3::ZERO) && (!settings.outside || scene.surfaces.escapes(DVec3::ZERO)) {
                memory.translation = None;
                return DepthBracket::free(distance.unwrap_or_default());
            }
            containment = scene.containment();
        }
        if let Some(ConvexPair::Overlap { lower, free, evaluations, .. }) = convex {
            return self.bracket(lower, free, settings, (containment, distance), evaluations);
        }
        let (lower, translation) = self.search(&mut scene, settings, pose_ba, memory);
        memory.translation = Some(translation);
        memory.pose_ba = Some(*pose_ba);
        let evaluations = scene.evaluations;
        (memory.kept, memory.gates) = scene.keep(&mut memory.leaves);
        self.bracket(lower, translation, settings, (containment, distance), evaluations)
    }

    /// Returns the result for bodies that are not separate.
    fn bracket(
        &self,
        lower: f64,
        translation: DVec3,
        settings: &GlobalSettings,
        (containment, distance): (Containment, Option<f64>),
        evaluations: u64,
    ) -> DepthBracket {
        let upper = translation.length();
        let rounding = DEPTH_ROUNDING * self.a.size().max(self.b.size());
        let lower = (lower - rounding).clamp(0.0, upper);
        let certified = upper - lower <= settings.gap;
        DepthBracket { lower, upper, translation, certified, containment, distance, evaluations }
    }

    /// Returns the lower bound and a verified free translation. The bodies are not separate.
    fn search(
        &self,
        scene: &mut Scene<'a>,
        settings: &GlobalSettings,
        pose_ba: &Pose,
        memory: &mut GlobalMemory,
    ) -> (f64, DVec3) {
        if !self.is_near(pose_ba, memory.pose_ba.as_ref(), DEPTH_NEAR) {
            *memory = GlobalMemory { convex: memory.convex.take(), ..GlobalMemory::default() };
        }
        if memory.leaves.is_empty() || !self.is_near(pose_ba, memory.listed_ba.as_ref(), DEPTH_LISTED) {
            memory.leaves.iter_mut().chain(&mut memory.base).for_each(|leaf| leaf.candidates = None);
            memory.listed_ba = Some(*pose_ba);
        }
        let last = memory.translation.map(|last| (last, DEPTH_REACH * last.length()));
        let apart = last.is_none().then(|| self.boxes_apart(scene));
        scene.place_cells(last.map_or_else(|| apart.unwrap_or_default().length(), |(_, reach)| reach));
        scene.restore(&memory.kept, &memory.leaves, std::mem::take(&mut memory.gates));
        let near = last.and_then(|(last, reach)| project(scene, last, reach)).filter(|&t| scene.verified(t));
        let free = near.unwrap_or_else(|| {
            let apart = apart.unwrap_or_else(|| self.boxes_apart(scene));
            let free = slide(scene, apart);
            if scene.verified(free) { free } else { apart }
        });
        let goal = Goal { gap: settings.gap, budget: settings.budget };
        let (lower, translation, leaves) = Search::new(scene, goal, free, &memory.leaves).run();
        if memory.leaves.is_empty() {
            memory.fresh = leaves.len();
            memory.base.clone_from(&leaves);
            for leaf in &mut memory.base {
                leaf.chain.retain(|key| !matches!(key, Key::Added(_)));
            }
        }
        // If the search from the base leaves also doubled the number of leaves, the base is out of
        // date.
        let many = leaves.len() > 2 * memory.fresh;
        memory.leaves = match (many, memory.rebased) {
            (false, _) => leaves,
            (true, false) => memory.base.clone(),
            (true, true) => Vec::new(),
        };
        memory.rebased = many && !memory.rebased;
        (lower, translation)
    }

    /// Returns true if body a moved by at most `share` of the smaller body's size from `last` to
    /// `pose_ba`.
    fn is_near(&self, pose_ba: &Pose, last: Option<&Pose>, share: f64) -> bool {
        let reach = share * self.a.size().min(self.b.size());
        let bounds = self.a.tree().bounds();
        let middle = 0.5 * (bounds.min + bounds.max);
        let half = 0.5 * self.a.size();
        last.is_some_and(|last| {
            let turn = 2.0 * pose_ba.rotation.dot(last.rotation).abs().min(1.0).acos();
            turn * half + pose_ba.point(middle).distance(last.point(middle)) <= reach
        })
    }

    /// Returns a translation along an axis that separates the bounding boxes of the bodies.
    fn boxes_apart(&self, scene: &Scene<'_>) -> DVec3 {
        let (moving, fixed) = (scene.surfaces.moving_box(), self.b.tree().bounds());
        let (up, down) = (fixed.max - moving.min, fixed.min - moving.max);
        let shifts = [up.x, up.y, up.z, down.x, down.y, down.z].map(|shift| shift + scene.hair.copysign(shift));
        let least = (0..6).fold(0, |best, k| if shifts[k].abs() < shifts[best].abs() { k } else { best });
        DVec3::AXES[least % 3] * shifts[least]
    }
}
