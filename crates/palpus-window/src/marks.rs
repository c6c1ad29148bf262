//! What is drawn of a moment: dots, and arrows as small solids, always of the same thickness in the
//! picture.
//!
//! A size in pixels is that in a picture of [`NOMINAL_HEIGHT`]; whoever draws says how long it is
//! in metres at a point.

use glam::DVec3;

use crate::moment::ShownCluster;
use crate::picture::Rgb;
use crate::raster::Corner;
use crate::scene::Scene;
use crate::style::Style;

/// The height of a picture for which sizes in pixels are stated; others scale.
pub(crate) const NOMINAL_HEIGHT: f64 = 800.0;
/// Pixels.
const DOT_RADIUS: f64 = 5.5;
const GRIP_RADIUS: f64 = 3.3;
const ANCHOR_RADIUS: f64 = 2.0;
const ANCHOR_ROD_RADIUS: f64 = 1.0;
const SHAFT_RADIUS: f64 = 2.2;
const CLUSTER_SHAFT_RADIUS: f64 = 1.6;
const LONGEST_ARROW: f64 = 150.0;
const TURNING_CIRCLE: f64 = 42.0;
/// The smallest turning arrow, of the largest.
const LEAST_TURN: f64 = 0.35;
/// Less than this part of the largest torque is noise to the eye, which an arrow of a size of its
/// own would make much of.
const NO_TURN: f64 = 0.004;

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

/// A dot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dot {
    /// World.
    pub(crate) point: DVec3,
    /// Pixels.
    pub(crate) radius: f64,
    pub(crate) colour: Rgb,
}

/// Everything that is drawn of a moment.
#[derive(Debug, Default)]
pub(crate) struct Marks {
    pub(crate) dots: Vec<Dot>,
    /// World.
    pub(crate) solids: Vec<(Triangles, Rgb)>,
}

impl Marks {
    /// Of the scene's moment, if it has one. `metres` says how long so many pixels are at a point
    /// of the world.
    pub(crate) fn of(scene: &Scene, style: &Style, metres: &impl Fn(DVec3, f64) -> f64) -> Self {
        let mut marks = Self::default();
        let Some(moment) = &scene.moment else { return marks };
        let colours = style.theme.colours();
        let place = |p: DVec3| scene.moment_pose.point(p);
        let turn = |v: DVec3| scene.moment_pose.vector(v);
        if style.contacts {
            marks.dots.extend(moment.contacts.iter().map(|contact| Dot {
                point: place(contact.point),
                radius: DOT_RADIUS,
                colour: if contact.separation < 0.0 { colours.penetrating } else { colours.disjoint },
            }));
        }
        if style.anchors {
            for anchor in &moment.anchors {
                let colour = if anchor.sliding { colours.sliding } else { colours.anchor };
                let (point, held) = (place(anchor.anchor), place(anchor.held));
                marks.dots.push(Dot { point, radius: ANCHOR_RADIUS, colour });
                marks.solids.push((rod(point, held, metres(held, ANCHOR_ROD_RADIUS)), colour));
            }
        }
        let arrow_of = |tail: DVec3, force: DVec3, radius: f64| {
            let length = metres(tail, LONGEST_ARROW) / scene.force_scale.max(f64::MIN_POSITIVE);
            arrow(tail, force * length, metres(tail, radius))
        };
        if style.clusters {
            let colour = |separation: f64| match style.clusters_as_contacts {
                false => colours.cluster,
                true if separation < 0.0 => colours.penetrating,
                true => colours.disjoint,
            };
            let arrow = |c: &ShownCluster| arrow_of(place(c.point), turn(c.force), CLUSTER_SHAFT_RADIUS);
            marks.solids.extend(moment.clusters.iter().map(|c| (arrow(c), colour(c.separation))));
        }
        if style.wrench {
            let grip = place(moment.grip);
            marks.solids.push((arrow_of(grip, turn(moment.wrench.force), SHAFT_RADIUS), colours.force));
            let part = (moment.wrench.torque.length() / scene.torque_scale.max(f64::MIN_POSITIVE)).min(1.0);
            if part > NO_TURN {
                let circle = metres(grip, TURNING_CIRCLE * (LEAST_TURN + (1.0 - LEAST_TURN) * part));
                let axis = turn(moment.wrench.torque);
                let turning = turning_arrow(grip, axis, circle, metres(grip, CLUSTER_SHAFT_RADIUS));
                marks.solids.push((turning, colours.torque));
            }
            marks.dots.push(Dot { point: grip, radius: GRIP_RADIUS, colour: colours.force });
        }
        marks
    }
}

/// An arrow from `tail` along `way`, its shaft `radius` metres thick. Short ones are all head, and
/// smaller.
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

/// A ball of few faces, for dots where everything is a solid.
#[cfg(feature = "gui")]
pub(crate) fn ball(center: DVec3, radius: f64) -> Triangles {
    let out = |ring: usize, k: usize| {
        let (height, around) = (
            std::f64::consts::PI * ring as f64 / BALL_RINGS as f64,
            std::f64::consts::TAU * k as f64 / BALL_SIDES as f64,
        );
        DVec3::new(height.sin() * around.cos(), height.sin() * around.sin(), height.cos())
    };
    let corner = |out: DVec3| Corner { point: center + out * radius, normal: out };
    let mut triangles = Vec::with_capacity(2 * BALL_RINGS * BALL_SIDES);
    for ring in 0..BALL_RINGS {
        for k in 0..BALL_SIDES {
            let [a, b, c, d] = [(ring, k), (ring + 1, k), (ring + 1, k + 1), (ring, k + 1)].map(|(r, k)| out(r, k));
            if ring + 1 < BALL_RINGS {
                triangles.push([corner(a), corner(b), corner(c)]);
            }
            if ring > 0 {
                triangles.push([corner(a), corner(c), corner(d)]);
            }
        }
    }
    triangles
}

/// Of a ball.
#[cfg(feature = "gui")]
const BALL_RINGS: usize = 5;
#[cfg(feature = "gui")]
const BALL_SIDES: usize = 9;

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
