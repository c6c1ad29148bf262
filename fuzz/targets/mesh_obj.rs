//! OBJ files, read and made bodies of.
#![no_main]

use palpus_fuzz::{Allowance, Seed, mesh_file, target};

fn run(data: &[u8]) {
    mesh_file::read_and_build(data, "obj");
}

fn seeds() -> Vec<Seed> {
    mesh_file::seeds(&["obj"])
}

// A file is read whole, and its result is some times as large; then a body of up to 64
// corners.
target!(run: run, allowance: Allowance { per_byte: 40, always: 8 << 20 }, seeds: seeds);
