//! A bolt and its nut, with real threads.
//!
//! The thread is one strip that winds up around the axis. The strip has four rows of vertices per
//! turn (root, flank, crest, flank). The first row of a turn is the fifth row of the previous turn.
//! Both ends of the strip are cut along a plane through the axis. A plain collar connects each end
//! with a flat ring. The thread of the nut is the same strip, wider by the clearance, with its
//! front toward the axis.

use std::f64::consts::TAU;

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::surface::{Surface, circle};

/// Rise of the thread in one turn, m.
pub const THREAD_PITCH: f64 = 0.002;
/// Distance from the lower to the upper end of [`bolt`], m.
pub const BOLT_LENGTH: f64 = 0.016;
/// Radius of the nut's thread minus radius of the bolt's thread, m.
pub const THREAD_CLEARANCE: f64 = 0.0002;
/// Height of the nut's grip above the start of its thread, m.
pub const NUT_GRIP: f64 = 0.004;

/// Radius of the bolt's root, m.
const ROOT: f64 = 0.0069;
/// Radius of the bolt's crest, m.
const CREST: f64 = 0.0079;
/// Number of vertices per turn.
const SIDES: usize = 24;
/// Number of turns of the bolt's thread.
const BOLT_TURNS: usize = 6;
/// Number of turns of the nut's thread.
const NUT_TURNS: usize = 3;
/// Distance between the lowest point of the strip and the flat ring below it, m; also the distance
/// at the upper end.
const COLLAR: f64 = 0.001;
/// Outer radius of the nut, m.
const NUT_RADIUS: f64 = 0.012;

/// A row of a turn: its height in pitches, and true if it lies on the crest. The angle between the
/// flanks is 60°. The first two rows have the radius of the collars. A collar must not block the
/// other part, so the bolt's collar has the radius of the root, and the nut's collar has the
/// radius of the crest.
type Row = (f64, bool);
const BOLT_ROWS: [Row; 4] = [(0.0, false), (0.21, false), (0.5, true), (0.71, true)];
const NUT_ROWS: [Row; 4] = [(0.5, true), (0.71, true), (1.0, false), (1.21, false)];

/// Returns a right-handed bolt of 16 mm along z, starting at z = −1 mm. The shape has 1300
/// triangles.
pub fn bolt() -> PolygonSoup {
    let mut surface = Surface::default();
    let thread = Thread { offset: 0.0, base: 0.0, turns: BOLT_TURNS, rows: BOLT_ROWS, inward: false };
    let (low, high) = thread.build(&mut surface);
    surface.cap_start(&low);
    surface.cap_end(&high);
    surface.finish()
}

/// Returns a round nut that fits [`bolt`]. It is 10 mm high, and its grip is in the middle of its
/// axis. The shape has 824 triangles and genus 1.
///
/// If the nut is turned by any angle φ (rad) about z and raised by [`NUT_GRIP`] + φ/2π ·
/// [`THREAD_PITCH`] (m), it does not touch the bolt's thread.
pub fn nut() -> PolygonSoup {
    let mut surface = Surface::default();
    let thread = Thread { offset: THREAD_CLEARANCE, base: -NUT_GRIP, turns: NUT_TURNS, rows: NUT_ROWS, inward: true };
    let (low, high) = thread.build(&mut surface);
    let outside = |surface: &mut Surface, ring: &[u32]| {
        let z = surface.at(ring[0]).z;
        surface.ring(circle(DVec3::Z * z, DVec3::X, DVec3::Y, NUT_RADIUS, SIDES, 0.0))
    };
    let (outer_low, outer_high) = (outside(&mut surface, &low), outside(&mut surface, &high));
    surface.band(&low, &outer_low);
    surface.band(&outer_low, &outer_high);
    surface.band(&outer_high, &high);
    surface.finish()
}

struct Thread {
    /// Offset of all radii, m.
    offset: f64,
    /// Height at which the thread begins, m.
    base: f64,
    turns: usize,
    rows: [Row; 4],
    /// True if the thread faces the axis.
    inward: bool,
}

impl Thread {
    /// Adds the strip and its collars. Returns the flat rings below and above.
    fn build(&self, surface: &mut Surface) -> (Vec<u32>, Vec<u32>) {
        let count = SIDES * self.turns;
        // Beyond the strip's end, only the first row continues, and closes the last turn from
        // above.
        let of = |u: usize| if u <= count { &self.rows[..] } else { &self.rows[..1] };
        let rows: Vec<Vec<u32>> = (0..=count + SIDES)
            .map(|u| of(u).iter().map(|&row| surface.vertex(self.point(u, row))).collect())
            .collect();
        // Row 4 is the first row of the next turn.
        let vertex = |u: usize, row: usize| if row < 4 { rows[u][row] } else { rows[u + SIDES][0] };
        let ring = |z: f64| circle(DVec3::Z * z, DVec3::X, DVec3::Y, self.radius(self.rows[0]), SIDES, 0.0);
        let low = surface.ring(ring(self.point(0, self.rows[0]).z - COLLAR));
        let high = surface.ring(ring(self.point(count + SIDES, self.rows[0]).z + COLLAR));
        let mut faces = Vec::new();
        for u in 0..count {
            for row in 0..4 {
                faces.push(vec![vertex(u, row), vertex(u + 1, row), vertex(u + 1, row + 1), vertex(u, row + 1)]);
            }
        }
        for k in 0..SIDES - 1 {
            faces.push(vec![low[k], low[k + 1], vertex(k + 1, 0), vertex(k, 0)]);
        }
        for k in 1..SIDES {
            let next = high[(k + 1) % SIDES];
            faces.push(vec![vertex(count + k, 0), vertex(count + k + 1, 0), next, high[k]]);
        }
        // The last side of the lower collar and the first side of the upper collar touch an end of
        // the thread, which has vertices on their edge.
        let start = [0, 1, 2, 3, 4].map(|row| vertex(0, row));
        let end = [0, 1, 2, 3, 4].map(|row| vertex(count, row));
        faces.push(vec![vertex(SIDES - 1, 0), low[SIDES - 1], low[0], start[0], start[1], start[4]]);
        faces.push(vec![vertex(count + 1, 0), high[1], high[0], end[4], end[1], end[0]]);
        faces.push(vec![start[1], start[2], start[3], start[4]]);
        faces.push(vec![end[4], end[3], end[2], end[1]]);
        for face in faces {
            // Adds a fan of triangles around the first corner.
            for k in 1..face.len() - 1 {
                let [a, b, c] = [face[0], face[k], face[k + 1]];
                if self.inward { surface.triangle(a, c, b) } else { surface.triangle(a, b, c) }
            }
        }
        (low, high)
    }

    fn radius(&self, (_, on_crest): Row) -> f64 {
        self.offset + if on_crest { CREST } else { ROOT }
    }

    fn point(&self, u: usize, row: Row) -> DVec3 {
        let turn = u as f64 / SIDES as f64;
        let radius = self.radius(row);
        let (sin, cos) = (TAU * (u % SIDES) as f64 / SIDES as f64).sin_cos();
        DVec3::new(radius * cos, radius * sin, self.base + THREAD_PITCH * (turn + row.0))
    }
}
