//! Counts instructions per query with valgrind. Other load on the machine does not affect this
//! count.
//!
//! The first pose of a coherent stretch is not counted, as in the time measurements. For each
//! figure the bench starts itself under callgrind, which counts only the instructions inside
//! [`counted_query`].

use std::fmt::Write;
use std::path::Path;
use std::process::Command;

use crate::contenders::{Contender, Name, Place, Subject};
use crate::motions::{Case, Motion};
use crate::{shapes, stretch};

/// The internal option with which the bench starts itself for one figure.
pub(crate) const COUNT: &str = "--count";

/// The rows of the table: contender and motion.
const ROWS: [(Name, Motion); 10] = [
    (Name::Local, Motion::Sliding),
    (Name::Local, Motion::Rolling),
    (Name::Local, Motion::Deep),
    (Name::Local, Motion::Cold),
    (Name::Proven, Motion::Sliding),
    (Name::Proven, Motion::Rolling),
    (Name::Proven, Motion::Deep),
    (Name::Proven, Motion::Cold),
    (Name::March, Motion::ApartCoherent),
    (Name::March, Motion::ApartCold),
];

/// The columns of the table: shape pairs.
const SHAPES: [&str; 5] = ["hull 20", "hull 100", "hull 500", "hull 2000", "boxes"];

/// A run under callgrind, for one row and one shape pair.
pub(crate) struct Counted {
    row: usize,
    shape: usize,
}

impl Counted {
    /// Parses `row/shape`, the two indices.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(row, shape)| Some((row.parse().ok()?, shape.parse().ok()?)));
        match numbers {
            Some((row, shape)) if row < ROWS.len() && shape < SHAPES.len() => Ok(Self { row, shape }),
            _ => Err(format!("no such row: {text}")),
        }
    }

    /// Runs the queries and prints how many were counted.
    pub(crate) fn run(&self) {
        let (name, motion) = ROWS[self.row];
        let Some(shape) = shapes::all().into_iter().find(|shape| shape.name == SHAPES[self.shape]) else { return };
        let (subject, case) = (Subject::new(&shape), Case::new(&shape, motion));
        let mut contender = Contender::of(name);
        let mut queries = 0;
        for poses in &case.stretches {
            contender.forget();
            for (k, place) in stretch::places(poses).iter().enumerate() {
                if !motion.is_coherent() {
                    contender.forget();
                } else if k == 0 {
                    std::hint::black_box(contender.query(&subject, place));
                    continue;
                }
                std::hint::black_box(counted_query(&mut contender, &subject, place));
                queries += 1;
            }
        }
        println!("{queries}");
    }
}

/// Runs one query. Valgrind finds this function by its name.
#[inline(never)]
fn counted_query(contender: &mut Contender, subject: &Subject<'_>, place: &Place) -> f64 {
    contender.query(subject, place)
}

/// Counts all rows, prints them, and writes them to `file`.
pub(crate) fn write(file: &Path) -> Result<(), String> {
    let mut text = String::from(
        "# Instructions per query, mean over the poses of benches/convex, counted by callgrind.\n\
         # cargo bench -p palpus --bench convex -- --instructions ../../benches/instructions.txt\n",
    );
    let _ = writeln!(text, "{:14} {:11} {}", "", "", SHAPES.map(|shape| format!("{shape:>10}")).join(" "));
    for (row, (name, motion)) in ROWS.iter().enumerate() {
        let mut line = format!("{:14} {:11}", name.text(), motion.name());
        for shape in 0..SHAPES.len() {
            let _ = write!(line, " {:10.0}", count(row, shape)?);
        }
        println!("{line}");
        let _ = writeln!(text, "{line}");
    }
    std::fs::write(file, text).map_err(|error| format!("{}: {error}", file.display()))
}

/// Returns the mean number of instructions per query for one row and one shape pair.
fn count(row: usize, shape: usize) -> Result<f64, String> {
    let this = std::env::current_exe().map_err(|error| error.to_string())?;
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null", "--collect-atstart=no"])
        .arg("--toggle-collect=*counted_query*")
        .arg(this)
        .args([COUNT, &format!("{row}/{shape}")])
        .output()
        .map_err(|error| format!("valgrind: {error}"))?;
    let (queries, report) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let collected =
        report.lines().find_map(|line| line.split("Collected :").nth(1)).and_then(|n| n.trim().parse().ok());
    match (queries.trim().parse::<f64>(), collected) {
        (Ok(queries), Some(collected)) => Ok(f64::max(collected, 0.0) / queries),
        _ => Err(format!("cannot read valgrind's output:\n{report}")),
    }
}
