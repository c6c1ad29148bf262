//! Bodies from the meshes of the scenes.

use std::sync::Arc;

use palpus::body::{Body, BodySettings, PolygonSoup};

pub(crate) fn body(soup: &PolygonSoup) -> Arc<Body> {
    Arc::new(Body::from_soup(soup, &BodySettings::default(), &mut |_| ()).expect("the mesh is a valid body"))
}
