//! Compares palpus with parry on pairs of convex shapes: penetration depth and distance, at
//! independent poses and along coherent paths.
//!
//! `cargo bench -p palpus --bench convex` prints a table within a minute. These options can follow
//! after `--`:
//!
//! * `--only TEXT`: measures only rows whose shape or motion contains the text.
//! * `--out FILE`: also writes the figures as CSV, for `benches/peers/convex_peers.py`.
//! * `--dump FOLDER`: writes the shapes and poses as text for the same script, and measures
//!   nothing.
//! * `--instructions FILE`: writes instruction counts per query, measured by valgrind, instead of
//!   times.
//!
//! All contenders run the same sequence of poses one after the other, so other load on the machine
//! affects all of them. The bench repeats the measurement in several rounds and takes the fastest
//! time of each pose. Therefore p50 and p99 describe the spread between poses, not the noise of the
//! machine. The cost of reading the clock is subtracted. In coherent motions, the first pose of
//! each sequence is not counted, because no contender has cached data at this pose. The ratio is
//! the p50 of palpus divided by the p50 of parry.
//!
//! "Beaten" is the fraction of the poses at which another contender found a smaller depth or
//! distance. At some poses of needles and cylinders, parry's depth is smaller than palpus' proven
//! depth by 0.3 % to 3 %. At these poses parry is wrong: an exhaustive search over face normals and
//! edge pairs confirms palpus' depth to the last digits. Therefore "beaten" is meaningful only for
//! the depth walk without proof.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a bench prints its results")]

mod contenders;
mod dump;
mod instructions;
mod motions;
mod shapes;
mod stretch;
mod table;

use std::path::PathBuf;

use crate::contenders::{Contender, Subject};
use crate::motions::{Case, Motion};
use crate::table::Row;

/// Arguments of the run.
#[derive(Default)]
struct Options {
    only: Option<String>,
    out: Option<PathBuf>,
    dump: Option<PathBuf>,
    instructions: Option<PathBuf>,
    counted: Option<instructions::Counted>,
}

impl Options {
    fn parse(mut words: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self::default();
        while let Some(word) = words.next() {
            let mut value = || words.next().ok_or(format!("{word} needs a value"));
            match word.as_str() {
                // Cargo adds this option.
                "--bench" => {}
                "--only" => options.only = Some(value()?),
                "--out" => options.out = Some(value()?.into()),
                "--dump" => options.dump = Some(value()?.into()),
                "--instructions" => options.instructions = Some(value()?.into()),
                instructions::COUNT => options.counted = Some(instructions::Counted::parse(&value()?)?),
                _ => return Err(format!("unknown option {word}")),
            }
        }
        Ok(options)
    }

    fn wants(&self, shape: &str, motion: Motion) -> bool {
        self.only.as_ref().is_none_or(|text| shape.contains(text.as_str()) || motion.name().contains(text.as_str()))
    }
}

fn main() -> Result<(), String> {
    let options = Options::parse(std::env::args().skip(1))?;
    if let Some(counted) = &options.counted {
        counted.run();
        return Ok(());
    }
    if let Some(file) = &options.instructions {
        return instructions::write(file);
    }
    if let Some(folder) = &options.dump {
        return dump::write(folder).map_err(|error| error.to_string());
    }
    let mut rows = Vec::new();
    for shape in shapes::all() {
        let subject = Subject::new(&shape);
        for motion in Motion::ALL {
            if options.wants(shape.name, motion) {
                let case = Case::new(&shape, motion);
                rows.push(measure(&subject, &case));
                rows.last().into_iter().for_each(Row::print);
            }
        }
    }
    if let Some(file) = &options.out {
        std::fs::write(file, table::csv(&rows)).map_err(|error| error.to_string())?;
    }
    Ok(())
}

/// Measures every contender on every stretch, for all rounds.
fn measure(subject: &Subject<'_>, case: &Case) -> Row {
    let mut contenders = Contender::all(case.motion);
    let mut results = vec![stretch::Result::default(); contenders.len()];
    for round in 0..stretch::ROUNDS {
        for (index, poses) in case.stretches.iter().enumerate() {
            for (contender, result) in contenders.iter_mut().zip(&mut results) {
                stretch::run(contender, subject, case.motion, poses, result, round, index);
            }
        }
    }
    Row::new(subject, case, &contenders, &results)
}
