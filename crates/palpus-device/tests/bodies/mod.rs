//! Bodies for scenes, made with the settings of the program.

use std::sync::Arc;

use palpus::body::{Body, BodySettings, PolygonSoup};

/// Makes the body of a mesh, with faces flattened within the file's precision.
pub(crate) fn body(soup: &PolygonSoup) -> Arc<Body> {
    let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    Arc::new(Body::from_soup(soup, &settings, &mut |_| ()).expect("the mesh is valid"))
}
