//! Mesh files within gzip, of a kind that is only known by their content; and gzip itself.
//!
//! The first byte says whether the rest is a gzip file, or a mesh file to be packed.
#![no_main]

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use palpus_fuzz::{Allowance, Seed, mesh_file, mesh_samples, target};

fn run(data: &[u8]) {
    let Some((&first, rest)) = data.split_first() else { return };
    if first % 2 == 0 {
        mesh_file::read_and_build(rest, "gz");
    } else {
        mesh_file::read_and_build(&packed(rest), "gz");
    }
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut packer = GzEncoder::new(Vec::new(), Compression::fast());
    packer.write_all(bytes).and_then(|()| packer.finish()).expect("memory takes everything")
}

fn seeds() -> Vec<Seed> {
    let samples = mesh_samples().into_iter().enumerate();
    let both = samples.flat_map(|(k, (extension, bytes))| {
        let (as_gzip, to_pack) = ([&[0][..], &packed(&bytes)].concat(), [&[1][..], &bytes].concat());
        [(format!("{k}.{extension}.gz"), as_gzip), (format!("{k}.{extension}"), to_pack)]
    });
    both.collect()
}

// A byte unpacks to a thousand, of which a mesh is made; a glTF may place one mesh many times.
target!(run: run, allowance: Allowance { per_byte: 100_000, always: 400 << 20 }, seeds: seeds);
