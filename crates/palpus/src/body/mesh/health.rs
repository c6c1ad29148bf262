//! Diagnoses a mesh: open or non-manifold edges, self-intersections, components, and the
//! repairs that were made.
//!
//! 1. Count the edges of one triangle (boundary), the edges of three or more triangles
//!    (non-manifold), and the edges of two triangles that disagree about the outer side.
//! 2. Count *pinched* vertices: their triangles form more than one fan, because two parts of the
//!    surface touch at the vertex.
//! 3. For each component, find whether it is closed, and compute the genus of closed components by
//!    Euler's formula. A pinched vertex counts once per fan.
//! 4. Count self-intersections: pairs of triangles that cross, overlap in a plane or touch. All
//!    pairs whose boxes overlap are tested exactly, up to a maximum number of tests.
//! 5. Report the findings to the user as [`Notice`]s.

mod components;
mod notice;
mod self_intersections;
#[cfg(test)]
mod tests;

use crate::body::mesh::edge_uses::EdgeUses;
use crate::body::{Cleaning, HalfEdges, Mesh, TriangleTree};
pub use components::ComponentHealth;
use components::{Fans, components};
pub use notice::Notice;
pub use self_intersections::SelfIntersections;

/// Diagnosis of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Health {
    /// Changes that were made to the polygons of the file.
    pub cleaning: Cleaning,
    /// Diagnosis of each component, in the order of the components' first triangles.
    pub components: Vec<ComponentHealth>,
    /// Number of edges that a single triangle uses.
    pub boundary_edges: usize,
    /// Number of edges that three or more triangles use.
    pub non_manifold_edges: usize,
    /// Number of edges of two triangles that disagree about the outer side.
    pub disagreeing_edges: usize,
    /// Number of vertices where parts of the surface touch without sharing an edge.
    pub pinched_vertices: usize,
    /// True if each edge is used equally often in both directions. The surface then has no
    /// boundary.
    pub closed: bool,
    /// Self-intersections; `None` if they were not tested.
    pub self_intersections: Option<SelfIntersections>,
}

impl Health {
    /// Computes everything except self-intersections, in linear time.
    pub fn quick(mesh: &Mesh, edges: &HalfEdges, cleaning: Cleaning) -> Self {
        let mut health = Self {
            cleaning,
            components: Vec::new(),
            boundary_edges: 0,
            non_manifold_edges: 0,
            disagreeing_edges: 0,
            pinched_vertices: 0,
            closed: mesh.is_closed(),
            self_intersections: None,
        };
        let mut branched = vec![false; mesh.vertices().len()];
        for uses in EdgeUses::new(mesh.vertices().len(), mesh.triangles()).edges() {
            let (t, k) = (uses[0] / 3, (uses[0] % 3) as usize);
            match uses.len() {
                1 => health.boundary_edges += 1,
                2 if edges.neighbour(t, k).is_some() => continue,
                2 => health.disagreeing_edges += 1,
                _ => health.non_manifold_edges += 1,
            }
            if uses.len() > 1 {
                let triangle = mesh.triangles()[t as usize];
                (branched[triangle[k] as usize], branched[triangle[(k + 1) % 3] as usize]) = (true, true);
            }
        }
        let fans = Fans::new(mesh, edges);
        health.pinched_vertices =
            fans.at_vertex.iter().zip(&branched).filter(|&(&fans, &branched)| fans > 1 && !branched).count();
        health.components = components(mesh, edges, &fans);
        health
    }

    /// Computes everything, including self-intersections.
    pub fn full(mesh: &Mesh, edges: &HalfEdges, tree: &TriangleTree, cleaning: Cleaning) -> Self {
        Self { self_intersections: Some(SelfIntersections::count(mesh, tree)), ..Self::quick(mesh, edges, cleaning) }
    }

    /// Returns true if each edge has one triangle or two triangles that agree, and no vertex is
    /// pinched.
    pub fn is_manifold(&self) -> bool {
        self.non_manifold_edges + self.disagreeing_edges + self.pinched_vertices == 0
    }

    /// Returns the sum of the genera of all components; `None` if the surface is not closed or not
    /// manifold.
    pub fn genus(&self) -> Option<usize> {
        if self.closed && self.is_manifold() { self.components.iter().map(|c| c.genus).sum() } else { None }
    }

    /// Returns all notices for the user, the most important first.
    pub fn notices(&self) -> Vec<Notice> {
        let cleaning = &self.cleaning;
        let mut notices = Vec::new();
        let mut tell = |count: usize, notice: fn(usize) -> Notice| {
            if count > 0 {
                notices.push(notice(count));
            }
        };
        tell(self.boundary_edges, Notice::Open);
        if let Some(own) = self.self_intersections.filter(SelfIntersections::any) {
            tell(own.triangles, if own.complete { Notice::SelfIntersecting } else { Notice::SelfIntersectingAtLeast });
        }
        tell(self.non_manifold_edges, Notice::NonManifoldEdges);
        tell(self.disagreeing_edges, Notice::DisagreeingEdges);
        tell(cleaning.one_sided_components, Notice::OneSided);
        tell(self.pinched_vertices, Notice::PinchedVertices);
        tell(self.self_intersections.map_or(0, |own| own.touching_pairs), Notice::Touching);
        tell(cleaning.inverted_components, Notice::Inverted);
        tell(cleaning.turned_triangles, Notice::Turned);
        tell(cleaning.duplicate_triangles, Notice::Duplicates);
        tell(cleaning.empty_triangles, Notice::EmptyTriangles);
        tell(cleaning.exchanged_triangles, Notice::ExchangedTriangles);
        tell(cleaning.degenerate_faces, Notice::DegenerateFaces);
        tell(cleaning.self_crossing_faces, Notice::SelfCrossingFaces);
        tell(cleaning.welded_vertices, Notice::Welded);
        tell(cleaning.unused_vertices, Notice::Unused);
        notices
    }
}
