//! Chooses values that a scene file leaves out, from its meshes.
//!
//! 1. *Tolerance*: the smallest of 1 mm, a hundredth of the smaller body, and half of the least
//!    play that two bodies have in each other ([`tolerance_by_play`]). Bodies may fit near the
//!    file's poses. A tool may also fit where the frames of both meshes coincide, because CAD
//!    programs write the parts of an assembly in one frame. Smaller bodies among the other tools and
//!    the objects lower the tolerance to a hundredth of the smallest, but at most to a fifth.
//! 2. *Start poses*: if neither body has a pose and their boxes would overlap, the probe starts
//!    above the environment, without overlap in any orientation. The probe's distance from first
//!    touch is at most the larger body's size and the distance that a hand moves in a second
//!    without haste.
//! 3. *Grip* of the probe and of each other tool: the origin of its mesh, or its centre of mass if
//!    this origin is outside of the mesh's box.
//!
//! Bodies of implausible size suggest a wrong unit, so a note is printed. The chosen values depend
//! only on the file and the meshes, so a recording can be replayed.

use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::Pose;
use palpus::algebra::tolerance::TOLERANCE_SHARE;
use palpus::body::Body;
use palpus::render::{tolerance_by_play, tolerance_by_size};
use palpus_io::scene::{ObjectMotion, SceneFile};

use crate::approach::Ways;

/// Plausible sizes of bodies that are felt by hand, m.
const SMALL: f64 = 5e-3;
const LARGE: f64 = 2.0;
/// Largest plausible ratio of the sizes of two bodies; metres read as millimetres give 1000.
const UNLIKE: f64 = 300.0;
/// Small objects lower the tolerance to no less than this share of the other limits. A scene may
/// have one small screw beside large parts, and the hand may move slower between unexamined
/// surfaces if the tolerance is smaller.
const LEAST_BY_OBJECTS: f64 = 0.2;
/// Start height of the probe above the environment's box, as a multiple of the probe's reach.
const CLEARANCE: f64 = 0.25;

/// Fills in the values that `file` leaves out. Returns notes about values other than the defaults.
/// `ways` has the probe and the environment, and `others` are the bodies of all other tools and of
/// the objects.
pub(crate) fn fill(file: &mut SceneFile, ways: &mut Ways, others: &[Arc<Body>]) -> Vec<String> {
    let mut notes = Vec::new();
    let (probe, environment) = (&ways.probe.clone(), &ways.environment.clone());
    let [smaller, larger] = [probe.size().min(environment.size()), probe.size().max(environment.size())];
    if larger < SMALL || smaller > LARGE || larger > UNLIKE * smaller {
        notes.push(format!(
            "the probe is {} across and the environment {}; is `unit` right? A mesh may have a unit of its own",
            length(probe.size()),
            length(environment.size())
        ));
    }
    if file.gaps.tolerance {
        let default = file.render.contact_tolerance;
        let of_two = tolerance_by_size(probe, environment);
        let of_all = of_two.min(by_objects(others).max(LEAST_BY_OBJECTS * of_two));
        let chosen = tolerance_by_play(of_all, fits(file, [probe, environment], others));
        if file.gaps.cluster_radius {
            // The radius shrinks by the same factor as the tolerance.
            file.render.cluster_radius *= chosen / default;
        }
        file.render.contact_tolerance = chosen;
        if chosen < default {
            let why = match (chosen < of_all, of_all < of_two) {
                (true, _) => "half of the play of the parts",
                (false, true) if of_all > LEAST_BY_OBJECTS * of_two => "a hundredth of the smallest body",
                (false, true) => "because of the smallest body",
                (false, false) => "a hundredth of the smaller body",
            };
            notes.push(format!("contacts exist below {}, {why}; see [contact] tolerance", length(chosen)));
        }
    }
    if file.gaps.grip
        && let Some(grip_a) = grip(probe, "probe", &mut notes)
    {
        file.render.grip_a = grip_a;
    }
    if file.gaps.places && file.hand.path.is_none() {
        let overlapping = probe.mesh().bounds().overlaps(&environment.mesh().bounds());
        let start = if overlapping { Pose::from_translation(above(probe, environment)) } else { Pose::IDENTITY };
        let way = ways.find(start, file.environment.pose, file.render.contact_tolerance);
        let nearer = way.nearer(start, larger);
        if overlapping || nearer.is_some() {
            file.probe.pose = nearer.unwrap_or(start);
            let [x, y, z] = (file.probe.pose.translation / file.metres_per_unit).to_array();
            let place = if overlapping { "above" } else { "near" };
            notes.push(format!(
                "the probe starts {place} the environment, at [{x:.3}, {y:.3}, {z:.3}]; see [probe] position"
            ));
        }
    }
    notes
}

