//! Tests the friction of a tool that slides from facet to facet behind a coupling.

use std::sync::Arc;

use glam::DVec3;

use super::{DT, at, settings};
use crate::algebra::{NoClock, Twist};
use crate::body::{Body, BodySettings, Mesh, PolygonSoup};
use crate::render::{Object, ProbeState, World};

/// Radius of the trough, m.
const TROUGH: f64 = 0.02;
/// Radius of the ball, m.
const BALL: f64 = 0.005;

/// Returns a block with a trough along y. The trough's cross-section is an arc of 120° with
/// `facets` facets.
fn trough(facets: u32) -> Arc<Body> {
    let mut soup = PolygonSoup::new();
    let arc = (0..=facets).map(|k| {
        let angle = (f64::from(k) / f64::from(facets) - 0.5) * 120f64.to_radians();
        (TROUGH * angle.sin(), TROUGH * (1.0 - angle.cos()))
    });
    let mut section: Vec<_> = arc.collect();
    section.extend([(0.03, 0.01), (0.03, -0.01), (-0.03, -0.01), (-0.03, 0.01)]);
    let count = section.len() as u32;
    for y in [-0.05, 0.05] {
        soup.vertices.extend(section.iter().map(|&(x, z)| DVec3::new(x, y, z)));
    }
    let (front, back): (Vec<_>, Vec<_>) = ((0..count).rev().collect(), (count..2 * count).collect());
    soup.push_face(&front);
    soup.push_face(&back);
    for k in 0..count {
        let next = (k + 1) % count;
        soup.push_face(&[k, next, count + next, count + k]);
    }
    let (mesh, _) = Mesh::from_soup(&soup).unwrap();
    Arc::new(Body::build(mesh, &BodySettings::default(), &mut |_| ()).unwrap())
}

fn ball() -> Arc<Body> {
    let points: Vec<_> = (0..400)
        .map(|k| {
            let (z, turn) = (1.0 - (f64::from(k) + 0.5) / 200.0, f64::from(k) * 2.399_963);
            let r = (1.0 - z * z).sqrt();
            DVec3::new(r * turn.cos(), r * turn.sin(), z) * BALL
        })
        .collect();
    Arc::new(Body::from_convex(&points).unwrap())
}

/// Returns the largest change of force (N) from tick to tick. A ball is pressed into the trough and
/// slides across it, and with `along` (m/s) along it.
fn largest_step(facets: u32, along: f64) -> f64 {
    let mut world = World::new(settings()).unwrap();
    world.add(Object::fixed(trough(facets), at(0.0, 0.0, 0.0))).unwrap();
    let tool = world.add_tool(ball(), settings()).unwrap();
    let (mut last, mut largest) = (DVec3::ZERO, 0.0f64);
    for k in 0..1200 {
        let time = f64::from(k) * DT;
        let angle = (f64::from(k.max(200)) / 700.0 - 1.0) * 40f64.to_radians();
        let reach = TROUGH - BALL + (0.01 * time - 1e-3).min(1e-3);
        let place = at(reach * angle.sin(), along * time - 0.02, TROUGH - reach * angle.cos());
        world.step(&[ProbeState { pose_ba: place, twist: Twist::default() }], DT, &NoClock);
        let force = world.tick(tool).commanded.force;
        if k > 250 {
            largest = largest.max(force.distance(last));
        }
        last = force;
    }
    largest
}

/// The change is 112 to 120 mN if a contact has no friction in the step that first presses it.
#[test]
fn friction_continues_from_facet_to_facet() {
    for (facets, along) in [(6, 0.03), (12, 0.0), (12, 0.03)] {
        let step = largest_step(facets, along);
        assert!(step < 0.05, "{facets} facets, {along} m/s along them: {step} N");
    }
}
