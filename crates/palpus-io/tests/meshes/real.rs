//! Tests with real files, which are skipped if the files are missing.

use std::path::{Path, PathBuf};

use palpus_io::read_mesh;

/// Returns the OBJ files in one folder of the models; no files if the models are missing.
fn models(folder: &str) -> Vec<PathBuf> {
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|above| above.join("shared/models").join(folder));
    let Some(entries) = above.filter_map(|folder| std::fs::read_dir(folder).ok()).next() else { return Vec::new() };
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "obj"));
    files.sort();
    files
}

#[test]
fn nasty_files_are_read_or_give_short_errors() {
    for path in models("nasty") {
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let expected = match name.as_str() {
            "raw_draco_inf_nan.obj" => Some(", line 1: coordinate \"inf\" is not a finite number"),
            "raw_trimesh_empty.obj" => Some(": the file has no faces (0 vertices)"),
            "raw_trimesh_notenoughindices.obj" => Some(", line 9: a face has 2 corners and needs at least 3"),
            _ => None,
        };
        match (read_mesh(&path), expected) {
            (Ok(soup), None) => assert!(soup.face_count() > 0, "{name}"),
            (Err(error), Some(expected)) => {
                let text = error.to_string();
                assert!(text.contains(&format!("{name}{expected}")) && !text.contains('\n'), "{text}");
            }
            (read, expected) => panic!("{name}: {:?}, expected {expected:?}", read.map(|soup| soup.face_count())),
        }
    }
}

#[test]
fn valid_files_are_read_completely() {
    for folder in ["paper", "pairs", "parts", "large"] {
        for path in models(folder) {
            let text = std::fs::read_to_string(&path).unwrap();
            let starting = |word: &str| text.lines().filter(|line| line.starts_with(word)).count();
            let soup = read_mesh(&path).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(
                (soup.vertices.len(), soup.face_count()),
                (starting("v "), starting("f ")),
                "{}",
                path.display()
            );
        }
    }
}