/// Returns the pairs of bodies of which one moves, at the poses at which they may fit.
fn fits<'a>(
    file: &SceneFile,
    [probe, environment]: [&'a Arc<Body>; 2],
    others: &'a [Arc<Body>],
) -> Vec<(&'a Arc<Body>, &'a Arc<Body>, Pose)> {
    let (tools, objects) = others.split_at(file.others.len());
    let tools = tools.iter().zip(&file.others).map(|(body, tool)| (body, tool.body.pose));
    let tools: Vec<_> = std::iter::once((probe, file.probe.pose)).chain(tools).collect();
    let fixed = (environment, file.environment.pose, false);
    let objects = objects
        .iter()
        .zip(&file.objects)
        .map(|(body, object)| (body, object.body.pose, object.motion != ObjectMotion::Fixed));
    let objects: Vec<_> = std::iter::once(fixed).chain(objects).collect();
    let mut fits = Vec::new();
    for &(tool, pose) in &tools {
        for &(object, place, _) in &objects {
            let pose_in_file = place.inverse() * pose;
            fits.push((tool, object, pose_in_file));
            if pose_in_file != Pose::IDENTITY {
                fits.push((tool, object, Pose::IDENTITY));
            }
        }
    }
    for (k, &(a, pose_a, moves_a)) in objects.iter().enumerate() {
        for &(b, pose_b, moves_b) in &objects[..k] {
            if moves_a || moves_b {
                fits.push((a, b, pose_b.inverse() * pose_a));
            }
        }
    }
    fits
}

/// Returns the tolerance (m) for the smallest of these bodies. Infinite without bodies.
fn by_objects(others: &[Arc<Body>]) -> f64 {
    others.iter().map(|body| TOLERANCE_SHARE * body.size()).fold(f64::INFINITY, f64::min)
}

/// Returns the grip of `body` in its mesh's frame, m: its centre of mass if the origin of the mesh
/// is outside of the mesh's box, else `None`. A note names the body as `what`.
pub(crate) fn grip(body: &Body, what: &str, notes: &mut Vec<String>) -> Option<DVec3> {
    let bounds = body.mesh().bounds();
    if DVec3::ZERO.clamp(bounds.min, bounds.max) == DVec3::ZERO {
        return None;
    }
    notes.push(format!(
        "the {what} is held at its centre of mass, because the origin of its mesh is outside of the mesh; `grip` sets another point"
    ));
    Some(body.mass().center_of_mass)
}

/// Formats a length (m) in a suitable unit.
pub(crate) fn length(metres: f64) -> String {
    let (times, unit) = match metres.abs() {
        large if large >= 1.0 => (1.0, "m"),
        middle if middle >= 0.1 => (1e2, "cm"),
        small if small >= 1e-4 => (1e3, "mm"),
        _ => (1e6, "µm"),
    };
    let value = metres * times;
    let figures = if value.abs() >= 100.0 {
        0
    } else if value.abs() >= 10.0 {
        1
    } else {
        2
    };
    format!("{value:.figures$} {unit}")
}

/// Returns the start position of the probe's middle relative to the environment's middle.
fn above(probe: &Body, environment: &Body) -> DVec3 {
    let (a, b) = (probe.mesh().bounds(), environment.mesh().bounds());
    let reach = 0.5 * (a.max - a.min).length();
    clear_above([b.min, b.max], reach) - 0.5 * (a.min + a.max)
}

