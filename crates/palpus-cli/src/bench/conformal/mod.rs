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

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use anyhow::bail;
use comfy_table::presets::UTF8_BORDERS_ONLY;
use comfy_table::{CellAlignment, Table};

use self::cases::Case;
use self::measure::Row;
use crate::{files, output};

/// Measures all cases, or the cases whose names begin with `only`. Writes `conformal.txt` and
/// `conformal.json` to `out`.
pub(super) fn conformal(
    out: &Path,
    models: Option<&Path>,
    [ticks, truths]: [usize; 2],
    only: Option<&str>,
) -> anyhow::Result<ExitCode> {
    files::make_folder(out)?;
    let wanted = |name: &str| only.is_none_or(|only| name.starts_with(only));
    let mut rows = Vec::new();
    for case in cases::CASES.iter().filter(|case| wanted(case.name)) {
        match Case::of(case, models, ticks)? {
            Some(case) => {
                rows.push(measure::measure(&case, truths)?);
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
    let mut time = table(&[
        "step, µs of processor time",
        "tolerance",
        "contacts",
        "p50",
        "p99",
        "p99.9",
        "query",
        "depth",
        "force",
        "late",
    ]);
    let mut work = table(&[
        "pairs a tick",
        "front",
        "due",
        "looked",
        "near",
        "marched",
        "steps",
        "carried",
        "at rest",
        "no surface",
        "no normal",
        "walked",
        "moved",
        "disbelieved",
        "patches",
        "dropped",
    ]);
    let mut truth = table(&["wrench", "turn p99", "of truth", "direction p99", "size p99", "torque p99", "analytic"]);
    for row in rows {
        let Row { name, tolerance, contacts, p50, p99, p999, query, depth, force, late, each, wrench, .. } = row;
        time.add_row([
            name.clone(),
            format!("{:.3} mm", tolerance * 1e3),
            format!("{contacts:.0}"),
            format!("{p50:.0}"),
            format!("{p99:.0}"),
            format!("{p999:.0}"),
            format!("{query:.0}"),
            format!("{depth:.0}"),
            format!("{force:.0}"),
            format!("{:.0} %", 100.0 * late),
        ]);
        let mut cells = vec![name.clone()];
        cells.extend(each.values().map(|value| format!("{value:.0}")));
        work.add_row(cells);
        truth.add_row([
            name.clone(),
            format!("{:.2}°", wrench.turn),
            format!("{:.2}°", wrench.true_turn),
            format!("{:.2}°", wrench.direction),
            format!("{:.1} %", 100.0 * wrench.size),
            format!("{:.1} %", 100.0 * wrench.torque),
            wrench.analytic.map_or("-".to_owned(), |[turn, size]| format!("{turn:.2}°, {:.1} %", 100.0 * size)),
        ]);
    }
    [time, work, truth]
        .map(|mut table| {
            for column in table.column_iter_mut().skip(1) {
                column.set_cell_alignment(CellAlignment::Right);
            }
            table.to_string()
        })
        .join("\n")
}

fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_preset(UTF8_BORDERS_ONLY);
    table.set_header(header.iter().copied());
    table
}
