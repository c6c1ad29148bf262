//! Merges the coplanar triangles of a hull into planar faces.
//!
//! 1. The largest triangle that has no face yet starts a new face. The plane of this triangle
//!    supports the whole hull exactly. The face keeps this plane, so repeated merges cause no
//!    drift.
//! 2. The face grows across sides to triangles whose corners lie within the merge distance
//!    below that plane. A triangle joins only if the face then is still a disc with a simple
//!    border, and does not fold over a sharp edge.
//! 3. A vertex in the interior of a face is dropped. If a vertex belongs to only two faces, it lies
//!    on a straight side of both faces and is dropped from both.
//! 4. A face is invalid in four cases: it has fewer than three corners left, it is turned over, it
//!    has a reflex corner, or its dropped vertices do not lie on the sides that replace them. The
//!    last case occurs if two faces meet at a tiny angle. The triangles of invalid faces are merged
//!    again with smaller and smaller merge distances, and finally only if exactly coplanar. If this
//!    fails too, every triangle becomes a face.
//!
//! This module does not weld vertices that are closer than the merge distance, because the mesh is
//! already welded.

use glam::DVec3;

use super::{
    normal::{cross_of, unit},
    quickhull::{Shell, orientation},
};
use crate::{
    algebra::{
        Plane,
        tolerance::{HULL_MERGE_PASSES, HULL_MERGE_RETREAT, HULL_MERGE_SMALLEST},
    },
    body::{Polytope, Provenance},
};

const NONE: u32 = u32::MAX;

/// The assignment of triangles to faces.
struct Faces {
    /// Index of each triangle's face.
    of: Vec<u32>,
    /// For each face, its first triangle and the unit normal of that triangle.
    founders: Vec<(u32, DVec3)>,
}

/// Returns the polytope with merged faces, and for each of its vertices the index of the point.
pub(super) fn merged(points: &[DVec3], shell: &Shell, coplanar: f64) -> Result<(Polytope, Vec<u32>), Unmergeable> {
    let mut distances = vec![coplanar; shell.triangles.len()];
    for pass in 0..=HULL_MERGE_PASSES {
        if pass == HULL_MERGE_PASSES {
            distances.fill(0.0);
        }
        let faces = grow_faces(points, shell, &distances);
        let mut spoilt = match assemble(points, shell, &faces, coplanar) {
            Ok(Some(answer)) => return Ok(answer),
            Ok(None) => vec![true; faces.founders.len()],
            Err(spoilt) => spoilt,
        };
        spoil_neighbours(shell, &faces, &distances, &mut spoilt);
        for (distance, &face) in distances.iter_mut().zip(&faces.of) {
            if spoilt[face as usize] {
                *distance *= HULL_MERGE_RETREAT;
                if *distance < HULL_MERGE_SMALLEST * coplanar {
                    *distance = 0.0;
                }
            }
        }
    }
    // Exact coplanarity is not transitive. On a lattice with rounding errors, some points are
    // exactly coplanar and others are not. Then a vertex between two faces may lie off the straight
    // side. In this case each triangle becomes a face.
    match assemble(points, shell, &unmerged(points, shell), 0.0) {
        Ok(Some(answer)) => Ok(answer),
        Ok(None) => Err(Unmergeable { collinear: Vec::new() }),
        Err(spoilt) => Err(Unmergeable { collinear: middles(points, shell, &spoilt) }),
    }
}

/// Error: some triangles are so narrow that their normals consist of rounding errors.
pub(super) struct Unmergeable {
    /// For each narrow triangle, the corner opposite the longest side. Up to rounding, this corner
    /// lies on a segment between other points.
    pub(super) collinear: Vec<u32>,
}

/// Returns the corner opposite the longest side of each triangle that is marked in `spoilt`, sorted
/// and without duplicates.
fn middles(points: &[DVec3], shell: &Shell, spoilt: &[bool]) -> Vec<u32> {
    let middle = |corners: &[u32; 3]| {
        let side = |k: usize| points[corners[k] as usize].distance_squared(points[corners[(k + 1) % 3] as usize]);
        let longest = (0..3).max_by(|&i, &j| side(i).total_cmp(&side(j))).unwrap_or(0);
        corners[(longest + 2) % 3]
    };
    let mut middles: Vec<u32> =
        shell.triangles.iter().zip(spoilt).filter(|(_, spoilt)| **spoilt).map(|(corners, _)| middle(corners)).collect();
    middles.sort_unstable();
    middles.dedup();
    middles
}

/// Makes each triangle its own face.
fn unmerged(points: &[DVec3], shell: &Shell) -> Faces {
    let normal = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|v| points[v as usize]);
        unit(cross_of(a, b, c))
    };
    let founders = shell.triangles.iter().enumerate().map(|(t, corners)| (t as u32, normal(corners))).collect();
    Faces { of: (0..shell.triangles.len() as u32).collect(), founders }
}

