//! The marks of a moment: dots, and arrows as small solids, whose thickness in the picture is
//! always the same.
//!
//! Sizes are in pixels of a picture of [`NOMINAL_HEIGHT`]. The renderer supplies the length in
//! metres of a pixel at a point.

use glam::DVec3;

use crate::moment::ShownCluster;
use crate::picture::Rgb;
use crate::raster::Corner;
use crate::scene::Scene;
use crate::style::{Colours, Style};

/// Height of the picture for which sizes in pixels are stated. Other pictures scale the sizes.
pub(crate) const NOMINAL_HEIGHT: f64 = 800.0;
/// Radii of dots and lines, pixels.
const DOT_RADIUS: f64 = 5.5;
const GRIP_RADIUS: f64 = 3.3;
const HAND_ROD_RADIUS: f64 = 1.0;
const ANCHOR_RADIUS: f64 = 2.0;
const ANCHOR_ROD_RADIUS: f64 = 1.0;
const SHAFT_RADIUS: f64 = 2.2;
const CLUSTER_SHAFT_RADIUS: f64 = 1.6;
/// Length of an arrow of the largest shown force; larger forces do not have longer arrows.
const LONGEST_ARROW: f64 = 150.0;
/// Radius of the turning arrow of the largest shown torque, pixels.
const TURNING_CIRCLE: f64 = 42.0;
/// The smallest turning arrow, relative to the largest.
const LEAST_TURN: f64 = 0.35;
/// Torques below this share of the largest torque are noise and have no arrow.
const NO_TURN: f64 = 0.004;

/// Radius of a patch for a force of zero and for the largest force.
const PATCH_RADII: (f64, f64) = (9.0, 17.0);
/// Radius of a patch's halo.
const HALO_RADIUS: f64 = 34.0;
/// Opacity of a patch.
const PATCH_COVER: f64 = 0.75;
/// Opacity of a patch's halo.
const HALO_COVER: f64 = 0.16;

/// Number of sides of round solids.
const SIDES: usize = 14;
/// Length of the head of an arrow, in radii of the shaft.
const HEAD_LENGTH: f64 = 6.0;
/// Radius of the head of an arrow, in radii of the shaft.
const HEAD_RADIUS: f64 = 2.6;
/// Angle of a turning arrow, rad.
const TURN: f64 = 1.5 * std::f64::consts::PI;
/// Number of straight parts of a turning arrow.
const TURN_PARTS: usize = 30;

/// Triangles, world.
pub(crate) type Triangles = Vec<[Corner; 3]>;

/// A dot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dot {
    /// Position, world.
    pub(crate) point: DVec3,
    /// Radius, pixels.
    pub(crate) radius: f64,
    pub(crate) colour: Rgb,
}

/// Pressure between bodies: a soft disc on the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    /// Position, world.
    pub(crate) point: DVec3,
    /// Unit normal of the surface, world.
    pub(crate) normal: DVec3,
    /// Radius, pixels.
    pub(crate) radius: f64,
    pub(crate) colour: Rgb,
    /// Opacity in the middle, 0 to 1.
    pub(crate) cover: f64,
}

impl Patch {
    /// Returns the opacity at this distance from the middle, in radii.
    pub(crate) fn cover_at(&self, radii: f64) -> f64 {
        let inside = (1.0 - radii * radii).max(0.0);
        self.cover * inside * inside
    }

    /// Returns the patch as triangles, with the opacity of each corner, for a disc of `radius`
    /// metres.
    #[cfg(feature = "gui")]
    pub(crate) fn triangles(&self, radius: f64) -> Vec<[(DVec3, f64); 3]> {
        let ring = ring(self.normal);
        let mut triangles = Vec::new();
        for step in PATCH_RINGS.windows(2) {
            let at = |radii: f64, k: usize| (self.point + ring[k % SIDES] * (radius * radii), self.cover_at(radii));
            for k in 0..SIDES {
                let [a, b] = [at(step[0], k), at(step[0], k + 1)];
                let [c, d] = [at(step[1], k), at(step[1], k + 1)];
                triangles.extend([[a, c, d], [a, d, b]]);
            }
        }
        triangles
    }
}

