//! The sections beyond the paper: a run in real time, feel, scale, other libraries, penetration
//! depth, and the machine.

use palpus_io::scene::FilePolicy;
use serde_json::Value;

use super::data::{Data, number, word};
use super::plan::{PAIRS, STEPS};
use super::ran::{Outcome, Ran, SAID};
use super::stored::{CONVEX, PAIRS_MEASURED, only, tables};
use super::{Reproduction, origin};
use crate::durations::duration;
use crate::numbers::said;
use crate::report::html::{Html, Tone};
use crate::report::run::Run;
use crate::table::Table;

/// Writes the section on the closed loop in real time on this machine.
pub(super) fn run(html: &mut Html, data: &Data<'_>, run: &str) -> anyhow::Result<()> {
    let recording = data.path("run", "run.csv");
    let read = recording.is_file().then(|| Run::of(&recording, FilePolicy::Inside)).transpose()?;
    let mut moments = Html::new();
    if let Some(read) = &read {
        read.moments(&mut moments)?;
    }
    html.section("run", "A spoon in a cup at 1 kHz, in real time", |section| {
        section.paragraph(
            "The closed loop in its default form: a simulated device in a simulated hand, and palpus's default \
            rendering. `palpus report` makes a separate page of any recording.",
        );
        origin(section, data, "run", run);
        if let Some(read) = &read {
            read.badges(section);
            read.tiles(section);
            section.append(moments);
            read.plots(section);
        }
    });
    Ok(())
}

/// Writes the section on the figures of feel.
pub(super) fn feel(html: &mut Html, data: &Data<'_>, run: &str) {
    html.section("feel", "What contact feels like", |section| {
        section.paragraph(
            "Every method on every scene in every simulated hand: one tick of delay, encoder steps of 0.03 mm, \
            the tick lengths of a recorded servo loop. The benchmark reads no clock, so these figures are the \
            same on every machine except for rounding. `paper`: exact linkage, direct rendering; \
            `coupled-smooth`: palpus's default; `predicted` and `voxel`: the two earlier methods with which the \
            paper compares its own, implemented from their papers; `epa`: one contact of EPA for each pair of \
            pieces.",
        );
        origin(section, data, "feel", run);
        if let Some(glance) = data.text("feel", "glance.md") {
            for table in tables(&glance, "") {
                section.table(&Table { title: "The most important figures".to_owned(), naming: 1, ..table });
            }
        }
        for (file, caption) in [
            (
                "rails_open.svg",
                "Two contacts become one: a knife slides over two ridges that converge, and the depth stays the same",
            ),
            ("torus-torus_open.svg", "Ring in ring, the same poses for all methods"),
        ] {
            if let Some(svg) = data.bytes("feel", file) {
                section.drawing(&svg, caption);
            }
        }
        let Some(all) = data.text("feel", "feel.md") else { return };
        for table in tables(&all, "What contact feels like") {
            let title = match table.title.as_str() {
                "Open loop" => "All scenes, open loop: the same poses for all methods",
                "In a normal hand" => "All scenes in a normal hand",
                "Without a hand" => "Scenes in which no hand holds the probe",
                _ => "",
            };
            section.folded(title, |inner| {
                inner.table(&Table { title: String::new(), naming: 2, ..table });
            });
        }
        for (begin, title) in [
            ("Against the truth", "Scenes with a known true wrench: the difference from it"),
            ("Insertion", "A peg into its hole, in every hand"),
        ] {
            if let Some(table) = of_all_scenes(&all, begin) {
                section.folded(title, |inner| {
                    inner.table(&table);
                });
            }
        }
        section.heading("Random parts with play");
        section.paragraph(
            "Slots, drawers, keys and square pegs with random play, twist, stiffness and tolerance, in each hand: hum \
            at rest, energy given to the hand, and true overlap of the meshes.",
        );
        origin(section, data, "sweep", run);
        for table in data.text("sweep", "sweep.md").iter().flat_map(|text| tables(text, "Flush sweep")) {
            section.table(&Table { title: String::new(), naming: 2, ..table });
        }
    });
}

