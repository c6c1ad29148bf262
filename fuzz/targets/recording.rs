//! CSV recordings. Their values have the same bits after they are written in each format and read
//! again.
#![no_main]

use palpus_fuzz::{Allowance, Seed, recording, target};
use palpus_io::record::RecordingFormat;

fn seeds() -> Vec<Seed> {
    recording::seeds(RecordingFormat::Csv)
}

target!(run: recording::read_and_write, allowance: Allowance { per_byte: 400, always: 2 << 20 }, seeds: seeds);
