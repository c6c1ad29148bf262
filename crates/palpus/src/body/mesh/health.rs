//! The state of a mesh: closed or open, manifold, self-intersecting, inverted; and the repairs that
//! made it a mesh.
//!
//! 1. Edges: used by one triangle (boundary), by three or more (non-manifold), or by two that
//!    disagree.
//! 2. Vertices whose triangles form more than one fan are *pinched*: parts of the surface touch
//!    there.
//! 3. Components: closed or open, and the genus of closed ones by Euler's formula, pinched vertices
//!    taken apart.
//! 4. Self-intersections: pairs of triangles that cross, overlap in a plane or touch, by exact
//!    tests of all pairs whose boxes overlap. The number of tests is bounded.
//! 5. Notices of these findings for the user ([`Notice`]).

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

/// Health of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Health {
    /// Changes that were made to the file's polygons.
    pub cleaning: Cleaning,
    /// Each component, in the order of its first triangle.
    pub components: Vec<ComponentHealth>,
    /// Edges that a single triangle uses.
    pub boundary_edges: usize,
    /// Edges that three or more triangles use.
    pub non_manifold_edges: usize,
    /// Edges of two triangles that disagree about which side is outside.
    pub disagreeing_edges: usize,
    /// Vertices at which parts of the surface touch that share no edge there.
    pub pinched_vertices: usize,
    /// Each edge is used as often in either direction: the surface has no boundary.
    pub closed: bool,
    /// `None` if self-intersections were not tested.
    pub self_intersections: Option<SelfIntersections>,
}

impl Health {
    /// Everything but self-intersections, in linear time.
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

    /// Everything, self-intersections included.
    pub fn full(mesh: &Mesh, edges: &HalfEdges, tree: &TriangleTree, cleaning: Cleaning) -> Self {
        Self { self_intersections: Some(SelfIntersections::count(mesh, tree)), ..Self::quick(mesh, edges, cleaning) }
    }

    /// Each edge has one or two triangles, which agree, and no vertex is pinched.
    pub fn is_manifold(&self) -> bool {
        self.non_manifold_edges + self.disagreeing_edges + self.pinched_vertices == 0
    }

    /// Number of handles of all components together, when the surface is closed and manifold.
    pub fn genus(&self) -> Option<usize> {
        if self.closed && self.is_manifold() { self.components.iter().map(|c| c.genus).sum() } else { None }
    }

    /// All notices for the user, the most important first.
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
