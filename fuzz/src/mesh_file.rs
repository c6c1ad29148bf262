//! Converts the bytes of a mesh file to a body in the same way as the program.

use std::cell::OnceCell;
use std::path::PathBuf;

use palpus::body::{Body, BodySettings};
use palpus_io::read_mesh;

use crate::{Folder, Seed, check, mesh_samples};

/// Largest number of vertices of a mesh that is converted to a body, because the conversion is much
/// slower than reading a file.
const MOST_VERTICES: usize = 64;
/// Largest number of face corners of such a mesh.
const MOST_CORNERS: usize = 160;

thread_local! {
    static FOLDER: OnceCell<Folder> = const { OnceCell::new() };
}

/// Reads `data` as a file with this extension and, if the mesh is small, converts it to a body.
pub fn read_and_build(data: &[u8], extension: &str) {
    let path: PathBuf = FOLDER.with(|folder| {
        let folder = folder.get_or_init(|| Folder::new("mesh"));
        folder.file(&format!("mesh.{extension}"), data)
    });
    let soup = match read_mesh(&path) {
        Ok(soup) => soup,
        Err(error) => return check::error(&error.to_string(), &path.display().to_string()),
    };
    check::soup(&soup);
    if soup.vertices.len() > MOST_VERTICES || soup.face_vertices.len() > MOST_CORNERS {
        return;
    }
    // The last byte, which rarely affects the mesh, selects the settings for measurements or for
    // haptic rendering.
    let touching = data.last().is_some_and(|byte| byte % 2 == 0);
    let flatness = if touching { BodySettings::HAPTIC } else { BodySettings::EXACT };
    match Body::from_soup(&soup, &BodySettings { flatness, ..BodySettings::default() }, &mut |_| ()) {
        Ok(body) => check::body(&body),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// Returns the samples with these extensions.
pub fn seeds(extensions: &[&str]) -> Vec<Seed> {
    let samples = mesh_samples().into_iter().enumerate();
    let wanted = samples.filter(|(_, (extension, _))| extensions.contains(extension));
    wanted.map(|(k, (extension, bytes))| (format!("{k}.{extension}"), bytes)).collect()
}
