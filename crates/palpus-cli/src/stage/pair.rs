//! A scene of two meshes without a scene file: `palpus run PROBE ENVIRONMENT`.
//!
//! 1. Both meshes are read. Without units from the user, likely units are chosen from their sizes
//!    ([`LikelyUnit`]), and a note tells which.
//! 2. The text of a scene file with these meshes and units is made. All other values are chosen as
//!    for a scene file that leaves them out ([`crate::gaps`]).
//! 3. The scene is prepared from this text as if it were a file in the smallest folder that
//!    contains both meshes, or in the current folder if that contains them. The recording contains
//!    the text, so the run can be replayed and saved from the window like the run of a scene file.
//!    The file itself is not written.

use std::path::{Path, PathBuf};
use std::thread;

use anyhow::{Context, anyhow, bail};
use glam::DVec3;
use palpus::body::{Aabb, PolygonSoup};
use palpus_io::scene::{FilePolicy, LikelyUnit, SceneBody, metres, parse_scene};

use super::Stage;
use super::prepare::{Part, of_file};
use crate::bodies::{self, Teller};
use crate::{files, output};

/// Prepares the scene of the meshes `files`: the probe's and the environment's. `units`: no unit, a
/// unit for both, or one for each.
pub(crate) fn of_pair(files: [&str; 2], units: &[String]) -> anyhow::Result<Stage> {
    let files = files.map(Path::new);
    let soups = read(files)?;
    let units = chosen(units, &soups)?;
    let (path, meshes) = place(files)?;
    let text = text(&meshes, &units, files)?;
    // The user named both meshes.
    let scene = parse_scene(&text, &path, FilePolicy::Anywhere)?;
    let of = |part: Part, _: &SceneBody| Ok(soups[usize::from(part != Part::Probe)].clone());
    Ok(Stage { has_file: false, ..of_file(&path, scene, &of, &Teller::Bar)? })
}

/// Prepares the scene of two meshes again, from its recorded `text` and `path`.
#[cfg(feature = "window")]
pub(crate) fn of_pair_again(path: &Path, text: &str, teller: &Teller<'_>) -> anyhow::Result<Stage> {
    let scene = parse_scene(text, path, FilePolicy::Anywhere)?;
    let of = |_: Part, body: &SceneBody| Ok(bodies::read_mesh(&body.mesh)?);
    Ok(Stage { has_file: false, ..of_file(path, scene, &of, teller)? })
}

/// Returns the name of the scene of two meshes.
pub(crate) fn pair_name(files: [&str; 2]) -> String {
    files.map(|file| Path::new(file).file_stem().unwrap_or_default().to_string_lossy().into_owned()).join("-")
}

/// Reads both meshes (step 1), on two threads.
fn read(files: [&Path; 2]) -> anyhow::Result<[PolygonSoup; 2]> {
    let is_scene = |file: &&&Path| file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    let is_built_in = |file: &&&Path| file.to_str().is_some_and(|name| palpus_scenes::scene(name).is_some());
    if let Some(scene) = files.iter().find(|file| is_scene(file) || is_built_in(file)) {
        bail!("{} is a scene; a run takes one scene, or two meshes", scene.display());
    }
    if files.into_iter().any(files::is_standard) {
        bail!("a run can be replayed from its recording only if its meshes are files; name a file instead of `-`");
    }
    let [probe, environment] = files;
    thread::scope(|scope| {
        let reading = scope.spawn(|| bodies::read_mesh(environment));
        let probe = bodies::read_mesh(probe)?;
        let environment = reading.join().map_err(|_| anyhow!("a mesh could not be read; please report this"))?;
        Ok([probe, environment?])
    })
}

/// Returns the names of the units: the user's, or likely ones.
fn chosen(units: &[String], soups: &[PolygonSoup; 2]) -> anyhow::Result<[String; 2]> {
    if let Some(bad) = units.iter().find(|unit| metres(unit).is_err()) {
        let known = metres(bad).err().unwrap_or_default();
        bail!("--unit {bad} is not a unit of length; usual names are {known}");
    }
    match units {
        [both] => return Ok([both.clone(), both.clone()]),
        [probe, environment] => return Ok([probe.clone(), environment.clone()]),
        [] => {}
        _ => bail!("--unit can be given twice: for the probe and for the environment"),
    }
    let sizes = soups.each_ref().map(|soup| {
        let bounds = Aabb::around(soup.vertices.iter().copied());
        (bounds.max - bounds.min).max(DVec3::ZERO)
    });
    let units = LikelyUnit::of_pair(sizes, [None; 2]).unwrap_or_else(|| sizes.map(LikelyUnit::of));
    let across = |k: usize| crate::gaps::length(sizes[k].length() * units[k].metres());
    let (across, names) = ([across(0), across(1)], units.map(LikelyUnit::name));
    let seen = if names[0] == names[1] {
        format!("the unit of both meshes seems to be {}", names[0])
    } else {
        format!("the unit seems to be {} for the probe and {} for the environment", names[0], names[1])
    };
    output::note(format!(
        "note: {seen} (the probe is {} across, the environment {}); --unit sets another",
        across[0], across[1]
    ));
    Ok(units.map(|unit| unit.name().to_owned()))
}

