//! Checks the invariants of a polytope.
//!
//! In debug builds, functions that build polytopes call these checks. Tests call the checks on many
//! polytopes. The error states the broken invariant and its place.

use crate::algebra::tolerance::WELL_FORMED_ROUNDING;
use crate::body::{Edge, Polytope, Provenance};

/// A broken invariant of a polytope.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Malformed {
    /// A position, plane or bound is NaN or infinite.
    #[error("a number is not finite at {0}")]
    NotFinite(&'static str),
    /// V − E + F is not 2.
    #[error("V − E + F is {0} and not 2")]
    Euler(i64),
    /// An edge is not a side of its faces, or joins a vertex to itself.
    #[error("edge {0} is not in the loops of its two faces, or joins a vertex to itself")]
    Edge(u32),
    /// A spoke disagrees with its edge or with the next spoke.
    #[error("spoke {spoke} of vertex {vertex} disagrees with its edge, its face or the next spoke")]
    Ring {
        /// Index of the vertex.
        vertex: u32,
        /// Index of the spoke in the ring.
        spoke: u32,
    },
    /// A loop has too few corners, repeats a corner, or disagrees with its edges.
    #[error("the loop of face {0} repeats a vertex, is too short or disagrees with its edges")]
    Loop(u32),
    /// A rim is original, or belongs to a solid.
    #[error("face {0} has zero width but is not a virtual rim of a plate")]
    Rim(u32),
    /// A face's normal is not of unit length.
    #[error("the normal of face {face} has length {length}")]
    NotUnit {
        /// Index of the face.
        face: u32,
        /// Length of its normal.
        length: f64,
    },
    /// A corner of a face is not in the face's plane.
    #[error("vertex {vertex} of face {face} lies {height:e} above its plane")]
    NotPlanar {
        /// Index of the face.
        face: u32,
        /// Index of the corner's vertex.
        vertex: u32,
        /// Height above the face's plane, in model units.
        height: f64,
    },
    /// A vertex next to a face is above the face's plane.
    #[error("vertex {vertex} lies {height:e} above the plane of face {face}")]
    NotConvex {
        /// Index of the face.
        face: u32,
        /// Index of a vertex next to a corner of the face.
        vertex: u32,
        /// Height above the face's plane, in model units.
        height: f64,
    },
    /// The loop of a face is clockwise as seen from the side to which its normal points.
    #[error("the loop of face {0} runs against its normal")]
    Reversed(u32),
}

impl Polytope {
    /// Checks all invariants.
    ///
    /// `coplanar` is the largest allowed distance of a corner from the plane of its face, in model
    /// units. Pass the merge distance with which the polytope was built. Convexity is tested at
    /// every edge, which is sufficient for a closed surface.
    ///
    /// # Errors
    /// Returns the first broken invariant.
    pub fn validate(&self, coplanar: f64) -> Result<(), Malformed> {
        self.validate_topology()?;
        self.check_planes(coplanar)
    }

    /// Checks the two invariants that do not depend on rounding: finite numbers and correct
    /// topology.
    ///
    /// # Errors
    /// Returns the first broken invariant.
    pub fn validate_topology(&self) -> Result<(), Malformed> {
        self.check_numbers()?;
        self.check_loops()?;
        self.check_rings()?;
        let euler = self.vertices().len() as i64 - self.edges().len() as i64 + self.face_count() as i64;
        if euler == 2 { Ok(()) } else { Err(Malformed::Euler(euler)) }
    }

    fn check_numbers(&self) -> Result<(), Malformed> {
        let fails = |sound: bool, place| if sound { Ok(()) } else { Err(Malformed::NotFinite(place)) };
        fails(self.vertices().iter().all(|v| v.is_finite()), "vertices")?;
        fails(self.planes().iter().all(|p| p.normal.is_finite() && p.offset.is_finite()), "planes")?;
        fails(self.centroid().is_finite() && self.radius().is_finite(), "bounds")
    }

    fn check_loops(&self) -> Result<(), Malformed> {
        let mut seen = vec![u32::MAX; self.vertices().len()];
        let mut sides = vec![[false; 2]; self.edge_count()];
        for f in 0..self.face_count() as u32 {
            let (corners, edges) = (self.face_vertices(f), self.face_edges(f));
            if corners.len() < 2 || edges.len() != corners.len() {
                return Err(Malformed::Loop(f));
            }
            if self.is_rim(f) && (!self.is_flat() || self.face_provenance(f) != Provenance::Virtual) {
                return Err(Malformed::Rim(f));
            }
            for (k, (v, e)) in corners.iter().zip(edges).enumerate() {
                let next = corners.at((k + 1) % corners.len());
                if e as usize >= sides.len() {
                    return Err(Malformed::Loop(f));
                }
                let Edge { tail, head, left, right } = self.edge(e);
                let side = match (v, next, f) {
                    along if along == (tail, head, left) => 0,
                    along if along == (head, tail, right) => 1,
                    _ => return Err(Malformed::Loop(f)),
                };
                if seen.get(v as usize).is_none_or(|&last| last == f) {
                    return Err(Malformed::Loop(f));
                }
                seen[v as usize] = f;
                sides[e as usize][side] = true;
            }
        }
        match sides.iter().zip(self.edges()).position(|(side, edge)| *side != [true; 2] || edge.tail == edge.head) {
            Some(e) => Err(Malformed::Edge(e as u32)),
            None => Ok(()),
        }
    }