/// Joins the tables of all scenes whose titles begin with this text.
fn of_all_scenes(text: &str, begin: &str) -> Option<Table> {
    let scenes = text.lines().filter_map(|line| line.strip_prefix("## "));
    let mut whole: Option<Table> = None;
    for scene in scenes {
        for table in tables(text, scene).into_iter().filter(|table| table.title.starts_with(begin)) {
            let named = |row: Vec<String>| [vec![scene.to_owned()], row].concat();
            let rows = table.rows.into_iter().map(named);
            match &mut whole {
                Some(whole) => whole.rows.extend(rows),
                None => {
                    let head = [vec!["scene".to_owned()], table.head].concat();
                    whole = Some(Table { title: String::new(), head, rows: rows.collect(), naming: table.naming + 1 });
                }
            }
        }
    }
    whole
}

/// Writes the section on the time of a step as a function of triangles and contacts.
pub(super) fn scale(html: &mut Html, data: &Data<'_>, run: &str) {
    html.section("scale", "What a step depends on", |section| {
        section.paragraph(
            "A ball of 4 cm slides on a torus with the irregular triangles of a scan. First plot: 1 k to 906 k \
            triangles, each with the tolerance that gives 4 contacts. Second plot: 100 k triangles with a \
            growing tolerance. A step is query, depth and force.",
        );
        for (id, caption) in [("triangles", "The step against triangles"), ("contacts", "The step against contacts")] {
            section.heading(caption);
            origin(section, data, id, run);
            if let Some(svg) = data.bytes(id, &format!("{id}.svg")) {
                section.drawing(&svg, "");
            }
            let Some(rows) = data.json::<Vec<Value>>(id, &format!("{id}.json")) else { continue };
            let head = ["", "triangles", "tolerance (mm)", "contacts a tick", "median (µs)", "p99", "p99.9", "largest"];
            section.table(&Table::new(&head, 1, rows.iter().map(scale_row)));
        }
    });
}

fn scale_row(row: &Value) -> Vec<String> {
    let value =
        |name: &str, factor: f64, digits| number(row, &[name]).map_or(String::new(), |n| said(n * factor, digits));
    vec![
        word(row, &["name"]).unwrap_or("").to_owned(),
        value("triangles_b", 1.0, 6),
        value("tolerance", 1e3, 3),
        value("contacts", 1.0, 3),
        value("p50", 1.0, 3),
        value("p99", 1.0, 3),
        value("p999", 1.0, 3),
        value("max", 1.0, 3),
    ]
}

/// Writes the section on real pairs, compared with Coal.
pub(super) fn pairs(html: &mut Html, data: &Data<'_>, run: &str) {
    html.section("pairs", "Real pairs, beside Coal", |section| {
        section.paragraph(
            "The engine's step (query, depth and force) in sustained contact, compared with Coal's OBB-tree \
            tolerance query on the same poses in the same run, in microseconds. Coal counts pairs of triangles, \
            palpus counts pairs of convex pieces. Each time is the smallest of three passes. The cost of an \
            empty Python call is subtracted from Coal's times.",
        );
        let measured: Vec<Table> = PAIRS
            .iter()
            .filter(|(id, ..)| data.is_done(id))
            .filter_map(|(id, ..)| tables(&data.text(id, "coal_scale.md")?, "").into_iter().next())
            .collect();
        if let Some(first) = measured.first() {
            let done = PAIRS.iter().find(|(id, ..)| data.is_done(id)).map_or("", |(id, ..)| *id);
            origin(section, data, done, run);
            let rows = measured.iter().flat_map(|table| table.rows.clone()).collect();
            let title = "Measured by this reproduction (µs)".to_owned();
            section.table(&Table { title, rows, naming: 1, ..first.clone() });
        }
        if measured.len() < PAIRS.len() {
            for table in tables(PAIRS_MEASURED, "One step on real pairs") {
                if measured.is_empty() {
                    origin(section, data, PAIRS[0].0, run);
                }
                let is_new = |row: &[String]| !measured.iter().any(|table| names_same(&table.rows, row));
                let rest = only(table, is_new);
                is_stored(section, "docs/benchmarks.md");
                section.table(&Table { title: "From the documents (µs)".to_owned(), naming: 1, ..rest });
            }
        }
    });
}

