//! The search for the lower bound. The search grows a surface around the origin that encloses only
//! blocked translations.
//!
//! 1. Divide the directions into cones over spherical triangles, twenty at the start. Each cone
//!    stores how far it is blocked along its three corner directions. The end points of these three
//!    lengths form the cone's triangle. The tetrahedron of this triangle and the origin is proven
//!    to be blocked.
//! 2. Take the cone whose triangle is nearest to the origin. The distance of this triangle is the
//!    lower bound.
//! 3. Search for an obstacle that contains the triangle's three corners. Replace the corners by the
//!    points where the corner directions leave the obstacle. An obstacle is convex, so all
//!    translations between the old and the new triangle are blocked.
//! 4. If no obstacle contains all three corners, test the point of the triangle nearest to the
//!    origin. If this translation is free, the upper bound equals the lower bound and the search
//!    ends.
//! 5. If it is not free, cut the cone in two across the longest side of its triangle.
//! 6. After every few cuts, find a free translation beside the nearest point of a cone, and slide
//!    it toward the origin. This improves the upper bound.
//!
//! The search ends if the bounds are close enough or the budget is spent. Both bounds are valid at
//! any time.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::sync::Arc;

use glam::DVec3;

use super::scene::{Candidates, Key, Leaf, Pair, Place, Scene};
use super::slabs::Slabs;
use super::way_out::{project, slide};
use crate::algebra::closest_on_triangle;
use crate::algebra::tolerance::{
    CONE_CUTS_PER_WAY_OUT, CONE_FILTER, CONE_FIRST_TRIES, CONE_GAIN, CONE_HINTS, CONE_SMALL, CONE_SMALLEST, CONE_TRIES,
    DEPTH_ROUNDING,
};

/// Directions in a spherical triangle, and how far they are blocked.
#[derive(Clone, Debug)]
struct Cone {
    /// Directions of the corners, as unit vectors.
    along: [DVec3; 3],
    /// The blocked length along each corner direction.
    reach: [f64; 3],
    /// The point of the triangle that is nearest to the origin, and its distance from the origin.
    foot: DVec3,
    bound: f64,
    /// Pairs of cells that may block more of the cone. `None` means all pairs. Until the list is
    /// filtered, it is the list of the parent cone.
    candidates: Option<Arc<[Pair]>>,
    filtered: bool,
    /// Obstacles that contained points of the cone, oldest first.
    chain: Vec<Key>,
    number: u64,
}

impl Cone {
    fn corners(&self) -> [DVec3; 3] {
        [0, 1, 2].map(|k| self.along[k] * self.reach[k])
    }

    /// Returns the newest obstacles of the chain.
    fn hints(&self) -> &[Key] {
        &self.chain[self.chain.len().saturating_sub(CONE_HINTS)..]
    }

    fn add(&mut self, obstacle: Key) {
        if !self.hints().contains(&obstacle) {
            self.chain.push(obstacle);
        }
    }

    fn measure(&mut self) {
        let [a, b, c] = self.corners();
        self.foot = closest_on_triangle(DVec3::ZERO, a, b, c);
        self.bound = self.foot.length();
    }
}

impl PartialEq for Cone {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Cone {}

impl PartialOrd for Cone {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cone {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.bound.total_cmp(&other.bound).then(self.number.cmp(&other.number))
    }
}

/// The condition that ends a search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goal {
    /// The search ends if the gap between the bounds is at most this.
    pub(super) gap: f64,
    /// Maximum number of evaluations.
    pub(super) budget: u64,
}

/// The search at one pose.
pub(super) struct Search<'s, 'a> {
    scene: &'s mut Scene<'a>,
    goal: Goal,
    cones: BinaryHeap<Reverse<Cone>>,
    /// The shortest known translation that is verified to be free.
    best: DVec3,
    /// Obstacles that may contain the origin. The list is computed when it is first needed.
    first_tries: Option<Arc<[Key]>>,
    numbered: u64,
    /// True if the search started with the cones of an earlier search.
    warm: bool,
}