    fn check_rings(&self) -> Result<(), Malformed> {
        let mut spokes = 0;
        for vertex in 0..self.vertices().len() as u32 {
            let ring = self.ring(vertex);
            spokes += ring.len();
            if ring.len() < 3 {
                return Err(Malformed::Ring { vertex, spoke: 0 });
            }
            for (k, spoke) in ring.iter().enumerate() {
                let Edge { tail, head, left, right } = self.edge(spoke.edge);
                let before = ring.at(if k == 0 { ring.len() } else { k } - 1).left;
                let outward = (tail, head, left, right) == (vertex, spoke.neighbour, spoke.left, before);
                let inward = (head, tail, right, left) == (vertex, spoke.neighbour, spoke.left, before);
                if !(outward || inward) {
                    return Err(Malformed::Ring { vertex, spoke: k as u32 });
                }
            }
        }
        // Each edge has two ends, and each ring goes around its vertex once. Therefore each edge
        // has two spokes.
        if spokes == 2 * self.edges().len() { Ok(()) } else { Err(Malformed::Ring { vertex: 0, spoke: 0 }) }
    }

    fn check_planes(&self, coplanar: f64) -> Result<(), Malformed> {
        let size = self.vertices().iter().fold(0.0, |size: f64, v| size.max(v.abs().max_element()));
        let rounding = WELL_FORMED_ROUNDING * size;
        // The plane of a plate passes through the mean height of its corners, so some neighbours
        // lie above it.
        let above = if self.is_flat() { rounding + coplanar } else { rounding };
        for face in 0..self.face_count() as u32 {
            let plane = self.plane(face);
            let length = plane.normal.length();
            if (length - 1.0).abs() > WELL_FORMED_ROUNDING {
                return Err(Malformed::NotUnit { face, length });
            }
            let corners = self.face_vertices(face);
            for vertex in corners {
                let height = plane.height(self.vertex(vertex));
                if height.abs() > coplanar + rounding {
                    return Err(Malformed::NotPlanar { face, vertex, height });
                }
                for spoke in self.ring(vertex) {
                    let height = plane.height(self.vertex(spoke.neighbour));
                    if height > above {
                        return Err(Malformed::NotConvex { face, vertex: spoke.neighbour, height });
                    }
                }
            }
            let area = corners.fan().map(|corners| {
                let [first, second, third] = corners.map(|v| self.vertex(v));
                (second - first).cross(third - first).dot(plane.normal)
            });
            // If a face is as narrow as the rounding errors, the sign is meaningless.
            if area.sum::<f64>() < -rounding * self.radius() {
                return Err(Malformed::Reversed(face));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::algebra::Plane;

    const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

    fn tetrahedron() -> (Vec<DVec3>, Vec<Vec<u32>>, Vec<Plane>) {
        let plane = |normal, offset| Plane { normal, offset };
        let slanted = plane(DVec3::ONE.normalize(), 1.0 / 3f64.sqrt());
        (
            vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
            FACES.iter().map(|face| face.to_vec()).collect(),
            vec![plane(-DVec3::Z, 0.0), plane(-DVec3::Y, 0.0), slanted, plane(-DVec3::X, 0.0)],
        )
    }

    fn check(vertices: Vec<DVec3>, loops: &[Vec<u32>], planes: Vec<Plane>) -> Result<(), Malformed> {
        let provenance = vec![Provenance::Original; planes.len()];
        Polytope::from_faces(vertices, loops, planes, provenance).unwrap().validate(1e-12)
    }

    #[test]
    fn each_broken_invariant_is_named() {
        let (vertices, loops, planes) = tetrahedron();
        assert_eq!(check(vertices.clone(), &loops, planes.clone()), Ok(()));

        let mut broken = planes.clone();
        broken[2].normal *= 2.0;
        assert!(matches!(check(vertices.clone(), &loops, broken), Err(Malformed::NotUnit { face: 2, .. })));
        let mut broken = planes.clone();
        broken[1].offset = 0.1;
        assert!(matches!(check(vertices.clone(), &loops, broken), Err(Malformed::NotPlanar { face: 1, .. })));
        let mut broken = planes.clone();
        broken[3].normal.x = f64::NAN;
        assert_eq!(check(vertices.clone(), &loops, broken), Err(Malformed::NotFinite("planes")));
        let turned: Vec<Plane> = planes.iter().map(|p| Plane { normal: -p.normal, offset: -p.offset }).collect();
        assert!(matches!(check(vertices.clone(), &loops, turned), Err(Malformed::NotConvex { .. })));
        let reversed: Vec<Vec<u32>> = loops.iter().map(|face| face.iter().rev().copied().collect()).collect();
        assert_eq!(check(vertices.clone(), &reversed, planes.clone()), Err(Malformed::Reversed(0)));

        let two = [vertices.clone(), vertices].concat();
        let shifted = loops.iter().map(|face| face.iter().map(|v| v + 4).collect());
        let loops: Vec<Vec<u32>> = loops.iter().cloned().chain(shifted).collect();
        assert_eq!(check(two, &loops, [planes.clone(), planes].concat()), Err(Malformed::Euler(4)));
    }
}
