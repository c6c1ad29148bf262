//! Box, table, sphere and pen.

use glam::DVec3;
use palpus::body::PolygonSoup;
use std::collections::HashMap;

use super::surface::{Surface, circle};

/// Returns a box around the origin with side lengths `size`, m. The shape has 12 triangles.
pub fn cuboid(size: DVec3) -> PolygonSoup {
    slab(-size / 2.0, size / 2.0)
}

/// Returns a flat slab of 300 mm × 200 mm × 20 mm, whose top lies in the plane z = 0. The shape has
/// 12 triangles.
pub fn table() -> PolygonSoup {
    slab(DVec3::new(-0.15, -0.10, -0.02), DVec3::new(0.15, 0.10, 0.0))
}

/// Returns a disc around the z axis, with its middle at the origin: a prism with `sides` sides,
/// `height` (m) high, with its corners at `radius` (m).
pub fn disc(radius: f64, height: f64, sides: usize) -> PolygonSoup {
    let mut surface = Surface::default();
    let mut ring = |z: f64| surface.ring(circle(DVec3::Z * z, DVec3::X, DVec3::Y, radius, sides, 0.0));
    let (bottom, top) = (ring(-0.5 * height), ring(0.5 * height));
    surface.cap_start(&bottom);
    surface.band(&bottom, &top);
    surface.cap_end(&top);
    surface.finish()
}

fn slab(low: DVec3, high: DVec3) -> PolygonSoup {
    let outline = |z| {
        [(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y)]
            .map(|(x, y): (f64, f64)| DVec3::new(x, y, z))
    };
    let mut surface = Surface::default();
    let bottom = surface.ring(outline(low.z));
    let top = surface.ring(outline(high.z));
    surface.cap_start(&bottom);
    surface.band(&bottom, &top);
    surface.cap_end(&top);
    surface.finish()
}

/// Returns a sphere around the origin with its vertices at `radius`, m. It is an icosahedron in
/// which each triangle is divided into four, `subdivisions` times: 20·4ⁿ triangles.
pub fn sphere(radius: f64, subdivisions: u32) -> PolygonSoup {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let mut vertices: Vec<DVec3> = (0..12)
        .map(|k| {
            let (one, phi) = (if k & 1 == 0 { 1.0 } else { -1.0 }, if k & 2 == 0 { golden } else { -golden });
            match k / 4 {
                0 => DVec3::new(one, phi, 0.0),
                1 => DVec3::new(0.0, one, phi),
                _ => DVec3::new(phi, 0.0, one),
            }
            .normalize()
        })
        .collect();
    let mut faces = icosahedron_faces(&vertices);
    for _ in 0..subdivisions {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                vertices.push((vertices[a as usize] + vertices[b as usize]).normalize());
                vertices.len() as u32 - 1
            })
        };
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    for v in &mut vertices {
        *v *= radius;
    }
    PolygonSoup::from_triangles(vertices, &faces)
}

/// Returns the faces of the icosahedron: all triples of mutually nearest vertices.
fn icosahedron_faces(vertices: &[DVec3]) -> Vec<[u32; 3]> {
    // Neighbouring vertices of an icosahedron are 63° apart (cosine 0.447), and other vertices are
    // at least 117° apart.
    let near = |a: usize, b: usize| vertices[a].dot(vertices[b]) > 0.4;
    let mut faces = Vec::with_capacity(20);
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]).dot(vertices[a]) > 0.0;
                    let [a, b, c] = [a, b, c].map(|v| v as u32);
                    faces.push(if outward { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    faces
}

/// The point of the pen in the pen's frame, m.
pub const PEN_TIP: DVec3 = DVec3::new(0.0, 0.0, -0.040);

/// Returns a pen: a convex octagonal prism of 140 mm along z with a conical point. The grip is 40
/// mm above [`PEN_TIP`]. The shape has 30 triangles.
pub fn pen() -> PolygonSoup {
    const SIDES: usize = 8;
    const RADIUS: f64 = 0.004;
    const CONE: f64 = 0.018;
    const LENGTH: f64 = 0.140;
    let mut surface = Surface::default();
    let mut ring_at = |height: f64| {
        let center = PEN_TIP + DVec3::Z * height;
        surface.ring(circle(center, DVec3::X, DVec3::Y, RADIUS, SIDES, 0.5))
    };
    let shoulder = ring_at(CONE);
    let end = ring_at(LENGTH);
    surface.point_start(&shoulder, PEN_TIP);
    surface.band(&shoulder, &end);
    surface.cap_end(&end);
    surface.finish()
}
