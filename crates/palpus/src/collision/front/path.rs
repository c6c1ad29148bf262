//! Pairs that slide: they are near each other, but stay apart along the expected path of the
//! bodies.
//!
//! The motion bound treats each motion as an approach. So a pair that is nearer than the motion of
//! a tick is due in each tick, also if its surfaces slide along each other. Where many pairs are
//! due, the front expects that the bodies repeat their last motion:
//!
//! 1. A *path* leads from the present placement of a, T₀, to the placement T₁ after some repeated
//!    motions. Between them are the placements (1 − λ) T₀ + λ T₁. These and T₁ are affine maps that
//!    need not be rigid.
//! 2. The gap of a pair along a normal that is fixed in b's frame is the least height of a's
//!    vertices minus the height of b. Let g₀ and g₁ be the gaps at T₀ and T₁. If no point of a is
//!    farther than D from its place at λ, the gap is at least (1 − λ) g₀ + λ g₁ − D, because the
//!    least of several linear functions is concave.
//! 3. A query finds a λ whose placement is near the present one, and D for the box around a. A pair
//!    is due if this bound is not above the tolerance. The comparison reads two numbers of each
//!    pair, from a list.
//!
//! The bound holds for any motion. If the bodies leave the path, D grows, and pairs are due sooner.
//! After a motion as long as the path, all its pairs are due, and its memory is used again.

use super::super::motion_bound::BoxImage;
use super::super::wakes::NEVER;
use super::rest::own_share;
use super::{Front, PlacedPair, State};
use crate::algebra::Placement;
use crate::algebra::tolerance::{
    GUARD_THICK, MOTION_NOISE, PATH_GAIN, PATH_LENGTH, PATH_PAIRS, PATH_ROOM, PATH_ROUNDING,
};
use crate::body::OrientedBox;

/// Number of paths: enough for one in each step, which lasts for [`PATH_LENGTH`] steps. If all are
/// in use, no path begins.
const PATHS: usize = PATH_LENGTH as usize + 2;

/// Number of pairs that are compared with their bounds at a time.
const GROUP: usize = 16;

/// An expected path, and the pairs that slide along it.
#[derive(Clone, Debug)]
struct Path {
    /// T₀ and T₁.
    ends: [Placement; 2],
    /// The box around a at T₀, and its change from T₀ to T₁.
    from: BoxImage,
    way: BoxImage,
    /// The longest way of a point of a from T₀ to T₁, model units.
    length: f64,
    places: Vec<u32>,
    /// The wake values of the pairs.
    wakes: Vec<u64>,
    /// Lower bounds of the gaps at T₀ and at T₁, model units.
    gaps_from: Vec<f32>,
    gaps_to: Vec<f32>,
    /// Thickness of the thinnest piece of all these pairs, model units.
    thinnest: f32,
    /// The motion bound's sum when the pairs were last compared with their bounds.
    compared: u64,
    /// All pairs are due when the motion bound's sum exceeds this.
    until: u64,
}

/// The present pose relative to a path.
#[derive(Clone, Copy, Debug)]
struct Near {
    /// λ of a place on the path.
    share: f64,
    /// The largest distance of a point of a from this place, model units.
    off: f64,
}

/// The paths of a front.
#[derive(Clone, Debug)]
pub(super) struct Paths {
    box_a: OrientedBox,
    paths: Vec<Path>,
    /// The path that began last.
    newest: usize,
    /// The present pose relative to the newest path. `None` if this query adds no pairs to it.
    now: Option<Near>,
    /// The pose of the last query of all pairs.
    last: Option<Placement>,
    /// Number of pairs that were due in the last query of all pairs.
    pub(super) due: u32,
}

impl Path {
    /// Memory for a path of at most `room` pairs.
    fn new(room: usize) -> Self {
        Self {
            ends: [Placement::IDENTITY; 2],
            from: BoxImage::ZERO,
            way: BoxImage::ZERO,
            length: 0.0,
            places: Vec::with_capacity(room),
            wakes: Vec::with_capacity(room),
            gaps_from: Vec::with_capacity(room),
            gaps_to: Vec::with_capacity(room),
            thinnest: f32::INFINITY,
            compared: 0,
            until: 0,
        }
    }