/// Returns a position at which a body with this reach about a point is above the box in every
/// orientation.
pub(crate) fn clear_above([low, high]: [DVec3; 2], reach: f64) -> DVec3 {
    (0.5 * (low + high)).with_z(high.z + reach * (1.0 + CLEARANCE))
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use glam::DVec3;
    use palpus::detect::{ContactQuery, QuerySettings};
    use palpus_io::scene::FilePolicy;
    use palpus_io::write_obj_groups;
    use palpus_scenes::shape;

    use super::length;

    use crate::stage;

    #[test]
    fn lengths_have_a_suitable_unit() {
        let words = [2.5e-6, 3.464e-4, 0.02, 0.1234, 120.0].map(length);
        assert_eq!(words, ["2.50 µm", "0.35 mm", "20.0 mm", "12.3 cm", "120 m"]);
    }

    /// Creates a folder with `cube.obj`, a cube with sides of 20 units, away from its origin.
    fn folder_with_cube(name: &str) -> PathBuf {
        crate::bodies::use_cache(false);
        let folder = std::env::temp_dir().join(format!("palpus-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("the folder can be created");
        let mut cube = String::new();
        for k in 0..8u32 {
            let side = |bit: u32| 5.0 + 20.0 * f64::from(k >> bit & 1);
            cube += &format!("v {} {} {}\n", side(0), side(1), side(2));
        }
        cube += "f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";
        std::fs::write(folder.join("cube.obj"), cube).expect("the file can be written");
        folder
    }

    #[test]
    fn scene_of_two_bare_meshes_makes_contact() {
        let folder = folder_with_cube("gaps");
        let scene = folder.join("scene.toml");
        for (unit, tolerance, notes) in
            [("mm", 0.2e-3 * 3f64.sqrt(), 3), ("cm", 1e-3, 2), ("um", 0.2e-6 * 3f64.sqrt(), 4), ("m", 1e-3, 3)]
        {
            let text = format!("unit = \"{unit}\"\n[probe]\nmesh = \"cube.obj\"\n[environment]\nmesh = \"cube.obj\"\n");
            std::fs::write(&scene, text).expect("the file can be written");
            let stage =
                stage::prepare(&scene.display().to_string(), FilePolicy::Inside).expect("the scene can be read");
            assert_eq!(stage.notes.len(), notes, "{:?}", stage.notes);
            assert!((stage.settings.contact_tolerance / tolerance - 1.0).abs() < 1e-6, "{:?}", stage.settings);
            assert!((stage.settings.grip_a - stage.probe.mass().center_of_mass).length() < 1e-12);
            let felt = |time: f64| {
                let (a, b) = (&stage.probe, &stage.environment);
                let settings = QuerySettings { tolerance: 0.0, capacity: 256, ..QuerySettings::default() };
                let pose = stage.environment_pose.inverse() * stage.path.pose(time);
                let mut query = ContactQuery::new(a.clone(), b.clone(), settings);
                query.nearest(&pose).map_or(f64::INFINITY, |contact| contact.separation)
            };
            // The goal of the simulated operator may lie beyond a small body.
            let mut on_its_way = (0..4000).map(|k| felt(0.5 * stage.path.duration() * f64::from(k) / 4000.0));
            assert!(stage.path.duration() <= 2.1, "{unit}: the first touch must come within a second");
            assert!(felt(0.0) > 0.0 && on_its_way.any(|gap| gap < 0.0), "the bodies must begin apart and then touch");
        }
        let _ = std::fs::remove_dir_all(&folder);
    }

    #[test]
    fn small_objects_lower_the_tolerance() {
        let folder = folder_with_cube("gaps-small");
        let scene = folder.join("scene.toml");
        for (unit, tolerance, why) in [
            ("cm", 1e-3, None),
            ("mm", 0.2e-3 * 3f64.sqrt(), Some("contacts exist below 0.35 mm, a hundredth of the smallest body")),
            ("um", 0.2e-3, Some("contacts exist below 0.20 mm, because of the smallest body")),
        ] {
            let body = "mesh = \"cube.obj\"\n";
            let text = format!(
                "unit = \"cm\"\n[probe]\n{body}[environment]\n{body}[[object]]\n{body}unit = \"{unit}\"\nposition = [0, 0, -500]\n"
            );
            std::fs::write(&scene, text).expect("the file can be written");
            let stage =
                stage::prepare(&scene.display().to_string(), FilePolicy::Inside).expect("the scene can be read");
            assert!((stage.settings.contact_tolerance / tolerance - 1.0).abs() < 1e-6, "{unit}: {:?}", stage.settings);
            let note = stage.notes.iter().find(|note| note.starts_with("contacts exist"));
            assert_eq!(note.map(|note| note.split(';').next()), why.map(Some), "{unit}");
        }
        let _ = std::fs::remove_dir_all(&folder);
    }

    #[test]
    fn cluster_radius_follows_the_tolerance_unless_the_file_states_it() {
        let folder = folder_with_cube("gaps-radius");
        let scene = folder.join("scene.toml");
        let body = "mesh = \"cube.obj\"\nunit = \"mm\"\n";
        for (contact, radius) in [("", 0.8e-3 * 3f64.sqrt()), ("[contact]\ncluster_radius = 3\n", 3e-3)] {
            let text = format!("unit = \"mm\"\n{contact}[probe]\n{body}[environment]\n{body}position = [0, 0, -50]\n");
            std::fs::write(&scene, text).expect("the file can be written");
            let stage =
                stage::prepare(&scene.display().to_string(), FilePolicy::Inside).expect("the scene can be read");
            assert!((stage.settings.cluster_radius / radius - 1.0).abs() < 1e-6, "{contact}: {:?}", stage.settings);
        }
        let _ = std::fs::remove_dir_all(&folder);
    }

    #[test]
    fn play_lowers_the_tolerance_wherever_two_bodies_fit() {
        const CLEARANCE: f64 = 2e-4;
        let folder = folder_with_cube("gaps-play");
        let peg = shape::disc(shape::PEG_RADIUS, 0.02, 32);
        let fit = DVec3::Z * -0.0125;
        for (name, soup, by) in
            [("peg", &peg, fit), ("aside", &peg, DVec3::X), ("hole", &shape::hole_block(CLEARANCE), DVec3::ZERO)]
        {
            let mut moved = soup.clone();
            moved.vertices.iter_mut().for_each(|vertex| *vertex += by);
            let file = std::fs::File::create(folder.join(name).with_extension("obj"));
            write_obj_groups(&mut file.expect("the file can be created"), [(name, moved)])
                .expect("the file can be written");
        }
        let part = |key: &str, mesh: &str, more: &str| format!("{key}\nmesh = \"{mesh}.obj\"\n{more}\n");
        let cube = part("[probe]", "cube", "unit = \"mm\"\nposition = [0, 0, 0.5]");
        let hole = part("[environment]", "hole", "");
        for (what, scene, by_play) in [
            (
                "the frames of probe and environment coincide",
                part("[probe]", "peg", "position = [0, 0, 0.5]") + &hole,
                true,
            ),
            (
                "the file places the probe in the hole",
                part("[probe]", "aside", "position = [-1, 0, -0.0125]") + &hole,
                true,
            ),
            ("the probe fits nowhere", part("[probe]", "aside", "position = [0, 0, 0.5]") + &hole, false),
            ("an object is in the hole", cube.clone() + &hole + &part("[[object]]", "peg", "motion = \"free\""), true),
            (
                "an object that never moves is in the hole",
                cube + &hole + &part("[[object]]", "peg", "motion = \"fixed\""),
                false,
            ),
        ] {
            let file = folder.join("scene.toml");
            std::fs::write(&file, format!("unit = \"m\"\n{scene}")).expect("the file can be written");
            let stage = stage::prepare(&file.display().to_string(), FilePolicy::Inside).expect("the scene can be read");
            let tolerance = stage.settings.contact_tolerance;
            assert_eq!((0.9..1.25).contains(&(2.0 * tolerance / CLEARANCE)), by_play, "{what}: {:?}", stage.notes);
        }
        let _ = std::fs::remove_dir_all(&folder);
    }

    #[test]
    fn far_mesh_is_moved_near() {
        crate::bodies::use_cache(false);
        let folder = std::env::temp_dir().join(format!("palpus-gaps-far-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("the folder can be created");
        let cube = |name: &str, at: f64| {
            let corner = |k: u32| [0, 1, 2].map(|bit| f64::from(k >> bit & 1) + if bit == 1 { at } else { 0.0 });
            let vertices = (0..8).map(corner).map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect::<String>();
            let faces = "f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";
            std::fs::write(folder.join(name), vertices + faces).expect("the file can be written");
        };
        cube("a.obj", 0.0);
        cube("b.obj", 15.0);
        let scene = folder.join("scene.toml");
        let text = "unit = \"m\"\n[probe]\nmesh = \"a.obj\"\n[environment]\nmesh = \"b.obj\"\n";
        std::fs::write(&scene, text).expect("the file can be written");
        let stage = stage::prepare(&scene.display().to_string(), FilePolicy::Inside).expect("the scene can be read");
        let start = stage.path.pose(0.0).translation.y;
        assert!((13.0..14.0).contains(&start), "{start}");
        assert!(stage.path.duration() <= 4.0);
        let _ = std::fs::remove_dir_all(&folder);
    }
}
