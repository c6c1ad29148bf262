//! Distances between bodies of very different size, compared with all pairs of triangles.
//!
//! The bodies are turned, so their coordinates are not round. Three properties of their surfaces
//! make the pieces differ from the mesh. Vertices lie off their plane by 1e-9 to 1e-7 of the size.
//! Coordinates are rounded to a decimal grid. Facets are coplanar except for a tiny bend.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Random};
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus::detect::{Contact, ContactQuery, QuerySettings};

const SEED: u64 = 0x5AFE_D157;

/// Relative to the size of the smaller body: the largest error of a distance.
const BOUND: f64 = 1e-9;

/// Number of pairs of bodies, and number of poses of each pair.
const PAIRS: usize = 18;
const POSES: usize = 12;

#[test]
fn distance_is_exact_for_the_smaller_body() {
    let mut random = Random::new(SEED);
    let mut worst = Worst::default();
    for pair in 0..PAIRS {
        let (large, name_large) = soup(&mut random, pair, 10.0);
        let ratio = 3.0 * (100.0_f64 / 3.0).powf(random.unit());
        let (small, name_small) = soup(&mut random, pair / KINDS + pair, 10.0 / ratio);
        let mut query = ContactQuery::new(body(&small), body(&large), QuerySettings::default());
        for pose in 0..POSES {
            let place = near(&mut random, &query, pose, 10.0 / ratio);
            let what =
                format!("seed {SEED:#x}, {name_small} at {name_large}, pair {pair}, pose {pose}, ratio {ratio:.1}");
            worst.hold(&mut query, &place, &what);
        }
    }
    assert!(worst.apart > PAIRS * POSES / 2, "only {} poses are apart", worst.apart);
    assert!(worst.error <= BOUND, "{:e} of the smaller body: {}", worst.error, worst.what);
}

/// The largest error so far.
#[derive(Default)]
struct Worst {
    error: f64,
    what: String,
    apart: usize,
}

impl Worst {
    /// Compares the distance, its points and its normal with the triangles, unless the bodies
    /// overlap.
    fn hold(&mut self, query: &mut ContactQuery, place: &Pose, what: &str) {
        query.clear();
        let found = query.nearest(place).expect("every body has pieces");
        let size = query.a().size().min(query.b().size());
        let a: Vec<_> = triangles(query.a()).map(|t| t.map(|p| place.point(p))).collect();
        let b: Vec<_> = triangles(query.b()).collect();
        if found.separation <= 0.0 {
            return;
        }
        let Some(exact) = distance(&a, &b, found.separation + size) else { return };
        self.apart += 1;
        let Contact { point_a, point_b, normal, separation, .. } = found;
        let off = |point: DVec3, mesh: &[[DVec3; 3]]| {
            mesh.iter().map(|t| point.distance(on_triangle(point, t))).fold(f64::INFINITY, f64::min)
        };
        let errors = [
            ("distance", separation - exact),
            ("point of a", off(point_a, &a)),
            ("point of b", off(point_b, &b)),
            ("points and normal", (point_a - point_b - normal * separation).length()),
        ];
        for (name, error) in errors {
            let error = error.abs() / size;
            if error > self.error {
                self.error = error;
                self.what = format!("{name}, {what}, distance {exact:e}");
            }
        }
    }
}

/// Number of kinds of bodies.
const KINDS: usize = 6;

/// Returns a body of about this size, in its own frame, and its name.
fn soup(random: &mut Random, kind: usize, size: f64) -> (PolygonSoup, &'static str) {
    let tiny = size * 10f64.powf(random.between(-9.0, -7.0));
    let half = DVec3::new(0.3, 0.22, 0.17) * size;
    let (mut soup, name) = match kind % KINDS {
        0 => (globe(|u| u * half), "ellipsoid"),
        1 => (globe(|u| u * half * (1.0 + 0.15 * (5.0 * u.x).sin() * (4.0 * u.y).cos())), "bumpy ball"),
        2 => (blocks(half, |_| 0.0), "box"),
        3 => (blocks(half, |_| tiny * random.signed()), "uneven box"),
        // Each face is a dome of this height over its plane.
        4 => (blocks(half, |p| tiny * (1.0 - (p / half).length_squared() / 3.0)), "nearly flat box"),
        _ => (blocks(half, |p| -0.1 * size * (9.0 * p.x / half.x).sin().powi(2)), "ribbed box"),
    };
    let turn = rotation(random);
    let shift = random.vector() * 0.3 * size;
    // Files have 6 to 9 decimal digits; every other body has all digits of a double.
    let grid = if random.below(2) == 0 { size * 10f64.powi(-(7 + random.below(3) as i32)) } else { 0.0 };
    let digits = if grid > 0.0 { 10f64.powi(-grid.log10().floor() as i32) } else { 0.0 };
    for p in &mut soup.vertices {
        *p = turn * *p + shift;
        if digits > 0.0 {
            *p = (*p * digits).round() / digits;
        }
    }
    (soup, name)
}