    fn clear(&mut self) {
        self.places.clear();
        self.wakes.clear();
        self.gaps_from.clear();
        self.gaps_to.clear();
        (self.thinnest, self.until) = (f32::INFINITY, 0);
    }

    /// Begins an empty path at `pose`, that repeats the motion since the pose `last`.
    fn begin(&mut self, last: &Placement, pose: &Placement, box_a: &OrientedBox, sum: u64) {
        let turn = (pose.rotation - last.rotation) * PATH_LENGTH;
        let shift = (pose.translation - last.translation) * PATH_LENGTH;
        let end = Placement { rotation: pose.rotation + turn, translation: pose.translation + shift };
        self.ends = [*pose, end];
        self.from = BoxImage::of(box_a, pose.rotation, pose.translation);
        self.way = BoxImage::of(box_a, turn, shift);
        self.length = self.way.farthest();
        self.compared = sum;
    }

    /// Finds a place on the path that is near the box `now`.
    fn near(&self, now: &BoxImage) -> Near {
        let moved = now.minus(1.0, &self.from);
        let share = (moved.dot(&self.way) / self.way.dot(&self.way)).clamp(0.0, 1.0);
        Near { share, off: moved.minus(share, &self.way).farthest() }
    }

    /// Returns the motion along the path after which the bound of a pair falls to `level` (model
    /// units), if its gaps at both ends are `from` and `to`. 0 if the bound is not above the level
    /// now.
    fn wait(&self, share: f64, [from, to]: [f64; 2], level: f64) -> f64 {
        let end = match (1.0 - share) * from + share * to {
            now if now > level && to > level => 1.0,
            now if now > level => (from - level) / (from - to),
            _ => share,
        };
        (end - share) * self.length
    }

    /// Removes the pairs whose bounds at λ = `share` are below `level` (model units), and calls
    /// `wake` with the place and the wake value of each.
    fn compare(&mut self, share: f64, level: f64, mut wake: impl FnMut(u32, u64)) {
        let (share, level) = (share as f32, level as f32);
        let rest = 1.0 - share;
        let is_below = |(&from, &to): (&f32, &f32)| rest * from + share * to < level;
        let mut k = 0;
        while k < self.places.len() {
            let end = self.places.len().min(k + GROUP);
            let group = || self.gaps_from[k..end].iter().zip(&self.gaps_to[k..end]);
            // Most groups have no such pair. A sum is computed without branches.
            if group().map(|gaps| u32::from(is_below(gaps))).sum::<u32>() == 0 {
                k = end;
            } else if let Some(below) = group().position(is_below) {
                wake(self.places.swap_remove(k + below), self.wakes.swap_remove(k + below));
                self.gaps_from.swap_remove(k + below);
                self.gaps_to.swap_remove(k + below);
            }
        }
    }
}

impl Paths {
    /// Memory for the paths of a body inside `box_a` (in a's frame), in a front of `places` pairs.
    pub(super) fn new(box_a: OrientedBox, places: usize) -> Self {
        let room = (PATH_ROOM * places as f64) as usize;
        let paths = (0..PATHS).map(|_| Path::new(room)).collect();
        Self { box_a, paths, newest: 0, now: None, last: None, due: 0 }
    }

    /// Ends all paths.
    pub(super) fn clear(&mut self) {
        self.paths.iter_mut().for_each(Path::clear);
        (self.now, self.last, self.due) = (None, None, 0);
    }

    /// True if the pair at `place` with this wake value is on a path.
    pub(super) fn contain(&self, place: u32, wake: u64) -> bool {
        let is_on = |path: &Path| path.places.iter().zip(&path.wakes).any(|(&p, &w)| (p, w) == (place, wake));
        self.paths.iter().any(is_on)
    }

    /// Chooses the path to which pairs are added in this query of all pairs: the newest one, or a
    /// new one after half a step. `sum` is the motion bound's sum.
    fn choose(&mut self, pose: &Placement, now: &BoxImage, sum: u64) {
        self.now = None;
        let Some(last) = self.last.replace(*pose) else { return };
        if self.due < PATH_PAIRS {
            return;
        }
        let path = &self.paths[self.newest];
        if !path.places.is_empty() && now.minus(1.0, &path.from).farthest() * PATH_LENGTH < 0.5 * path.length {
            self.now = Some(path.near(now));
            return;
        }
        let next = (self.newest + 1) % PATHS;
        let path = &mut self.paths[next];
        if path.places.is_empty() {
            path.begin(&last, pose, &self.box_a, sum);
            if path.length > 0.0 {
                (self.newest, self.now) = (next, Some(Near { share: 0.0, off: 0.0 }));
            }
        }
    }
}

