//! Finds convex connected parts of the surface, and makes each of them one patch.
//!
//! The time to grow a patch facet by facet is quadratic in its size, which is too slow for a
//! sphere of 80 000 triangles. A connected part without reflex sides is nearly always convex. The
//! part is convex if it passes these steps:
//!
//! 1. Compute the hull of all its vertices.
//! 2. Check that the plane of each facet supports the hull: the highest vertex along the facet's
//!    normal must lie in the plane. The search climbs from the highest vertex of the previous
//!    facet.
//! 3. Check that no triangle of another part enters the hull.

use std::ops::ControlFlow;

use glam::DVec3;

use crate::algebra::tolerance::{ENTERED, WHOLE_FACETS};
use crate::body::decompose::contain::Clipper;
use crate::body::decompose::facet::{Bend, Facets, NONE, Surface};
use crate::body::{Aabb, Hull, TriangleTree, convex_hull};

/// Returns the facets of each convex part that has at least [`WHOLE_FACETS`] facets.
pub(crate) fn convex_parts(surface: &Surface<'_>, facets: &Facets, tree: &TriangleTree) -> Vec<Vec<u32>> {
    let mut part_of = vec![NONE; facets.len()];
    let mut convex = Vec::new();
    for first in 0..facets.len() as u32 {
        if part_of[first as usize] != NONE {
            continue;
        }
        part_of[first as usize] = first;
        let mut part = vec![first];
        let mut reflex = false;
        let mut next = 0;
        while let Some(&f) = part.get(next) {
            next += 1;
            for link in facets.links(f) {
                reflex |= link.bend == Bend::Reflex;
                if part_of[link.facet as usize] == NONE {
                    part_of[link.facet as usize] = first;
                    part.push(link.facet);
                }
            }
        }
        let sheet = surface.is_sheet(facets.triangles(first)[0]);
        if !reflex && !sheet && part.len() >= WHOLE_FACETS && is_convex(surface, facets, tree, &part, &part_of) {
            convex.push(part);
        }
    }
    convex
}

fn is_convex(surface: &Surface<'_>, facets: &Facets, tree: &TriangleTree, part: &[u32], part_of: &[u32]) -> bool {
    let mut corners: Vec<u32> = part.iter().flat_map(|&f| facets.corners(f)).copied().collect();
    corners.sort_unstable();
    corners.dedup();
    let points: Vec<DVec3> = corners.iter().map(|&v| surface.vertex(v)).collect();
    let Ok(Hull::Solid { polytope, .. }) = convex_hull(&points, surface.noise()) else { return false };
    let mut top = 0;
    let supports = part.iter().all(|&f| {
        let plane = facets.plane(f);
        top = polytope.support_from(top, plane.normal);
        plane.height(polytope.vertex(top)) <= surface.noise()
    });
    if !supports {
        return false;
    }
    let mut clipper = Clipper::default();
    let depth = ENTERED * surface.noise();
    let visit = |t: u32, triangle: &[DVec3; 3]| {
        let other = part_of[facets.of_triangle(t) as usize] != part_of[part[0] as usize];
        if other && clipper.enters(*triangle, polytope.planes().iter().copied(), depth) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    tree.visit_overlapping(&Aabb::around(points), visit).is_continue()
}
