//! The gap of a pair while the middle between its closest points is pulled aside.
//!
//! For a pull q (a vector, a rise per length), `gap(q) = min over points a and b of |a − b| − q·(a + b)`: closest points that
//! may get farther from each other by 2 |q| for each length that their middle wins along q. With no pull it is the distance;
//! its derivative by q is minus twice the middle of the pair that attains it. By linear-programming duality
//!
//! `gap(q) = max over |w| ≤ 1 of [ min_a (w − q)·a − max_b (w + q)·b ]`,
//!
//! a concave function of the direction w alone, which asks the bodies for nothing but support vertices, and which no motion of a
//! that moves none of its points by more than δ changes by more than `(1 + |q|) δ`.
//!
//! 1. Of the vertex pairs known (at first one), find the w that is best for them: some one to three of them, its *basis*,
//!    are then equally good, and the bodies being apart, |w| = 1.
//! 2. Ask for the vertex pair that supports w. If it is no better than the basis is, done: the basis tells an upper bound of
//!    the gap and the support pair a lower one.
//! 3. Else add it, and again. Only the basis is kept, so that four pairs are known at the most.
//!
//! For no pull this is GJK in its dual form. A change of q leaves the pairs what they are, so that one gap's basis is a good start
//! of the next one's.

use glam::DVec3;

use super::HubPair;
use super::cso::Cso;
use crate::algebra::tolerance::{BLEND_FLAT, BLEND_ROUNDS, OFFSET_SLACK};

/// A vertex of a and one of b.
#[derive(Clone, Copy, Debug)]
struct Pair {
    hub: HubPair,
    /// a − b.
    apart: DVec3,
    /// a + b, each from the origin.
    sum: DVec3,
}

/// The bodies, and the vertex pairs known.
pub(super) struct PulledGap<'c, 'p> {
    cso: &'c Cso<'p>,
    /// By how much a is moved first, so that bodies that overlap touch.
    moved: DVec3,
    /// Near the contact.
    origin: DVec3,
    /// A gap that is known as exactly as this is known.
    rounding: f64,
    pairs: [Pair; 4],
    count: usize,
    /// w, unit.
    along: DVec3,
    /// Of a basis of three: positive if it runs counter-clockwise about w.
    turn: f64,
    /// Where the next climbs begin.
    hub: HubPair,
    /// Vertex pairs asked for so far.
    pub(super) rounds: u32,
}

/// Pairs that may be a basis, and the other ones that are known.
type Choice = (&'static [usize], &'static [usize]);

/// The choices of a basis, by how many pairs are known: the largest first, since flat contact has three.
const CHOICES: [&[Choice]; 4] = [
    &[],
    &[(&[0], &[])],
    &[(&[0, 1], &[]), (&[0], &[1]), (&[1], &[0])],
    &[
        (&[0, 1, 2], &[]),
        (&[0, 1], &[2]),
        (&[0, 2], &[1]),
        (&[1, 2], &[0]),
        (&[0], &[1, 2]),
        (&[1], &[0, 2]),
        (&[2], &[0, 1]),
    ],
];

/// Those with the pair that came last.
const CHOICES_WITH_LAST: [&[Choice]; 5] = [
    &[],
    &[(&[0], &[])],
    &[(&[0, 1], &[]), (&[1], &[0])],
    &[(&[0, 1, 2], &[]), (&[0, 2], &[1]), (&[1, 2], &[0]), (&[2], &[0, 1])],
    &[
        (&[0, 1, 3], &[2]),
        (&[0, 2, 3], &[1]),
        (&[1, 2, 3], &[0]),
        (&[0, 3], &[1, 2]),
        (&[1, 3], &[0, 2]),
        (&[2, 3], &[0, 1]),
        (&[3], &[0, 1, 2]),
    ],
];

/// The best direction for a set of pairs, and how good it is.
struct Best {
    along: DVec3,
    gap: f64,
    /// None of the pairs can be left out.
    is_basis: bool,
    turn: f64,
}

