//! Writes the scenes of the benchmark as files for other engines.

use std::fmt::Write as _;
use std::path::Path;

use glam::DVec3;
use palpus::body::{Body, PolygonSoup};
use palpus_io::write_obj_groups;
use serde::Serialize;

use super::super::ground::Ground;
use super::super::open;
use super::super::truth::{self, True};
use super::clearance::Fit;
use crate::bench::TICK;
use crate::files;

/// Text of the folder's README: its files, and their terms of use.
const README: &str = include_str!("README.md");

/// Writes the folder's description.
pub(super) fn describe(out: &Path) -> anyhow::Result<()> {
    let text = README.replace("{version}", env!("CARGO_PKG_VERSION")).replace("{licence}", env!("CARGO_PKG_LICENSE"));
    files::write(&out.join("README.md"), text)
}

/// Parameters of a scene's contact, in SI units.
#[derive(Serialize)]
struct Parameters {
    /// Point of the probe about which torques are computed, in the probe's frame, m.
    grip: [f64; 3],
    /// Stiffness of a contact, N/m.
    stiffness: f64,
    /// Separation from which contacts of methods without a coupling push, m.
    tolerance: f64,
    /// Static and dynamic coefficient; `None` without friction.
    friction: Option<[f64; 2]>,
    /// Time between two rows of the motion, s.
    period: f64,
    /// True if the true wrench is known and written to `truth.csv`.
    has_truth: bool,
}

/// Writes the meshes, the motion and the parameters of a scene.
pub(super) fn write(out: &Path, ground: &Ground) -> anyhow::Result<()> {
    let folder = out.join("scenes").join(ground.name);
    files::make_folder(&folder)?;
    for (name, body) in [("probe", &ground.probe), ("environment", &ground.environment)] {
        files::write(&folder.join(format!("{name}.obj")), obj(name, soup(ground, name, body))?)?;
    }
    files::write(&folder.join("motion.csv"), motion(ground))?;
    if let Some(truth) = truth(ground) {
        files::write(&folder.join("truth.csv"), truth)?;
    }
    let settings = &ground.settings;
    let friction = settings.friction.filter(|_| open::tuning(ground).friction);
    let parameters = Parameters {
        grip: settings.grip_a.to_array(),
        stiffness: settings.stiffness,
        tolerance: settings.contact_tolerance,
        friction: friction.map(|friction| [friction.static_coefficient, friction.dynamic_coefficient]),
        period: TICK,
        has_truth: ground.truth.is_some()
            || ground.refined.is_some()
            || Fit::of(ground.name).is_some_and(|fit| fit.is_exact),
    };
    files::write(&folder.join("parameters.json"), serde_json::to_string_pretty(&parameters)? + "\n")
}

/// Returns the original polygons of a built-in scene, or the triangles of a model.
fn soup(ground: &Ground, name: &str, body: &Body) -> PolygonSoup {
    match palpus_scenes::scene(ground.name) {
        Some(scene) if name == "probe" => scene.probe,
        Some(scene) => scene.environment,
        None => PolygonSoup::from_triangles(body.mesh().vertices().to_vec(), body.mesh().triangles()),
    }
}

fn obj(name: &str, soup: PolygonSoup) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    write_obj_groups(&mut bytes, [(name, soup)])?;
    Ok(bytes)
}

/// Returns the true wrench at each row of the motion, for methods whose force begins where surfaces
/// touch. An unknown torque or row is empty. `None` for a scene without known wrenches.
fn truth(ground: &Ground) -> Option<String> {
    let exact = Fit::of(ground.name).filter(|fit| fit.is_exact);
    if ground.truth.is_none() && ground.refined.is_none() && exact.is_none() {
        return None;
    }
    let mut text = String::from("force_x,force_y,force_z,torque_x,torque_y,torque_z\n");
    for (k, probe) in ground.script.iter().enumerate() {
        let unit = match (&ground.truth, exact) {
            (Some(truth), _) => Some(truth::direct(truth, &ground.settings, 0.0, probe)),
            (None, Some(fit)) => Some(True { force: fit.overlap(probe), torque: None }),
            (None, None) => truth::shared(ground, 0.0, k),
        };
        let cells = |v: Option<DVec3>| {
            let v = v.map(|v| v * ground.settings.stiffness);
            v.map_or(",,".to_owned(), |v| format!("{:?},{:?},{:?}", v.x, v.y, v.z))
        };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{},{}", cells(unit.map(|unit| unit.force)), cells(unit.and_then(|unit| unit.torque)));
    }
    Some(text)
}

