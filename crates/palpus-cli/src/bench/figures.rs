//! `palpus bench figures`: Table 1, Figures 4, 5 and 6 of the paper.
//!
//! The scripted hands move the probe directly, without a device, so that the same poses are queried
//! on every machine. The times are from this machine.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use anyhow::anyhow;
use palpus::WallClock;
use palpus::detect::{Contact, ContactQuery, QuerySettings};
use palpus::render::{Clustering, Renderer, Settings, TickSummary, WorkLimit};
use palpus_io::scene::FilePolicy;

use super::figure_4::figure_4;
use super::{TICK, table};
use crate::plots::{BLUE, Drawn, Figure, GREEN, Panel, Series, VERMILION, bands, write_svg};
use crate::stage::{self, Stage};
use crate::{files, output, query};

pub(super) fn figures(out: &Path, models: Option<&Path>) -> anyhow::Result<ExitCode> {
    files::make_folder(out)?;
    let rows = table::measure(models)?;
    let text = table::text(&rows);
    fs::write(out.join("table1.txt"), format!("{text}\n"))?;
    fs::write(out.join("table1.json"), serde_json::to_string_pretty(&rows)?)?;
    output::line(&text);
    figure_4(out)?;
    figure_5(out)?;
    figure_6(out)?;
    output::line(format!(
        "written to {}: table1 and figures 4, 5 and 6 as text, JSON, PNG, CSV and SVG",
        out.display()
    ));
    Ok(ExitCode::SUCCESS)
}

/// Measures query time, force time and contacts while a spoon touches a cup.
fn figure_5(out: &Path) -> anyhow::Result<()> {
    let stage = stage::prepare("spoon-cup", FilePolicy::Inside)?;
    let as_in_the_paper = Settings { clustering: Clustering::Linkage, ..stage.settings };
    let mut renderer = Renderer::new(stage.probe.clone(), stage.environment.clone(), as_in_the_paper)?;
    renderer.allow(WorkLimit::Unlimited);
    let mut ticks = pass(&stage, &mut renderer);
    let mut totals = vec![total_ms(&ticks)];
    for _ in 1..PASSES {
        renderer.clear();
        let again = pass(&stage, &mut renderer);
        totals.push(total_ms(&again));
        for (best, again) in ticks.iter_mut().zip(again) {
            best.times.query = best.times.query.min(again.times.query);
            best.times.depth = best.times.depth.min(again.times.depth);
            best.times.force = best.times.force.min(again.times.force);
        }
    }
    files::write(&out.join("figure5_passes.json"), &serde_json::to_string(&totals)?)?;
    let mut file = query::create(&out.join("figure5.csv"))?;
    writeln!(file, "tick,query_us,force_us,contacts,clusters,separation_m,penetrating")?;
    for (k, tick) in ticks.iter().enumerate() {
        let (query, force) = (query_us(tick), force_us(tick));
        let penetrating = u8::from(tick.separation < 0.0);
        writeln!(file, "{k},{query},{force},{},{},{},{penetrating}", tick.contacts, tick.clusters, tick.separation)?;
    }
    file.flush()?;
    let curve = |value: &dyn Fn(&TickSummary) -> f64| -> Vec<(f64, f64)> {
        ticks.iter().enumerate().map(|(k, tick)| (k as f64, value(tick))).collect()
    };
    let intervals = bands(ticks.iter().enumerate().map(|(k, tick)| (k as f64, tick.separation < 0.0)));
    let figure = Figure {
        bands: intervals,
        ..Figure::new(
            "Figure 5: a spoon touches a cup (shaded: penetrating)",
            "tick (1 ms)",
            vec![
                Panel::lines(
                    "time of the contact query and of the force computation",
                    "µs",
                    vec![
                        Series::new("contact query", BLUE, curve(&query_us)),
                        Series::new("force", VERMILION, curve(&force_us)),
                    ],
                ),
                Panel::lines(
                    "contacts",
                    "number",
                    vec![
                        Series::new("contacts", BLUE, curve(&|tick| f64::from(tick.contacts))),
                        Series::new("clusters", GREEN, curve(&|tick| f64::from(tick.clusters))),
                    ],
                ),
            ],
        )
    };
    write_svg(&figure, &out.join("figure5.svg"))
}

