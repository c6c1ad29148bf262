//! Two sweeps over a closed body. The sweeps measure the depth to which contact persists, and the
//! errors of depth and direction.
//!
//! * *Pop-through*: a small probe is pushed in at random points of the surface, along the inward
//!   normal, to 45 % of the way to the opposite wall. Contact must persist, and its depth must not
//!   decrease while the true depth increases.
//! * *Depth errors*: a small probe is placed at random points inside the body. Depth and direction
//!   of the deepest contact are compared with the nearest point of the surface.
//!
//! Both sweeps use the pair query of the servo path and take its deepest contact, like eq. 5 of
//! \[K02\]. The probe is an octahedron with a random rotation, much smaller than the body. Its
//! extent along the normal is subtracted from the depth.

mod figures;
mod probes;

use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::{Pose, Random};
use palpus::body::Body;
use palpus::detect::Contact;

pub use figures::{CORRECT_RATIO, DepthErrors, HELD_BINS, PopThrough, RATIO_ENDS};
use probes::Probes;

/// Fraction of the way to the opposite wall to which probes are pushed.
pub const PUSHED_SHARE: f64 = 0.45;
/// Number of steps of a push.
const STEPS: u32 = 30;
/// Radius of the probe, relative to the thickness or distance that it measures.
const PROBE_SHARE: f64 = 0.01;
/// Allowed decrease of the depth from step to step, relative to the thickness.
const FALL: f64 = 0.01;
/// The point at which the probe entered counts as the nearest surface point if the true depth is at
/// least this fraction of the depth along the push.
const OWN: f64 = 0.98;
/// Parts thinner than this are not tested, and points nearer to the surface are not measured. The
/// value is relative to the body's size.
const THINNEST: f64 = 1e-4;

/// One push.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Point on the surface where the push began.
    pub point: DVec3,
    /// Distance from that point along the inward normal to the next wall, m.
    pub thickness: f64,
    /// Fraction of the thickness up to which contact persisted; [`PUSHED_SHARE`] if contact was
    /// never lost.
    pub held: f64,
    /// Fraction of the thickness up to which the entered surface was the nearest surface, at most
    /// [`PUSHED_SHARE`].
    pub own: f64,
    /// Fraction of the thickness, up to [`Self::own`], at which the depth first decreased or became
    /// less than three quarters of the true depth.
    pub grew: f64,
}

/// One point inside the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// The point, in the body's frame.
    pub point: DVec3,
    /// Distance from the nearest surface, m.
    pub distance: f64,
    /// Depth of the deepest contact, m; 0 without contact.
    pub depth: f64,
    /// Angle between the contact's normal and the direction to the nearest surface, rad; π without
    /// contact.
    pub turn: f64,
}

impl Judged {
    /// Returns the relative error of the depth; 1 without contact.
    pub fn error(&self) -> f64 {
        (self.depth / self.distance - 1.0).abs()
    }
}

/// Pushes a small probe into a closed body at `samples` points of its surface.
///
/// A point is replaced by another point if its inward normal meets no opposite wall, or if the wall
/// is too near to measure. If nearly all points are replaced, the result has fewer pushes than
/// requested.
pub fn pop_through(body: &Arc<Body>, samples: usize, seed: u64) -> Vec<Push> {
    let mut random = Random::new(seed);
    let mut probes = Probes::new(body, &mut random);
    let mut pushes = Vec::with_capacity(samples);
    let areas = running_areas(body);
    for _ in 0..4 * samples {
        if pushes.len() == samples {
            break;
        }
        let (triangle, point) = surface_point(body, &areas, &mut random);
        let inward = -body.mesh().triangle_normal(triangle);
        let thickness = opposite_wall(body, triangle, point, inward);
        if thickness.is_finite() && thickness > THINNEST * body.size() {
            pushes.push(push(body, &mut probes, point, inward, thickness));
        }
    }
    pushes
}

