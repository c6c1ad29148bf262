//! Computes how the flat faces of the mesh continue around the surface faces of each piece: step 7 of
//! `build`. `border` gives access to the results.

use std::collections::HashSet;

use glam::DVec3;

use super::border::{InnerVertex, PartialSide};
use super::build::Source;
use super::{Admissible, FaceRim, FlatAround};
use crate::algebra::tolerance::{ADMISSIBLE_ANGLE, COVERED_HALF, NORMALS_PER_PART, ON_FACE};
use crate::algebra::{Workers, map_in_order};
use crate::body::piece::{clip_to_face, face_area, polygon_area};
use crate::body::{HalfEdges, Mesh, Piece, Polytope};

impl Admissible {
    /// Finds the rims of the surface faces of one piece, which begin at `first`, and whether the
    /// mesh covers them.
    pub(super) fn add_rims(&mut self, source: &Source<'_>, polytope: &Polytope, piece: &Piece, first: usize) {
        let tolerance = ON_FACE * source.noise;
        for own in &mut self.faces[first..] {
            let (plane, corners) = (polytope.plane(own.face), polytope.face_vertices(own.face));
            let triangles = match own.whole {
                true => piece.face_triangles(own.face).to_vec(),
                false => {
                    let (triangles, area) = triangles_on(source, polytope, piece, own.face);
                    own.covered |= area >= COVERED_HALF * face_area(polytope, own.face);
                    triangles
                }
            };
            if corners.len() > FaceRim::MOST {
                continue;
            }
            let sides = triangles.iter().flat_map(|&t| [(t, 0), (t, 1), (t, 2)]);
            let continues = |t, k| source.half_edges.neighbour(t, k).is_some_and(|(n, _)| source.lies_in(n, plane));
            let rims: Vec<[DVec3; 2]> = sides
                .filter(|&(t, k)| !continues(t, k))
                .map(|(t, k)| [k, (k + 1) % 3].map(|k| source.mesh.triangle_points(t)[k]))
                .collect();
            for k in 0..corners.len() {
                let ends = [k, (k + 1) % corners.len()].map(|k| polytope.vertex(corners.at(k)));
                match rim_of_side(&rims, ends, tolerance) {
                    None => own.rim.flat |= 1 << k,
                    Some(rim) if rim != [0.0, 1.0] => {
                        own.rim.partial |= 1 << k;
                        self.partial.push(PartialSide { face: own.face, side: k as u32, rim });
                    }
                    Some(_) => {}
                }
            }
        }
    }

    /// Finds the inner vertices of all pieces, and the rims of all surface faces. `normals` are the
    /// normals of the triangles.
    pub(super) fn find_inner(
        &mut self,
        mesh: &Mesh,
        half_edges: &HalfEdges,
        normals: &[DVec3],
        polytopes: &[Polytope],
        workers: &dyn Workers,
    ) {
        let triangles = mesh.triangles();
        let mut open = vec![false; mesh.vertices().len()];
        for (t, k) in (0..triangles.len()).flat_map(|t| [(t, 0), (t, 1), (t, 2)]) {
            if half_edges.neighbour(t as u32, k).is_none() {
                open[triangles[t][k] as usize] = true;
                open[triangles[t][(k + 1) % 3] as usize] = true;
            }
        }
        let of_triangle = |t: usize| triangles[t].map(|v| self.flat_around(v, normals[t], open[v as usize]));
        let found = map_in_order(workers, triangles.len(), NORMALS_PER_PART, of_triangle, &mut |_| ());
        let mut known: Vec<(u32, InnerVertex)> = Vec::new();
        for (t, around) in found.into_iter().enumerate() {
            let normal = normals[t];
            let inner = triangles[t].into_iter().zip(around).filter(|corner| corner.1 != FlatAround::Corner);
            known.extend(inner.map(|(v, around)| (v, InnerVertex { vertex: 0, around, normal })));
        }
        known.sort_by_key(|known| known.0);
        let is_parallel = |one: DVec3, other: DVec3| one.distance_squared(other) < ADMISSIBLE_ANGLE * ADMISSIBLE_ANGLE;
        known.dedup_by(|one, other| one.0 == other.0 && is_parallel(one.1.normal, other.1.normal));
        for k in 1..self.pieces.len() {
            let [from, to] = [k - 1, k].map(|end| self.pieces[end].corners as usize);
            for (vertex, &v) in (0_u32..).zip(&self.corners[from..to]) {
                let begin = known.partition_point(|known| known.0 < v);
                let of_corner = known[begin..].iter().take_while(|known| known.0 == v);
                self.inner.extend(of_corner.map(|known| InnerVertex { vertex, ..known.1 }));
            }
            self.pieces[k].inner = self.inner.len() as u32;
        }
        self.inner.shrink_to_fit();
        for (k, polytope) in (0..).zip(polytopes) {
            let [from, to] = [k, k + 1].map(|end: u32| self.pieces[end as usize].faces as usize);
            for i in from..to {
                let (face, border) = (self.faces[i].face, self.border_of(k));
                let corners = polytope.face_vertices(face);
                let normal = polytope.plane(face).normal;
                let around = |i: usize| border.around(corners.at(i), normal, ADMISSIBLE_ANGLE);
                let bits = |kind| {
                    let of_kind = (0..corners.len().min(FaceRim::MOST)).filter(|&i| around(i) == kind);
                    of_kind.fold(0, |bits, i| bits | 1 << i)
                };
                let (all, half) = (bits(FlatAround::All), bits(FlatAround::Half));
                let rim = &mut self.faces[i].rim;
                (rim.all, rim.half) = (all, half);
            }
        }
    }