impl<'c, 'p> PulledGap<'c, 'p> {
    /// Starts from the vertex pair `hub` and the direction `normal` (unit, from b into a).
    pub(super) fn new(
        cso: &'c Cso<'p>,
        moved: DVec3,
        origin: DVec3,
        normal: DVec3,
        hub: HubPair,
        rounding: f64,
    ) -> Self {
        let none = Pair { hub, apart: DVec3::ZERO, sum: DVec3::ZERO };
        let mut gap =
            Self { cso, moved, origin, rounding, pairs: [none; 4], count: 1, along: normal, turn: 1.0, hub, rounds: 0 };
        gap.pairs[0] = gap.pair(hub);
        gap
    }

    /// The gap for the pull `q`; `None` if it ran out of rounds.
    pub(super) fn at(&mut self, q: DVec3) -> Option<f64> {
        let mut upper = self.settle(q, CHOICES[self.count]).unwrap_or(f64::INFINITY);
        let mut lower = f64::NEG_INFINITY;
        for _ in 0..BLEND_ROUNDS {
            self.climb(q);
            let known = self.pairs[..self.count].iter().find(|pair| pair.hub == self.hub).copied();
            let pair = known.unwrap_or_else(|| self.pair(self.hub));
            lower = lower.max(height(&pair, self.along, q));
            // No pair is worse than one that the direction was chosen for.
            if known.is_some() || upper - lower <= self.rounding {
                return Some(lower);
            }
            if self.count == 3 {
                let leaving = self.likely_to_leave(&pair);
                self.pairs.swap(2, leaving);
            }
            self.pairs[self.count] = pair;
            self.count += 1;
            upper = self.settle(q, CHOICES_WITH_LAST[self.count]).map_or(upper, |gap| gap.min(upper));
        }
        (upper - lower <= OFFSET_SLACK * self.cso.size()).then_some(lower)
    }

    fn pair(&self, hub: HubPair) -> Pair {
        let (a, b) = (self.cso.point_a(hub.a) + self.moved - self.origin, self.cso.b.vertex(hub.b) - self.origin);
        Pair { hub, apart: a - b, sum: a + b }
    }

    /// Moves to the vertex pair that supports the present direction.
    fn climb(&mut self, q: DVec3) {
        let Cso { a, b, .. } = *self.cso;
        self.hub.a = a.support_from(self.hub.a, self.cso.toward_b(self.along - q));
        self.hub.b = b.support_from(self.hub.b, self.along + q);
        self.rounds += 1;
    }

    /// Which of a basis of three leaves when `pair` comes: seen along w, the triangle of the other three holds the origin.
    fn likely_to_leave(&self, pair: &Pair) -> usize {
        let across = self.along.cross(pair.apart) * self.turn;
        let side = [0, 1, 2].map(|k| across.dot(self.pairs[k].apart));
        (0..3).find(|k| side[(k + 1) % 3] >= 0.0 && side[(k + 2) % 3] <= 0.0).unwrap_or(2)
    }

    /// Finds the best direction for the known pairs, forgets all but its basis, which is one of `choices`, and tells how good it
    /// is if that is beyond doubt.
    fn settle(&mut self, q: DVec3, choices: &[Choice]) -> Option<f64> {
        for &(set, others) in choices {
            if let Some(found) = self.best_for(set, q)
                && found.is_basis
                && self.least(others, &found, q) >= found.gap - self.rounding
            {
                self.keep(set, &found);
                return Some(found.gap);
            }
        }
        // Rounding alone leaves no set that is a basis beyond doubt: then the direction that is best for all.
        let mut best: Option<(&[usize], Best)> = None;
        let mut most = f64::NEG_INFINITY;
        for &(set, others) in choices {
            let Some(found) = self.best_for(set, q) else { continue };
            let least = self.least(others, &found, q).min(found.gap);
            if least > most {
                (most, best) = (least, Some((set, found)));
            }
        }
        let (set, found) = best?;
        self.keep(set, &found);
        None
    }