impl Front {
    /// Makes pairs due that slide and may be within the tolerance. Chooses the path to which this
    /// query adds pairs.
    pub(super) fn follow_paths(&mut self, query: &PlacedPair<'_>) {
        let sum = self.motion_bound.sum();
        let Placement { rotation, translation } = *query.pose_ba;
        let now = BoxImage::of(&self.paths.box_a, rotation, translation);
        let noise = MOTION_NOISE * (self.motion_bound.size() + translation.length());
        for path in self.paths.paths.iter_mut().filter(|path| !path.places.is_empty()) {
            if path.until < sum {
                path.clear();
                continue;
            }
            if !query.wants(path.thinnest) {
                continue;
            }
            let Near { share, off } = path.near(&now);
            let level = query.tolerance + off + noise + PATH_ROUNDING * (query.tolerance + path.length);
            let (wakes, compared) = (&mut self.wakes, path.compared);
            path.compare(share, level, |place, wake| {
                // The pair may have been due for another reason since.
                if wakes.get(place) == wake {
                    wakes.set(place, compared);
                }
            });
            path.compared = sum;
        }
        if query.is_of_all() {
            self.paths.choose(query.pose_ba, &now, sum);
        }
    }

    /// Lets the pair at `place` slide along the chosen path, if it can wait for much longer there
    /// than for a motion of `clearance` (model units). `is_measured` is true if this query has
    /// measured the pair.
    pub(super) fn slide(&mut self, query: &PlacedPair<'_>, place: u32, clearance: f64, is_measured: bool) {
        let Some(Near { share, off }) = self.paths.now else { return };
        let path = &self.paths.paths[self.paths.newest];
        let is_full = path.places.len() == path.places.capacity();
        // A pair that was merged with the other half is never due.
        if PATH_GAIN * clearance >= path.length || is_full || self.wakes.get(place) == NEVER {
            return;
        }
        let gaps = self.gaps_along(query, place, &path.ends, is_measured);
        let (level, farthest) = (query.tolerance + off, query.tolerance + path.length);
        if path.wait(share, gaps, level) <= PATH_GAIN * clearance || gaps[0].max(gaps[1]) > farthest {
            return;
        }
        // Thin pieces are also examined within a fast tick.
        let thickness = self.thinnest_at[place as usize];
        if f64::from(thickness) * PATH_LENGTH < GUARD_THICK * path.length {
            return;
        }
        let wake = self.motion_bound.due(own_share(place) * path.length);
        let path = &mut self.paths.paths[self.paths.newest];
        path.places.push(place);
        path.wakes.push(wake);
        path.gaps_from.push(gaps[0] as f32);
        path.gaps_to.push(gaps[1] as f32);
        path.thinnest = path.thinnest.min(thickness);
        path.until = path.until.max(wake);
        self.pairs[place as usize].state = State::Sliding;
        self.wakes.set(place, wake);
    }

