//! Both bodies at one pose: what is known of translations by themselves.

use glam::DVec3;

use super::cell::Cell;
use super::interior::{Interior, cell_at};
use super::obstacle::Obstacle;
use super::surfaces::{Crossing, Surfaces};
use super::{Containment, GlobalDepth};
use crate::algebra::tolerance::{
    DEPTH_LENSES, DEPTH_PROBES, DEPTH_TRIES, LENS_CENTERING, LENS_FIRST_STEP, LENS_STEP_GROWTH, LENS_STEPS,
};
use crate::algebra::{Placement, Pose};
use crate::body::Body;

/// A pair of cells, as the ball about the middle of its obstacle.
#[derive(Clone, Copy, Debug)]
struct Pair {
    center: DVec3,
    inner: f64,
    outer: f64,
    moving: u32,
    fixed: u32,
}

/// An obstacle that was made for one translation.
struct Added {
    moving: Vec<DVec3>,
    fixed: Vec<DVec3>,
    center: DVec3,
    inner: f64,
    outer: f64,
}

/// A point in both bodies.
#[derive(Clone, Copy, Debug)]
struct Lens {
    /// In a's frame.
    point_a: DVec3,
    /// In b's frame.
    point_b: DVec3,
    /// The nearest point of both surfaces, in b's frame.
    nearest: DVec3,
    /// Its distance.
    depth: f64,
}

/// What a translation is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// In the obstacle of this number.
    Blocked(u32),
    /// Verified free.
    Free,
    /// Neither was shown: the surfaces cross, by less than can be resolved.
    Unclear,
}

/// Both bodies at one relative pose.
pub(super) struct Scene<'a> {
    a: &'a Body,
    b: &'a Body,
    interior_b: &'a Interior,
    placement: Placement,
    pub(super) surfaces: Surfaces<'a>,
    /// Corners of all cells of a in b's frame, and where those of each cell begin.
    corners: Vec<DVec3>,
    starts: Vec<u32>,
    pairs: Vec<Pair>,
    added: Vec<Added>,
    /// Length that is neither blocked nor free: a free translation keeps at least so far off.
    pub(super) hair: f64,
    /// Obstacles looked at closely, and surfaces compared.
    pub(super) evaluations: u64,
    scores: Vec<(f64, u32)>,
}

impl<'a> Scene<'a> {
    pub(super) fn new(query: &GlobalDepth<'a>, pose_ba: &Pose, hair: f64) -> Self {
        let (a, b) = (query.a, query.b);
        let surfaces = Surfaces::new(
            (a, &query.interior_a.components),
            (b, &query.interior_b.components),
            pose_ba,
        );
        Self {
            a,
            b,
            interior_b: query.interior_b,
            placement: pose_ba.placement(),
            surfaces,
            corners: Vec::new(),
            starts: Vec::new(),
            pairs: Vec::new(),
            added: Vec::new(),
            hair,
            evaluations: 0,
            scores: Vec::new(),
        }
    }

    /// Collects the pairs of cells that block translations no longer than `reach`.
    pub(super) fn collect_pairs(&mut self, interior_a: &Interior, reach: f64) {
        self.starts.push(0);
        for cell in &interior_a.cells {
            self.corners.extend(cell.corners.iter().map(|&p| self.placement.point(p)));
            self.starts.push(self.corners.len() as u32);
        }
        for (moving, p) in interior_a.cells.iter().enumerate() {
            let center = self.placement.point(p.center);
            for (fixed, q) in self.interior_b.cells.iter().enumerate() {
                let (offset, outer) = (q.center - center, p.outer + q.outer);
                if offset.length_squared() < (outer + reach) * (outer + reach) {
                    let inner = p.inner + q.inner;
                    self.pairs.push(Pair { center: offset, inner, outer, moving: moving as u32, fixed: fixed as u32 });
                }
            }
        }
        // Large ones first.
        self.pairs.sort_by(|p, q| q.inner.total_cmp(&p.inner));
    }

    /// Number of pairs, which come before the obstacles that were added.
    pub(super) fn pair_count(&self) -> u32 {
        self.pairs.len() as u32
    }