/// Marks the neighbours of invalid faces that cannot shrink. A face that cannot shrink is a single
/// triangle with a corner on the side of another face, so the faces beside it contain too many
/// triangles.
fn spoil_neighbours(shell: &Shell, faces: &Faces, distances: &[f64], spoilt: &mut [bool]) {
    let at_end: Vec<u32> = (0..faces.of.len() as u32)
        .filter(|&t| spoilt[faces.of[t as usize] as usize] && distances[t as usize] <= 0.0)
        .collect();
    for t in at_end {
        for across in shell.neighbours[t as usize] {
            spoilt[faces.of[across as usize] as usize] = true;
        }
    }
}

/// Does steps 1 and 2. Each face uses the merge distance of its first triangle.
fn grow_faces(points: &[DVec3], shell: &Shell, distances: &[f64]) -> Faces {
    let corners = |t: u32| shell.triangles[t as usize].map(|v| points[v as usize]);
    let mut order: Vec<(f64, u32)> = (0..shell.triangles.len() as u32)
        .map(|t| {
            let [a, b, c] = corners(t);
            ((b - a).cross(c - a).length_squared(), t)
        })
        .collect();
    order.sort_unstable_by(|s, t| t.0.total_cmp(&s.0).then(s.1.cmp(&t.1)));
    let mut faces = Faces { of: vec![NONE; shell.triangles.len()], founders: Vec::new() };
    let mut touched = vec![NONE; points.len()];
    let mut queue: Vec<u32> = Vec::new();
    for (_, seed) in order {
        if faces.of[seed as usize] != NONE {
            continue;
        }
        let [a, b, c] = corners(seed);
        let normal = unit(cross_of(a, b, c));
        let distance = distances[seed as usize];
        let faces_along = |[a, b, c]: [DVec3; 3]| cross_of(a, b, c).dot(normal) > 0.0;
        let near = |p: DVec3| (distance > 0.0 && normal.dot(p - a) >= -distance) || orientation(a, b, c, p) == 0.0;
        let face = faces.founders.len() as u32;
        faces.founders.push((seed, normal));
        queue.clear();
        queue.push(seed);
        let mut done = 0;
        while done < queue.len() {
            let here = queue[done];
            done += 1;
            let joins = here == seed
                || faces.of[here as usize] == NONE
                    && keeps_a_disc(shell, &faces.of, &touched, here, face)
                    && corners(here).into_iter().all(near)
                    && faces_along(corners(here));
            if joins {
                faces.of[here as usize] = face;
                for v in shell.triangles[here as usize] {
                    touched[v as usize] = face;
                }
                queue.extend(shell.neighbours[here as usize].into_iter().filter(|&t| faces.of[t as usize] == NONE));
            }
        }
    }
    faces
}

/// Returns true if a face that is a disc stays a disc when triangle `t` joins it. The face stays a
/// disc if `t` shares two sides with it. The face also stays a disc if `t` shares one side and the
/// face does not contain the opposite corner of `t`.
fn keeps_a_disc(shell: &Shell, face_of: &[u32], touched: &[u32], t: u32, face: u32) -> bool {
    let shared = shell.neighbours[t as usize].map(|n| face_of[n as usize] == face);
    match shared.iter().filter(|&&s| s).count() {
        1 => (0..3).all(|k| !shared[k] || touched[shell.triangles[t as usize][(k + 2) % 3] as usize] != face),
        2 => true,
        _ => false,
    }
}

