//! Do the scripted hands really touch what they say? Judged by samples of both surfaces: each vertex and face centre of
//! one body against every triangle of the other. That can miss an edge–edge contact, so it errs towards "apart", by less
//! than the size of a triangle.

use glam::DVec3;
use palpus::algebra::{Pose, closest_on_triangle};
use palpus::body::PolygonSoup;

use super::*;

struct Surface {
    triangles: Vec<[DVec3; 3]>,
    samples: Vec<DVec3>,
    low: DVec3,
    high: DVec3,
    longest_edge: f64,
}

impl Surface {
    fn new(soup: &PolygonSoup) -> Self {
        let triangles: Vec<_> = (0..soup.face_count())
            .map(|f| {
                let face = soup.face(f);
                [0, 1, 2].map(|k| soup.vertices[face[k] as usize])
            })
            .collect();
        let centers = triangles.iter().map(|t| (t[0] + t[1] + t[2]) / 3.0);
        let samples = soup.vertices.iter().copied().chain(centers).collect();
        let low = soup.vertices.iter().copied().reduce(DVec3::min).unwrap_or_default();
        let high = soup.vertices.iter().copied().reduce(DVec3::max).unwrap_or_default();
        let sides = triangles.iter().flat_map(|&[a, b, c]| [a.distance(b), b.distance(c), c.distance(a)]);
        let longest_edge = sides.fold(0.0, f64::max);
        Self { triangles, samples, low, high, longest_edge }
    }

    /// Distance to the surface, negative inside, or `limit` when the surface is farther than that, on either side: no
    /// path goes that deep without its neighbouring samples telling.
    fn signed_distance(&self, p: DVec3, limit: f64) -> f64 {
        if p.clamp(self.low, self.high).distance(p) > limit {
            return limit;
        }
        // A triangle whose corner is farther than this cannot come within the limit.
        let reach = limit + self.longest_edge;
        let near = self.triangles.iter().filter(|t| t[0].distance_squared(p) <= reach * reach);
        let squares = near.map(|&[a, b, c]| closest_on_triangle(p, a, b, c).distance_squared(p));
        let nearest = squares.fold(f64::INFINITY, f64::min).sqrt();
        if nearest > limit {
            return limit;
        }
        let mut winding = 0.0;
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|corner| corner - p);
            let [la, lb, lc] = [a.length(), b.length(), c.length()];
            winding += a.dot(b.cross(c)).atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
        }
        if winding > std::f64::consts::PI { -nearest } else { nearest }
    }
}

/// The smallest signed distance of the samples of either surface to the other one.
fn separation(a: &Surface, b: &Surface, pose: &Pose, limit: f64) -> f64 {
    let back = pose.inverse();
    let of_a = a.samples.iter().map(|&p| b.signed_distance(pose.point(p), limit));
    let of_b = b.samples.iter().map(|&p| a.signed_distance(back.point(p), limit));
    of_a.chain(of_b).fold(limit, f64::min)
}

/// Separations at even times along the scene's path.
fn profile(scene: &Scene, count: usize, both: bool) -> Vec<f64> {
    let (mut a, mut b) = (Surface::new(&scene.probe), Surface::new(&scene.environment));
    if !both {
        // The ball's vertices alone are fine enough beside the tube's wall.
        b.samples.clear();
        a.samples.truncate(scene.probe.vertices.len());
    }
    (0..=count)
        .map(|k| separation(&a, &b, &scene.path.pose(scene.path.duration() * k as f64 / count as f64), 0.0025))
        .collect()
}

fn assert_touches(name: &str, count: usize, both: bool, deepest: std::ops::Range<f64>, changes: usize) {
    let scene = scene(name).expect("a scene of that name");
    let profile = profile(&scene, count, both);
    let lowest = profile.iter().copied().fold(f64::INFINITY, f64::min);
    let swaps = profile.windows(2).filter(|pair| (pair[0] < 0.0) != (pair[1] < 0.0)).count();
    let shown: Vec<_> = profile.iter().map(|d| (d * 1e5).round() / 100.0).collect();
    assert!(deepest.contains(&-lowest), "{name}: deepest {:.3e} m, profile in mm {shown:?}", -lowest);
    assert!(swaps >= changes, "{name}: {swaps} changes between apart and overlapping, profile in mm {shown:?}");
    assert!(profile[0] > scene.contact.tolerance, "{name} starts in contact: {shown:?}");
}

#[test]
fn the_spoon_touches_the_cup_again_and_again() {
    assert_touches("spoon-cup", 130, true, 0.0005..0.003, 12);
}

#[test]
fn the_pen_crosses_the_sphere_once() {
    assert_touches("pen-sphere", 60, true, 0.001..0.002, 2);
}

#[test]
fn the_peg_goes_in() {
    assert_touches("peg-hole", 80, true, 0.0001..0.001, 4);
}

#[test]
fn the_rings_pull_on_each_other() {
    assert_touches("torus-torus", 24, true, 0.001..0.003, 4);
}

#[test]
fn the_ball_feels_the_lumen() {
    assert_touches("intestine", 36, false, 0.0005..0.0025, 8);
}

#[test]
fn the_box_stands_on_the_table() {
    assert_touches("box-table", 60, true, 0.0008..0.002, 2);
}

#[test]
fn the_ball_slides_in_the_groove() {
    assert_touches("v-groove", 60, true, 0.0005..0.002, 2);
}

#[test]
fn no_hand_moves_faster_or_more_suddenly_than_a_hand() {
    for entry in scenes() {
        let scene = entry.build();
        assert_eq!(scene.start, scene.path.pose(0.0));
        let mut previous = scene.path.twist(0.0);
        for k in 1..=(scene.path.duration() * 1000.0) as usize {
            let twist = scene.path.twist(k as f64 * 1e-3);
            let (speed, turn) = (twist.linear.length(), twist.angular.length());
            let jump = (twist.linear - previous.linear).length();
            assert!(speed < 0.25 && turn < 4.0, "{}: {speed} m/s, {turn} rad/s at {k} ms", scene.name);
            assert!(jump < 5e-3, "{}: {jump} m/s in 1 ms at {k} ms", scene.name);
            previous = twist;
        }
    }
}

#[test]
fn names_are_unique_and_found() {
    for entry in scenes() {
        assert_eq!(scenes().iter().filter(|other| other.name == entry.name).count(), 1);
        assert!(scene(entry.name).is_some_and(|scene| scene.summary == entry.summary));
    }
    assert!(scene("no such scene").is_none());
}