    /// Number of obstacles.
    pub(super) fn count(&self) -> u32 {
        (self.pairs.len() + self.added.len()) as u32
    }

    /// Center, inner and outer radius of obstacle `k`.
    pub(super) fn ball(&self, k: u32) -> (DVec3, f64, f64) {
        match self.pairs.get(k as usize) {
            Some(pair) => (pair.center, pair.inner, pair.outer),
            None => {
                let added = &self.added[k as usize - self.pairs.len()];
                (added.center, added.inner, added.outer)
            }
        }
    }

    /// Obstacle `k`.
    pub(super) fn obstacle(&self, k: u32) -> Obstacle<'_> {
        let (center, inner, outer) = self.ball(k);
        let (moving, fixed): (&[DVec3], &[DVec3]) = match self.pairs.get(k as usize) {
            Some(pair) => {
                let m = pair.moving as usize;
                let corners = &self.corners[self.starts[m] as usize..self.starts[m + 1] as usize];
                (corners, &self.interior_b.cells[pair.fixed as usize].corners)
            }
            None => {
                let added = &self.added[k as usize - self.pairs.len()];
                (&added.moving, &added.fixed)
            }
        };
        Obstacle { moving, fixed, center, inner, outer }
    }

    /// Up to `most` obstacles, out of `candidates` and those added, that may hold all `points`; the most promising first.
    pub(super) fn promising(&mut self, candidates: Candidates<'_>, points: &[DVec3], most: usize) -> Vec<u32> {
        let mut scores = std::mem::take(&mut self.scores);
        scores.clear();
        let mut look = |k: u32| {
            let (center, inner, outer) = self.ball(k);
            let squared = points.iter().map(|p| p.distance_squared(center)).fold(0.0, f64::max);
            if squared < outer * outer {
                scores.push((inner - squared.sqrt(), k));
            }
        };
        match candidates {
            Candidates::All => (0..self.pair_count()).for_each(&mut look),
            Candidates::Some(list) => list.iter().copied().for_each(&mut look),
        }
        (self.pair_count()..self.count()).for_each(&mut look);
        let order = |p: &(f64, u32), q: &(f64, u32)| q.0.total_cmp(&p.0).then(p.1.cmp(&q.1));
        if scores.len() > most {
            scores.select_nth_unstable_by(most, order);
            scores.truncate(most);
        }
        scores.sort_unstable_by(order);
        let answer = scores.iter().map(|&(_, k)| k).collect();
        self.scores = scores;
        answer
    }

    /// An obstacle that holds `t`, if there is any among `candidates` and those added.
    pub(super) fn holder(&mut self, candidates: Candidates<'_>, t: DVec3) -> Option<u32> {
        for most in [DEPTH_TRIES, usize::MAX] {
            for k in self.promising(candidates, &[t], most) {
                self.evaluations += 1;
                if self.obstacle(k).holds(t) {
                    return Some(k);
                }
            }
        }
        None
    }

    /// Finds out what `t` is. If no known obstacle holds it, the surfaces tell, and an obstacle may be added.
    pub(super) fn classify(&mut self, candidates: Candidates<'_>, t: DVec3) -> Place {
        if let Some(k) = self.holder(candidates, t) {
            return Place::Blocked(k);
        }
        self.probe(t)
    }

    /// What the surfaces say of `t`.
    fn probe(&mut self, t: DVec3) -> Place {
        self.evaluations += DEPTH_PROBES as u64;
        let crossings = self.surfaces.crossings(t, DEPTH_PROBES);
        if crossings.is_empty() {
            if !self.surfaces.nested(t) {
                return Place::Free;
            }
            let distance = self.surfaces.distance(t);
            if distance <= self.hair {
                return Place::Unclear;
            }
            let ball = Added { moving: vec![], fixed: vec![], center: t, inner: distance, outer: distance };
            self.added.push(ball);
            return Place::Blocked(self.count() - 1);
        }
        let Some(added) = self.obstacle_at(&crossings, t) else { return Place::Unclear };
        self.added.push(added);
        let k = self.count() - 1;
        if self.obstacle(k).holds(t) {
            return Place::Blocked(k);
        }
        self.added.pop();
        Place::Unclear
    }

    /// The obstacle of two cells that overlap where the bodies do, with a moved by `t`.
    fn obstacle_at(&self, crossings: &[Crossing], t: DVec3) -> Option<Added> {
        let closed = |body: &Body| body.mesh().is_closed();
        let (p, q) = if closed(self.a) && closed(self.b) {
            // A few of the crossings, from all over.
            let stride = crossings.len().div_ceil(DEPTH_LENSES);
            let lenses = crossings.iter().step_by(stride).filter_map(|crossing| self.lens(crossing, t));
            let deepest = lenses.max_by(|p, q| p.depth.total_cmp(&q.depth))?;
            let z = deepest.point_a;
            (Cell::grow(self.a.tree(), z, z, self.a.size())?, {
                let z = deepest.point_b;
                Cell::grow(self.b.tree(), z, z, self.b.size())?
            })
        } else {
            let crossing = crossings.first()?;
            (
                cell_or_triangle(self.a, self.placement.inverse_point(crossing.point - t), crossing.moving)?,
                cell_or_triangle(self.b, crossing.point, crossing.fixed)?,
            )
        };
        Some(Added {
            moving: p.corners.iter().map(|&corner| self.placement.point(corner)).collect(),
            center: q.center - self.placement.point(p.center),
            inner: p.inner + q.inner,
            outer: p.outer + q.outer,
            fixed: q.corners,
        })
    }

    /// A point deep in both bodies near a crossing of their surfaces, with a moved by `t`.
    fn lens(&self, crossing: &Crossing, t: DVec3) -> Option<Lens> {
        let size = self.a.size().min(self.b.size());
        let outward_a = self.placement.vector(self.a.mesh().triangle_normal(crossing.moving));
        let outward_b = self.b.mesh().triangle_normal(crossing.fixed);
        let inward = -(outward_a + outward_b).normalize_or_zero();
        let mut best: Option<Lens> = None;
        let mut step = LENS_FIRST_STEP * size;
        for _ in 0..LENS_STEPS {
            let found = self.lens_at(crossing.point + inward * step, t);
            let better = found.is_some_and(|found| best.is_none_or(|best| found.depth > best.depth));
            if better {
                best = found;
            } else if best.is_some() {
                break;
            }
            step *= LENS_STEP_GROWTH;
        }
        let mut best = best?;
        for _ in 0..LENS_CENTERING {
            let away = (best.point_b - best.nearest).normalize_or_zero();
            match self.lens_at(best.point_b + away * (0.5 * best.depth), t) {
                Some(found) if found.depth > best.depth => best = found,
                _ => break,
            }
        }
        Some(best)
    }

    /// The point `z` (b's frame) if it lies in both bodies, with a moved by `t`.
    fn lens_at(&self, z: DVec3, t: DVec3) -> Option<Lens> {
        let point_a = self.placement.inverse_point(z - t);
        if !self.b.tree().inside(z) || !self.a.tree().inside(point_a) {
            return None;
        }
        let (p, q) = (self.a.tree().nearest(point_a)?, self.b.tree().nearest(z)?);
        let nearest = if p.distance < q.distance { self.placement.point(p.point) + t } else { q.point };
        Some(Lens { point_a, point_b: z, nearest, depth: p.distance.min(q.distance) })
    }

    /// Which body lies in the other where they are.
    pub(super) fn containment(&self) -> Containment {
        self.surfaces.containment(DVec3::ZERO)
    }
}

/// Which obstacles to look at, beside those that were added.
#[derive(Clone, Copy, Debug)]
pub(super) enum Candidates<'a> {
    All,
    Some(&'a [u32]),
}

/// The cell of a solid below `point` of its triangle `t`, or of a surface that bounds no solid the triangle.
fn cell_or_triangle(body: &Body, point: DVec3, t: u32) -> Option<Cell> {
    let corners = body.mesh().triangle_points(t);
    if !body.mesh().is_closed() {
        return Some(Cell::flat(corners));
    }
    let [a, b, c] = corners;
    let on_surface = crate::algebra::closest_on_triangle(point, a, b, c);
    cell_at(body, on_surface, body.mesh().triangle_normal(t))
}
