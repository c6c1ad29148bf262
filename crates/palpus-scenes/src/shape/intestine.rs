//! A tube like an intestine: folded into rows, with a lumen whose radius is wavy (the bulges are
//! called haustra). It has 24 846 triangles, like the model in the paper's Table 1.
//!
//! The surface is one closed sequence of rings: along the outer wall, over one cut end, back along
//! the lumen, and over the other cut end. The outer radius is smaller than the bend radius of the
//! folds, and smaller than half the distance between neighbouring rows. So the surface cannot
//! intersect itself. The wall is 3 mm thick everywhere.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::surface::{Surface, circle};

/// Mean radius of the lumen, m. The radius varies by ±10 %.
pub const LUMEN_RADIUS: f64 = 0.013;
/// Relative height of the haustra.
const WAVINESS: f64 = 0.10;
/// Length of one haustrum along the centre line, m.
const HAUSTRUM: f64 = 0.033;
/// Thickness of the wall, m.
pub const GUT_WALL: f64 = 0.003;

/// Number of straight rows. Half circles connect them.
const ROWS: usize = 4;
/// Length of a row, m.
const ROW_LENGTH: f64 = 0.110;
/// Radius of the half circles, m.
const BEND_RADIUS: f64 = 0.024;
/// Amplitude of the rise and fall of the rows, m.
const HEAVE: f64 = 0.005;
/// Wavelength of the rise and fall along the centre line, m.
const HEAVE_LENGTH: f64 = 0.180;

const SIDES: usize = 41;
const OUTER_BANDS: usize = 151;
const LUMEN_BANDS: usize = 150;

/// The centre line of [`intestine`]. Its parameter in \[0, 1\] is proportional to the length along
/// the line without the rise and fall.
#[derive(Clone, Copy, Debug, Default)]
pub struct CenterLine;

impl CenterLine {
    /// Returns the length of the line without the rise and fall, m.
    pub fn length(&self) -> f64 {
        ROWS as f64 * ROW_LENGTH + (ROWS - 1) as f64 * PI * BEND_RADIUS
    }

    /// Returns the point at parameter `u`, m.
    pub fn point(&self, u: f64) -> DVec3 {
        let s = u.clamp(0.0, 1.0) * self.length();
        let lap = ROW_LENGTH + PI * BEND_RADIUS;
        let row = ((s / lap) as usize).min(ROWS - 1);
        let along = s - row as f64 * lap;
        let y = (2.0 * row as f64 - (ROWS - 1) as f64) * BEND_RADIUS;
        let (x, y) = if along <= ROW_LENGTH {
            (along - ROW_LENGTH / 2.0, y)
        } else {
            let (sin, cos) = ((along - ROW_LENGTH) / BEND_RADIUS).sin_cos();
            (ROW_LENGTH / 2.0 + BEND_RADIUS * sin, y + BEND_RADIUS * (1.0 - cos))
        };
        let direction = if row.is_multiple_of(2) { 1.0 } else { -1.0 };
        DVec3::new(direction * x, y, HEAVE * (TAU * s / HEAVE_LENGTH).sin())
    }

    /// Returns two unit axes perpendicular to the line at parameter `u`. The first axis is
    /// horizontal. The cross product of the axes points along the line.
    pub fn across(&self, u: f64) -> (DVec3, DVec3) {
        let (before, after) = ((u - 1e-5).clamp(0.0, 1.0), (u + 1e-5).clamp(0.0, 1.0));
        let tangent = (self.point(after) - self.point(before)).normalize();
        let level = DVec3::Z.cross(tangent).normalize();
        (level, tangent.cross(level))
    }

    /// Returns the radius of the lumen at parameter `u`, m.
    pub fn lumen_radius(&self, u: f64) -> f64 {
        LUMEN_RADIUS * (1.0 - WAVINESS * (TAU * u * self.length() / HAUSTRUM).cos())
    }
}

/// Returns a folded tube with wall and lumen, open at both cut ends. It is about 160 mm × 180 mm ×
/// 45 mm in size, around the origin. The shape has 24 846 triangles and genus 1.
pub fn intestine() -> PolygonSoup {
    let line = CenterLine;
    let mut surface = Surface::default();
    let mut ring_at = |u: f64, wall: f64| {
        let (level, steep) = line.across(u);
        surface.ring(circle(line.point(u), level, steep, line.lumen_radius(u) + wall, SIDES, 0.0))
    };
    let outer = (0..=OUTER_BANDS).map(|k| (k as f64 / OUTER_BANDS as f64, GUT_WALL));
    let lumen = (0..=LUMEN_BANDS).rev().map(|k| (k as f64 / LUMEN_BANDS as f64, 0.0));
    let rings: Vec<_> = outer.chain(lumen).map(|(u, wall)| ring_at(u, wall)).collect();
    for k in 0..rings.len() {
        surface.band(&rings[k], &rings[(k + 1) % rings.len()]);
    }
    surface.finish()
}
