//! Values that the engine's feature `serde` writes are read back bit for bit.

use std::sync::Arc;

use palpus::glam::{DQuat, DVec3};
use palpus::{Body, Contact, ContactQuery, FrictionSettings, Pose, QuerySettings, Settings};
use serde::{Deserialize, Serialize};

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Document {
    settings: Settings,
    pose: Pose,
    contacts: Vec<Contact>,
}

#[test]
fn settings_and_contacts_are_read_back_exactly() {
    let corners = [-0.5, 0.5].map(|x| [-0.5, 0.5].map(|y| [-0.5, 0.5].map(|z| DVec3::new(x, y, z))));
    let cube = Arc::new(Body::from_convex(corners.as_flattened().as_flattened()).unwrap());
    let asked = QuerySettings { tolerance: 0.01, patch_angle: Some(0.1), ..QuerySettings::default() };
    let mut query = ContactQuery::new(cube.clone(), cube, asked);
    let pose = Pose::new(DQuat::from_rotation_z(0.3), DVec3::new(0.1, 0.2, 0.995));
    let contacts = query.contacts(&pose).to_vec();
    assert!(contacts.len() > 2, "a patch: {contacts:?}");
    let friction = FrictionSettings { static_coefficient: 0.4, dynamic_coefficient: 0.3, tangential_stiffness: 1e3 };
    let settings = Settings { friction: Some(friction), split_angle: None, ..Settings::default() };
    let document = Document { settings, pose, contacts };
    let text = toml::to_string(&document).unwrap();
    assert_eq!(toml::from_str::<Document>(&text).unwrap(), document, "{text}");
    let misspelt = text.replacen("cluster_radius", "clusters_radius", 1);
    let error = toml::from_str::<Document>(&misspelt).unwrap_err().to_string();
    assert!(error.contains("clusters_radius"), "{error}");
}