/// True if one of `rows` has the name of `row`, written with either dash.
fn names_same(rows: &[Vec<String>], row: &[String]) -> bool {
    let plain = |name: &str| name.replace('–', "-");
    rows.iter().any(|known| known.first().map(|name| plain(name)) == row.first().map(|name| plain(name)))
}

/// Writes the section on a nut that is pressed on its thread.
pub(super) fn conformal(html: &mut Html, data: &Data<'_>, run: &str) {
    html.section("conformal", "A nut on its thread", |section| {
        section.paragraph(
            "An M16 nut overlaps the thread of its bolt by this share of the pitch, first upward, then downward. \
            `-chosen` uses the tolerance that a scene file gets by default, and `-coupled` renders behind the coupling \
            with limited work. Times are processor time of one thread. The errors are the largest of the net force \
            and torque at some poses, compared with all contacts without sampling or memory.",
        );
        origin(section, data, "conformal", run);
        let Some(rows) = data.json::<Vec<Value>>("conformal", "conformal.json") else { return };
        let head = [
            "case",
            "tolerance (mm)",
            "contacts",
            "median (µs)",
            "p99",
            "p99.9",
            "steps at the work limit (%)",
            "direction (°)",
            "size (%)",
            "torque (%)",
        ];
        section.table(&Table::new(&head, 1, rows.iter().map(conformal_row)));
    });
}

fn conformal_row(row: &Value) -> Vec<String> {
    let name = word(row, &["name"]).unwrap_or("");
    // Behind the coupling, the wrench is that of the coupling, and there is no truth for it.
    let is_compared = |way: &[&str]| way[0] != "wrench" || !name.ends_with("-coupled");
    let value = |way: &[&str], factor: f64| {
        number(row, way).filter(|_| is_compared(way)).map_or(String::new(), |n| said(n * factor, 3))
    };
    vec![
        name.to_owned(),
        value(&["tolerance"], 1e3),
        value(&["contacts"], 1.0),
        value(&["p50"], 1.0),
        value(&["p99"], 1.0),
        value(&["p999"], 1.0),
        value(&["late"], 100.0),
        value(&["wrench", "direction"], 1.0),
        value(&["wrench", "size"], 100.0),
        value(&["wrench", "torque"], 100.0),
    ]
}

fn is_stored(html: &mut Html, file: &str) {
    html.element("p", "origin", |p| {
        p.badge(Tone::Warning, "not measured in this run");
        p.prose(&format!("figures of an earlier run, from `{file}`, which names the run and its machine"));
    });
}

/// Writes the section on penetration depth and distance of convex pairs, compared with other
/// libraries.
pub(super) fn convex(html: &mut Html, data: &Data<'_>, run: &str) {
    html.section("convex", "Convex pairs, compared with parry, Coal and MuJoCo", |section| {
        section.paragraph(
            "Penetration depth and distance of two convex hulls, microseconds, median / p99. In \
            coherent motion, such as the motion of a hand, palpus's walk starts at its last result; `proven` \
            adds the certificate that no direction is shorter. The paper states about 100 µs for a depth on its \
            machine, for hulls of any size.",
        );
        origin(section, data, "convex", run);
        let measured = data.text("convex", "convex.md").filter(|_| data.is_done("convex"));
        let all = match &measured {
            Some(text) => tables(text, ""),
            None => tables(CONVEX, ""),
        };
        if measured.is_none() {
            if let Some(table) = parry_alone(data) {
                section.table(&table);
            }
            is_stored(section, "docs/benchmarks.md");
        }
        for table in &all {
            let rolling =
                only(table.clone(), |row| matches!(row.get(1).map(String::as_str), Some("rolling" | "apart")));
            section.table(&Table { naming: 2, ..rolling });
        }
        section.folded("All motions: sliding, rolling, deep, and without history (cold)", |inner| {
            for table in all {
                inner.table(&Table { naming: 2, ..table });
            }
        });
    });
}

