//! Tests the properties that every shape must have.

use std::collections::HashMap;
use std::ops::ControlFlow;

use glam::{DVec2, DVec3};
use palpus::body::{Cleaning, Mesh, PolygonSoup, TrianglePair};

use super::*;

struct Case {
    name: &'static str,
    build: fn() -> PolygonSoup,
    triangles: usize,
    genus: i64,
}

const CASES: [Case; 26] = [
    Case { name: "torus", build: torus, triangles: 2000, genus: 1 },
    Case { name: "cup", build: cup, triangles: 500, genus: 1 },
    Case { name: "spoon", build: spoon, triangles: 336, genus: 0 },
    Case { name: "intestine", build: intestine, triangles: 24_846, genus: 1 },
    Case { name: "pen", build: pen, triangles: 30, genus: 0 },
    Case { name: "icosahedron", build: || sphere(1.0, 0), triangles: 20, genus: 0 },
    Case { name: "sphere", build: || sphere(0.04, 3), triangles: 1280, genus: 0 },
    Case { name: "cuboid", build: || cuboid(DVec3::new(0.06, 0.04, 0.03)), triangles: 12, genus: 0 },
    Case { name: "table", build: table, triangles: 12, genus: 0 },
    Case { name: "peg", build: peg, triangles: 188, genus: 0 },
    Case { name: "hole block", build: || hole_block(DEFAULT_CLEARANCE), triangles: 144, genus: 1 },
    Case { name: "scanned torus", build: || scanned_torus(2000), triangles: 2006, genus: 1 },
    Case { name: "v-groove", build: v_groove, triangles: 24, genus: 0 },
    Case { name: "rails", build: rails, triangles: 36, genus: 0 },
    Case { name: "knife", build: knife, triangles: 8, genus: 0 },
    Case { name: "bolt", build: bolt, triangles: 1300, genus: 0 },
    Case { name: "nut", build: nut, triangles: 824, genus: 1 },
    Case { name: "channel", build: || channel(0.08, &SLOT), triangles: 28, genus: 0 },
    Case {
        name: "sleeve",
        build: || along_x(sleeve(DVec3::new(0.03, 0.04, 0.05), DVec2::new(0.02, 0.03))),
        triangles: 32,
        genus: 1,
    },
    Case { name: "key", build: key, triangles: 28, genus: 0 },
    Case { name: "square peg", build: square_peg, triangles: 20, genus: 0 },
    Case { name: "screwdriver", build: screwdriver, triangles: 92, genus: 0 },
    Case { name: "knurled roller", build: || knurled_roller(48, 20), triangles: 2016, genus: 0 },
    Case { name: "ball on stem", build: ball_on_stem, triangles: 958, genus: 0 },
    Case { name: "socket", build: || socket(0.0001), triangles: 894, genus: 0 },
    Case { name: "gear", build: gear, triangles: 1024, genus: 0 },
];

const SLOT: ChannelSection = ChannelSection { half_gap: 0.0011, half_width: 0.015, floor: -0.02, bottom: -0.03 };

fn triangle(soup: &PolygonSoup, f: usize) -> [DVec3; 3] {
    let face = soup.face(f);
    [0, 1, 2].map(|k| soup.vertices[face[k] as usize])
}

