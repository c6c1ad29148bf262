//! True contacts of scenes with several contacts or curved surfaces. The contacts come from
//! formulas of the surfaces that the meshes approximate, or from an exhaustive search over the
//! features of the meshes (`Features`).
//!
//! * `rails`: the contacts of the knife's edge with the two ridges.
//! * `torus-torus`: the local minima of the distance between two circles, minus the radii of the
//!   two tubes.
//! * `intestine`: the local minima of the distance between a ball and the lumen, whose radius is a
//!   formula along the centre line.
//! * `spoon-cup`, `peg-hole`, `nut-bolt`: all pairs of features of the two meshes.
//!
//! Contacts that push in the same direction share one stiffness: see [`push`].

use std::f64::consts::TAU;

use glam::DVec3;
use palpus::algebra::{Pose, Wrench};

use crate::Scene;
use crate::catalogue::gut;
use crate::features::Features;
use crate::shape::{
    CUP_WALL, CenterLine, GUT_WALL, KNIFE_DEPTH, PEG_RADIUS, THREAD_PITCH, TORUS_MAJOR_RADIUS, TORUS_MINOR_RADIUS,
    rails_half_gap,
};
use crate::truth::TrueContact;

/// Number of samples along a circle or a centre line, which bracket the local minima.
const SAMPLES: usize = 1440;
/// Number of halvings of a bracket. The last bracket is 1e-12 of the line.
const HALVINGS: usize = 30;

/// The true contacts of one scene.
#[derive(Debug)]
pub struct Refined(Law);

#[derive(Debug)]
enum Law {
    Rails,
    Rings,
    Gut,
    Features(Box<Features>),
}

impl Refined {
    /// Returns the contacts of `scene`, if they are known.
    pub fn of(scene: &Scene) -> Option<Self> {
        // `wall` is the thickness of the thinnest wall that contacts enter, m.
        let features =
            |wall: f64| Features::new(&scene.probe, &scene.environment, wall).map(Box::new).map(Law::Features);
        let law = match scene.name {
            "rails" => Law::Rails,
            "torus-torus" => Law::Rings,
            "intestine" => Law::Gut,
            "spoon-cup" => features(CUP_WALL)?,
            "peg-hole" => features(PEG_RADIUS)?,
            // Half way up, thread and groove are equally wide.
            "nut-bolt" => features(0.5 * THREAD_PITCH)?,
            _ => return None,
        };
        Some(Self(law))
    }

    /// Returns the contacts with a separation below `reach` (m) for the probe at `pose`. `None` in
    /// two cases: a contact is deeper than half a wall, so the nearest surface may be on the other
    /// side; or the pairs of features do not explain the overlap.
    pub fn contacts(&self, pose: &Pose, reach: f64) -> Option<Vec<TrueContact>> {
        let mut found = match &self.0 {
            Law::Rails => knife_on_ridges(pose),
            Law::Rings => ring_in_ring(pose),
            Law::Gut => ball_in_gut(pose.translation)?,
            Law::Features(features) => features.contacts(pose, reach)?,
        };
        found.retain(|contact| contact.separation < reach);
        Some(found)
    }
}

impl Refined {
    /// Returns every contact that the probe at `pose` may get after a motion of less than `reach`
    /// (m). A tool on springs rests on these contacts. The probe must not overlap the environment
    /// by more than `reach`.
    pub fn supports(&self, pose: &Pose, reach: f64) -> Vec<TrueContact> {
        let mut found = match &self.0 {
            Law::Rails => knife_on_ridges(pose),
            Law::Rings => ring_in_ring(pose),
            Law::Gut => ball_at_wall(pose.translation),
            Law::Features(features) => features.supports(pose, reach),
        };
        found.retain(|contact| contact.separation < reach);
        found
    }
}

fn knife_on_ridges(pose: &Pose) -> Vec<TrueContact> {
    let edge = pose.point(DVec3::NEG_Z * KNIFE_DEPTH);
    let on_ridge = |side: f64| TrueContact {
        point: Some(DVec3::new(side * rails_half_gap(edge.y), edge.y, 0.0)),
        normal: DVec3::Z,
        separation: edge.z,
    };
    vec![on_ridge(-1.0), on_ridge(1.0)]
}

/// Returns the point of a circle that is nearest to `p`. The circle lies about `center` in the
/// plane of the vectors u and v (unit and perpendicular).
fn nearest_on_circle(p: DVec3, center: DVec3, [u, v]: [DVec3; 2], radius: f64) -> DVec3 {
    let (x, y) = ((p - center).dot(u), (p - center).dot(v));
    let length = x.hypot(y);
    let (x, y) = if length > 0.0 { (x / length, y / length) } else { (1.0, 0.0) };
    center + (u * x + v * y) * radius
}

fn ring_in_ring(pose: &Pose) -> Vec<TrueContact> {
    let axes = [pose.vector(DVec3::X), pose.vector(DVec3::Y)];
    let pair = |s: f64| {
        let (sin, cos) = (TAU * s).sin_cos();
        let own = pose.translation + (axes[0] * cos + axes[1] * sin) * TORUS_MAJOR_RADIUS;
        (own, nearest_on_circle(own, DVec3::ZERO, [DVec3::X, DVec3::Y], TORUS_MAJOR_RADIUS))
    };
    let places = minima(|s| pair(s).0.distance(pair(s).1), true);
    let contact = |s: f64| {
        let (own, other) = pair(s);
        let normal = (own - other).normalize_or(DVec3::Z);
        let separation = own.distance(other) - 2.0 * TORUS_MINOR_RADIUS;
        TrueContact { point: Some(other + normal * TORUS_MINOR_RADIUS), normal, separation }
    };
    places.into_iter().map(contact).collect()
}