/// Returns the table of the bench alone, without the libraries that need Python.
fn parry_alone(data: &Data<'_>) -> Option<Table> {
    let text = data.text("convex", "convex.csv")?;
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let micros =
            |k: usize| cells.get(k).and_then(|ns| ns.parse::<f64>().ok()).map_or(String::new(), |ns| said(ns / 1e3, 3));
        let name = |k: usize| cells.get(k).copied().unwrap_or("").to_owned();
        vec![name(0), name(1), name(2), micros(4), micros(5)]
    };
    let head = ["shape", "motion", "method", "median (µs)", "p99"];
    Some(Table::new(&head, 3, text.lines().skip(1).map(row)).titled("palpus and parry"))
}

/// Writes the section on the motion of the centre of a contact patch.
pub(super) fn depth(html: &mut Html, data: &Data<'_>, run: &str) {
    html.section("depth", "Penetration depth: smoothness", |section| {
        section.paragraph(
            "The plot shows that the middle of a contact patch moves continuously while a box tilts through flat contact \
             on a table; an exact contact point cannot.",
        );
        origin(section, data, "depth", run);
        if let Some(svg) = data.bytes("depth", "depth_witness.svg") {
            section.drawing(&svg, "Contact point of a box that tilts on a table: the exact witness point, and the middle of the contact patch");
        }
    });
}

/// Writes the section on the machine, the versions, and every command.
pub(super) fn made(html: &mut Html, data: &Data<'_>, reproduction: &Reproduction) {
    html.section("made", "How this was made", |section| {
        section.paragraph(&format!(
            "`{}`, begun {}, took {}. DIR is the folder of the reproduction, MODELS the folder with the real meshes.",
            reproduction.command,
            reproduction.run,
            duration(reproduction.seconds)
        ));
        section.heading("Machine");
        section.facts(&[&reproduction.machine[..], &from_doctor(data)[..]].concat());
        section.heading("Program");
        section.facts(&reproduction.versions);
        section.heading("Seeds");
        section.facts(&SEEDS.map(|(what, seed)| (what.to_owned(), seed.to_owned())));
        section.heading("Commands, in their order");
        let row = |id: &&'static str| data.ran(id).map(|ran| command_row(id, &ran, &reproduction.run));
        let head = ["step", "command", "outcome", "took", "load when it began"];
        section.table(&Table::new(&head, 3, STEPS.iter().filter_map(row)));
    });
}

/// All random seeds.
const SEEDS: [(&str, &str); 6] = [
    ("scripted hands' tremor", "5 and others, in palpus-scenes"),
    ("tick lengths of the servo loop in the feel suite", "0xfee1_0001"),
    ("random parts with play: first case", "0xf1a5_4000"),
    ("scale: directions from which the ball comes", "0x5ca1_e002"),
    ("pairs: directions from which bodies meet", "0x5ca1_e001"),
    ("convex pairs: shapes and poses", "0x5eed_c03e"),
];

fn command_row(id: &str, ran: &Ran, run: &str) -> Vec<String> {
    let what = match ran.outcome {
        Outcome::Done if ran.run == run => "measured in this run".to_owned(),
        Outcome::Done => format!("measured on {}", ran.finished),
        Outcome::Failed => format!("failed: {}", ran.why),
        Outcome::Skipped => format!("left out: {}", ran.why),
    };
    let took = if ran.outcome == Outcome::Skipped { String::new() } else { duration(ran.seconds) };
    let command = if ran.command.is_empty() { String::new() } else { format!("`{}`", ran.command) };
    vec![id.to_owned(), command, what, took, ran.load.map_or(String::new(), |load| said(load, 2))]
}

