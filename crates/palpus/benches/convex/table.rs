//! Writes the figures as a table for people and as CSV for scripts.

use std::fmt::Write;

use crate::contenders::{Contender, Name, Subject};
use crate::motions::Case;
use crate::stretch::Result;

/// Two separations count as equal if they differ by at most this, relative to the sum of the radii.
const SAME: f64 = 1e-7;

/// The figures of one shape pair in one motion.
pub(crate) struct Row {
    shape: &'static str,
    motion: &'static str,
    poses: usize,
    cells: Vec<Cell>,
}

struct Cell {
    name: Name,
    p50: f64,
    p99: f64,
    /// Fraction of the poses at which another contender found a smaller depth or distance.
    beaten: f64,
}

impl Row {
    pub(crate) fn new(subject: &Subject<'_>, case: &Case, contenders: &[Contender], results: &[Result]) -> Self {
        let shape = subject.shape;
        let same = SAME * (shape.a.radius() + shape.b.radius());
        let poses = results.first().map_or(0, |result| result.answers.len());
        let best = |k: usize| results.iter().map(|result| result.answers[k].abs()).fold(f64::INFINITY, f64::min);
        let cell = |(contender, result): (&Contender, &Result)| {
            // A contender without a result (NaN) counts as beaten too.
            let beaten = (0..poses)
                .filter(|&k| result.answers[k].abs().partial_cmp(&(best(k) + same)).is_none_or(|order| order.is_gt()));
            Cell {
                name: contender.name(),
                p50: result.percentile(0.5),
                p99: result.percentile(0.99),
                beaten: beaten.count() as f64 / poses as f64,
            }
        };
        let cells = contenders.iter().zip(results).map(cell).collect();
        Self { shape: shape.name, motion: case.motion.name(), poses, cells }
    }

    /// Returns the p50 of `cell` divided by the p50 of parry; `None` for parry itself.
    fn ratio(&self, cell: &Cell) -> Option<f64> {
        let parry = self.cells.iter().find(|other| matches!(other.name, Name::ParryEpa | Name::ParryGjk))?;
        (parry.name != cell.name).then_some(cell.p50 / parry.p50)
    }

    pub(crate) fn print(&self) {
        let mut line = format!("{:10} {:11}", self.shape, self.motion);
        for cell in &self.cells {
            let _ = write!(line, " | {:12} {:7.0} {:7.0} ns", cell.name.text(), cell.p50, cell.p99);
            if let Some(ratio) = self.ratio(cell) {
                let _ = write!(line, "  x{ratio:5.3}");
            }
            if cell.beaten > 0.0 {
                let _ = write!(line, " (beaten {:.1} %)", 100.0 * cell.beaten);
            }
        }
        println!("{line}");
    }
}

/// Returns all rows as CSV, one line per contender.
pub(crate) fn csv(rows: &[Row]) -> String {
    let mut text = String::from("shape,motion,contender,poses,p50_ns,p99_ns,ratio_to_parry,beaten\n");
    for row in rows {
        for cell in &row.cells {
            let ratio = row.ratio(cell).map_or(String::new(), |ratio| format!("{ratio:.4}"));
            let Cell { name, p50, p99, beaten } = cell;
            let _ = writeln!(
                text,
                "{},{},{},{},{p50:.0},{p99:.0},{ratio},{beaten:.4}",
                row.shape,
                row.motion,
                name.text(),
                row.poses
            );
        }
    }
    text
}
