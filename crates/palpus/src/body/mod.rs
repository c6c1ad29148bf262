//! All that is computed once per object: mesh, convex pieces, hierarchy of hulls, mass properties \[K02 §3.2\].

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
mod polytope;
mod shading_normals;
mod soup;
mod triangle_tree;
mod triangulate;
mod well_formed;

pub use feature::{Feature, FeaturePair};
pub use hull::{Hull, HullError, convex_hull, convex_polygon};
pub use polytope::{Edge, Polytope, PolytopeError, Provenance, Spoke};
pub use soup::PolygonSoup;
pub use well_formed::Malformed;