    /// Returns how much of the neighbourhood of mesh vertex `v` belongs to a flat face with this
    /// normal. `open` is true for a vertex at a boundary.
    fn flat_around(&self, v: u32, normal: DVec3, open: bool) -> FlatAround {
        let edges = self.edges(v);
        let flat = edges.iter().filter(|&&edge| !self.rises(edge, -normal, 0.0));
        let count = flat.clone().count();
        if count < 2 || edges.iter().any(|&edge| self.rises(edge, normal, ADMISSIBLE_ANGLE)) {
            return FlatAround::Corner;
        }
        if count == edges.len() && !open {
            return FlatAround::All;
        }
        // At a convex corner, all flat edges are within half a turn from one of them.
        let is_left = |edge: DVec3, other: DVec3| {
            let across = normal.dot(edge.cross(other));
            let slack = ADMISSIBLE_ANGLE * edge.length() * other.length();
            across > slack || across >= -slack && edge.dot(other) > 0.0
        };
        match flat.clone().any(|&edge| flat.clone().all(|&other| is_left(edge, other))) {
            true => FlatAround::Corner,
            false => FlatAround::Half,
        }
    }
}

/// Returns the triangles of the mesh that lie on a face, those of other pieces included, and the
/// area that they cover. Pieces overlap where the mesh is flat.
fn triangles_on(source: &Source<'_>, polytope: &Polytope, piece: &Piece, face: u32) -> (Vec<u32>, f64) {
    let plane = polytope.plane(face);
    let mut seen: HashSet<u32> = piece.face_triangles(face).iter().copied().collect();
    let mut next: Vec<u32> = piece.face_triangles(face).to_vec();
    let (mut found, mut covered) = (Vec::new(), 0.0);
    while let Some(t) = next.pop() {
        let mut polygon = source.mesh.triangle_points(t).to_vec();
        clip_to_face(&mut polygon, polytope, face);
        if polygon.len() < 3 || !source.lies_in(t, plane) {
            continue;
        }
        found.push(t);
        covered += polygon_area(&polygon, plane.normal);
        let beyond = (0..3).filter_map(|k| source.half_edges.neighbour(t, k));
        next.extend(beyond.map(|(n, _)| n).filter(|&n| seen.insert(n)));
    }
    (found, covered)
}

/// Returns the part of the side from `tail` to `head` along which one of the `rims` runs, from 0 at
/// the tail to 1 at the head; `None` if none does. Distances up to `tolerance` do not count.
fn rim_of_side(rims: &[[DVec3; 2]], [tail, head]: [DVec3; 2], tolerance: f64) -> Option<[f64; 2]> {
    let along = (head - tail).try_normalize()?;
    let length = tail.distance(head);
    let is_beside = |x: DVec3| (x - tail).cross(along).length() <= tolerance;
    let parts = rims.iter().filter(|rim| rim.iter().all(|&x| is_beside(x))).map(|rim| {
        let [s, e] = rim.map(|x| along.dot(x - tail));
        [s.min(e), s.max(e)]
    });
    let within = parts.filter(|&[s, e]| e > tolerance && s < length - tolerance);
    let [s, e] = within.reduce(|one, other| [one[0].min(other[0]), one[1].max(other[1])])?;
    let place = |x: f64| {
        if x <= tolerance {
            0.0
        } else if x >= length - tolerance {
            1.0
        } else {
            x / length
        }
    };
    Some([place(s), place(e)])
}
