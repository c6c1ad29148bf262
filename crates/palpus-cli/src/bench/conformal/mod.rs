//! `palpus bench conformal`: measures the time of close-fitting contact, the work of the query, and
//! the error of the wrench.
//!
//! Each case is two bodies and a motion (`cases`). Ticks are timed with the processor time of their
//! thread, so that other programs have little effect. The counters come from the engine's tick. At
//! some ticks, `measure` compares the wrench with two references: the same contact law at the same
//! pose without memory, and the analytic force of the case.

mod cases;
mod cpu;
mod measure;
mod trace;

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use anyhow::bail;

use self::cases::Case;
use self::measure::{COUNTED, Row};
use self::trace::Trace;
use crate::table::Table;
use crate::{files, output};

/// Measures all cases, or the case called `only`. If no case has this name, measures the cases
/// whose names begin with it. Writes `conformal.txt` and `conformal.json` to `out`, and for other
/// engines a folder for each case if `traces` is true.
pub(super) fn conformal(
    out: &Path,
    models: Option<&Path>,
    [ticks, truths, helpers]: [usize; 3],
    only: Option<&str>,
    traces: bool,
) -> anyhow::Result<ExitCode> {
    files::make_folder(out)?;
    let exact = cases::names().into_iter().find(|name| only == Some(name));
    let wanted = |name: &str| match (exact, only) {
        (Some(exact), _) => name == exact,
        (None, Some(only)) => name.starts_with(only),
        (None, None) => true,
    };
    let mut rows = Vec::new();
    for case in cases::CASES.iter().filter(|case| wanted(case.name)) {
        match Case::of(case, models, ticks)? {
            Some(case) => {
                let mut trace = if traces { Some(Trace::new(&out.join(case.name), &case)?) } else { None };
                rows.push(measure::measure(&case, truths, helpers, trace.as_mut())?);
                if let Some(trace) = trace {
                    trace.finish()?;
                }
                output::line(rows.last().map_or(String::new(), measure::Row::line));
            }
            None => output::note(format!("note: {} needs meshes that are not in --models", case.name)),
        }
    }
    if rows.is_empty() {
        bail!("there is no case {}; the cases are {}", only.unwrap_or("anything"), cases::names().join(", "));
    }
    let text = text(&rows);
    output::line(&text);
    fs::write(out.join("conformal.txt"), format!("{text}\n"))?;
    fs::write(out.join("conformal.json"), serde_json::to_string_pretty(&rows)?)?;
    output::line(format!("written to {}", out.display()));
    Ok(ExitCode::SUCCESS)
}

/// Returns three tables: time, work, and error of the wrench.
fn text(rows: &[Row]) -> String {
    let time = |row: &Row| {
        let first = [row.name.clone(), format!("{:.3} mm", row.tolerance * 1e3)];
        let whole = [row.contacts, row.p50, row.p99, row.p999, row.query, row.depth, row.force];
        let last = format!("{:.0} %", 100.0 * row.late);
        first.into_iter().chain(whole.map(|value| format!("{value:.0}"))).chain([last]).collect()
    };
    let work = |row: &Row| {
        [row.name.clone()].into_iter().chain(row.each.values().map(|value| format!("{value:.0}"))).collect()
    };
    let truth = |row: &Row| {
        let wrench = &row.wrench;
        vec![
            row.name.clone(),
            format!("{:.2}°", wrench.turn),
            format!("{:.2}°", wrench.true_turn),
            format!("{:.2}°", wrench.direction),
            format!("{:.1} %", 100.0 * wrench.size),
            format!("{:.1} %", 100.0 * wrench.torque),
            wrench.analytic.map_or("-".to_owned(), |[turn, size]| format!("{turn:.2}°, {:.1} %", 100.0 * size)),
        ]
    };
    let headings: Vec<&str> = ["pairs a tick"].into_iter().chain(COUNTED.map(|(_, heading, _)| heading)).collect();
    [
        Table::new(&TIME, 1, rows.iter().map(time)),
        Table::new(&headings, 1, rows.iter().map(work)),
        Table::new(&TRUTH, 1, rows.iter().map(truth)),
    ]
    .map(|table| table.text())
    .join("\n")
}

/// Headings of the times.
const TIME: [&str; 10] =
    ["step, µs of processor time", "tolerance", "contacts", "p50", "p99", "p99.9", "query", "depth", "force", "late"];
/// Headings of the errors.
const TRUTH: [&str; 7] = ["wrench", "turn p99", "of truth", "direction p99", "size p99", "torque p99", "analytic"];
