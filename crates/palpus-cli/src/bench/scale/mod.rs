//! `palpus bench scale`: measures the time of a step against triangles, contacts and pairs of
//! bodies.
//!
//! 1. *Triangles*: a ball on a scanned torus of 1 k to 906 k triangles. The tolerance is chosen
//!    so that each size has the same number of contacts.
//! 2. *Contacts*: the ball on one size of the torus with a growing tolerance.
//! 3. *Pairs*: scanned and constructed parts in contact. The poses are stored with the times,
//!    so that other libraries can process the same poses (`benches/peers/coal_scale.py`).
//! 4. *Hurried*: the same pairs, coupled, with limited work in a step, compared with steps without
//!    a limit.
//!
//! Every tick of contact is computed in several passes, and its smallest time is kept. The engine
//! does the same work in each pass, so the differences come from the operating system.

mod growth;
mod hurried;
pub(super) mod motion;
pub(super) mod pairs;
mod timing;

use std::fs;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::bail;
use palpus::body::Body;
use serde::Serialize;

use self::timing::Times;
use crate::summary::Micros;
use crate::table::Table;
use crate::{files, output};

pub(super) fn scale(out: &Path, models: Option<&Path>, effort: Effort, only: Option<&str>) -> anyhow::Result<ExitCode> {
    files::make_folder(out)?;
    let known = ["triangles", "contacts", "hurried"].into_iter().chain(pairs::PAIRS.iter().map(|pair| pair.name));
    if let Some(only) = only
        && !known.clone().any(|name| name == only)
    {
        bail!("there is no --only {only}; the names are {}", known.collect::<Vec<_>>().join(", "));
    }
    let wanted = |name: &str| only.is_none_or(|only| only == name);
    if wanted("triangles") {
        report(out, "triangles", &growth::against_triangles(out, effort)?)?;
    }
    if wanted("contacts") {
        report(out, "contacts", &growth::against_contacts(out, effort)?)?;
    }
    if wanted("hurried") {
        bound(out, models, effort)?;
    }
    let mut rows = Vec::new();
    for pair in pairs::PAIRS.iter().filter(|pair| wanted(pair.name)) {
        match models.and_then(|models| pair.files(models)) {
            Some(files) => rows.push(pairs::measure(pair, &files, out, effort)?),
            None => output::note(format!("note: {} needs {} and {} in --models", pair.name, pair.a.file, pair.b.file)),
        }
    }
    if !rows.is_empty() {
        report(out, "pairs", &rows)?;
    }
    output::line(format!("written to {}", out.display()));
    Ok(ExitCode::SUCCESS)
}

/// Runs part 4, the hurried steps.
fn bound(out: &Path, models: Option<&Path>, effort: Effort) -> anyhow::Result<()> {
    let mut rows = Vec::new();
    for pair in &pairs::PAIRS {
        if let Some(files) = models.and_then(|models| pair.files(models)) {
            rows.push(hurried::measure(pair, &files, effort.ticks)?);
        }
    }
    if !rows.is_empty() {
        let text = hurried::text(&rows);
        output::line(&text);
        fs::write(out.join("hurried.txt"), text)?;
        fs::write(out.join("hurried.json"), serde_json::to_string_pretty(&rows)?)?;
    }
    Ok(())
}

/// Extent of the measurement.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// Number of ticks of contact per pair.
    pub(super) ticks: usize,
    /// Number of passes over the same ticks; the smallest time of each tick counts.
    pub(super) passes: u32,
}

/// One row of the results.
#[derive(Debug, Serialize)]
struct Row {
    name: String,
    triangles_a: usize,
    triangles_b: usize,
    pieces_a: usize,
    pieces_b: usize,
    /// Contact tolerance, m.
    tolerance: f64,
    #[serde(flatten)]
    times: Times,
    /// Poses of the pair, for other libraries.
    #[serde(skip_serializing_if = "Option::is_none")]
    repeat: Option<pairs::Repeat>,
}

impl Row {
    fn new(name: String, a: &Body, b: &Body, tolerance: f64, times: Times) -> Self {
        Self {
            name,
            triangles_a: a.mesh().triangles().len(),
            triangles_b: b.mesh().triangles().len(),
            pieces_a: a.pieces().len(),
            pieces_b: b.pieces().len(),
            tolerance,
            times,
            repeat: None,
        }
    }
}

/// Prints the rows and writes them as text, CSV and JSON.
fn report(out: &Path, name: &str, rows: &[Row]) -> anyhow::Result<()> {
    let text = text(rows);
    output::line(&text);
    fs::write(out.join(format!("{name}.txt")), format!("{text}\n"))?;
    fs::write(out.join(format!("{name}.json")), serde_json::to_string_pretty(rows)?)?;
    let mut csv = String::from(
        "name,triangles_a,triangles_b,pieces_a,pieces_b,tolerance_m,ticks,contacts_mean,p50_us,p99_us,p999_us,max_us\n",
    );
    for row in rows {
        let Row { name, triangles_a, triangles_b, pieces_a, pieces_b, tolerance, times, .. } = row;
        let Times { ticks, contacts, micros: Micros { p50, p99, p999, max } } = times;
        csv += &format!(
            "{name},{triangles_a},{triangles_b},{pieces_a},{pieces_b},{tolerance},{ticks},{contacts},{p50},{p99},{p999},{max}\n"
        );
    }
    fs::write(out.join(format!("{name}.csv")), csv)?;
    Ok(())
}

fn text(rows: &[Row]) -> String {
    let head = ["step, µs", "triangles", "pieces", "tolerance", "contacts", "p50", "p99", "p99.9", "max"];
    let cells = |row: &Row| {
        let Times { contacts, micros: Micros { p50, p99, p999, max }, .. } = &row.times;
        let first = [
            row.name.clone(),
            format!("{} / {}", row.triangles_a, row.triangles_b),
            format!("{} / {}", row.pieces_a, row.pieces_b),
            format!("{:.3} mm", row.tolerance * 1e3),
        ];
        first.into_iter().chain([contacts, p50, p99, p999, max].map(|value| format!("{value:.1}"))).collect()
    };
    Table::new(&head, 1, rows.iter().map(cells)).text()
}

/// Two bodies, shared with a renderer.
pub(super) struct Bodies {
    pub(super) a: Arc<Body>,
    pub(super) b: Arc<Body>,
}