fn triangles(body: &Body) -> impl Iterator<Item = [DVec3; 3]> {
    (0..body.mesh().triangles().len() as u32).map(|t| body.mesh().triangle_points(t))
}

fn body(soup: &PolygonSoup) -> Arc<Body> {
    Arc::new(Body::from_soup(soup, &BodySettings::default(), &mut |_| ()).expect("a closed mesh"))
}

/// Places a near a random triangle of b: at a random pose, or flush with the triangle except for a
/// tiny tilt.
fn near(random: &mut Random, query: &ContactQuery, pose: usize, small: f64) -> Pose {
    let (a, b) = (query.a().mesh(), query.b().mesh());
    let (on_a, on_b) = (random.below(a.triangles().len()) as u32, random.below(b.triangles().len()) as u32);
    let middle = |[p, q, r]: [DVec3; 3]| (p + q + r) / 3.0;
    let (from, to) = (middle(a.triangle_points(on_a)), middle(b.triangle_points(on_b)));
    let normal = b.triangle_normal(on_b);
    let facing = DQuat::from_rotation_arc(a.triangle_normal(on_a), -normal);
    // A body with a large rotation gets a larger gap, so that it does not overlap b.
    let (angle, least_gap): (f64, f64) = match pose % 4 {
        0 => (0.0, 1e-5),
        1 => (10f64.powf(random.between(-10.0, -3.0)), 1e-5),
        2 => (random.between(0.0, 0.7), 0.1),
        _ => (random.between(0.0, 3.0), 0.5),
    };
    let gap = small * least_gap.powf(random.unit());
    let turn = DQuat::from_axis_angle(random.direction(), angle) * facing;
    Pose::new(turn, to + normal * gap - turn * from)
}

fn rotation(random: &mut Random) -> DQuat {
    DQuat::from_axis_angle(random.direction(), random.between(0.0, 3.0))
}

/// Returns a sphere, divided by latitude and longitude and moved by `place`.
fn globe(place: impl Fn(DVec3) -> DVec3) -> PolygonSoup {
    const BANDS: u32 = 14;
    const SIDES: u32 = 24;
    let mut soup = PolygonSoup::new();
    soup.vertices.push(place(-DVec3::Z));
    for band in 1..BANDS {
        let latitude = std::f64::consts::PI * (f64::from(band) / f64::from(BANDS) - 0.5);
        for k in 0..SIDES {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(SIDES);
            let r = latitude.cos();
            soup.vertices.push(place(DVec3::new(r * angle.cos(), r * angle.sin(), latitude.sin())));
        }
    }
    soup.vertices.push(place(DVec3::Z));
    let top = soup.vertices.len() as u32 - 1;
    let at = |band: u32, k: u32| 1 + (band - 1) * SIDES + k % SIDES;
    for k in 0..SIDES {
        soup.push_face(&[0, at(1, k + 1), at(1, k)]);
        for band in 1..BANDS - 1 {
            soup.push_face(&[at(band, k), at(band, k + 1), at(band + 1, k)]);
            soup.push_face(&[at(band, k + 1), at(band + 1, k + 1), at(band + 1, k)]);
        }
        soup.push_face(&[at(BANDS - 1, k), at(BANDS - 1, k + 1), top]);
    }
    soup
}

/// Returns a box whose faces are grids of triangles. `rise` returns the distance by which a vertex
/// is moved outward, along the axis of its face.
fn blocks(half: DVec3, mut rise: impl FnMut(DVec3) -> f64) -> PolygonSoup {
    const CELLS: i32 = 6;
    let mut soup = PolygonSoup::new();
    let mut places: Vec<[i32; 3]> = Vec::new();
    for axis in 0..3 {
        for side in [0, CELLS] {
            for i in 0..CELLS {
                for j in 0..CELLS {
                    let mut corner = |di: i32, dj: i32| {
                        let mut cell = [0; 3];
                        cell[axis] = side;
                        cell[(axis + 1) % 3] = i + di;
                        cell[(axis + 2) % 3] = j + dj;
                        if let Some(known) = places.iter().position(|place| *place == cell) {
                            return known as u32;
                        }
                        places.push(cell);
                        let unit = DVec3::from(cell.map(|c| 2.0 * f64::from(c) / f64::from(CELLS) - 1.0));
                        let mut p = unit * half;
                        p[axis] += unit[axis] * rise(p);
                        soup.vertices.push(p);
                        soup.vertices.len() as u32 - 1
                    };
                    let quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    let quad = if side == 0 { [quad[0], quad[3], quad[2], quad[1]] } else { quad };
                    soup.push_face(&[quad[0], quad[1], quad[2]]);
                    soup.push_face(&[quad[0], quad[2], quad[3]]);
                }
            }
        }
    }
    soup
}