impl<'s, 'a> Search<'s, 'a> {
    /// Prepares a search. `free` is a verified free translation.
    ///
    /// The search starts from `leaves`, the final cones of an earlier search at a nearby pose. If
    /// `leaves` is empty, the search starts from the initial cones.
    pub(super) fn new(scene: &'s mut Scene<'a>, goal: Goal, free: DVec3, leaves: &[Leaf]) -> Self {
        let mut search = Self {
            scene,
            goal,
            cones: BinaryHeap::new(),
            best: free,
            first_tries: None,
            numbered: 0,
            warm: !leaves.is_empty(),
        };
        search.resume(leaves);
        for along in icosahedron().into_iter().filter(|_| leaves.is_empty()) {
            search.push(along, [0.0; 3], None, Vec::new());
        }
        search
    }

    /// Returns the lower bound, the shortest free translation, and the final cones.
    pub(super) fn run(mut self) -> (f64, DVec3, Vec<Leaf>) {
        let mut cuts = 0;
        // The least bound of the cones whose bound cannot be raised.
        let mut stuck = f64::INFINITY;
        while let Some(Reverse(mut cone)) = self.cones.pop() {
            let done = cone.bound.min(stuck) >= self.best.length() - self.goal.gap;
            if done || stuck <= cone.bound || self.scene.evaluations >= self.goal.budget {
                stuck = stuck.min(cone.bound);
                self.cones.push(Reverse(cone));
                break;
            }
            let mut gain = self.advance(&mut cone);
            if gain >= CONE_GAIN * self.goal.gap {
                self.cones.push(Reverse(cone));
                continue;
            }
            let hair = self.scene.hair;
            let foot = if cone.bound > 0.0 { cone.foot * (1.0 + hair / cone.bound) } else { DVec3::ZERO };
            if self.look_at(&mut cone, foot) == Some(Place::Free) {
                stuck = stuck.min(cone.bound);
                self.cones.push(Reverse(cone));
                break;
            }
            let hints = cone.hints().to_vec();
            gain += self.advance_within(&mut cone, &hints);
            let [a, b, c] = cone.corners();
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            if cone.bound > 0.0 && longest <= CONE_SMALL * self.goal.gap {
                // An obstacle that contains the foot may not contain all corners of a small cone.
                for corner in cone.corners() {
                    self.look_at(&mut cone, corner * (1.0 + hair / corner.length()));
                    let hints = cone.hints().to_vec();
                    gain += self.advance_within(&mut cone, &hints);
                }
            }
            if gain >= CONE_GAIN * self.goal.gap {
                self.cones.push(Reverse(cone));
                continue;
            }
            if cone.bound > 0.0 && longest <= CONE_SMALLEST * self.goal.gap {
                if gain > CONE_SMALLEST * self.goal.gap {
                    self.cones.push(Reverse(cone));
                    continue;
                }
                // The cone may be in a narrow wedge between obstacles. A cut is unlikely to hit the
                // wedge's corner.
                self.seek_way_out(&cone);
                stuck = stuck.min(cone.bound);
                continue;
            }
            cuts += 1;
            if cuts % CONE_CUTS_PER_WAY_OUT == 0 && cone.bound > 0.0 {
                self.seek_way_out(&cone);
            }
            self.cut(&cone);
        }
        let open = stuck.min(self.cones.peek().map_or(f64::INFINITY, |Reverse(cone)| cone.bound));
        let leaves = self.cones.into_iter().map(|Reverse(cone)| Leaf {
            along: cone.along,
            chain: cone.chain,
            candidates: cone.candidates,
        });
        (open.min(self.best.length()), self.best, leaves.collect())
    }

    fn push(&mut self, along: [DVec3; 3], reach: [f64; 3], candidates: Option<Arc<[Pair]>>, chain: Vec<Key>) {
        self.numbered += 1;
        let number = self.numbered;
        let (foot, bound, filtered) = (DVec3::ZERO, 0.0, false);
        let mut cone = Cone { along, reach, foot, bound, candidates, filtered, chain, number };
        cone.measure();
        self.cones.push(Reverse(cone));
    }

