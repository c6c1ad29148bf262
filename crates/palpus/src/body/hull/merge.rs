//! Merges the coplanar triangles of a hull into planar faces.
//!
//! 1. The largest triangle that has no face yet founds one. Its plane supports the whole hull exactly, and so it stays
//!    the face's plane: no drift along a chain of merges.
//! 2. The face grows across sides to triangles whose corners lie within the merge distance below that plane, and only
//!    so that it stays a disc with a simple border.
//! 3. A vertex inside one face is gone; one between only two faces lies on a straight side and is dropped from both.
//! 4. If that leaves a face with fewer than three corners, or two faces that share a pair of vertices twice, a merge
//!    was one too many: all is done again with a smaller merge distance, at last with exact coplanarity alone, which
//!    cannot fail.

use glam::DVec3;

use super::{
    HullError,
    normal::{cross_of, unit},
    quickhull::{Shell, orientation},
};
use crate::{
    algebra::{Plane, tolerance::HULL_MERGE_RETREAT},
    body::{Polytope, Provenance},
};

const NONE: u32 = u32::MAX;

/// The polytope with merged faces, and for each of its vertices the point.
pub(super) fn merged(points: &[DVec3], shell: &Shell, coplanar: f64) -> Result<(Polytope, Vec<u32>), HullError> {
    [coplanar, coplanar * HULL_MERGE_RETREAT, 0.0]
        .into_iter()
        .find_map(|coplanar| {
            let (groups, planes) = grow_faces(points, shell, coplanar);
            assemble(points, shell, &groups, planes)
        })
        .ok_or(HullError::Inconsistent)
}

/// The face that each triangle belongs to, and for each face the triangle that founded it and its plane.
fn grow_faces(points: &[DVec3], shell: &Shell, coplanar: f64) -> (Vec<u32>, Vec<(u32, DVec3)>) {
    let corners = |t: u32| shell.triangles[t as usize].map(|v| points[v as usize]);
    let areas: Vec<f64> = (0..shell.triangles.len() as u32)
        .map(|t| {
            let [a, b, c] = corners(t);
            (b - a).cross(c - a).length_squared()
        })
        .collect();
    let mut order: Vec<u32> = (0..shell.triangles.len() as u32).collect();
    order.sort_by(|&s, &t| areas[t as usize].total_cmp(&areas[s as usize]));
    let mut groups = vec![NONE; shell.triangles.len()];
    let mut touched = vec![NONE; points.len()];
    let mut founders = Vec::new();
    let mut queue: Vec<u32> = Vec::new();
    for seed in order {
        if groups[seed as usize] != NONE {
            continue;
        }
        let [a, b, c] = corners(seed);
        let normal = unit(cross_of(a, b, c));
        let near = |p: DVec3| (coplanar > 0.0 && normal.dot(p - a) >= -coplanar) || orientation(a, b, c, p) == 0.0;
        let group = founders.len() as u32;
        founders.push((seed, normal));
        queue.clear();
        queue.push(seed);
        let mut done = 0;
        while done < queue.len() {
            let here = queue[done];
            done += 1;
            if groups[here as usize] != NONE {
                continue;
            }
            if here != seed
                && !(keeps_a_disc(shell, &groups, &touched, here, group) && corners(here).into_iter().all(near))
            {
                continue;
            }
            groups[here as usize] = group;
            for v in shell.triangles[here as usize] {
                touched[v as usize] = group;
            }
            queue.extend(shell.neighbours[here as usize].into_iter().filter(|&t| groups[t as usize] == NONE));
        }
    }
    (groups, founders)
}

/// Whether a face that is a disc stays one when triangle `t` joins it: through one side with the far corner new to the
/// face, or through two.
fn keeps_a_disc(shell: &Shell, groups: &[u32], touched: &[u32], t: u32, group: u32) -> bool {
    let shared = shell.neighbours[t as usize].map(|n| groups[n as usize] == group);
    match shared.iter().filter(|&&s| s).count() {
        1 => (0..3).all(|k| !shared[k] || touched[shell.triangles[t as usize][(k + 2) % 3] as usize] != group),
        2 => true,
        _ => false,
    }
}

/// Builds the polytope of the merged faces; `None` when they do not make one.
fn assemble(
    points: &[DVec3],
    shell: &Shell,
    groups: &[u32],
    founders: Vec<(u32, DVec3)>,
) -> Option<(Polytope, Vec<u32>)> {
    // A face passes a vertex of its border once, so a vertex has as many faces as borders leave it.
    let mut valence = vec![0u32; points.len()];
    let mut first_side = vec![(NONE, 0); founders.len()];
    for (t, corners) in shell.triangles.iter().enumerate() {
        for k in 0..3 {
            if groups[t] != groups[shell.neighbours[t][k] as usize] {
                valence[corners[k] as usize] += 1;
                let first = &mut first_side[groups[t] as usize];
                if first.0 == NONE {
                    *first = (t as u32, k);
                }
            }
        }
    }
    let kept: Vec<u32> = (0..points.len() as u32).filter(|&v| valence[v as usize] >= 3).collect();
    let mut places = vec![NONE; points.len()];
    for (place, &v) in kept.iter().enumerate() {
        places[v as usize] = place as u32;
    }
    let mut loops = Vec::with_capacity(founders.len());
    let mut planes = Vec::with_capacity(founders.len());
    for (&side, &(seed, normal)) in first_side.iter().zip(&founders) {
        let mut border = border_from(shell, groups, side)?;
        border.retain(|&v| places[v as usize] != NONE);
        if border.len() < 3 {
            return None;
        }
        // The founding plane supports the hull; when its own corners are gone, lower it onto what is left.
        let founded = shell.triangles[seed as usize].iter().any(|&v| places[v as usize] != NONE);
        let supported = if founded { &border } else { &kept };
        let offset = supported.iter().map(|&v| normal.dot(points[v as usize])).fold(f64::NEG_INFINITY, f64::max);
        planes.push(Plane { normal, offset });
        loops.push(border.iter().map(|&v| places[v as usize]).collect::<Vec<_>>());
    }
    let vertices = kept.iter().map(|&v| points[v as usize]).collect();
    let provenance = vec![Provenance::Original; planes.len()];
    Polytope::from_faces(vertices, &loops, planes, provenance).ok().map(|polytope| (polytope, kept))
}

/// The border of the face that lies left of `first`, a side of it given as triangle and corner.
fn border_from(shell: &Shell, groups: &[u32], first: (u32, usize)) -> Option<Vec<u32>> {
    let group = groups[*[first.0].first()? as usize];
    let mut border = Vec::new();
    let (mut t, mut k) = first;
    loop {
        border.push(shell.triangles[t as usize][k]);
        // Turn about the side's head, inside the face, to the next side of the border.
        k = (k + 1) % 3;
        loop {
            let across = shell.neighbours[t as usize][k];
            if groups[across as usize] != group {
                break;
            }
            let head = shell.triangles[t as usize][k];
            k = shell.triangles[across as usize].iter().position(|&v| v == head)?;
            t = across;
        }
        if (t, k) == first {
            return Some(border);
        }
        if border.len() > 3 * shell.triangles.len() {
            return None;
        }
    }
}
