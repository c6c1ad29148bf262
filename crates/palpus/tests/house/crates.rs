//! Reads the imports between crates from their manifests.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Returns two lists for each crate of the folder: the crates of this project that its product code
/// imports, and the crates that only its tests, benches and build scripts import.
pub(crate) fn arrows(crates: &Path) -> BTreeMap<String, [Vec<String>; 2]> {
    let folders = fs::read_dir(crates)
        .expect("the folder of the crates is readable")
        .map(|entry| entry.expect("an entry is readable").path());
    let manifests = folders.map(|folder| folder.join("Cargo.toml")).filter(|manifest| manifest.is_file());
    manifests.map(|manifest| read(&fs::read_to_string(&manifest).expect("a manifest is readable"))).collect()
}

/// Returns the name of a crate and its arrows.
pub(crate) fn read(manifest: &str) -> (String, [Vec<String>; 2]) {
    let (mut name, mut arrows) = (String::new(), [Vec::new(), Vec::new()]);
    let mut section = "";
    for line in manifest.lines().map(str::trim) {
        if line.starts_with('[') {
            section = line.trim_matches(['[', ']']);
            // A table such as `[dependencies.palpus-io]`, possibly for one target.
            if let Some((table, key)) = section.rsplit_once('.').filter(|(_, key)| is_ours(key)) {
                keep(&mut arrows, table, key);
            }
            continue;
        }
        let Some((key, value)) = line.split_once('=') else { continue };
        let key = key.trim().split('.').next().unwrap_or("").trim_matches('"');
        if section == "package" && key == "name" {
            name = value.trim().trim_matches('"').to_string();
        } else if is_ours(key) {
            keep(&mut arrows, section, key);
        }
    }
    (name, arrows)
}

fn is_ours(key: &str) -> bool {
    key == "palpus" || key.starts_with("palpus-")
}

fn keep(arrows: &mut [Vec<String>; 2], section: &str, key: &str) {
    let kind = match section.rsplit('.').next() {
        Some("dependencies") => 0,
        Some("dev-dependencies" | "build-dependencies") => 1,
        _ => return,
    };
    arrows[kind].push(key.to_string());
}