    /// Starts with the cones of a search at a nearby pose, and advances each cone through its
    /// obstacles again.
    fn resume(&mut self, leaves: &[Leaf]) {
        let mut at_origin: BTreeMap<Key, bool> = BTreeMap::new();
        let mut exits: BTreeMap<(Key, [u64; 3]), f64> = BTreeMap::new();
        for leaf in leaves {
            // Entries before the last obstacle that contains the origin are not needed.
            let holds = |key: &Key| {
                let ask = || self.scene.obstacle(*key).holds(DVec3::ZERO);
                *at_origin.entry(*key).or_insert_with(ask)
            };
            let first = leaf.chain.iter().rposition(holds);
            let (mut reach, mut chain) = ([0.0; 3], Vec::new());
            if let Some(first) = first {
                // Neighbouring cones share directions, so exits are cached.
                let key = leaf.chain[first];
                reach = leaf.along.map(|along| {
                    let ask = || self.scene.run_inside(key, DVec3::ZERO, along);
                    let exit = *exits.entry((key, along.to_array().map(f64::to_bits))).or_insert_with(ask);
                    (exit * (1.0 - DEPTH_ROUNDING)).min(1.5 * self.best.length())
                });
                chain.push(key);
                self.scene.evaluations += 1;
            }
            self.push(leaf.along, reach, leaf.candidates.clone(), chain);
            let Some(Reverse(mut cone)) = self.cones.pop() else { continue };
            cone.filtered = cone.candidates.is_some();
            for &key in &leaf.chain[first.map_or(0, |first| first + 1)..] {
                self.advance_within(&mut cone, &[key]);
            }
            self.cones.push(Reverse(cone));
        }
    }

    /// Moves the cone's triangle to the exit of the obstacle that raises the cone's bound most.
    /// Returns the increase of the bound.
    fn advance(&mut self, cone: &mut Cone) -> f64 {
        let hints = cone.hints().to_vec();
        let mut gain = self.advance_within(cone, &hints);
        if gain >= CONE_GAIN * self.goal.gap {
            return gain;
        }
        if self.warm {
            // An obstacle that blocked the cone at a nearby pose usually blocks the cone at this
            // pose too. Otherwise the obstacle may block a part of the cone.
            let known = self.scene.promising(Candidates::Known, &cone.corners(), CONE_FIRST_TRIES);
            gain += self.advance_within(cone, &known);
            if gain > 0.0 || cone.bound > 0.0 && self.scene.holder(Candidates::Known, cone.foot).is_some() {
                return gain;
            }
        }
        let tries = self.tries(cone);
        let (first, rest) = tries.split_at(tries.len().min(CONE_FIRST_TRIES));
        gain += self.advance_within(cone, first);
        for &k in rest {
            if gain > 0.0 {
                break;
            }
            gain = self.advance_within(cone, &[k]);
        }
        gain
    }

    /// Returns the obstacles that may contain the cone's triangle, the most promising first.
    fn tries(&mut self, cone: &mut Cone) -> Arc<[Key]> {
        if cone.reach == [0.0; 3] {
            // At the start, the triangle of every cone is the origin.
            let tries = || self.scene.promising(Candidates::All, &[DVec3::ZERO], CONE_TRIES).into();
            return Arc::clone(self.first_tries.get_or_insert_with(tries));
        }
        let candidates = self.candidates(cone);
        self.scene.promising(Candidates::Some(&candidates), &cone.corners(), CONE_TRIES).into()
    }

    /// Moves the cone's triangle to the exit of the best of the `obstacles`. Returns the
    /// increase of the bound.
    fn advance_within(&mut self, cone: &mut Cone, obstacles: &[Key]) -> f64 {
        let corners = cone.corners();
        let enough = 1.5 * self.best.length();
        let mut best: Option<(Cone, Key)> = None;
        for &k in obstacles {
            self.scene.evaluations += 1;
            let obstacle = self.scene.obstacle(k);
            if !corners.iter().all(|&corner| obstacle.holds(corner)) {
                continue;
            }
            let mut moved = cone.clone();
            for ((reach, &corner), &along) in moved.reach.iter_mut().zip(&corners).zip(&cone.along) {
                let exit = self.scene.run_inside(k, corner, along);
                *reach = reach.max((*reach + exit * (1.0 - DEPTH_ROUNDING)).min(enough));
            }
            moved.measure();
            if best.as_ref().is_none_or(|(best, _)| moved.bound > best.bound) {
                best = Some((moved, k));
            }
        }
        let Some((best, k)) = best else { return 0.0 };
        let gain = (best.bound - cone.bound).max(0.0);
        if gain > 0.0 {
            *cone = best;
            cone.add(k);
            self.scene.note(k);
        }
        gain
    }