fn push(body: &Arc<Body>, probes: &mut Probes, point: DVec3, inward: DVec3, thickness: f64) -> Push {
    let mut push = Push { point, thickness, held: PUSHED_SHARE, own: PUSHED_SHARE, grew: PUSHED_SHARE };
    let probe = probes.of_size(body, PROBE_SHARE * thickness);
    probe.query.clear();
    let (mut lost, mut left, mut fell) = (false, false, false);
    let mut deepest: f64 = 0.0;
    for step in 1..=STEPS {
        let before = PUSHED_SHARE * f64::from(step - 1) / f64::from(STEPS);
        let gone = thickness * PUSHED_SHARE * f64::from(step) / f64::from(STEPS);
        let place = Pose { translation: point + inward * gone, ..Pose::IDENTITY };
        let depth = probe.deepest(&place).map_or(0.0, |contact| probe.depth_at_centre(&contact));
        if depth <= 0.0 && !lost {
            (lost, push.held) = (true, before);
        }
        let true_depth = body.tree().nearest(place.translation).map_or(0.0, |near| near.distance);
        if true_depth < OWN * gone && !left {
            (left, push.own) = (true, before);
        }
        if !left && !fell && (depth < deepest - FALL * thickness || depth < 0.75 * true_depth) {
            (fell, push.grew) = (true, before);
        }
        deepest = deepest.max(depth);
    }
    push.grew = push.grew.min(push.own);
    push
}

/// Places a small probe at `samples` points inside a closed body.
pub fn depth_errors(body: &Arc<Body>, samples: usize, seed: u64) -> Vec<Judged> {
    let mut random = Random::new(seed);
    let mut probes = Probes::new(body, &mut random);
    let mut judged = Vec::with_capacity(samples);
    let bounds = body.mesh().bounds();
    let mut tries = 0;
    while judged.len() < samples && tries < 1000 * samples {
        tries += 1;
        let point = bounds.min + 0.5 * (random.vector() + 1.0) * (bounds.max - bounds.min);
        if !body.tree().inside(point) {
            continue;
        }
        let Some(near) = body.tree().nearest(point).filter(|near| near.distance > THINNEST * body.size()) else {
            continue;
        };
        let probe = probes.of_size(body, PROBE_SHARE * near.distance);
        probe.query.clear();
        let contact = probe.deepest(&Pose { translation: point, ..Pose::IDENTITY });
        let out = (near.point - point) / near.distance;
        judged.push(Judged {
            point,
            distance: near.distance,
            depth: contact.map_or(0.0, |contact| probe.depth_at_centre(&contact)),
            turn: contact.map_or(std::f64::consts::PI, |contact| contact.normal.angle_between(out)),
        });
    }
    judged
}

/// Returns for each triangle the sum of all areas up to and including it.
fn running_areas(body: &Body) -> Vec<f64> {
    let mut sum = 0.0;
    let area = |t| {
        sum += body.mesh().triangle_area(t);
        sum
    };
    (0..body.mesh().triangles().len() as u32).map(area).collect()
}

/// Returns a random point of the surface, uniformly by area, and its triangle.
fn surface_point(body: &Body, areas: &[f64], random: &mut Random) -> (u32, DVec3) {
    let wanted = random.unit() * areas[areas.len() - 1];
    let triangle = areas.partition_point(|&sum| sum <= wanted).min(areas.len() - 1) as u32;
    let [a, b, c] = body.mesh().triangle_points(triangle);
    let (mut u, mut v) = (random.unit(), random.unit());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    (triangle, a + (b - a) * u + (c - a) * v)
}

/// Returns the distance from a point of a triangle along the inward normal to the next wall.
fn opposite_wall(body: &Body, triangle: u32, point: DVec3, inward: DVec3) -> f64 {
    let mut wall = f64::INFINITY;
    let _ = body.tree().visit_ray(point, inward, f64::INFINITY, |hit| {
        if hit.triangle != triangle && hit.t < wall {
            wall = hit.t;
        }
        std::ops::ControlFlow::Continue(wall)
    });
    wall
}

/// Returns the deepest of `contacts`. `None` if the bodies do not overlap.
fn deepest(contacts: &[Contact]) -> Option<Contact> {
    let overlapping = contacts.iter().filter(|contact| contact.separation < 0.0);
    overlapping.min_by(|x, y| x.separation.total_cmp(&y.separation)).copied()
}
