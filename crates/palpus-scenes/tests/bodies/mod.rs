//! Bodies out of the scenes' meshes.

use std::sync::Arc;

use palpus::body::{Body, BodySettings, PolygonSoup};

pub(crate) fn body(soup: &PolygonSoup) -> Arc<Body> {
    Arc::new(Body::from_soup(soup, &BodySettings::default(), &mut |_| ()).expect("the mesh makes a body"))
}