/// Does steps 3 and 4. Returns `Err` with the invalid faces. Returns `Ok(None)` if the topology is
/// invalid and the faces at fault are unknown.
#[allow(clippy::type_complexity, reason = "a private function with three outcomes")]
fn assemble(
    points: &[DVec3],
    shell: &Shell,
    faces: &Faces,
    coplanar: f64,
) -> Result<Option<(Polytope, Vec<u32>)>, Vec<bool>> {
    // A border visits each of its vertices once. Therefore the number of faces at a vertex equals
    // the number of border sides that start at the vertex.
    let mut valence = vec![0u32; points.len()];
    let mut first_side = vec![(NONE, 0); faces.founders.len()];
    for (t, corners) in shell.triangles.iter().enumerate() {
        let face = faces.of[t];
        for k in 0..3 {
            if face != faces.of[shell.neighbours[t][k] as usize] {
                valence[corners[k] as usize] += 1;
                if first_side[face as usize].0 == NONE {
                    first_side[face as usize] = (t as u32, k);
                }
            }
        }
    }
    let kept: Vec<u32> = (0..points.len() as u32).filter(|&v| valence[v as usize] >= 3).collect();
    let mut places = vec![NONE; points.len()];
    for (place, &v) in kept.iter().enumerate() {
        places[v as usize] = place as u32;
    }
    let stays = |v: u32| places[v as usize] != NONE;
    let sides: u32 = valence.iter().sum();
    let mut border = Vec::with_capacity(points.len());
    let mut loops = Vec::with_capacity(sides as usize);
    let mut loop_starts = Vec::with_capacity(faces.founders.len() + 1);
    loop_starts.push(0);
    let mut planes = Vec::with_capacity(faces.founders.len());
    let mut spoilt = vec![false; faces.founders.len()];
    for (face, &(seed, normal)) in faces.founders.iter().enumerate() {
        let begin = loops.len();
        if !border_from(shell, &faces.of, first_side[face], &mut border) {
            return Ok(None);
        }
        if !straightened(points, &mut border, stays, normal, coplanar, &mut loops) {
            spoilt[face] = true;
            loops.truncate(begin);
            continue;
        }
        // The plane of the first triangle supports the hull. If all corners of that triangle are
        // dropped, move the plane down to the remaining points.
        let founded = shell.triangles[seed as usize].into_iter().any(stays);
        let supported = if founded { &loops[begin..] } else { &kept };
        let offset = supported.iter().map(|&v| normal.dot(points[v as usize])).fold(f64::NEG_INFINITY, f64::max);
        planes.push(Plane { normal, offset });
        loops[begin..].iter_mut().for_each(|v| *v = places[*v as usize]);
        loop_starts.push(loops.len() as u32);
    }
    if spoilt.contains(&true) {
        return Err(spoilt);
    }
    let vertices = kept.iter().map(|&v| points[v as usize]).collect();
    let provenance = vec![Provenance::Original; planes.len()];
    Ok(Polytope::from_loops(vertices, loop_starts, loops, planes, provenance).ok().map(|polytope| (polytope, kept)))
}

/// Writes the vertices of a face's border into `border`, starting with the side `first` (triangle
/// and corner). Returns false if the face has no border.
fn border_from(shell: &Shell, face_of: &[u32], first: (u32, usize), border: &mut Vec<u32>) -> bool {
    let Some(&face) = face_of.get(first.0 as usize) else { return false };
    border.clear();
    let (mut t, mut k) = first;
    loop {
        border.push(shell.triangles[t as usize][k]);
        // Rotate about the head of the side, inside the face, to the next side of the border.
        k = (k + 1) % 3;
        loop {
            let across = shell.neighbours[t as usize][k];
            if face_of[across as usize] != face {
                break;
            }
            let head = shell.triangles[t as usize][k];
            let Some(corner) = shell.triangles[across as usize].iter().position(|&v| v == head) else { return false };
            (t, k) = (across, corner);
        }
        if (t, k) == first {
            return true;
        }
        if border.len() > shell.triangles.len() {
            return false;
        }
    }
}

/// Appends the corners of a border that stay to `loops`. Returns false in two cases: the corners do
/// not form a convex polygon about `normal`, or a dropped vertex does not lie on the side that
/// replaces it. Both tests allow the merge distance.
fn straightened(
    points: &[DVec3],
    border: &mut [u32],
    stays: impl Fn(u32) -> bool,
    normal: DVec3,
    coplanar: f64,
    loops: &mut Vec<u32>,
) -> bool {
    let Some(first) = border.iter().position(|&v| stays(v)) else { return false };
    border.rotate_left(first);
    let at = |v: u32| points[v as usize];
    // Distance of `v` to the left of the line from `tail` to `head`.
    let inside = |v: u32, tail: u32, head: u32| normal.dot(unit(at(head) - at(tail)).cross(at(v) - at(tail)));
    let begin = loops.len();
    loops.push(border[0]);
    let mut dropped = 0;
    for k in 1..=border.len() {
        let head = border[k % border.len()];
        if !stays(head) {
            dropped += 1;
            continue;
        }
        let tail = border[k - dropped - 1];
        // With exact coplanarity, dropped vertices lie exactly on the side. The test is then
        // skipped, because it could fail only by its own rounding errors.
        if coplanar > 0.0 && border[k - dropped..k].iter().any(|&v| inside(v, tail, head).abs() > coplanar) {
            return false;
        }
        dropped = 0;
        loops.push(head);
    }
    loops.pop();
    let corners = &loops[begin..];
    let n = corners.len();
    if n < 3 {
        return false;
    }
    let reflex = |k: usize| inside(corners[k], corners[(k + n - 1) % n], corners[(k + 1) % n]) > coplanar;
    if n > 3 && coplanar > 0.0 && (0..n).any(reflex) {
        return false;
    }
    let area: DVec3 = corners[1..].windows(2).map(|side| cross_of(at(corners[0]), at(side[0]), at(side[1]))).sum();
    area.dot(normal) > 0.0
}