    fn best_for(&self, set: &[usize], q: DVec3) -> Option<Best> {
        match *set {
            [i] => Some(self.for_one(&self.pairs[i], q)),
            [i, j] => self.for_two(&self.pairs[i], &self.pairs[j], q),
            [i, j, k] => self.for_three(&self.pairs[i], &self.pairs[j], &self.pairs[k], q),
            _ => None,
        }
    }

    fn least(&self, others: &[usize], found: &Best, q: DVec3) -> f64 {
        others.iter().map(|&k| height(&self.pairs[k], found.along, q)).fold(f64::INFINITY, f64::min)
    }

    fn keep(&mut self, set: &[usize], found: &Best) {
        (self.along, self.turn) = (found.along, found.turn);
        for (place, &k) in set.iter().enumerate() {
            if place != k {
                self.pairs[place] = self.pairs[k];
            }
        }
        self.count = set.len();
    }

    fn for_one(&self, i: &Pair, q: DVec3) -> Best {
        let length = i.apart.length();
        let along = if length > self.rounding { i.apart / length } else { self.along };
        Best { along, gap: height(i, along, q), is_basis: true, turn: 1.0 }
    }

    fn for_two(&self, i: &Pair, j: &Pair, q: DVec3) -> Option<Best> {
        let edge = i.apart - j.apart;
        let squared = edge.length_squared();
        // w·edge = rise.
        let rise = q.dot(i.sum - j.sum);
        let slack = 1.0 - rise * rise / squared;
        if slack <= BLEND_FLAT {
            return None;
        }
        let across = j.apart - edge * (j.apart.dot(edge) / squared);
        let distance = across.length();
        let side = if distance > self.rounding {
            across / distance
        } else {
            (self.along - edge * (self.along.dot(edge) / squared)).try_normalize()?
        };
        let along = edge * (rise / squared) + side * slack.sqrt();
        // Where along the edge it is attained: between its ends?
        let share = (distance * rise / slack.sqrt() - j.apart.dot(edge)) / squared;
        Some(Best {
            along,
            gap: height(i, along, q),
            is_basis: (-BLEND_FLAT..=1.0 + BLEND_FLAT).contains(&share),
            turn: 1.0,
        })
    }

    fn for_three(&self, i: &Pair, j: &Pair, k: &Pair, q: DVec3) -> Option<Best> {
        let (e, f) = (i.apart - k.apart, j.apart - k.apart);
        let across = e.cross(f);
        let squared = across.length_squared();
        if squared <= BLEND_FLAT * BLEND_FLAT * e.length_squared() * f.length_squared() {
            return None;
        }
        let inverse = 1.0 / squared;
        let (rise_e, rise_f) = (q.dot(i.sum - k.sum), q.dot(j.sum - k.sum));
        let tilted = (f.cross(across) * rise_e + across.cross(e) * rise_f) * inverse;
        let slack = 1.0 - tilted.length_squared();
        if slack <= 0.0 {
            return None;
        }
        let unit = across * inverse.sqrt();
        let distance = unit.dot(k.apart);
        let faces = if distance.abs() > self.rounding { distance } else { unit.dot(self.along) };
        let side = if faces < 0.0 { -unit } else { unit };
        let along = tilted + side * slack.sqrt();
        // The shares of the three in the point of their triangle that lies along w; they add up to w·across.
        let turn = |p: DVec3, r: DVec3| along.dot(p.cross(r)) * faces.signum();
        let least = turn(j.apart, k.apart).min(turn(k.apart, i.apart)).min(turn(i.apart, j.apart));
        let is_basis = least >= -BLEND_FLAT * squared.sqrt();
        Some(Best { along, gap: height(k, along, q), is_basis, turn: faces.signum() })
    }
}

/// How far apart the planes across `along` through the vertices of a pair are, pulled.
#[inline]
fn height(pair: &Pair, along: DVec3, q: DVec3) -> f64 {
    along.dot(pair.apart) - q.dot(pair.sum)
}
