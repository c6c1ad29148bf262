//! Connected parts of the surface that are convex as a whole, each found to be one patch at once.
//!
//! Growing a patch facet by facet costs the square of its size, which is slow for a sphere of 80
//! 000 triangles. A part without any reflex side is nearly always convex. One test proves it:
//!
//! 1. The hull of all its vertices.
//! 2. Each facet's plane supports the hull: its extreme vertex, found by climbing from the last
//!    facet's, is in the plane.
//! 3. No triangle of another part enters the hull.

use std::ops::ControlFlow;

use glam::DVec3;

use crate::algebra::tolerance::{ENTERED, WHOLE_FACETS};
use crate::body::decompose::contain::Clipper;
use crate::body::decompose::facet::{Bend, Facets, NONE, Surface};
use crate::body::{Aabb, Hull, TriangleTree, convex_hull};

/// The convex parts of at least [`WHOLE_FACETS`] facets.
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
        if !reflex && part.len() >= WHOLE_FACETS && is_convex(surface, facets, tree, &part, &part_of) {
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
