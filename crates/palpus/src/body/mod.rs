//! All that is computed once per object: mesh, convex pieces, hierarchy of hulls, mass properties \[K02 §3.2\].

mod bounds;
mod contain;
mod decompose;
mod facet;
mod feature;
mod half_edge;
mod health;
mod hierarchy;
mod hull;
mod mass;
mod mesh;
mod orient;
mod polytope;
mod shading_normals;
mod soup;
mod triangle_pair;
mod triangle_tree;
mod triangulate;
mod weld;
mod well_formed;
mod winding;

pub use bounds::{OrientedBox, Sphere};
pub use feature::{Feature, FeaturePair};
pub use half_edge::{EdgeKind, HalfEdges};
pub use hierarchy::{Hierarchy, HierarchyError, Node, NodeKind};
pub use hull::{Hull, HullError, convex_hull, convex_polygon};
pub use mesh::{Cleaning, Mesh, MeshError};
pub use polytope::{Edge, Polytope, PolytopeError, Provenance, Spoke};
pub use soup::PolygonSoup;
pub use triangle_pair::TrianglePair;
pub use triangle_tree::{Aabb, RayHit, SurfacePoint, TriangleTree};
pub use triangulate::{Cut, triangulate};
pub use well_formed::Malformed;