/// Returns a free path for the scene's file (step 3), and the meshes as this file names them.
fn place(typed: [&Path; 2]) -> anyhow::Result<(PathBuf, [PathBuf; 2])> {
    let real = |file: &Path| file.canonicalize().with_context(|| format!("{} cannot be read", file.display()));
    let meshes = [real(typed[0])?, real(typed[1])?];
    let here = std::env::current_dir().and_then(|folder| folder.canonicalize()).unwrap_or_default();
    let mut folders = std::iter::once(here.as_path()).chain(meshes[0].ancestors().skip(1));
    let folder = folders.find(|folder| meshes.iter().all(|mesh| mesh.starts_with(folder))).unwrap_or(&here);
    let named = meshes.each_ref().map(|mesh| mesh.strip_prefix(folder).unwrap_or(mesh).to_owned());
    let name = pair_name(typed.map(|file| file.to_str().unwrap_or("mesh")));
    Ok((files::free(&folder.join(name + ".toml")), named))
}

/// Returns the text of the scene file (step 2).
fn text(meshes: &[PathBuf; 2], units: &[String; 2], files: [&Path; 2]) -> anyhow::Result<String> {
    let quoted = |mesh: &Path| {
        let name = mesh.to_str().with_context(|| format!("a scene file cannot name {}", mesh.display()))?;
        anyhow::Ok(toml::Value::from(name).to_string())
    };
    let [probe, environment] = [quoted(&meshes[0])?, quoted(&meshes[1])?];
    let own = if units[0] == units[1] { String::new() } else { format!("unit = {:?}\n", units[1]) };
    let typed = files.map(|file| file.to_string_lossy().replace(char::is_control, " ")).join(" ");
    Ok(format!(
        "# palpus run {typed}\nunit = {:?}\n\n[probe]\nmesh = {probe}\n\n[environment]\nmesh = {environment}\n{own}",
        units[0]
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron with edges of this length.
    fn tetrahedron(side: f64) -> String {
        format!("v 0 0 0\nv {side} 0 0\nv 0 {side} 0\nv 0 0 {side}\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    }

    #[test]
    fn two_meshes_make_a_scene() {
        bodies::use_cache(false);
        let folder = std::env::temp_dir().join(format!("palpus-pair-{}", std::process::id()));
        let inner = folder.join("in it");
        std::fs::create_dir_all(&inner).expect("the folder can be created");
        let (tool, part) = (folder.join("tool.obj"), inner.join("the \"part\".obj"));
        std::fs::write(&tool, tetrahedron(0.08)).expect("the mesh can be written");
        std::fs::write(&part, tetrahedron(120.0)).expect("the mesh can be written");
        let named = [tool.to_str().expect("UTF-8"), part.to_str().expect("UTF-8")];
        let stage = of_pair(named, &[]).expect("the pair can be prepared");
        // 0.08 m beside 120 mm.
        let size = |body: &palpus::body::Body| body.mesh().bounds();
        assert!((size(&stage.probe).max.x - 0.08).abs() < 1e-9, "{:?}", size(&stage.probe));
        assert!((size(&stage.environment).max.x - 0.12).abs() < 1e-9, "{:?}", size(&stage.environment));
        // The recorded text gives the same scene, inside of its folder.
        let text = stage.recorded.text.as_deref().expect("the text is recorded");
        let palpus_io::record::SceneSource::File(path) = &stage.recorded.source else { panic!("not a file") };
        let again = parse_scene(text, Path::new(path), FilePolicy::Inside).expect("the text can be read");
        assert_eq!(again.probe.mesh.canonicalize().ok(), tool.canonicalize().ok());
        assert_eq!(again.environment.mesh.canonicalize().ok(), part.canonicalize().ok());

        let stage = of_pair(named, &["cm".to_owned()]).expect("the pair can be prepared");
        assert!((size(&stage.environment).max.x - 1.2).abs() < 1e-9);
        let bad = of_pair(named, &["parsec".to_owned()]).err().map(|error| error.to_string());
        assert!(bad.is_some_and(|error| error.contains("parsec") && error.contains("mm")));
        std::fs::remove_dir_all(&folder).expect("the folder can be removed");
    }

    #[test]
    fn name_of_a_pair_has_both_meshes() {
        assert_eq!(pair_name(["parts/tool.stl", "part.obj"]), "tool-part");
    }
}