    /// Classifies `t`, a point of the cone. `None` if `t` is longer than `best`. If an obstacle
    /// contains `t`, it becomes a hint.
    fn look_at(&mut self, cone: &mut Cone, t: DVec3) -> Option<Place> {
        if t.length() >= self.best.length() {
            return None;
        }
        let known = cone.hints().iter().copied().find(|&k| self.scene.obstacle(k).holds(t));
        let place = match known {
            Some(k) => Place::Blocked(k),
            None => {
                let candidates = self.candidates(cone);
                self.scene.classify(Candidates::Some(&candidates), t)
            }
        };
        match place {
            Place::Free if self.scene.verified(t) => self.best = t,
            // `t` leads into a pocket, which does not count as free, or is within `hair` of
            // contact.
            Place::Free => {}
            Place::Blocked(k) => cone.add(k),
            Place::Unclear => {}
        }
        Some(place)
    }

    /// Searches for a shorter free translation near the cone's nearest point.
    fn seek_way_out(&mut self, cone: &Cone) {
        let limit = self.best.length();
        if let Some(free) = project(self.scene, cone.foot, 1.5 * limit) {
            let free = slide(self.scene, free);
            if free.length() < limit && self.scene.verified(free) {
                self.best = free;
            }
        }
    }

    /// Cuts a cone in two across the longest side of its triangle.
    fn cut(&mut self, cone: &Cone) {
        // At the start, the triangle is a point. Then the triangle of the directions is cut.
        let shape = if cone.bound > 0.0 { cone.corners() } else { cone.along };
        let length = |k: usize| shape[k].distance_squared(shape[(k + 1) % 3]);
        let k = [1, 2].into_iter().fold(0, |best, k| if length(k) > length(best) { k } else { best });
        let (i, j) = (k, (k + 1) % 3);
        let (along, reach) = if cone.reach[i] > 0.0 && cone.reach[j] > 0.0 {
            let middle = 0.5 * (cone.along[i] * cone.reach[i] + cone.along[j] * cone.reach[j]);
            let reach = middle.length();
            (middle / reach, reach)
        } else {
            ((cone.along[i] + cone.along[j]).normalize(), 0.0)
        };
        for replaced in [i, j] {
            let (mut directions, mut reaches) = (cone.along, cone.reach);
            (directions[replaced], reaches[replaced]) = (along, reach);
            self.push(directions, reaches, cone.candidates.clone(), cone.chain.clone());
        }
    }

    /// Returns the candidates of a cone: pairs of cells whose obstacles may extend into the cone
    /// beyond its triangle.
    fn candidates(&mut self, cone: &mut Cone) -> Arc<[Pair]> {
        let before = cone.candidates.as_ref();
        if let Some(before) = before.filter(|before| cone.filtered || before.len() < CONE_FILTER) {
            return Arc::clone(before);
        }
        let (directions, reaches) = (&cone.along, &cone.reach);
        // The part of the cone between the old triangle and the length of the shortest known free
        // translation.
        let limit = self.best.length();
        let widest = closest_on_triangle(DVec3::ZERO, directions[0], directions[1], directions[2]).length();
        let inner = [0, 1, 2].map(|k| directions[k] * reaches[k]);
        let outer = directions.map(|along| along * (limit / widest));
        let slabs = Slabs::around(inner.into_iter().chain(outer));
        let meeting: Arc<[Pair]> = match before {
            Some(before) => before.iter().copied().filter(|&pair| self.scene.may_meet(pair, &slabs)).collect(),
            None => self.scene.pairs_meeting(&slabs).into(),
        };
        cone.candidates = Some(Arc::clone(&meeting));
        cone.filtered = true;
        meeting
    }
}

/// Returns the corner directions of the faces of a regular icosahedron.
fn icosahedron() -> Vec<[DVec3; 3]> {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut corners = Vec::new();
    for (one, phi) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
        for corner in [DVec3::new(0.0, one, phi), DVec3::new(one, phi, 0.0), DVec3::new(phi, 0.0, one)] {
            corners.push(corner.normalize());
        }
    }
    let near = |p: DVec3, q: DVec3| p.dot(q) > 0.4;
    let mut faces = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let [p, q, r] = [corners[i], corners[j], corners[k]];
                if near(p, q) && near(q, r) && near(r, p) {
                    faces.push([p, q, r]);
                }
            }
        }
    }
    faces
}
