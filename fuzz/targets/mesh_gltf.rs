//! glTF and GLB files are read and converted to bodies. Other files to which a glTF file refers do
//! not exist.
#![no_main]

use palpus_fuzz::{Allowance, Seed, mesh_file, target};

fn run(data: &[u8]) {
    mesh_file::read_and_build(data, "gltf");
}

fn seeds() -> Vec<Seed> {
    mesh_file::seeds(&["gltf", "glb"])
}

// A glTF may repeat one mesh many times, up to four million corners.
target!(run: run, allowance: Allowance { per_byte: 100, always: 400 << 20 }, seeds: seeds);