fn ball_in_gut(center: DVec3) -> Option<Vec<TrueContact>> {
    let found = ball_at_wall(center);
    found.iter().all(|contact| contact.separation >= -0.5 * GUT_WALL).then_some(found)
}

fn ball_at_wall(center: DVec3) -> Vec<TrueContact> {
    let line = CenterLine;
    let wall = |u: f64| {
        let (level, steep) = line.across(u);
        nearest_on_circle(center, line.point(u), [level, steep], line.lumen_radius(u))
    };
    let contact = |u: f64| {
        let point = wall(u);
        let normal = (center - point).normalize_or(DVec3::Z);
        TrueContact { point: Some(point), normal, separation: center.distance(point) - gut::BALL }
    };
    minima(|u| center.distance(wall(u)), false).into_iter().map(contact).collect()
}

/// Returns the places in \[0, 1\] of the local minima of `at`. If `round`, the curve is closed.
fn minima(at: impl Fn(f64) -> f64, round: bool) -> Vec<f64> {
    let place = |k: usize| k as f64 / SAMPLES as f64;
    let values: Vec<f64> = (0..=SAMPLES).map(|k| at(place(k))).collect();
    let is_lowest = |k: usize| {
        let before = if k > 0 { values[k - 1] } else { values[SAMPLES - 1] };
        let after = if k < SAMPLES { values[k + 1] } else { values[1] };
        values[k] < before && values[k] <= after
    };
    let inner = if round { 0..SAMPLES } else { 1..SAMPLES };
    inner.filter(|&k| is_lowest(k)).map(|k| lowest(&at, place(k) - place(1), place(k) + place(1))).collect()
}

/// Returns the place of the minimum of `at` between `low` and `high`, by bisection of the slope.
fn lowest(at: &impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let width = 1e-4 * (high - low);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if at(middle + width) > at(middle - width) { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// Returns the force and torque about `grip` of contacts with unit stiffness. Contacts push below
/// the separation `contact_offset` (m).
///
/// A contact with the engagement w = `contact_offset` − separation pushes with w · max κw′ / Σ κw′.
/// The maximum and the sum run over all contacts. κ is the square of the cosine between the
/// directions, and 0 beyond 90°. So contacts with one direction have together the force of the
/// deepest contact, and contacts at 90° do not affect each other. The torque is `None` if a
/// contact's point is unknown.
pub fn push(contacts: &[TrueContact], contact_offset: f64, grip: DVec3) -> (DVec3, Option<DVec3>) {
    let engaged = |contact: &TrueContact| (contact_offset - contact.separation).max(0.0);
    let mut sum = Wrench::ZERO;
    let mut is_known = true;
    for contact in contacts.iter().filter(|contact| engaged(contact) > 0.0) {
        let (mut most, mut total) = (0.0_f64, 0.0);
        for other in contacts {
            let along = contact.normal.dot(other.normal).max(0.0);
            let load = along * along * engaged(other);
            most = most.max(load);
            total += load;
        }
        let force = contact.normal * (engaged(contact) * most / total);
        sum.force += force;
        match contact.point {
            Some(point) => sum.torque += (point - grip).cross(force),
            None => is_known = false,
        }
    }
    (sum.force, is_known.then_some(sum.torque))
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::scene;

    fn refined(name: &str) -> (Refined, Scene) {
        let scene = scene(name).expect("a built-in scene");
        (Refined::of(&scene).expect("a scene with known contacts"), scene)
    }

    #[test]
    fn ridges_share_one_stiffness() {
        let (rails, _) = refined("rails");
        let pose = Pose::from_translation(DVec3::new(0.0, -0.01, KNIFE_DEPTH - 3e-4));
        let contacts = rails.contacts(&pose, 1e-3).expect("not deep");
        let (force, torque) = push(&contacts, 0.0, pose.translation);
        assert!((force - DVec3::Z * 3e-4).length() < 1e-15 && torque.expect("known").length() < 1e-15, "{contacts:?}");
    }

    #[test]
    fn rings_across_each_other_touch_at_the_inner_equator() {
        let (rings, _) = refined("torus-torus");
        let x = 2.0 * TORUS_MAJOR_RADIUS - 2.0 * TORUS_MINOR_RADIUS + 1e-3;
        let pose = Pose::new(DQuat::from_rotation_x(0.25 * TAU), DVec3::X * x);
        let contacts = rings.contacts(&pose, 0.0).expect("not deep");
        let [contact] = contacts[..] else { panic!("{contacts:?}") };
        assert!(
            (contact.separation + 1e-3).abs() < 1e-9 && contact.normal.dot(DVec3::NEG_X) > 1.0 - 1e-9,
            "{contact:?}"
        );
    }

    #[test]
    fn ball_in_a_straight_row_has_the_intended_depth() {
        let (gut, scene) = refined("intestine");
        // The radius is largest in the middle of a haustrum, which is a bulge between two narrow
        // places.
        let line = CenterLine;
        let u = 1.5 * 0.033 / line.length();
        let (level, _) = line.across(u);
        let center = line.point(u) + level * (line.lumen_radius(u) - gut::BALL + 5e-4);
        let contacts = gut.contacts(&Pose::from_translation(center), 0.0).expect("not deep");
        let [contact] = contacts[..] else { panic!("{contacts:?}") };
        assert!((contact.separation + 5e-4).abs() < 2e-5 && contact.normal.dot(-level) > 0.999, "{contact:?}");
        assert!(scene.contact.stiffness > 0.0);
    }
}
