//! STL files are read and converted to bodies.
#![no_main]

use palpus_fuzz::{Allowance, Seed, mesh_file, target};

fn run(data: &[u8]) {
    mesh_file::read_and_build(data, "stl");
}

fn seeds() -> Vec<Seed> {
    mesh_file::seeds(&["stl"])
}

// The limit covers the whole file, a result of several times its size, and a body of at most 64
// vertices.
target!(run: run, allowance: Allowance { per_byte: 40, always: 8 << 20 }, seeds: seeds);
