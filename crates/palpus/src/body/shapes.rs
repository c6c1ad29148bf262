//! Shapes and real models for the tests of `body`.

use std::path::Path;

use glam::DVec3;

use super::{Mesh, PolygonSoup};

/// Returns the box between two opposite corners.
pub(crate) fn cuboid(low: DVec3, high: DVec3) -> Mesh {
    let corner = |i: u32| DVec3::select(glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0), high, low);
    let mut soup = PolygonSoup::new();
    soup.vertices.extend((0..8).map(corner));
    for face in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        soup.push_face(&face);
    }
    Mesh::from_soup(&soup).unwrap().0
}

/// Returns a torus about z, made of `n` × `m` quads.
pub(crate) fn torus(major: f64, minor: f64, n: u32, m: u32) -> Mesh {
    let mut soup = PolygonSoup::new();
    for i in 0..n {
        for j in 0..m {
            let (s, t) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(m));
            let (s, t) = (s * std::f64::consts::TAU, t * std::f64::consts::TAU);
            let ring = major + minor * t.cos();
            soup.vertices.push(DVec3::new(ring * s.cos(), ring * s.sin(), minor * t.sin()));
            let (k, l) = ((i + 1) % n, (j + 1) % m);
            soup.push_face(&[i * m + j, k * m + j, k * m + l, i * m + l]);
        }
    }
    Mesh::from_soup(&soup).unwrap().0
}

/// Reads a real model. If the file is missing, prints a note and returns `None`.
#[allow(clippy::print_stderr, reason = "a skipped test must say so")]
pub(super) fn model(name: &str) -> Option<PolygonSoup> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/models")).join(name);
    let Ok(text) = std::fs::read(&path) else {
        eprintln!("skipped: the model {name} is missing");
        return None;
    };
    let mut soup = PolygonSoup::new();
    for line in String::from_utf8_lossy(&text).lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let x: Vec<f64> = words.take(3).filter_map(|word| word.parse().ok()).collect();
                soup.vertices.push(DVec3::new(x[0], x[1], x[2]));
            }
            Some("f") => {
                let index = |word: &str| word.split('/').next().and_then(|number| number.parse::<u32>().ok());
                let face: Vec<u32> = words.filter_map(index).map(|v| v - 1).collect();
                soup.push_face(&face);
            }
            _ => {}
        }
    }
    Some(soup)
}