/// Distances from the middle at which a patch has corners, in radii.
#[cfg(feature = "gui")]
const PATCH_RINGS: [f64; 4] = [0.0, 0.3, 0.6, 1.0];

/// A value next to a mark.
#[derive(Clone, Debug)]
pub(crate) struct Label {
    /// Position, world.
    pub(crate) point: DVec3,
    /// Position of the grip, world. The window writes the label beyond its position from there.
    #[cfg_attr(not(feature = "gui"), expect(dead_code, reason = "pictures write labels at the right"))]
    pub(crate) from: DVec3,
    pub(crate) words: String,
    pub(crate) colour: Rgb,
}

/// All marks of a moment.
#[derive(Debug, Default)]
pub(crate) struct Marks {
    pub(crate) patches: Vec<Patch>,
    pub(crate) labels: Vec<Label>,
    pub(crate) dots: Vec<Dot>,
    /// Triangles of each solid, and its colour.
    pub(crate) solids: Vec<(Triangles, Rgb)>,
}

impl Marks {
    /// Makes the marks of the scene's moment, if the scene has a moment. `metres` returns the
    /// length of this many pixels at a point of the world. `visible` returns the part of an arrow
    /// (its tail and its way, world) that is in the picture, 0 to 1; arrows are shortened to it.
    pub(crate) fn of(
        scene: &Scene,
        style: &Style,
        metres: &impl Fn(DVec3, f64) -> f64,
        visible: &impl Fn(DVec3, DVec3) -> f64,
    ) -> Self {
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
        if style.contacts {
            marks.press(moment.clusters.iter().map(|c| (place(c.point), turn(c.force))), &colours);
        }
        // Clusters that press against each other can have many times the force on the hand.
        let way_of = |tail: DVec3, force: DVec3| {
            let longest = metres(tail, LONGEST_ARROW);
            let way = (force * (longest / scene.force_scale.max(f64::MIN_POSITIVE))).clamp_length_max(longest);
            way * visible(tail, way)
        };
        let arrow_of = |tail: DVec3, force: DVec3, radius: f64| arrow(tail, way_of(tail, force), metres(tail, radius));
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
            let (force, torque) = (moment.wrench.force.length(), moment.wrench.torque.length());
            marks.solids.push((arrow_of(grip, turn(moment.wrench.force), SHAFT_RADIUS), colours.force));
            if force > NO_TURN * scene.force_scale {
                let point = grip + way_of(grip, turn(moment.wrench.force));
                marks.labels.push(Label { point, from: grip, words: format!("{force:.2} N"), colour: colours.force });
            }
            let part = (moment.wrench.torque.length() / scene.torque_scale.max(f64::MIN_POSITIVE)).min(1.0);
            if part > NO_TURN {
                let circle = metres(grip, TURNING_CIRCLE * (LEAST_TURN + (1.0 - LEAST_TURN) * part));
                let axis = turn(moment.wrench.torque);
                let turning = turning_arrow(grip, axis, circle, metres(grip, CLUSTER_SHAFT_RADIUS));
                marks.solids.push((turning, colours.torque));
                let point = grip - turn(moment.wrench.force).normalize_or(DVec3::Z) * circle;
                let words = format!("{:.1} mN·m", torque * 1e3);
                marks.labels.push(Label { point, from: grip, words, colour: colours.torque });
            }
            marks.dots.push(Dot { point: grip, radius: GRIP_RADIUS, colour: colours.force });
            if scene.is_grip_apart() {
                let hand = place(moment.hand);
                marks.dots.push(Dot { point: hand, radius: GRIP_RADIUS, colour: colours.grip });
                marks.solids.push((rod(hand, grip, metres(grip, HAND_ROD_RADIUS)), colours.grip));
            }
        }
        marks
    }

    /// Adds patches at contact forces. A larger force has a redder and larger patch. Each patch has
    /// a halo, so that a light touch is visible too.
    fn press(&mut self, forces: impl Iterator<Item = (DVec3, DVec3)> + Clone, colours: &Colours) {
        let largest = forces.clone().map(|(_, force)| force.length()).fold(0.0, f64::max);
        for (point, force) in forces {
            let Some(normal) = force.try_normalize() else { continue };
            let part = (force.length() / largest).clamp(0.0, 1.0);
            let mix =
                |k: usize| (f64::from(colours.light[k]) * (1.0 - part) + f64::from(colours.heavy[k]) * part) as u8;
            let colour = [mix(0), mix(1), mix(2)];
            let halo = Patch { point, normal, radius: HALO_RADIUS, colour, cover: HALO_COVER };
            let radius = PATCH_RADII.0 + (PATCH_RADII.1 - PATCH_RADII.0) * part;
            self.patches.extend([halo, Patch { radius, cover: PATCH_COVER, ..halo }]);
        }
    }
}

