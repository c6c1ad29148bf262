//! The gap of a pair along a fixed normal, when one body is tilted against the other by a little.
//!
//! Let x run over the tangent plane of `normal`, through an origin near the contact, and let a and b be sheared so that their
//! facing surfaces tilt against each other by q (a rise per length: a by +q/2, b by −q/2). The least of a's height over b's,
//!
//! `gap(q) = max over p of [ min_a (n + p + q/2)·a − max_b (n + p − q/2)·b ]`,
//!
//! (linear-programming duality: p are the slopes of planes that pass between the bodies), is a linear program in p and the gap,
//! of three variables and with a constraint (a *cut*) for each vertex pair. Only p up to [`SKIRT_SLOPE`] are admitted. That is
//! the same as giving both bodies skirts that fall off from their rims with that slope: the gap then exists for every pose
//! (also for plates seen edge on), and no motion changes it by more than `√(1 + p²)` times as much.
//!
//! 1. Start from one cut and two bounds far outside of the admitted p: their multipliers are not negative (dual feasible).
//! 2. Solve; ask for the bound that p violates most, else for the vertex pair that supports p: if its cut holds, done.
//! 3. Exchange it for a row of the basis by the ratio test (dual simplex), again.
//!
//! A change of q moves the right-hand sides alone, so the end of one program is a dual feasible start of the next.

use glam::{DMat3, DVec2, DVec3};

use super::HubPair;
use super::cso::Cso;
use crate::algebra::tolerance::{BLEND_PIVOT, BLEND_PIVOTS, BLEND_ROUNDING, OFFSET_SLACK, SKIRT_SLOPE};

/// A constraint of the program: `row · (p, gap) ≤ fixed + tilted · q`.
#[derive(Clone, Copy, Debug)]
struct Row {
    row: DVec3,
    fixed: f64,
    tilted: DVec2,
    /// Of a cut.
    hub: Option<HubPair>,
}

impl Row {
    fn bound(axis: DVec2, slope: f64) -> Self {
        Self { row: axis.extend(0.0), fixed: slope, tilted: DVec2::ZERO, hub: None }
    }
}

/// Three rows that hold with equality, and a hub pair near the optimum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Basis {
    rows: [Row; 3],
    hub: HubPair,
}

/// The pair, the plane, and how lengths are judged.
pub(super) struct TiltedGap<'c, 'p> {
    pub(super) cso: &'c Cso<'p>,
    pub(super) origin: DVec3,
    pub(super) normal: DVec3,
    pub(super) along: [DVec3; 2],
    /// Six pairs of opposite directions in the plane that bound p.
    pub(super) bounds: [DVec2; 6],
    /// A vertex that pierces a plane by less does not.
    pub(super) rounding: f64,
    /// Moves of all programs.
    pub(super) pivots: u32,
}

impl TiltedGap<'_, '_> {
    /// A vector in the tangent plane, from its coordinates.
    pub(super) fn in_plane(&self, q: DVec2) -> DVec3 {
        self.along[0] * q.x + self.along[1] * q.y
    }

    fn on_plane(&self, v: DVec3) -> DVec2 {
        DVec2::new(self.along[0].dot(v), self.along[1].dot(v))
    }

    /// A dual feasible basis around the cut of `hub`.
    pub(super) fn first(&self, hub: HubPair) -> Basis {
        let cut = self.cut(hub);
        let bound = |axis: DVec2, along: f64| {
            let axis = if along < 0.0 { -axis } else { axis };
            // Twice the slope is outside of the polygon that the bounds make.
            Row::bound(axis, 2.0 * SKIRT_SLOPE)
        };
        Basis { rows: [cut, bound(DVec2::X, -cut.row.x), bound(DVec2::Y, -cut.row.y)], hub }
    }

    /// Moves `basis` to the optimum for the tilt `q` and tells the gap there; `None` if it ran out of steps.
    pub(super) fn solve(&mut self, basis: &mut Basis, q: DVec2) -> Option<f64> {
        let (mut least, mut most) = (f64::NEG_INFINITY, f64::INFINITY);
        for _ in 0..BLEND_PIVOTS {
            let [k, l, m] = basis.rows;
            let inverse = DMat3::from_cols(k.row, l.row, m.row).inverse();
            let right = DVec3::from_array(basis.rows.map(|row| row.fixed + row.tilted.dot(q)));
            let solution = inverse.transpose() * right;
            if !solution.is_finite() {
                return None;
            }
            let entering = match self.violated_bound(solution.truncate()) {
                Some(row) => row,
                None => {
                    basis.hub = self.support(basis.hub, solution.truncate(), q);
                    let cut = self.cut(basis.hub);
                    // The program's value falls towards the gap, and what the supports allow at p does not exceed it.
                    let pierced = cut.row.dot(solution) - cut.fixed - cut.tilted.dot(q);
                    least = least.max(solution.z - pierced.max(0.0));
                    most = most.min(solution.z);
                    // A cut of the basis holds but for rounding.
                    let known = basis.rows.iter().any(|row| row.hub == cut.hub);
                    if known || solution.z - least <= self.rounding {
                        return Some(least);
                    }
                    cut
                }
            };
            let leaving = leaving(inverse * entering.row, inverse.z_axis)?;
            basis.rows[leaving] = entering;
            self.pivots += 1;
        }
        (most - least <= OFFSET_SLACK * self.cso.size()).then_some(least)
    }

    fn violated_bound(&self, p: DVec2) -> Option<Row> {
        let mut worst = None;
        let mut most = SKIRT_SLOPE * (1.0 + BLEND_ROUNDING);
        for axis in self.bounds {
            let along = axis.dot(p);
            if along.abs() > most {
                most = along.abs();
                worst = Some(if along < 0.0 { -axis } else { axis });
            }
        }
        worst.map(|axis| Row::bound(axis, SKIRT_SLOPE))
    }

    /// The vertex pair that a plane of slope `p` touches first.
    fn support(&self, hint: HubPair, p: DVec2, q: DVec2) -> HubPair {
        let Cso { a, b, .. } = *self.cso;
        let (plane, tilt) = (self.normal + self.in_plane(p), 0.5 * self.in_plane(q));
        HubPair { a: a.support_from(hint.a, self.cso.toward_b(plane + tilt)), b: b.support_from(hint.b, plane - tilt) }
    }

    fn cut(&self, hub: HubPair) -> Row {
        let (a, b) = (self.cso.point_a(hub.a) - self.origin, self.cso.b.vertex(hub.b) - self.origin);
        let apart = a - b;
        let row = (-self.on_plane(apart)).extend(1.0);
        Row { row, fixed: self.normal.dot(apart), tilted: 0.5 * self.on_plane(a + b), hub: Some(hub) }
    }
}

/// The ratio test: which row leaves so that all multipliers stay not negative. `None`: no row can (rounding alone).
fn leaving(shares: DVec3, multipliers: DVec3) -> Option<usize> {
    let least_share = BLEND_PIVOT * shares.abs().max_element();
    let mut best = None;
    let (mut ratio, mut largest) = (f64::INFINITY, 0.0);
    for k in 0..3 {
        let (share, multiplier) = (shares[k], multipliers[k].max(0.0));
        if share > least_share {
            let here = multiplier / share;
            if here < ratio || here <= ratio && share > largest {
                (best, ratio, largest) = (Some(k), here, share);
            }
        }
    }
    best
}