    /// Returns lower bounds of the gap of the pair at `place` at both ends of a path, model units.
    fn gaps_along(&self, query: &PlacedPair<'_>, place: u32, ends: &[Placement; 2], is_measured: bool) -> [f64; 2] {
        let [from, mut to] = [0, 1].map(|k| self.stored_gap(&ends[k], place));
        // If the pair was measured, its vertices are in the cache.
        if to <= query.tolerance
            && is_measured
            && let Some(gap) = self.gap_at(query, &ends[1], place)
        {
            to = to.max(gap);
        }
        [from, to]
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::super::super::oracle::cuboid;
    use super::super::super::{LeafPairs, Side};
    use super::*;
    use crate::algebra::{Pose, Random};
    use crate::body::{Hierarchy, Polytope, convex_hull};

    const SEED: u64 = 0x0511_de55;
    const TOLERANCE: f64 = 0.01;
    /// Tiles in a row, and rows.
    const TILES: usize = 12;

    /// Steps of `TILES` rows at these heights. Each row consists of tiles, whose heights differ a
    /// little, so that a few touch at a time. The hull of two rows fills the hollow between them.
    fn steps(random: &mut Random, heights: &[f64]) -> Vec<Polytope> {
        let tile = |k: usize, height: f64| {
            let at = DVec3::new((k / TILES) as f64, (k % TILES) as f64, heights[k / TILES] + height);
            let corners: Vec<DVec3> =
                cuboid(DVec3::new(0.45, 0.45, 0.1)).vertices().iter().map(|&corner| at + corner).collect();
            convex_hull(&corners, 1e-10).unwrap().into_polytope().unwrap().0
        };
        (0..TILES * TILES).map(|k| tile(k, 0.02 * random.unit())).collect()
    }

    /// Moves steps along equal ones at a gap of about the tolerance. Calls `look` in each tick
    /// with the front, which must be right.
    fn slide_steps(mut look: impl FnMut(&Front, &PlacedPair<'_>, &str)) {
        let mut random = Random::new(SEED);
        for case in 0..6 {
            let heights: Vec<f64> = (0..TILES).map(|_| 2.0 * random.unit()).collect();
            let bodies = [(); 2].map(|()| steps(&mut random, &heights));
            let hierarchies = [0, 1].map(|k| Hierarchy::build(&bodies[k], 1e-10).unwrap());
            let [a, b] = [0, 1].map(|k| Side { hierarchy: &hierarchies[k], pieces: &bodies[k] });
            let (mut front, mut found) = (Front::new(a, b, 1 << 14), LeafPairs::new(2000));
            let mut pose = Pose::from_translation(DVec3::new(0.01, 0.2, 0.225));
            let (mut velocity, mut turn) = (DVec3::ZERO, DVec3::ZERO);
            for tick in 0..150 {
                // The motion changes its direction every 50 ticks, and a little in each tick.
                if tick % 50 == 0 {
                    velocity = random.vector() * DVec3::new(0.0005, 0.05, 0.0005);
                    turn = random.vector() * DVec3::new(1e-5, 1e-5, 1e-4);
                }
                let shake = random.vector() * 1e-4;
                let turn = DQuat::from_scaled_axis(turn + random.vector() * 1e-5);
                pose = Pose::new(turn * pose.rotation, pose.translation + velocity + shake);
                let placement = pose.placement();
                // A fast tick also examines thin pieces at poses on the way.
                let thinner_than = if tick % 7 == 3 { 0.5 } else { f64::INFINITY };
                let tolerance = TOLERANCE * (1.0 + 0.2 * (0.3 * f64::from(tick)).sin());
                let query = PlacedPair { thinner_than, ..PlacedPair::new(a, b, &placement, tolerance) };
                front.within(&query, &mut found);
                look(&front, &query, &format!("seed {SEED:#x}, case {case}, tick {tick}"));
            }
        }
    }

    fn count(front: &Front) -> usize {
        (0..front.fresh).filter(|&place| front.pairs[place as usize].state == State::Sliding).count()
    }

    #[test]
    fn pairs_that_slide_are_due_before_they_are_near() {
        let (mut most, mut slid) = (0, 0);
        slide_steps(|front, query, what| {
            assert_eq!(front.validate(query), Ok(()), "{what}");
            most = most.max(count(front));
            slid += usize::from(count(front) > 0);
        });
        assert!(most > 50 && slid > 300, "{most} pairs slid at once, some in {slid} ticks");
    }

    #[test]
    fn a_sliding_pair_without_a_path_is_named() {
        let mut named = 0;
        slide_steps(|front, query, what| {
            let slides = |&place: &u32| {
                let is_due = front.wakes.get(place) < front.motion_bound.sum();
                front.pairs[place as usize].state == State::Sliding && !is_due
            };
            if let Some(place) = (0..front.fresh).find(slides) {
                let mut broken = front.clone();
                broken.paths.clear();
                assert_eq!(broken.validate(query), Err(super::super::validate::FrontFault::Path(place)), "{what}");
                named += 1;
            }
        });
        assert!(named > 0);
    }
}
