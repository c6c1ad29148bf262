//! All that is computed once per object: mesh, convex pieces, hierarchy of hulls, mass properties \[K02 §3.2\].

mod aabb;
mod admissible;
#[expect(clippy::module_inception, reason = "the room is named after what is built in it, and this is it")]
mod body;
mod bounds;
mod contain;
mod decompose;
mod directory;
mod edge_uses;
mod facet;
mod feature;
mod grow;
mod half_edge;
mod health;
mod hierarchy;
mod hull;
mod mass;
mod mesh;
mod orient;
mod piece;
mod polytope;
mod precision;
mod shading_normals;
#[cfg(test)]
mod shapes;
mod soup;
mod thicken;
mod trial_hull;
mod triangle_pair;
mod triangle_tree;
mod triangulate;
mod weld;
mod well_formed;
mod whole;
mod wide_hull;

pub use aabb::Aabb;
pub use admissible::{Admissible, Borrowed, Cap, OwnArc, OwnFace, OwnNormals};
pub use body::{Body, BodyError, BodyParts, BodySettings, Ground};
pub use bounds::{OrientedBox, Sphere};
pub use feature::{Feature, FeaturePair};
pub use half_edge::{EdgeKind, HalfEdges};
pub use health::{ComponentHealth, Health, Notice, SelfIntersections};
pub use hierarchy::{Hierarchy, HierarchyError, HierarchyFault, Node, NodeKind};
pub use hull::{Hull, HullError, convex_hull, convex_polygon};
pub use mass::{MassProperties, MassSource, PrincipalInertia};
pub use mesh::{Cleaning, Mesh, MeshError};
pub use piece::Piece;
pub use polytope::{
    Edge, Loop, LoopIter, Polytope, PolytopeError, PolytopeRestorer, Provenance, Ring, RingIter, Spoke,
};
pub use shading_normals::ShadingNormals;
pub use soup::PolygonSoup;
pub use triangle_pair::TrianglePair;
pub use triangle_tree::{RayHit, SurfacePoint, TriangleTree};
pub use triangulate::{Cut, triangulate};
pub use well_formed::Malformed;