/// Number of passes over the same ticks. The shortest time of each stage of each tick counts, which
/// removes delays by the operating system.
const PASSES: usize = 5;

/// Runs one pass along the scripted path, and returns the summary of each tick.
fn pass(stage: &Stage, renderer: &mut Renderer) -> Vec<TickSummary> {
    let clock = WallClock::new();
    (0..ticks(stage))
        .map(|k| {
            let time = k as f64 * TICK;
            renderer.step(&stage.scripted(time), TICK, &clock).summary()
        })
        .collect()
}

/// Returns the time of all contacts of a pass, ms.
fn total_ms(ticks: &[TickSummary]) -> f64 {
    ticks.iter().map(|tick| query_us(tick) + force_us(tick)).sum::<f64>() / 1e3
}

fn query_us(tick: &TickSummary) -> f64 {
    (tick.times.query + tick.times.depth) as f64 / 1e3
}

fn force_us(tick: &TickSummary) -> f64 {
    tick.times.force as f64 / 1e3
}

/// Measures contact point, normal and distance while a pen is drawn over a sphere.
fn figure_6(out: &Path) -> anyhow::Result<()> {
    let stage = stage::prepare("pen-sphere", FilePolicy::Inside)?;
    let Settings { contact_tolerance: tolerance, capacity, .. } = stage.settings;
    let settings = QuerySettings { tolerance, capacity, ..QuerySettings::default() };
    let mut query = ContactQuery::new(stage.probe.clone(), stage.environment.clone(), settings);
    let mut contacts = Vec::with_capacity(ticks(&stage));
    for k in 0..ticks(&stage) {
        let pose = stage.path.pose(k as f64 * TICK);
        contacts.push(query.nearest(&pose).ok_or_else(|| anyhow!("tick {k} of the pen's path has no answer"))?);
    }
    let mut file = query::create(&out.join("figure6.csv"))?;
    writeln!(file, "tick,point_x,point_y,point_z,normal_x,normal_y,normal_z,distance_m,penetrating")?;
    for (k, contact) in contacts.iter().enumerate() {
        let (p, n, d) = (contact.midpoint(), contact.normal, contact.separation);
        writeln!(file, "{k},{},{},{},{},{},{},{d},{}", p.x, p.y, p.z, n.x, n.y, n.z, u8::from(d < 0.0))?;
    }
    file.flush()?;
    let curve = |value: &dyn Fn(&Contact) -> f64| -> Vec<(f64, f64)> {
        contacts.iter().enumerate().map(|(k, contact)| (k as f64, value(contact))).collect()
    };
    let axes = |value: &dyn Fn(&Contact) -> glam::DVec3| {
        [("x", VERMILION), ("y", GREEN), ("z", BLUE)]
            .into_iter()
            .enumerate()
            .map(|(axis, (label, color))| Series::new(label, color, curve(&|contact| value(contact)[axis])))
            .collect()
    };
    let panel = |title, unit, series| Panel { title, unit, series, drawn: Drawn::ThickInBands };
    let figure = Figure {
        bands: bands(contacts.iter().enumerate().map(|(k, contact)| (k as f64, contact.separation < 0.0))),
        ..Figure::new(
            "Figure 6: a pen is drawn over a sphere (thick and shaded: penetrating)",
            "tick (1 ms)",
            vec![
                panel("(a) contact point", "mm", axes(&|contact| contact.midpoint() * 1e3)),
                panel("(b) contact normal", "", axes(&|contact| contact.normal)),
                panel(
                    "(c) distance, negative when penetrating",
                    "mm",
                    vec![Series::new("distance", BLUE, curve(&|contact| contact.separation * 1e3))],
                ),
            ],
        )
    };
    write_svg(&figure, &out.join("figure6.svg"))
}

/// Returns the number of ticks of the scene's script.
pub(super) fn ticks(stage: &Stage) -> usize {
    (stage.path.duration() / TICK).round() as usize
}