/// Returns an arrow from `tail` along `way`, with a shaft of `radius` metres. A short arrow
/// consists only of its head, which is smaller.
pub(crate) fn arrow(tail: DVec3, way: DVec3, radius: f64) -> Triangles {
    let Some(along) = way.try_normalize() else { return Vec::new() };
    let length = way.length();
    let radius = radius.min(length / (HEAD_LENGTH + 1.0));
    let neck = tail + along * (length - HEAD_LENGTH * radius);
    let mut triangles = rod(tail, neck, radius);
    triangles.extend(cone(neck, tail + way, HEAD_RADIUS * radius));
    triangles
}

/// Returns a rod between two points.
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

/// Returns a cone on a base about `base`, with its tip at `tip`.
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

/// Returns an arrow round `axis` by the right-hand rule, on a circle around `center`.
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
    // The direction is tangential at the end of the shaft, so that the head continues the shaft.
    let tangent = v * end.cos() - u * end.sin();
    triangles.extend(cone(at(end), at(end) + tangent * HEAD_LENGTH * radius, HEAD_RADIUS * radius));
    triangles
}

/// Returns a ball with few faces, for dots in renderers that draw only solids.
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

/// Number of rings of triangles in a ball.
#[cfg(feature = "gui")]
const BALL_RINGS: usize = 5;
/// Number of pairs of triangles in a ring of a ball.
#[cfg(feature = "gui")]
const BALL_SIDES: usize = 9;

/// Returns unit vectors around an axis.
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
    fn arrow_reaches_from_tail_to_tip_and_faces_outward() {
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
    fn patches_show_pressure_and_labels_are_at_tips() {
        use crate::moment::Moment;
        use palpus::algebra::Wrench;
        let mut moment = Moment::new(4);
        let cluster = |x: f64, force: f64| ShownCluster {
            point: DVec3::new(x, 0.0, 0.0),
            force: DVec3::Z * force,
            separation: 0.0,
        };
        moment.clusters.extend([cluster(0.0, 2.0), cluster(1.0, 0.2), cluster(2.0, 0.0)]);
        moment.wrench = Wrench { force: DVec3::Z * 2.2, torque: DVec3::X * 0.5 };
        let scene = Scene { moment: Some(moment), force_scale: 4.4, ..Scene::default() };
        let marks = Marks::of(&scene, &Style::default(), &|_, pixels| pixels, &|_, _| 1.0);
        assert_eq!(marks.patches.len(), 4, "there must be no patch without a force");
        let (heavy, light) = (marks.patches[1], marks.patches[3]);
        assert!(heavy.radius > light.radius && heavy.colour[1] < light.colour[1] && heavy.normal == DVec3::Z);
        assert!(heavy.cover_at(0.0) > 0.5 && heavy.cover_at(1.0) == 0.0);
        assert_eq!(marks.labels[0].words, "2.20 N");
        assert!(
            (marks.labels[0].point - DVec3::Z * 75.0).length() < 1e-9,
            "the label must be at the tip, at half the longest length"
        );
        assert_eq!(marks.labels[1].words, "500.0 mN·m");
    }

    #[test]
    fn zero_force_has_no_arrow() {
        assert!(arrow(DVec3::ONE, DVec3::ZERO, 0.1).is_empty());
        assert!(turning_arrow(DVec3::ONE, DVec3::ZERO, 1.0, 0.1).is_empty());
    }
}
