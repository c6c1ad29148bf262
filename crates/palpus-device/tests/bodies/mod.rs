//! Bodies of a program's scenes, as the program makes them.

use std::sync::Arc;

use palpus::body::{Body, BodySettings, PolygonSoup};

/// The body of a mesh, flat where its file's digits are not.
pub(crate) fn body(soup: &PolygonSoup) -> Arc<Body> {
    let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    Arc::new(Body::from_soup(soup, &settings, &mut |_| ()).expect("a mesh that makes a body"))
}
