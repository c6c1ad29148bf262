//! Mesh files compressed by gzip, whose format is recognised only by their content, and damaged
//! gzip files.
//!
//! The first byte selects whether the other bytes are a gzip file or a mesh file to compress.
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
    packer.write_all(bytes).and_then(|()| packer.finish()).expect("writing to memory succeeds")
}

fn seeds() -> Vec<Seed> {
    let samples = mesh_samples().into_iter().enumerate();
    let both = samples.flat_map(|(k, (extension, bytes))| {
        let (as_gzip, to_pack) = ([&[0][..], &packed(&bytes)].concat(), [&[1][..], &bytes].concat());
        [(format!("{k}.{extension}.gz"), as_gzip), (format!("{k}.{extension}"), to_pack)]
    });
    both.collect()
}

// A byte may decompress to a thousand bytes of a mesh file; a glTF may repeat one mesh many times.
target!(run: run, allowance: Allowance { per_byte: 100_000, always: 400 << 20 }, seeds: seeds);
