//! All data that are computed once per object: its mesh, convex pieces, hierarchy of hulls and mass
//! properties \[K02 §3.2\].

mod aabb;
#[expect(clippy::module_inception, reason = "the room is named after its main type")]
mod body;
mod decompose;
mod hierarchy;
mod hull;
mod mass;
mod mesh;
mod piece;
mod polytope;
mod precision;
#[cfg(test)]
pub(crate) mod shapes;

pub use aabb::Aabb;
pub use body::{Body, BodyError, BodyParts, BodySettings, Ground};
pub use hierarchy::bounds::{OrientedBox, Sphere};
pub use hierarchy::{Hierarchy, HierarchyError, HierarchyFault, Node, NodeKind};
pub use hull::{Hull, HullError, convex_hull, convex_polygon};
pub use mass::{MassProperties, MassSource, PrincipalInertia};
pub use mesh::half_edge::{EdgeKind, HalfEdges};
pub use mesh::health::{ComponentHealth, Health, Notice, SelfIntersections};
pub use mesh::shading_normals::ShadingNormals;
pub use mesh::soup::PolygonSoup;
pub use mesh::triangle_pair::TrianglePair;
pub use mesh::triangle_tree::{RayHit, SurfacePoint, TriangleTree};
pub use mesh::triangulate::{Cut, triangulate};
pub use mesh::{Cleaning, Mesh, MeshError};
pub use piece::Piece;
pub use piece::admissible::{Admissible, AdmissibleNormals, Borrowed, Cap, SurfaceArc, SurfaceFace};
pub(crate) use piece::admissible::{Border, FaceRim, FlatAround, Valley, gap_beside, is_near};
pub use polytope::feature::{Feature, FeaturePair};
pub use polytope::validate::Malformed;
pub use polytope::{
    Edge, Loop, LoopIter, Polytope, PolytopeError, PolytopeRestorer, Provenance, Ring, RingIter, Spoke,
};
