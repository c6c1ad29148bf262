//! Settings as lines of a scene file.

use std::fmt::Write as _;

use palpus::render::{Clustering, Settings};

/// Writes the tables `contact` and `coupling` of a scene file whose unit of length has this many
/// metres.
pub(super) fn toml(settings: &Settings, metres_per_unit: f64) -> String {
    let length = |metres: f64| metres / metres_per_unit;
    let clustering = if settings.clustering == Clustering::Smooth { "smooth" } else { "linkage" };
    let mut text = format!(
        "# Lengths in units of {metres_per_unit:?} m, as `unit` of the scene says.\n[contact]\ntolerance = {:?}\ncluster_radius = {:?}\n\
         clustering = \"{clustering}\"\nstiffness = {:?}\n",
        length(settings.contact_tolerance),
        length(settings.cluster_radius),
        settings.stiffness,
    );
    // Writing to a string cannot fail.
    if let Some(friction) = &settings.friction {
        let _ = writeln!(
            text,
            "friction = {{ static = {:?}, dynamic = {:?}, stiffness = {:?} }}",
            friction.static_coefficient, friction.dynamic_coefficient, friction.tangential_stiffness
        );
    }
    let _ = writeln!(text, "shading = {}", settings.shading.is_some());
    if let Some(shading) = &settings.shading {
        let (crease, most) = (shading.crease_angle.to_degrees(), shading.most_turn.to_degrees());
        let _ = writeln!(text, "crease_angle = {crease:?}\nshading_limit = {most:?}");
    }
    text += "\n[coupling]\n";
    let Some(coupling) = &settings.coupling else { return text + "mode = \"direct\"\n" };
    let _ = writeln!(
        text,
        "mode = \"coupled\"\nstiffness = {:?}\ndamping = {:?}\nangular_stiffness = {:?}\nangular_damping = {:?}\ncontact_offset = {:?}\nmass = {:?}",
        coupling.stiffness,
        coupling.damping,
        coupling.angular_stiffness,
        coupling.angular_damping,
        length(coupling.contact_offset),
        coupling.mass
    );
    text
}

#[cfg(test)]
mod tests {
    use palpus_device::SimulationSettings;
    use palpus_io::read_scene;
    use palpus_io::scene::{CouplingMode, FilePolicy};

    use super::*;
    use crate::stage;

    #[test]
    fn settings_are_kept_in_the_scene_file() {
        crate::bodies::use_cache(false);
        let stage = stage::prepare("spoon-cup", FilePolicy::Inside).expect("the scene is built in");
        let folder = std::env::temp_dir().join(format!("palpus-settings-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("the folder can be created");
        std::fs::write(folder.join("a.obj"), "").expect("the file can be written");
        for mode in [CouplingMode::Coupled, CouplingMode::Direct] {
            let settings = stage.settings_in(mode, &SimulationSettings::default().spec, 1000.0);
            let text = "unit = \"mm\"\n[probe]\nmesh = \"a.obj\"\n[environment]\nmesh = \"a.obj\"\n".to_owned();
            let scene = folder.join("scene.toml");
            std::fs::write(&scene, text + &toml(&settings, 1e-3)).expect("the file can be written");
            let read = read_scene(&scene, FilePolicy::Inside).expect("the scene can be read");
            let near = |one: f64, other: f64| assert!((one - other).abs() <= 1e-12 * other.abs(), "{one} {other}");
            near(read.render.contact_tolerance, settings.contact_tolerance);
            near(read.render.cluster_radius, settings.cluster_radius);
            near(read.render.stiffness, settings.stiffness);
            assert_eq!((read.coupling.mode, read.render.clustering), (mode, settings.clustering));
            assert_eq!(read.render.friction, settings.friction);
            let (read_shading, shading) = (read.render.shading, settings.shading);
            near(read_shading.map_or(0.0, |s| s.crease_angle), shading.map_or(0.0, |s| s.crease_angle));
            if let Some(coupling) = settings.coupling {
                assert_eq!(read.coupling.stiffness, Some(coupling.stiffness));
                near(read.coupling.contact_offset.unwrap_or(0.0), coupling.contact_offset);
            }
        }
        let _ = std::fs::remove_dir_all(&folder);
    }
}
