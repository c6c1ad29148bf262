//! Convex pairs beside parry in one run: penetration depth and distance, cold and along coherent
//! paths.
//!
//! `cargo bench -p palpus --bench convex` prints a table within a minute. Options after `--`:
//!
//! * `--only TEXT`: only rows whose shape or motion contains the text;
//! * `--out FILE`: the figures as CSV too, for `benches/peers/convex_peers.py`;
//! * `--dump FOLDER`: the shapes and poses of the run as text, for the same script, and nothing is
//!   measured;
//! * `--instructions FILE`: instruction counts per query by valgrind instead of times.
//!
//! How it measures: every contender runs the same stretch of poses in turn, so that noise of the
//! machine hits all; the whole is done for several rounds, and each pose counts with its fastest
//! round. So p50 and p99 are over poses, not over the machine's moods. The cost of reading the
//! clock is subtracted. In coherent motions the first pose of a stretch is cold for everyone and
//! not counted. Ratios are of p50, palpus over parry.
//!
//! "Beaten" is the share of the poses at which another contender found a smaller depth or distance.
//! If palpus' proof is beaten (some poses of needles and cylinders, by 0.3 % to 3 % of the
//! depth), parry is wrong. Trying all face normals and edge pairs gives palpus' depth to the last
//! digits, and parry's is smaller than any valid depth. So only the walk alone is beaten.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a bench is run to be read")]

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
                // Cargo adds this one.
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

/// Runs every contender over every stretch, some rounds of it.
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
