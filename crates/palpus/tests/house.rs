//! The house's one law, held: a room of the engine imports only rooms that sort before it.

use std::fs;
use std::path::{Path, PathBuf};

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("the source folder is beside this test") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// The rooms named after `crate::` in `text`, with their line numbers.
fn imports(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//")).flat_map(|(k, line)| {
        line.match_indices("crate::").map(move |(at, word)| {
            let rest = &line[at + word.len()..];
            let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
            (k + 1, &rest[..end])
        })
    })
}

#[test]
fn a_room_imports_only_rooms_that_sort_before_it() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut rooms: Vec<String> = fs::read_dir(&source)
        .expect("the source folder is beside this test")
        .filter_map(|entry| {
            let path = entry.ok()?.path();
            path.is_dir().then(|| path.file_name()?.to_str().map(String::from)).flatten()
        })
        .collect();
    rooms.sort();
    assert_eq!(rooms, ["algebra", "body", "collision", "depth", "detect", "force", "render"]);
    let mut broken = Vec::new();
    for room in &rooms {
        for file in rust_files(&source.join(room)) {
            let text = fs::read_to_string(&file).expect("a readable source file");
            for (line, import) in imports(&text) {
                if rooms.iter().any(|r| r == import) && import > room.as_str() {
                    broken.push(format!("{}:{line} imports {import}", file.display()));
                }
            }
        }
    }
    assert!(broken.is_empty(), "imports against the order of the rooms:\n{}", broken.join("\n"));
}
