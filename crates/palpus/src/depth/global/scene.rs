//! Both bodies at one pose: their obstacles, and the classification of translations.

mod added;

use std::cell::{Cell as Shared, OnceCell};
use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;

use self::added::Added;
use super::cell::Cell;
use super::interior::Interior;
use super::obstacle::{Exit, Gate, Obstacle};
use super::slabs::Slabs;
use super::surfaces::Surfaces;
use super::{Containment, GlobalDepth};
use crate::algebra::tolerance::{DEPTH_PROBES, DEPTH_TRIES, RECENT_HOLDERS};
use crate::algebra::{Placement, Pose};
use crate::body::Body;

/// A pair of cells: one of the moving body, one of the fixed body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Pair {
    moving: u32,
    fixed: u32,
}

/// Identifies an obstacle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Key {
    /// The obstacle of two prepared cells.
    Pair(Pair),
    /// An obstacle that was added at this pose.
    Added(u32),
}

/// A pair of cells, and the bits of the direction of a ray from the origin.
pub(super) type Ray = (Pair, [u64; 3]);

/// Classification of a translation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// Blocked by this obstacle.
    Blocked(Key),
    /// Free, verified on the surfaces.
    Free,
    /// The search could show neither, because the surfaces cross by less than the search can
    /// resolve.
    Unclear,
}

/// A cone at the end of a search.
#[derive(Clone, Debug)]
pub(super) struct Leaf {
    pub(super) along: [DVec3; 3],
    /// The obstacles that blocked the cone, oldest first.
    pub(super) chain: Vec<Key>,
    /// Pairs of cells that may have blocked more of the cone.
    pub(super) candidates: Option<Arc<[Pair]>>,
}

/// A cell of the moving body in b's frame.
struct PlacedCell {
    center: DVec3,
    /// True if the cell may block a translation that is shorter than the reach of the search.
    near: bool,
    /// Computed when first needed.
    corners: OnceCell<Vec<DVec3>>,
    /// Slabs of these corners, computed when first needed.
    slabs: OnceCell<Slabs>,
}

/// Both bodies at one relative pose.
pub(super) struct Scene<'a> {
    pub(super) a: &'a Body,
    pub(super) b: &'a Body,
    interior_a: &'a Interior,
    interior_b: &'a Interior,
    pub(super) placement: Placement,
    pub(super) surfaces: Surfaces<'a>,
    /// The cells of body a in b's frame.
    cells: Vec<PlacedCell>,
    added: Vec<Added>,
    /// Clearance of a free translation from the obstacles. A translation nearer to contact than
    /// this counts neither as blocked nor as free.
    pub(super) hair: f64,
    /// If true, pockets do not count as free.
    outside: bool,
    /// Number of detailed tests of obstacles and comparisons of surfaces.
    pub(super) evaluations: u64,
    scores: Vec<(f64, u32, Key)>,
    /// The obstacles that contained recently classified translations, newest first.
    recent: Vec<Key>,
    /// The obstacles that blocked a translation or a cone at this pose or at a nearby pose, sorted.
    known: Vec<Key>,
    /// Exits of rays from the origin out of obstacles. The first map has the exits of a nearby
    /// pose, the second the exits of this pose.
    gates: [BTreeMap<Ray, Gate>; 2],
    /// The last translation that the surfaces found to be free.
    free: Shared<Option<DVec3>>,
}

impl<'a> Scene<'a> {
    pub(super) fn new(query: &GlobalDepth<'a>, pose_ba: &Pose, hair: f64, outside: bool) -> Self {
        let (a, b) = (query.a, query.b);
        let surfaces = Surfaces::new((a, &query.interior_a.components), (b, &query.interior_b.components), pose_ba);
        let placement = pose_ba.placement();
        Self {
            a,
            b,
            interior_a: query.interior_a,
            interior_b: query.interior_b,
            placement,
            surfaces,
            cells: Vec::new(),
            added: Vec::new(),
            hair,
            outside,
            evaluations: 0,
            scores: Vec::new(),
            recent: Vec::new(),
            known: Vec::new(),
            gates: [BTreeMap::new(), BTreeMap::new()],
            free: Shared::new(None),
        }
    }

    /// Places the cells of body a that may block translations no longer than `reach`.
    pub(super) fn place_cells(&mut self, reach: f64) {
        let bounds = self.b.tree().bounds();
        let place = |cell: &Cell| {
            let center = self.placement.point(cell.center);
            let near = bounds.distance_squared(center) <= (reach + cell.outer).powi(2);
            PlacedCell { center, near, corners: OnceCell::new(), slabs: OnceCell::new() }
        };
        self.cells = self.interior_a.cells.iter().map(place).collect();
    }

    /// Returns the corners of a cell of body a in b's frame.
    fn corners(&self, k: usize) -> &[DVec3] {
        let place = || self.interior_a.cells[k].corners.iter().map(|&p| self.placement.point(p)).collect();
        self.cells[k].corners.get_or_init(place)
    }

    fn slabs(&self, k: usize) -> &Slabs {
        self.cells[k].slabs.get_or_init(|| Slabs::around(self.corners(k).iter().copied()))
    }

