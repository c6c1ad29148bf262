//! The most important figures, one in each row: the table of README.md and of reports.

use super::held::HARDEST;
use super::row::Row;

/// A row of the table: its title, scene, hand, measure, factor and unit.
struct Line {
    what: &'static str,
    scene: &'static str,
    hand: &'static str,
    measure: &'static str,
    factor: f64,
    unit: &'static str,
}

const fn line(
    what: &'static str,
    scene: &'static str,
    hand: &'static str,
    measure: &'static str,
    factor: f64,
    unit: &'static str,
) -> Line {
    Line { what, scene, hand, measure, factor, unit }
}

const LINES: [Line; 6] = [
    line("force lost in a millisecond when two contacts merge", "rails", "", "step while merging", 1.0, "%"),
    line("largest force step, ring in ring", "torus-torus", "", "force step max", 1e3, "mN/ms"),
    line("energy given to an ordinary hand, spoon in cup", "spoon-cup", "normal", "energy generated", 1e6, "µJ"),
    line(
        "greatest stable contact stiffness, box on table, ordinary hand",
        "box-rest",
        "normal",
        "greatest stable stiffness",
        1.0,
        "N/m",
    ),
    line(
        "greatest stable contact stiffness, box on table, without a hand",
        "box-rest",
        "none",
        "greatest stable stiffness",
        1.0,
        "N/m",
    ),
    line("deepest visible overlap, ball in intestine", "intestine", "normal", "deepest in the loop", 1e3, "mm"),
];

/// Methods, and their names for readers.
const METHODS: [(&str, &str); 4] = [
    ("paper", "the paper's way"),
    ("coupled-smooth", "palpus's default"),
    ("predicted", "depth predicted from the last features"),
    ("voxel-coupled", "point shell in voxels, coupled"),
];

/// Returns the table as Markdown; `None` if no number of the table was measured.
pub(super) fn markdown(rows: &[Row]) -> Option<String> {
    let value = |line: &Line, method: &str| {
        let is_it = |row: &&Row| {
            row.scene == line.scene && row.method == method && row.hand == line.hand && row.measure == line.measure
        };
        rows.iter().find(is_it).map(|row| row.value)
    };
    let mut text = String::from("| |");
    METHODS.iter().for_each(|(_, name)| text += &format!(" {name} |"));
    text += "\n|---|";
    text += &"---:|".repeat(METHODS.len());
    text.push('\n');
    let mut any = false;
    for line in &LINES {
        let cells = METHODS.map(|(method, _)| value(line, method).map_or(String::new(), |value| said(line, value)));
        any |= cells.iter().any(|cell| !cell.is_empty());
        text += &format!("| {} ({}) | {} |\n", line.what, line.unit, cells.join(" | "));
    }
    any.then_some(text)
}

/// Formats a value with two significant digits; whole numbers from a hundred on.
fn said(line: &Line, value: f64) -> String {
    let value = value * line.factor;
    match value {
        _ if line.unit == "N/m" && value <= 0.0 => "< 100".to_owned(),
        _ if line.unit == "N/m" && value >= HARDEST => format!("≥ {HARDEST:.0}"),
        _ if !value.is_finite() => "lost".to_owned(),
        _ if value.abs() < NOTHING => "0".to_owned(),
        _ if value.abs() >= 10.0 => format!("{value:.0}"),
        _ if value.abs() >= 1.0 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}

/// Smaller values (in the shown unit) are rounding errors.
const NOTHING: f64 = 5e-4;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measured_value_is_in_its_cell() {
        let row = |scene, method: &'static str, hand, measure, value| Row {
            scene,
            method: method.into(),
            hand,
            measure,
            unit: "",
            value,
        };
        assert_eq!(markdown(&[row("rails", "paper", "normal", "step while merging", 100.0)]), None);
        let rows = [
            row("rails", "paper", "", "step while merging", 100.0),
            row("box-rest", "coupled-smooth", "none", "greatest stable stiffness", HARDEST),
            row("spoon-cup", "predicted", "normal", "energy generated", 4.2e-8),
        ];
        let text = markdown(&rows).unwrap();
        assert!(text.contains("two contacts merge (%) | 100 |  |  |  |"), "{text}");
        assert!(text.contains("without a hand (N/m) |  | ≥ 51200 |  |  |"), "{text}");
        assert!(text.contains("spoon in cup (µJ) |  |  | 0.04 |  |"), "{text}");
    }
}
