//! Finds the files of a recorded scene: the scene file in the recording, and its meshes by their
//! content.
//!
//! A mesh is the recorded mesh if its content has the recorded hash, under any name and in any
//! folder. The places are searched in this order:
//!
//! 1. the recording's folder: the path in the scene file relative to it, and the file name alone;
//! 2. the place at the time of the recording;
//! 3. the folders that the user names: the same two paths, then all meshes in these folders and
//!    their subfolders.
//!
//! Changes since the recording are reported before the replay.

use std::path::{Path, PathBuf};

use anyhow::bail;
use palpus::body::PolygonSoup;
use palpus_io::record::RecordedScene;
use palpus_io::scene::{FilePolicy, SceneBody, parse_scene};
use palpus_io::{ContentHash, MeshFormat, RecordingHeader, read_mesh};

use crate::bodies::Teller;
use crate::output;
use crate::stage::{self, Part, Stage};

/// Depth to which folders are searched.
const DEPTH: usize = 3;

/// See the module's description.
#[derive(Clone, Copy)]
pub(crate) struct Places<'a> {
    /// The recording's file.
    pub(crate) recording: &'a Path,
    /// Folders with meshes that the user names.
    pub(crate) meshes: &'a [PathBuf],
    /// Files that the recorded scene file may name.
    pub(crate) policy: FilePolicy,
}

impl<'a> Places<'a> {
    /// Searches the recording's folder and the original places.
    pub(crate) fn of(recording: &'a Path, policy: FilePolicy) -> Self {
        Self { recording, meshes: &[], policy }
    }

    /// Prepares a recorded scene from the text of its file, whose path was `path`. `others`: the
    /// contents of the other tools' meshes.
    pub(super) fn stage(
        &self,
        scene: &RecordedScene,
        text: &str,
        path: &Path,
        others: &[ContentHash],
    ) -> anyhow::Result<Stage> {
        let mut file = parse_scene(text, path, self.policy)?;
        // Hands and start poses stay as recorded.
        file.gaps.places = false;
        (file.probe.pose, file.environment.pose) = (scene.probe.pose, scene.environment.pose);
        for (object, recorded) in file.objects.iter_mut().zip(&scene.objects) {
            object.body.pose = recorded.pose;
        }
        file.hand.path = None;
        file.others.iter_mut().for_each(|tool| tool.hand.path = None);
        let folder = path.parent().unwrap_or(Path::new(""));
        let read = |part: Part, body: &SceneBody| {
            let content = match part {
                Part::Probe => scene.probe.content,
                Part::Environment => scene.environment.content,
                Part::Other(k) => others.get(k).copied().unwrap_or(scene.probe.content),
                Part::Object(k) => scene.objects.get(k).map_or(scene.probe.content, |object| object.content),
            };
            self.mesh(&body.mesh, folder, &content)
        };
        stage::of_file(path, file, &read, &Teller::Bar)
    }

    /// Returns the mesh with this content; the scene file in `folder` names it as `place`.
    fn mesh(&self, place: &Path, folder: &Path, content: &ContentHash) -> anyhow::Result<PolygonSoup> {
        let name = Path::new(place.file_name().unwrap_or_default());
        let within = place.strip_prefix(folder).ok().filter(|within| within.is_relative()).unwrap_or(name);
        let beside = self.recording.parent().unwrap_or(Path::new(""));
        let mut candidates = vec![beside.join(within), beside.join(name), place.to_owned()];
        candidates.extend(self.meshes.iter().flat_map(|folder| [folder.join(within), folder.join(name)]));
        let mut others: Vec<PathBuf> = Vec::new();
        let mut first_problem = None;
        for candidate in candidates.iter().filter(|candidate| candidate.is_file()) {
            match read_mesh(candidate) {
                Ok(soup) if ContentHash::of_soup(&soup) == *content => return Ok(soup),
                Ok(_) if others.contains(candidate) => {}
                Ok(_) => others.push(candidate.clone()),
                Err(error) => _ = first_problem.get_or_insert(error),
            }
        }
        for candidate in self.meshes.iter().flat_map(|folder| meshes_in(folder, DEPTH)) {
            if let Ok(soup) = read_mesh(&candidate)
                && ContentHash::of_soup(&soup) == *content
            {
                let (name, found) = (name.display(), candidate.display());
                output::note(format!("note: {name} is {found}, by its content"));
                return Ok(soup);
            }
        }
        let name = name.display();
        if let Some(other) = others.first() {
            bail!(
                "{} is not the mesh of the recording: it has changed (its content hash is not {content}); \
                --meshes DIR names a folder with the recorded {name}, under any name",
                other.display()
            );
        }
        if let Some(error) = first_problem {
            return Err(error.into());
        }
        bail!(
            "the recorded mesh {name} is neither in the folder of the recording nor at {}; put it there, or use \
            --meshes DIR with a folder that has it, under any name",
            place.display()
        )
    }
}

/// Returns the meshes in a folder and its subfolders, in the order of their names.
fn meshes_in(folder: &Path, depth: usize) -> Vec<PathBuf> {
    let mut entries: Vec<_> = std::fs::read_dir(folder).into_iter().flatten().flatten().collect();
    entries.sort_by_key(std::fs::DirEntry::file_name);
    let mut meshes = Vec::new();
    for entry in entries {
        let path = entry.path();
        match entry.file_type() {
            Ok(kind) if kind.is_dir() && depth > 0 => meshes.extend(meshes_in(&path, depth - 1)),
            Ok(_) if MeshFormat::of_extension(&path).is_some() && path.is_file() => meshes.push(path),
            _ => {}
        }
    }
    meshes
}

/// Prints a note if the program's version or the scene file differs from the recording.
pub(super) fn tell_changes(header: &RecordingHeader, file: Option<&Path>) {
    let version = env!("CARGO_PKG_VERSION");
    if header.palpus_version != version {
        let recorded = &header.palpus_version;
        output::note(format!("note: recorded with palpus {recorded}, but this is {version}: wrenches may differ"));
    }
    let Some((file, text)) = file.zip(header.scene.text.as_deref()) else { return };
    if std::fs::read_to_string(file).is_ok_and(|now| now != text) {
        let file = file.display();
        output::note(format!("note: {file} has changed since the recording; the replay uses the recorded text"));
    }
}
