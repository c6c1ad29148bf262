//! Writes the report: tables of all measures, as Markdown and as self-contained HTML with the
//! plots, and the raw numbers.

use std::fmt::Write as _;
use std::path::Path;

use serde::Serialize;

use super::Z_WIDTH;
use super::closed::{HANDS, PACE_SEED};
use super::columns::{Column, FLUSH, LOOP, OPEN, PEG, REST, SUMMARY, SUMMARY_OF_HANDS, TRUTH, TRUTH_PARTS};
use super::ground::Ground;
use super::held::HARDEST;
use super::method::Entry;
use super::row::Row;
use crate::files;
use crate::plots::Svg;
use crate::report::html::Html;
use crate::table::Table;

/// A part of the page: a heading, text, tables and plots.
pub(super) struct Section<'a> {
    pub(super) title: String,
    pub(super) text: String,
    pub(super) tables: Vec<Table>,
    pub(super) figures: &'a [Svg],
}

#[derive(Serialize)]
struct Document<'a> {
    pace_seed: u64,
    quick: bool,
    rows: &'a [Row],
}

/// All measures, with their scenes and methods.
#[derive(Clone, Copy)]
pub(super) struct Measured<'a> {
    pub(super) grounds: &'a [Ground],
    /// Scenes of flush faces, play and machine parts.
    pub(super) flush: &'a [&'static str],
    pub(super) entries: &'a [Entry],
    pub(super) rows: &'a [Row],
    pub(super) figures: &'a [(&'a str, Vec<Svg>)],
    pub(super) quick: bool,
}

pub(super) fn write(out: &Path, measured: &Measured<'_>) -> anyhow::Result<()> {
    let sections = sections(measured);
    let Measured { rows, figures, quick, .. } = *measured;
    let csv = csv(rows);
    let json = serde_json::to_string_pretty(&Document { pace_seed: PACE_SEED, quick, rows })?;
    for (name, text) in
        [("feel.csv", csv), ("feel.json", json), ("feel.md", markdown(&sections)), ("feel.html", html(&sections))]
    {
        files::write(&out.join(name), text)?;
    }
    for (scene, figures) in figures {
        for (kind, figure) in ["open", "held"].iter().zip(figures) {
            files::write(&out.join(format!("{scene}_{kind}.svg")), figure.as_str())?;
        }
    }
    Ok(())
}

/// Returns all rows as a table of values.
pub(super) fn csv(rows: &[Row]) -> String {
    let mut csv = String::from("scene,method,hand,measure,unit,value\n");
    for Row { scene, method, hand, measure, unit, value } in rows {
        // Writing to a string cannot fail.
        let _ = writeln!(csv, "{scene},{method},{hand},{measure},{unit},{value}");
    }
    csv
}

fn sections<'a>(measured: &Measured<'a>) -> Vec<Section<'a>> {
    let Measured { grounds, flush, entries, rows, figures, .. } = *measured;
    let mut sections = vec![introduction(measured)];
    for (ground, (_, figures)) in grounds.iter().zip(figures) {
        let pick = Pick { rows, scene: ground.name };
        let mut tables = vec![pick.by_method("Open loop", entries, &OPEN)];
        if ground.truth.is_some() || ground.refined.is_some() {
            tables.push(pick.by_method("Against the truth (without friction)", entries, &TRUTH));
            tables.push(pick.by_method("Springs, motion and rest behind the coupling", entries, &TRUTH_PARTS));
        }
        tables.push(pick.by_hand("Closed loop", entries, &LOOP));
        tables.push(pick.by_hand("Held", entries, &REST));
        tables.push(pick.by_hand("Insertion", entries, &PEG));
        tables.push(pick.z_width(entries));
        tables.retain(|table| !table.rows.is_empty());
        let text = format!(
            "Contact tolerance {} mm, cluster radius {} mm, stiffness {} N/m, {}.",
            short(ground.settings.contact_tolerance * 1e3, 3),
            short(ground.settings.cluster_radius * 1e3, 3),
            short(ground.settings.stiffness, 4),
            if ground.settings.friction.is_some() { "with friction" } else { "no friction" },
        );
        sections.push(Section { title: ground.name.to_owned(), text, tables, figures });
    }
    for &scene in flush {
        let table = Pick { rows, scene }.by_hand("Closed loop", entries, &FLUSH);
        let text = String::from(
            "Flush faces, play or machine parts: hum above 10 Hz, energy, and the true overlap of the meshes.",
        );
        sections.push(Section { title: scene.to_owned(), text, tables: vec![table], figures: &[] });
    }
    sections
}

