//! A bolt and its nut, with real threads.
//!
//! The thread is one strip that winds up around the axis: four rows of vertices a turn (root,
//! flank, crest, flank), of which the first of a turn is the fifth of the turn before. Its two ends
//! are cut along the plane through the axis, and a plain collar leads to a flat ring above and
//! below. The nut's is the same strip, wider by the clearance, and looked at from within.

use std::f64::consts::TAU;

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::skin::{Skin, circle};

/// Rise of the thread in one turn, m.
pub const THREAD_PITCH: f64 = 0.002;
/// From the lower to the upper end of [`bolt`], m.
pub const BOLT_LENGTH: f64 = 0.016;
/// How much wider the nut's thread is than the bolt's, m on the radius.
pub const THREAD_CLEARANCE: f64 = 0.0002;
/// How high the nut's grip is over where its thread would begin on the bolt's, m.
pub const NUT_GRIP: f64 = 0.004;

/// Radii of the bolt's root and crest, m.
const ROOT: f64 = 0.0069;
const CREST: f64 = 0.0079;
/// Vertices a turn.
const SIDES: usize = 24;
const BOLT_TURNS: usize = 6;
const NUT_TURNS: usize = 3;
/// Between the strip's lowest point and the flat ring below, and the same above, m.
const COLLAR: f64 = 0.001;
const NUT_RADIUS: f64 = 0.012;

/// A row of a turn: where it stands, in parts of the pitch, and whether on the crest. Flanks stand
/// at 60° to each other. The first two rows stand at the radius of the collars, which must not be
/// in the way: the bolt's on the root, the nut's on the crest.
type Row = (f64, bool);
const BOLT_ROWS: [Row; 4] = [(0.0, false), (0.21, false), (0.5, true), (0.71, true)];
const NUT_ROWS: [Row; 4] = [(0.5, true), (0.71, true), (1.0, false), (1.21, false)];

/// A right-handed bolt of 16 mm along z, from z = −1 mm on: 1300 triangles.
pub fn bolt() -> PolygonSoup {
    let mut skin = Skin::default();
    let thread = Thread { offset: 0.0, base: 0.0, turns: BOLT_TURNS, rows: BOLT_ROWS, inward: false };
    let (low, high) = thread.build(&mut skin);
    skin.cap_start(&low);
    skin.cap_end(&high);
    skin.finish()
}

/// A round nut that winds onto [`bolt`]: 10 mm high, its grip in the middle of its axis: 824
/// triangles, genus 1.
///
/// Turned by any angle φ about z and raised by [`NUT_GRIP`] + φ/2π · [`THREAD_PITCH`], it stands
/// free in the bolt's thread.
pub fn nut() -> PolygonSoup {
    let mut skin = Skin::default();
    let thread = Thread { offset: THREAD_CLEARANCE, base: -NUT_GRIP, turns: NUT_TURNS, rows: NUT_ROWS, inward: true };
    let (low, high) = thread.build(&mut skin);
    let outside = |skin: &mut Skin, ring: &[u32]| {
        let z = skin.at(ring[0]).z;
        skin.ring(circle(DVec3::Z * z, DVec3::X, DVec3::Y, NUT_RADIUS, SIDES, 0.0))
    };
    let (outer_low, outer_high) = (outside(&mut skin, &low), outside(&mut skin, &high));
    skin.band(&low, &outer_low);
    skin.band(&outer_low, &outer_high);
    skin.band(&outer_high, &high);
    skin.finish()
}

struct Thread {
    /// m on the radius.
    offset: f64,
    /// Height at which it begins, m.
    base: f64,
    turns: usize,
    rows: [Row; 4],
    /// Seen from the axis.
    inward: bool,
}

impl Thread {
    /// The strip and its collars; answers the flat rings below and above.
    fn build(&self, skin: &mut Skin) -> (Vec<u32>, Vec<u32>) {
        let count = SIDES * self.turns;
        // Beyond the strip's end only the first row goes on, which closes the last turn from above.
        let of = |u: usize| if u <= count { &self.rows[..] } else { &self.rows[..1] };
        let rows: Vec<Vec<u32>> =
            (0..=count + SIDES).map(|u| of(u).iter().map(|&row| skin.vertex(self.point(u, row))).collect()).collect();
        // Row 4 is the first row of the next turn.
        let vertex = |u: usize, row: usize| if row < 4 { rows[u][row] } else { rows[u + SIDES][0] };
        let ring = |z: f64| circle(DVec3::Z * z, DVec3::X, DVec3::Y, self.radius(self.rows[0]), SIDES, 0.0);
        let low = skin.ring(ring(self.point(0, self.rows[0]).z - COLLAR));
        let high = skin.ring(ring(self.point(count + SIDES, self.rows[0]).z + COLLAR));
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
        // The collar's last side below and its first one above meet the thread's end, which has
        // corners on their edge.
        let start = [0, 1, 2, 3, 4].map(|row| vertex(0, row));
        let end = [0, 1, 2, 3, 4].map(|row| vertex(count, row));
        faces.push(vec![vertex(SIDES - 1, 0), low[SIDES - 1], low[0], start[0], start[1], start[4]]);
        faces.push(vec![vertex(count + 1, 0), high[1], high[0], end[4], end[1], end[0]]);
        faces.push(vec![start[1], start[2], start[3], start[4]]);
        faces.push(vec![end[4], end[3], end[2], end[1]]);
        for face in faces {
            // A fan about the first corner.
            for k in 1..face.len() - 1 {
                let [a, b, c] = [face[0], face[k], face[k + 1]];
                if self.inward { skin.triangle(a, c, b) } else { skin.triangle(a, b, c) }
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