    /// Calls `visit` with each pair of cells whose boxes overlap when body a is moved by some
    /// translation between `low` and `high`.
    fn visit_pairs(&self, low: DVec3, high: DVec3, mut visit: impl FnMut(Pair)) {
        for (moving, _) in self.cells.iter().enumerate().filter(|(_, cell)| cell.near) {
            let (least, most) = self.slabs(moving).bounds();
            self.interior_b.tree.visit(least + low, most + high, &mut |fixed| {
                visit(Pair { moving: moving as u32, fixed });
            });
        }
    }

    /// Returns the pairs of cells that may block translations within `slabs`.
    pub(super) fn pairs_meeting(&self, slabs: &Slabs) -> Vec<Pair> {
        let (low, high) = slabs.bounds();
        let mut pairs = Vec::new();
        self.visit_pairs(low, high, |pair| {
            if self.may_meet(pair, slabs) {
                pairs.push(pair);
            }
        });
        pairs
    }

    /// Returns false only if the obstacle of `pair` blocks no translation within `slabs`.
    pub(super) fn may_meet(&self, pair: Pair, slabs: &Slabs) -> bool {
        let (moving, fixed) = self.pair_slabs(pair);
        Slabs::may_meet(moving, fixed, slabs)
    }

    /// Returns the slabs of the moving cell and of the fixed cell of a pair.
    fn pair_slabs(&self, pair: Pair) -> (&Slabs, &Slabs) {
        (self.slabs(pair.moving as usize), &self.interior_b.slabs[pair.fixed as usize])
    }

    /// Returns the center, the inner radius and the outer radius of an obstacle.
    pub(super) fn ball(&self, key: Key) -> (DVec3, f64, f64) {
        match key {
            Key::Pair(Pair { moving, fixed }) => {
                let (p, q) = (&self.interior_a.cells[moving as usize], &self.interior_b.cells[fixed as usize]);
                (q.center - self.cells[moving as usize].center, p.inner + q.inner, p.outer + q.outer)
            }
            Key::Added(k) => {
                let added = &self.added[k as usize];
                (added.center, added.inner, added.outer)
            }
        }
    }

