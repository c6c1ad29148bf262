//! Hashes the sources that decide which pieces a mesh gives. A program can then detect a prepared
//! body on disk that another version of the engine made.

use std::fs;
use std::path::{Path, PathBuf};

fn main() {
    let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
    let mut feed = |bytes: &[u8]| {
        // FNV-1a needs no dependency, and the hash needs no protection from attacks.
        for &byte in bytes {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    };
    for folder in ["src/algebra", "src/body"] {
        println!("cargo::rerun-if-changed={folder}");
        for file in files(Path::new(folder)) {
            feed(file.to_string_lossy().replace('\\', "/").as_bytes());
            feed(&fs::read(&file).unwrap_or_default());
        }
    }
    println!("cargo::rustc-env=PALPUS_BODY_FINGERPRINT={hash:016x}");
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push(path);
        }
    }
    found.sort();
    found
}
