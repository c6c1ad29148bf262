//! Arrows as small solids: always of the same thickness in the picture, and shaded like everything else.

use glam::DVec3;

use crate::raster::Corner;

/// Sides of a round thing.
const SIDES: usize = 14;
/// The head of an arrow: its length and its radius in radii of the shaft.
const HEAD_LENGTH: f64 = 6.0;
const HEAD_RADIUS: f64 = 2.6;
/// Of a turning arrow, rad: what the arrow goes round, and in how many straight parts.
const TURN: f64 = 1.5 * std::f64::consts::PI;
const TURN_PARTS: usize = 30;

/// Triangles, world.
pub(crate) type Triangles = Vec<[Corner; 3]>;

/// An arrow from `tail` along `way`, its shaft `radius` metres thick. Short ones are all head, and smaller.
pub(crate) fn arrow(tail: DVec3, way: DVec3, radius: f64) -> Triangles {
    let Some(along) = way.try_normalize() else { return Vec::new() };
    let length = way.length();
    let radius = radius.min(length / (HEAD_LENGTH + 1.0));
    let neck = tail + along * (length - HEAD_LENGTH * radius);
    let mut triangles = rod(tail, neck, radius);
    triangles.extend(cone(neck, tail + way, HEAD_RADIUS * radius));
    triangles
}

/// A rod between two points.
pub(crate) fn rod(from: DVec3, to: DVec3, radius: f64) -> Triangles {
    let Some(along) = (to - from).try_normalize() else { return Vec::new() };
    let ring = ring(along);
    let mut triangles = Vec::with_capacity(3 * SIDES);
    for k in 0..SIDES {
        let (u, v) = (ring[k], ring[(k + 1) % SIDES]);
        let corner = |center: DVec3, out: DVec3| Corner { point: center + out * radius, normal: out };
        triangles.push([corner(from, u), corner(from, v), corner(to, v)]);
        triangles.push([corner(from, u), corner(to, v), corner(to, u)]);
        triangles.push(flat([from, from + v * radius, from + u * radius], -along));
    }
    triangles
}

/// A cone on a base about `base`, with its tip at `tip`.
fn cone(base: DVec3, tip: DVec3, radius: f64) -> Triangles {
    let Some(along) = (tip - base).try_normalize() else { return Vec::new() };
    let slope = radius / (tip - base).length();
    let ring = ring(along);
    let mut triangles = Vec::with_capacity(2 * SIDES);
    for k in 0..SIDES {
        let (u, v) = (ring[k], ring[(k + 1) % SIDES]);
        let normal = |out: DVec3| (out + along * slope).normalize();
        triangles.push([
            Corner { point: base + u * radius, normal: normal(u) },
            Corner { point: base + v * radius, normal: normal(v) },
            Corner { point: tip, normal: normal((u + v).normalize_or(u)) },
        ]);
        triangles.push(flat([base, base + v * radius, base + u * radius], -along));
    }
    triangles
}

/// An arrow round `axis`, by the right hand's rule, in a circle about `center`.
pub(crate) fn turning_arrow(center: DVec3, axis: DVec3, circle: f64, radius: f64) -> Triangles {
    let Some(axis) = axis.try_normalize() else { return Vec::new() };
    let u = axis.any_orthonormal_vector();
    let v = axis.cross(u);
    let at = |angle: f64| center + (u * angle.cos() + v * angle.sin()) * circle;
    let head = (HEAD_LENGTH * radius / circle).min(0.5 * TURN);
    let end = TURN - head;
    let mut triangles = Vec::new();
    for k in 0..TURN_PARTS {
        let angle = |k: usize| end * k as f64 / TURN_PARTS as f64;
        triangles.extend(rod(at(angle(k)), at(angle(k + 1)), radius));
    }
    // Along the tangent where the shaft ends, so that the head joins on.
    let tangent = v * end.cos() - u * end.sin();
    triangles.extend(cone(at(end), at(end) + tangent * HEAD_LENGTH * radius, HEAD_RADIUS * radius));
    triangles
}

/// Unit vectors round an axis.
fn ring(along: DVec3) -> [DVec3; SIDES] {
    let u = along.any_orthonormal_vector();
    let v = along.cross(u);
    std::array::from_fn(|k| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / SIDES as f64).sin_cos();
        u * cos + v * sin
    })
}

fn flat(points: [DVec3; 3], normal: DVec3) -> [Corner; 3] {
    points.map(|point| Corner { point, normal })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arrow_reaches_from_its_tail_to_its_tip_and_looks_outward() {
        let (tail, way) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 3.0, 4.0));
        let triangles = arrow(tail, way, 0.05);
        let along: Vec<f64> = triangles.iter().flatten().map(|c| (c.point - tail).dot(way) / 25.0).collect();
        assert!(along.iter().all(|part| (-1e-9..1.0 + 1e-9).contains(part)));
        assert!(along.iter().any(|part| *part < 1e-9) && along.iter().any(|part| *part > 1.0 - 1e-9));
        for [a, b, c] in triangles {
            let normal = (b.point - a.point).cross(c.point - a.point);
            assert!(normal.dot(a.normal + b.normal + c.normal) > 0.0);
        }
    }

    #[test]
    fn no_force_is_no_arrow() {
        assert!(arrow(DVec3::ONE, DVec3::ZERO, 0.1).is_empty());
        assert!(turning_arrow(DVec3::ONE, DVec3::ZERO, 1.0, 0.1).is_empty());
    }
}