fn introduction(measured: &Measured<'_>) -> Section<'static> {
    let Measured { grounds, flush, entries, rows, quick, .. } = *measured;
    let scripted: Vec<&str> = grounds.iter().map(|ground| ground.name).collect();
    let mut text = String::from("Methods: ");
    let methods: Vec<String> = entries.iter().map(|entry| format!("{}: {}", entry.name, entry.summary)).collect();
    text += &methods.join("; ");
    text += ". Open loop: all methods get the same poses, 1000 per second. Closed loop: a simulated hand, one tick of delay, encoder steps of 0.03 mm, and the tick lengths of a recorded servo loop (978 to 1012 Hz, single ticks of up to 2.4 ms). A step over motion of 1 is the step of a single contact of this stiffness; a jump is larger.";
    if quick {
        text += " This is a quick run: parts of the scripts, one hand, a coarse search.";
    }
    let across = |title: &str, scenes: &[&str], columns: &[Column], hand: &'static str| {
        let mut table = table(title, &["scene", "method"], columns, []);
        for &scene in scenes {
            let pick = Pick { rows, scene };
            for entry in entries {
                let cells = pick.cells(entry.name, hand, columns);
                if cells.iter().any(|cell| !cell.is_empty()) {
                    table.rows.push([scene.to_owned(), entry.name.to_owned()].into_iter().chain(cells).collect());
                }
            }
        }
        table
    };
    let mut tables = vec![
        across("Open loop", &scripted, &SUMMARY, ""),
        across("In a normal hand", &scripted, &SUMMARY_OF_HANDS, "normal"),
    ];
    tables.push(across("Without a hand", &scripted, &SUMMARY_OF_HANDS, "none"));
    tables.push(across("Flush faces, play and machine parts in a normal hand", flush, &FLUSH, "normal"));
    tables.retain(|table| !table.rows.is_empty());
    Section { title: "What contact feels like".to_owned(), text, tables, figures: &[] }
}

pub(super) fn table(
    title: &str,
    names: &[&str],
    columns: &[Column],
    rows: impl IntoIterator<Item = Vec<String>>,
) -> Table {
    let head: Vec<&str> = names.iter().copied().chain(columns.iter().map(|column| column.head)).collect();
    Table::new(&head, names.len(), rows).titled(title)
}

/// The rows of one scene.
pub(super) struct Pick<'a> {
    pub(super) rows: &'a [Row],
    pub(super) scene: &'a str,
}

impl Pick<'_> {
    fn value(&self, method: &str, hand: &str, measure: &str) -> Option<f64> {
        let is_it =
            |row: &&Row| row.scene == self.scene && row.method == method && row.hand == hand && row.measure == measure;
        self.rows.iter().find(is_it).map(|row| row.value)
    }

    /// Returns one cell for each column; cells without a measurement are empty.
    pub(super) fn cells(&self, method: &str, hand: &str, columns: &[Column]) -> Vec<String> {
        let cell = |column: &Column| {
            let values: Vec<f64> =
                column.measures.iter().filter_map(|measure| self.value(method, hand, measure)).collect();
            let said = values.iter().map(|value| said(value * column.factor, column)).collect::<Vec<_>>();
            said.join(" / ")
        };
        columns.iter().map(cell).collect()
    }

    fn by_method(&self, title: &str, entries: &[Entry], columns: &[Column]) -> Table {
        let row = |entry: &Entry| {
            [entry.name.to_owned()].into_iter().chain(self.cells(entry.name, "", columns)).collect::<Vec<_>>()
        };
        table(title, &["method"], columns, entries.iter().map(row)).without_empty()
    }

    fn by_hand(&self, title: &str, entries: &[Entry], columns: &[Column]) -> Table {
        let row = |hand: &str, entry: &Entry| -> Vec<String> {
            let cells = self.cells(entry.name, hand, columns);
            [hand.to_owned(), entry.name.to_owned()].into_iter().chain(cells).collect()
        };
        let rows = HANDS.iter().flat_map(|(hand, _)| entries.iter().map(move |entry| row(hand, entry)));
        table(title, &["hand", "method"], columns, rows).without_empty()
    }

    fn z_width(&self, entries: &[Entry]) -> Table {
        let columns = Z_WIDTH.each_ref().map(|(_, measure)| Column {
            head: measure,
            measures: std::slice::from_ref(measure),
            factor: 1.0,
            digits: 3,
        });
        self.by_hand("Z-width: greatest stable stiffness (N/m) over contact damping and hand", entries, &columns)
    }
}