/// Returns the facts measured by the doctor.
fn from_doctor(data: &Data<'_>) -> Vec<(String, String)> {
    let Some(found) = data.json::<Value>("doctor", SAID) else { return Vec::new() };
    let mut facts = Vec::new();
    let mut add = |name: &str, value: String| facts.push((name.to_owned(), value));
    if let Some(words) = word(&found, &["verdict", "words"]) {
        let notes = found.get("verdict").and_then(|verdict| verdict.get("notes")).and_then(Value::as_array);
        let notes: Vec<&str> = notes.into_iter().flatten().filter_map(|note| word(note, &["what"])).collect();
        add("verdict of the doctor", [vec![words.trim_end_matches(':')], notes].concat().join(" · "));
    }
    let micros = |way: &[&str]| number(&found, way).map_or_else(|| "?".to_owned(), |us| format!("{} µs", said(us, 3)));
    add(
        "a bare timer at 1 kHz is late by",
        format!(
            "{} (median), {} (p99.9), {} (largest)",
            micros(&["timer", "p50_us"]),
            micros(&["timer", "p999_us"]),
            micros(&["timer", "max_us"])
        ),
    );
    if let Some(rate) = number(&found, &["scene", "achievable_hz"]) {
        add("holds a spoon in a cup at up to", format!("{} Hz", said(rate, 5)));
    }
    let governors = found.get("machine").and_then(|machine| machine.get("governors"));
    add(
        "governor",
        governors.and_then(Value::as_array).map_or_else(|| "not known here".to_owned(), |all| governor_names(all)),
    );
    if let Some(is) = found.get("machine").and_then(|m| m.get("real_time_kernel")).and_then(Value::as_bool) {
        add("real-time kernel", if is { "yes" } else { "no" }.to_owned());
    }
    if let Some(is) = found.get("machine").and_then(|m| m.get("virtual_machine")).and_then(Value::as_bool) {
        add("virtual machine", if is { "yes" } else { "no" }.to_owned());
    }
    if let Some(cores) = number(&found, &["load", "others_cores"]) {
        add("other programs kept busy meanwhile", format!("{} cores", said(cores, 2)));
    }
    facts
}

fn governor_names(all: &[Value]) -> String {
    let name = |governor: &Value| governor.get(0).and_then(Value::as_str).map(str::to_owned);
    all.iter().filter_map(name).collect::<Vec<_>>().join(", ")
}

/// Returns the verdict of `palpus doctor` as a badge; empty if that step was not run.
pub(super) fn fitness(data: &Data<'_>) -> Option<(Tone, &'static str)> {
    let found = data.json::<Value>("doctor", SAID)?;
    match word(&found, &["verdict", "fitness"])? {
        "fit" => Some((Tone::Good, "machine fit for 1 kHz")),
        "fit_with_notes" => Some((Tone::Plain, "machine holds 1 kHz, with notes")),
        _ => Some((Tone::Warning, "machine did not hold 1 kHz")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_scenes_are_merged() {
        let text = "# All\n\n## a\n\n**Against the truth (x)**\n\n| method | m |\n|---|---|\n| p | 1 |\n\n## b\n\n**Other**\n\n| method |\n|---|\n\n\
                    **Against the truth (x)**\n\n| method | m |\n|---|---|\n| q | 2 |\n";
        let table = of_all_scenes(text, "Against").unwrap();
        assert_eq!(table.head, ["scene", "method", "m"]);
        assert_eq!(
            (table.rows, table.naming),
            (vec![vec!["a".into(), "p".into(), "1".into()], vec!["b".into(), "q".into(), "2".into()]], 2)
        );
        assert!(of_all_scenes(text, "Nothing").is_none());
    }
}
