//! The objects of a scene in addition to the probe and the environment: `[[object]]`, and
//! `gravity`.

use glam::DVec3;
use palpus::algebra::Twist;

use super::keys::Section;
use super::read::{Files, read_body};
use super::{ObjectMotion, SceneError, SceneObject};

/// Largest number of objects in a scene, because every pair of objects can touch.
const MOST: usize = 200;
/// Default density of a free body in kg/m³: the density of water.
const DENSITY: f64 = 1000.0;
/// Default gravity of a scene with free bodies, m/s².
const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

const KEYS: [&str; 9] =
    ["mesh", "unit", "position", "orientation", "motion", "density", "mass", "velocity", "angular_velocity"];

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Fixed,
    Driven,
    Free,
}

/// Reads all `[[object]]` tables.
pub(super) fn read_objects(top: &Section<'_>, unit: f64, files: Files<'_>) -> Result<Vec<SceneObject>, SceneError> {
    let sections = top.sections("object", &KEYS)?;
    if let Some(one_too_many) = sections.get(MOST) {
        return Err(one_too_many
            .error(format!("a scene may have at most {MOST} objects; merge the fixed objects into one mesh")));
    }
    sections.iter().map(|section| read_object(section, unit, files)).collect()
}

fn read_object(section: &Section<'_>, unit: f64, files: Files<'_>) -> Result<SceneObject, SceneError> {
    let body = read_body(section, unit, files)?;
    let kinds = [("free", Kind::Free), ("driven", Kind::Driven), ("fixed", Kind::Fixed)];
    let kind = section.choice("motion", &kinds)?.unwrap_or(Kind::Free);
    let positive = |x: f64| x > 0.0;
    let density = section.number("density", "greater than 0 kg/m³", positive)?;
    let mass = section.number("mass", "greater than 0 kg", positive)?;
    let linear = section.vector("velocity")?.map(|velocity| DVec3::from_array(velocity.into_inner()) * unit);
    let angular = section.vector("angular_velocity")?.map(|velocity| DVec3::from_array(velocity.into_inner()));
    if kind != Kind::Free && (density.is_some() || mass.is_some()) {
        return Err(section.error("density and mass need motion = \"free\"; remove them"));
    }
    if kind != Kind::Driven && (linear.is_some() || angular.is_some()) {
        return Err(section.error("velocity and angular_velocity need motion = \"driven\"; remove them"));
    }
    let motion = match (kind, mass, density) {
        (Kind::Fixed, ..) => ObjectMotion::Fixed,
        (Kind::Driven, ..) => ObjectMotion::Driven(Twist {
            angular: angular.unwrap_or(DVec3::ZERO),
            linear: linear.unwrap_or(DVec3::ZERO),
        }),
        (Kind::Free, Some(_), Some(_)) => return Err(section.error("set either density or mass, not both")),
        (Kind::Free, Some(mass), None) => ObjectMotion::FreeOfMass(mass),
        (Kind::Free, None, density) => ObjectMotion::FreeOfDensity(density.unwrap_or(DENSITY)),
    };
    Ok(SceneObject { body, motion })
}

/// Reads `gravity` along the world's axes, in m/s² for every unit of the scene.
pub(super) fn read_gravity(top: &Section<'_>, objects: &[SceneObject]) -> Result<DVec3, SceneError> {
    if let Some(gravity) = top.vector("gravity")? {
        return Ok(DVec3::from_array(gravity.into_inner()));
    }
    let falls =
        |object: &SceneObject| matches!(object.motion, ObjectMotion::FreeOfMass(_) | ObjectMotion::FreeOfDensity(_));
    Ok(if objects.iter().any(falls) { GRAVITY } else { DVec3::ZERO })
}