/// Returns the distance of two sets of triangles; `None` if some triangles cross. Only pairs nearer
/// than `limit` count.
fn distance(a: &[[DVec3; 3]], b: &[[DVec3; 3]], limit: f64) -> Option<f64> {
    let sphere = |t: &[DVec3; 3]| {
        let middle = (t[0] + t[1] + t[2]) / 3.0;
        (middle, t.iter().map(|p| p.distance(middle)).fold(0.0, f64::max))
    };
    let spheres_b: Vec<_> = b.iter().map(sphere).collect();
    let mut least = limit;
    for s in a {
        let (middle, radius) = sphere(s);
        for (t, (other, reach)) in b.iter().zip(&spheres_b) {
            let most = least + radius + reach;
            if middle.distance_squared(*other) <= most * most {
                if crosses(s, t) || crosses(t, s) {
                    return None;
                }
                least = least.min(between_triangles(s, t));
            }
        }
    }
    Some(least)
}

/// Returns true if a side of `s` passes through `t`.
fn crosses(s: &[DVec3; 3], t: &[DVec3; 3]) -> bool {
    let normal = (t[1] - t[0]).cross(t[2] - t[0]);
    (0..3).any(|k| {
        let (p, q) = (s[k], s[(k + 1) % 3]);
        let (above, below) = (normal.dot(p - t[0]), normal.dot(q - t[0]));
        if above * below >= 0.0 {
            return false;
        }
        let x = p + (q - p) * (above / (above - below));
        (0..3).all(|k| (t[(k + 1) % 3] - t[k]).cross(x - t[k]).dot(normal) >= 0.0)
    })
}

fn between_triangles(s: &[DVec3; 3], t: &[DVec3; 3]) -> f64 {
    let corners =
        |s: &[DVec3; 3], t: &[DVec3; 3]| s.iter().map(|p| p.distance(on_triangle(*p, t))).fold(f64::INFINITY, f64::min);
    let mut least = corners(s, t).min(corners(t, s));
    for k in 0..3 {
        for l in 0..3 {
            least = least.min(between_lines(s[k], s[(k + 1) % 3], t[l], t[(l + 1) % 3]));
        }
    }
    least
}

/// Returns the point of a triangle that is closest to `p`: the foot on its plane, or the nearest of
/// the closest points of its sides.
fn on_triangle(p: DVec3, t: &[DVec3; 3]) -> DVec3 {
    let normal = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
    let foot = p - normal * normal.dot(p - t[0]);
    if (0..3).all(|k| (t[(k + 1) % 3] - t[k]).cross(foot - t[k]).dot(normal) >= 0.0) {
        return foot;
    }
    let side = |k: usize| {
        let (u, v) = (t[k], t[(k + 1) % 3]);
        u + (v - u) * ((p - u).dot(v - u) / (v - u).length_squared()).clamp(0.0, 1.0)
    };
    let nearer = |x: DVec3, y: DVec3| if y.distance(p) < x.distance(p) { y } else { x };
    nearer(nearer(side(0), side(1)), side(2))
}

/// Returns the distance between two segments at the points where their lines are nearest to each
/// other. For nearly parallel segments these points are inexact, but then the closest points of the
/// corners are just as near.
fn between_lines(p: DVec3, q: DVec3, u: DVec3, v: DVec3) -> f64 {
    let (d, e) = (q - p, v - u);
    let across = d.cross(e);
    let area = across.length_squared();
    if area == 0.0 {
        return f64::INFINITY;
    }
    let s = ((u - p).cross(e).dot(across) / area).clamp(0.0, 1.0);
    let t = ((p + d * s - u).dot(e) / e.length_squared()).clamp(0.0, 1.0);
    let s = ((u + e * t - p).dot(d) / d.length_squared()).clamp(0.0, 1.0);
    (p + d * s).distance(u + e * t)
}