fn said(value: f64, column: &Column) -> String {
    match column.head {
        "in" => (if value > 0.0 { "yes" } else { "no" }).to_owned(),
        head if head.starts_with("greatest stable stiffness") || head.starts_with("Z-width") => {
            stiffness(value, column)
        }
        _ => short(value, column.digits),
    }
}

fn stiffness(value: f64, column: &Column) -> String {
    if value <= 0.0 {
        "< 100".to_owned()
    } else if value >= HARDEST {
        format!("≥ {HARDEST:.0}")
    } else {
        short(value, column.digits)
    }
}

/// Smaller values, in the unit of the table, are rounding errors.
const NOTHING: f64 = 1e-7;

/// Returns the value with `digits` significant digits.
fn short(value: f64, digits: usize) -> String {
    if value.abs() < NOTHING {
        return "0".to_owned();
    }
    if value.is_nan() {
        return "lost".to_owned();
    }
    if !value.is_finite() {
        return "∞".to_owned();
    }
    let size = value.abs().log10().floor() as i32;
    if size < -4 {
        return format!("{value:.*e}", digits.saturating_sub(1));
    }
    let decimals = (digits as i32 - 1 - size).max(0) as usize;
    format!("{value:.decimals$}")
}

pub(super) fn markdown(sections: &[Section<'_>]) -> String {
    let mut text = String::new();
    for (k, section) in sections.iter().enumerate() {
        text += &format!("{} {}\n\n{}\n\n", if k == 0 { "#" } else { "##" }, section.title, section.text);
        for table in &section.tables {
            text += &table.markdown();
            text += "\n";
        }
    }
    text
}

fn html(sections: &[Section<'_>]) -> String {
    let mut page = Html::new();
    for (k, section) in sections.iter().enumerate() {
        page.text_in(if k == 0 { "h1" } else { "h2" }, "", &section.title).text_in("p", "", &section.text);
        for table in &section.tables {
            page.table(table);
        }
        for figure in section.figures {
            page.plot(figure, "");
        }
    }
    page.page("What contact feels like")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_significant_digits_only() {
        for (value, digits, expected) in [
            (0.0, 3, "0"),
            (1234.5, 3, "1234"),
            (12.345, 3, "12.3"),
            (0.012345, 3, "0.0123"),
            (1.2345e-6, 2, "1.2e-6"),
            (1e-12, 2, "0"),
            (f64::INFINITY, 2, "∞"),
        ] {
            assert_eq!(short(value, digits), expected);
        }
    }

    #[test]
    fn missing_measure_has_no_column() {
        let row = |hand, measure, value| Row { scene: "s", method: "m".into(), hand, measure, unit: "", value };
        let rows = [row("none", "limit cycle", 0.5), row("firm", "limit cycle", 2.0)];
        let pick = Pick { rows: &rows, scene: "s" };
        let mut entries = [super::super::METHODS[0]];
        entries[0].name = "m";
        let table = pick.by_hand("t", &entries, &REST);
        assert_eq!(table.head, ["hand", "method", "limit cycle (% of mean force)"]);
        assert_eq!(table.rows, [["none", "m", "0.50"], ["firm", "m", "2.0"]]);
    }
}