    /// Returns the obstacle that `key` identifies.
    pub(super) fn obstacle(&self, key: Key) -> Obstacle<'_> {
        let (center, inner, outer) = self.ball(key);
        let (moving, fixed): (&[DVec3], &[DVec3]) = match key {
            Key::Pair(Pair { moving, fixed }) => {
                (self.corners(moving as usize), &self.interior_b.cells[fixed as usize].corners)
            }
            Key::Added(k) => (&self.added[k as usize].moving, &self.added[k as usize].fixed),
        };
        Obstacle { moving, fixed, center, inner, outer }
    }

    /// Returns how far beyond `from` the ray along `along` (unit) from the origin stays inside the
    /// obstacle. `from` is a point of the ray and of the obstacle.
    pub(super) fn run_inside(&mut self, key: Key, from: DVec3, along: DVec3) -> f64 {
        let mut gate = None;
        let ray = match key {
            Key::Pair(pair) => Some((pair, along.to_array().map(f64::to_bits))),
            Key::Added(_) => None,
        };
        if let Some(ray) = ray {
            gate = self.gates[1].get(&ray).or_else(|| self.gates[0].get(&ray)).copied();
        }
        let exit: Option<Exit> = self.obstacle(key).exit_by(from, along, &mut gate);
        if let (Some(ray), Some(gate)) = (ray, gate) {
            self.gates[1].insert(ray, gate);
        }
        exit.map_or(0.0, |exit| exit.distance)
    }

    /// Returns up to `most` obstacles that may contain all `points`, out of `candidates` and the
    /// added obstacles. The obstacles are sorted by the depth that their slabs estimate, deepest
    /// first.
    pub(super) fn promising(&mut self, candidates: Candidates<'_>, points: &[DVec3], most: usize) -> Vec<Key> {
        let mut scores = std::mem::take(&mut self.scores);
        scores.clear();
        let slabs = Slabs::around(points.iter().copied());
        let mut look = |pair: Pair| {
            let (moving, fixed) = self.pair_slabs(pair);
            let depth = Slabs::depth(moving, fixed, &slabs);
            if depth > 0.0 {
                scores.push((depth, scores.len() as u32, Key::Pair(pair)));
            }
        };
        match candidates {
            Candidates::All => {
                let (low, high) = slabs.bounds();
                self.visit_pairs(low, high, &mut look);
            }
            Candidates::Some(list) => list.iter().copied().for_each(&mut look),
            Candidates::Known => {
                for key in &self.known {
                    if let Key::Pair(pair) = *key {
                        look(pair);
                    }
                }
            }
        }
        for (k, added) in self.added.iter().enumerate() {
            let depth = if added.moving.is_empty() {
                added.inner - points.iter().map(|p| p.distance(added.center)).fold(0.0, f64::max)
            } else {
                Slabs::depth(&added.moving_slabs, &added.fixed_slabs, &slabs)
            };
            if depth > 0.0 {
                scores.push((depth, scores.len() as u32, Key::Added(k as u32)));
            }
        }
        // Obstacles with equal depth keep the order in which they were found, which is the order of
        // the cells.
        let order = |p: &(f64, u32, Key), q: &(f64, u32, Key)| q.0.total_cmp(&p.0).then(p.1.cmp(&q.1));
        if scores.len() > most {
            scores.select_nth_unstable_by(most, order);
            scores.truncate(most);
        }
        scores.sort_unstable_by(order);
        let answer = scores.iter().map(|&(.., key)| key).collect();
        self.scores = scores;
        answer
    }

    /// Records that the obstacle `key` blocked a translation or a cone.
    pub(super) fn note(&mut self, key: Key) {
        if let Err(place) = self.known.binary_search(&key) {
            self.known.insert(place, key);
        }
    }

    /// Returns an obstacle that contains `t`, out of `candidates` and the added obstacles.
    pub(super) fn holder(&mut self, candidates: Candidates<'_>, t: DVec3) -> Option<Key> {
        if let Some(k) = self.recent.iter().position(|&key| self.obstacle(key).holds(t)) {
            self.recent[..=k].rotate_right(1);
            return self.recent.first().copied();
        }
        let found = self.search_holder(candidates, t)?;
        self.recent.truncate(RECENT_HOLDERS - 1);
        self.recent.insert(0, found);
        Some(found)
    }

    fn search_holder(&mut self, candidates: Candidates<'_>, t: DVec3) -> Option<Key> {
        for most in [DEPTH_TRIES, usize::MAX] {
            let keys = self.promising(candidates, &[t], most);
            let looked_at = if most == usize::MAX { DEPTH_TRIES } else { 0 };
            for &key in keys.iter().skip(looked_at) {
                self.evaluations += 1;
                if self.obstacle(key).holds(t) {
                    return Some(key);
                }
            }
            if keys.len() < most {
                break;
            }
        }
        None
    }

    /// Classifies `t`. If no known obstacle contains `t`, the surfaces decide, and an obstacle may
    /// be added.
    pub(super) fn classify(&mut self, candidates: Candidates<'_>, t: DVec3) -> Place {
        let place = self.place(candidates, t);
        if let Place::Blocked(Key::Added(k)) = place {
            self.added[k as usize].used = true;
        }
        place
    }

    fn place(&mut self, candidates: Candidates<'_>, t: DVec3) -> Place {
        if !self.known.is_empty() && matches!(candidates, Candidates::All) {
            // Near the previous answer, a translation is usually free, or one of a few known
            // obstacles blocks it.
            if let Some(&k) = self.known.iter().find(|&&key| self.obstacle(key).holds(t)) {
                return Place::Blocked(k);
            }
            if self.free(t) {
                return Place::Free;
            }
        }
        if let Some(k) = self.holder(candidates, t) {
            return Place::Blocked(k);
        }
        self.probe(t)
    }

    /// Classifies `t` by the surfaces. If the surfaces cross, adds an obstacle.
    fn probe(&mut self, t: DVec3) -> Place {
        self.evaluations += DEPTH_PROBES as u64;
        let crossings = self.surfaces.crossings(t, DEPTH_PROBES);
        if crossings.is_empty() {
            if !self.surfaces.nested(t) {
                self.free.set(Some(t));
                return Place::Free;
            }
            let distance = self.surfaces.distance(t);
            if distance <= self.hair {
                return Place::Unclear;
            }
            let nothing = Slabs::around([]);
            self.added.push(Added {
                source: None,
                moving: Vec::new(),
                fixed: Vec::new(),
                fixed_cell: None,
                used: true,
                center: t,
                inner: distance,
                outer: distance,
                moving_slabs: nothing,
                fixed_slabs: nothing,
            });
            return Place::Blocked(Key::Added(self.added.len() as u32 - 1));
        }
        let Some(added) = self.obstacle_at(&crossings, t) else { return Place::Unclear };
        self.added.push(added);
        let key = Key::Added(self.added.len() as u32 - 1);
        if self.obstacle(key).holds(t) {
            return Place::Blocked(key);
        }
        self.added.pop();
        Place::Unclear
    }

    /// Returns true if `t` is free according to the surfaces alone. If `outside` is set, body a
    /// must also be able to move out of b from this position.
    pub(super) fn verified(&self, t: DVec3) -> bool {
        self.free(t) && (!self.outside || self.surfaces.escapes(t))
    }

    /// Returns true if `t` is free according to the surfaces alone.
    fn free(&self, t: DVec3) -> bool {
        if self.free.get() == Some(t) {
            return true;
        }
        let free = self.surfaces.is_free(t);
        if free {
            self.free.set(Some(t));
        }
        free
    }

    /// Returns which body lies in the other, without a translation.
    pub(super) fn containment(&self) -> Containment {
        self.surfaces.containment(DVec3::ZERO)
    }
}

/// The obstacles to test, in addition to the obstacles that were added at this pose.
#[derive(Clone, Copy, Debug)]
pub(super) enum Candidates<'a> {
    All,
    Some(&'a [Pair]),
    /// The obstacles that blocked a translation at this pose or at a nearby pose.
    Known,
}