/// Returns the poses of the probe's mesh in the environment's frame: time (s), translation (m),
/// unit quaternion.
fn motion(ground: &Ground) -> String {
    let mut text = String::from("time,tx,ty,tz,qx,qy,qz,qw\n");
    for (k, probe) in ground.script.iter().enumerate() {
        let (t, q) = (probe.pose_ba.translation, probe.pose_ba.rotation);
        let time = k as f64 * TICK;
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{time:.3},{:?},{:?},{:?},{:?},{:?},{:?},{:?}", t.x, t.y, t.z, q.x, q.y, q.z, q.w);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpus_io::read_mesh_noting;

    /// The exported folder, read as another engine would read it, must equal the scene. The
    /// folder's README must name each file.
    #[test]
    fn folder_reads_back() {
        let out = std::env::temp_dir().join(format!("palpus-open-data-{}", std::process::id()));
        let ground = Ground::new("box-rest", 1.0).expect("the scene is built in");
        write(&out, &ground).expect("the file can be written");
        describe(&out).expect("the file can be written");
        let folder = out.join("scenes").join("box-rest");
        let text = |path: std::path::PathBuf| std::fs::read_to_string(path).expect("the file can be read");
        let numbers = |file: &str, columns: usize| -> Vec<Vec<f64>> {
            let text = text(folder.join(file));
            let rows = text.lines().skip(1);
            let rows: Vec<Vec<f64>> = rows
                .map(|row| row.split(',').map(|cell| cell.parse().expect("the cell is a number")).collect())
                .collect();
            assert!(rows.iter().all(|row| row.len() == columns), "{file}");
            rows
        };
        let motion = numbers("motion.csv", 8);
        assert_eq!(motion.len(), ground.script.len());
        for (row, probe) in motion.iter().zip(&ground.script) {
            let (t, q) = (probe.pose_ba.translation, probe.pose_ba.rotation);
            assert_eq!(row[1..], [t.x, t.y, t.z, q.x, q.y, q.z, q.w]);
        }
        // The box lies flat, so the force points straight up and is k times the overlap.
        let truth = numbers("truth.csv", 6);
        assert_eq!(truth.len(), motion.len());
        let largest = truth.iter().map(|row| row[2]).fold(0.0, f64::max);
        assert!(largest > 0.01 && truth.iter().all(|row| row[0] == 0.0 && row[1] == 0.0), "{largest}");
        let parameters: serde_json::Value =
            serde_json::from_str(&text(folder.join("parameters.json"))).expect("the JSON is valid");
        assert_eq!(parameters["stiffness"].as_f64(), Some(ground.settings.stiffness));
        assert_eq!(parameters["has_truth"].as_bool(), Some(true));
        let scene = palpus_scenes::scene("box-rest").expect("the scene is built in");
        for (name, made) in [("probe.obj", scene.probe), ("environment.obj", scene.environment)] {
            let soup = read_mesh_noting(&folder.join(name), &mut |_| ()).expect("the mesh can be read");
            assert_eq!((soup.vertices, soup.face_vertices), (made.vertices, made.face_vertices), "{name}");
        }
        let readme = text(out.join("README.md"));
        for entry in std::fs::read_dir(&folder).expect("the folder can be read") {
            let name = entry.expect("the entry can be read").file_name();
            assert!(readme.contains(&*name.to_string_lossy()), "README.md does not name {}", name.display());
        }
        assert!(readme.contains(env!("CARGO_PKG_VERSION")) && !readme.contains('{'), "{readme}");
        std::fs::remove_dir_all(&out).expect("the folder can be deleted");
    }
}