fn volume(soup: &PolygonSoup) -> f64 {
    (0..soup.face_count())
        .map(|f| {
            let [a, b, c] = triangle(soup, f);
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}

#[test]
fn every_shape_is_closed_manifold_and_outward() {
    for Case { name, build, triangles, genus } in CASES {
        let soup = build();
        assert_eq!(soup.face_count(), triangles, "{name}");
        let mut edges = HashMap::new();
        for f in 0..soup.face_count() {
            let face = soup.face(f);
            assert_eq!(face.len(), 3, "{name}");
            for k in 0..3 {
                let again = edges.insert((face[k], face[(k + 1) % 3]), f);
                assert!(again.is_none(), "{name}: an edge is used twice in the same direction");
            }
        }
        for &(a, b) in edges.keys() {
            assert!(edges.contains_key(&(b, a)), "{name}: edge {a}–{b} is open");
        }
        let (v, e, f) = (soup.vertices.len() as i64, edges.len() as i64 / 2, triangles as i64);
        assert_eq!(v - e + f, 2 - 2 * genus, "{name}: Euler characteristic");
        assert!(volume(&soup) > 0.0, "{name} is inside out");
    }
}

#[test]
fn every_vertex_has_one_ring_of_triangles() {
    for Case { name, build, .. } in CASES {
        let soup = build();
        let mut following = vec![HashMap::new(); soup.vertices.len()];
        for f in 0..soup.face_count() {
            let face = soup.face(f);
            for k in 0..3 {
                following[face[k] as usize].insert(face[(k + 1) % 3], face[(k + 2) % 3]);
            }
        }
        for (v, ring) in following.iter().enumerate() {
            let start = *ring.keys().next().unwrap_or_else(|| panic!("{name}: vertex {v} is unused"));
            let mut at = ring[&start];
            let mut steps = 1;
            while at != start && steps <= ring.len() {
                at = ring[&at];
                steps += 1;
            }
            assert_eq!(steps, ring.len(), "{name}: vertex {v} connects two sheets");
        }
    }
}

#[test]
fn shapes_are_reproducible_without_slivers() {
    for Case { name, build, .. } in CASES {
        let soup = build();
        for f in 0..soup.face_count() {
            let [a, b, c] = triangle(&soup, f);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            let height = (b - a).cross(c - a).length() / longest;
            assert!(height > 1e-2 * longest, "{name}: triangle {f} is a sliver: {height:e} on {longest:e}");
        }
        assert!(soup == build(), "{name}");
    }
}

/// The engine must not need to repair a shape. By exact predicates, two triangles may share only
/// their common vertices and edges.
#[test]
fn shapes_need_no_repair() {
    for Case { name, build, .. } in CASES {
        let (mesh, cleaning) = Mesh::from_soup(&build()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(cleaning, Cleaning::default(), "{name}");
        assert!(mesh.is_closed() && mesh.component_count() == 1, "{name}");
        let _ = mesh.tree().visit_own_pairs(|(f, a), (g, b)| {
            assert_eq!(TrianglePair::new(*a, *b), TrianglePair::Apart, "{name}: triangles {f} and {g}");
            ControlFlow::Continue(())
        });
    }
}

/// Returns the distance from `p` to the surface.
fn distance(soup: &PolygonSoup, p: DVec3) -> f64 {
    (0..soup.face_count())
        .map(|f| {
            let [a, b, c] = triangle(soup, f);
            palpus::algebra::closest_on_triangle(p, a, b, c).distance(p)
        })
        .fold(f64::INFINITY, f64::min)
}

/// Returns how many times the surface winds around `p`: 1 inside, 0 outside.
fn winding(soup: &PolygonSoup, p: DVec3) -> f64 {
    let solid_angle = |f| {
        let [a, b, c] = triangle(soup, f).map(|v| (v - p).normalize());
        2.0 * a.dot(b.cross(c)).atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
    };
    (0..soup.face_count()).map(solid_angle).sum::<f64>() / (2.0 * std::f64::consts::TAU)
}

#[test]
fn cup_is_hollow_with_a_solid_wall() {
    let cup = cup();
    for (p, inside) in [
        (DVec3::new(0.0, 0.0, 0.03), 0.0),
        (DVec3::new(0.0, 0.0, 0.003), 1.0),
        (DVec3::new(-0.0328, 0.0, 0.051), 1.0),
        (DVec3::new(0.057, 0.0, 0.0365), 1.0),
        (DVec3::new(0.045, 0.0, 0.0365), 0.0),
    ] {
        assert!((winding(&cup, p) - inside).abs() < 1e-9, "{p}");
    }
    for z in [0.01, 0.02, 0.04, 0.06] {
        assert!(distance(&cup, DVec3::new(-cup_inner_radius(z), 0.0, z)) < 1e-6, "inner radius at {z}");
    }
}

#[test]
fn spoon_has_a_cavity() {
    let spoon = spoon();
    assert!(winding(&spoon, DVec3::new(0.048, 0.0, -0.010)).abs() < 1e-9);
    assert!((winding(&spoon, DVec3::new(0.048, 0.0, -0.0140)) - 1.0).abs() < 1e-9);
    assert!((winding(&spoon, DVec3::ZERO) - 1.0).abs() < 1e-9, "the grip must lie in the handle");
}

#[test]
fn lumen_is_hollow() {
    let (soup, line) = (intestine(), CenterLine);
    for u in [0.1, 0.33, 0.5, 0.77] {
        let (level, _) = line.across(u);
        assert!(winding(&soup, line.point(u)).abs() < 1e-6, "{u}");
        let wall = line.point(u) + level * (line.lumen_radius(u) + 0.0015);
        assert!((winding(&soup, wall) - 1.0).abs() < 1e-6, "{u}");
    }
}

#[test]
fn peg_fits_at_any_rotation() {
    let (peg, block) = (peg(), hole_block(DEFAULT_CLEARANCE));
    let radius = |p: &DVec3| p.truncate().length();
    let widest = peg.vertices.iter().map(radius).fold(0.0, f64::max);
    assert!((widest - PEG_RADIUS).abs() < 1e-15);
    // The flat faces of the hole are nearest to the axis at their middles.
    let n = block.vertices.iter().filter(|p| radius(p) < 0.01 && p.z >= 0.0).copied().collect::<Vec<_>>();
    let narrowest = (0..n.len()).map(|k| radius(&((n[k] + n[(k + 1) % n.len()]) / 2.0))).fold(1.0, f64::min);
    assert!((narrowest - widest - DEFAULT_CLEARANCE / 2.0).abs() < 1e-12);
}
