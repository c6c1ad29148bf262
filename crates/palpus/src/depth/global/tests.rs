//! Tests identities and known depths. The oracle for small shapes classifies a grid of translations
//! by the surfaces alone. Its resolution is the spacing of the grid. `.ci/hold_reference.py` checks
//! exact results of more difficult pairs.

mod identities;
mod known;

use glam::{DQuat, DVec3};

use super::surfaces::Surfaces;
use super::*;
use crate::algebra::Random;
use crate::algebra::{Alone, Workers};
use crate::body::{BodySettings, PolygonSoup};

fn body(soup: &PolygonSoup) -> Body {
    Body::from_soup(soup, &BodySettings::default(), &mut |_| ()).expect("a valid body")
}

fn interior(body: &Body) -> Interior {
    Interior::new(body, &Alone, &mut |_| ())
}

/// Returns a prism from z = 0 to `height` over an outline in the xy plane (counter-clockwise).
fn prism(outline: &[(f64, f64)], height: f64) -> PolygonSoup {
    let n = outline.len() as u32;
    let level = |z: f64| outline.iter().map(move |&(x, y)| DVec3::new(x, y, z));
    let mut soup = PolygonSoup { vertices: level(0.0).chain(level(height)).collect(), ..PolygonSoup::new() };
    soup.push_face(&(0..n).rev().collect::<Vec<_>>());
    soup.push_face(&(n..2 * n).collect::<Vec<_>>());
    for k in 0..n {
        soup.push_face(&[k, (k + 1) % n, n + (k + 1) % n, n + k]);
    }
    soup
}

fn cuboid(size: DVec3) -> PolygonSoup {
    prism(&[(0.0, 0.0), (size.x, 0.0), (size.x, size.y), (0.0, size.y)], size.z)
}

/// Returns an L-shaped solid of 2 × 2 × 1, with arms of width 1.
fn ell() -> PolygonSoup {
    prism(&[(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)], 1.0)
}

/// Returns a block of 3 × 3 × 1, with a groove of width 1 and depth 2.
fn groove() -> PolygonSoup {
    let outline = [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (2.0, 3.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)];
    prism(&outline, 1.0)
}

fn placed(mut soup: PolygonSoup, pose: &Pose) -> PolygonSoup {
    for p in &mut soup.vertices {
        *p = pose.point(*p);
    }
    soup
}

fn random_pose(random: &mut Random, reach: f64) -> Pose {
    let rotation = DQuat::from_axis_angle(random.direction(), std::f64::consts::TAU * random.unit());
    Pose::new(rotation, DVec3::ONE + random.vector() * reach)
}
