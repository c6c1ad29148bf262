//! `palpus bench feel`: measures what contact feels like, for every method, scene and simulated
//! hand.
//!
//! 1. *Open loop* (`open`): all methods get the same poses. Measures steps, directions, truth and
//!    pop-throughs.
//! 2. *Closed loop* (`scripted`): a simulated hand follows the scene's script. Measures energy,
//!    depth and insertion.
//! 3. *Flush* (`flush`): flush faces, play and machine parts in the closed loop; the flush sweep.
//! 4. *Held* (`held`): the probe rests in contact. Measures limit cycles and the greatest stable
//!    stiffness, also as a function of damping and hand (Z-width).
//!
//! This module reads no clock: the same seed gives the same numbers. Each thread processes one pair
//! (a scene and a method) at a time.

mod closed;
mod columns;
mod figure;
mod flush;
mod glance;
mod ground;
mod held;
mod method;
mod open;
mod open_benchmark;
mod report;
mod row;
mod scripted;
mod truth;

use std::path::Path;
use std::process::ExitCode;
use std::sync::Mutex;

use anyhow::{Context, bail};
use palpus::algebra::Workers;
use palpus_io::Threads;

use self::closed::HANDS;
use self::ground::{Ground, SCENES};
use self::method::{ContactOffset, Entry, METHODS, Tuning};
pub(super) use self::open_benchmark::{Asked as OpenAsked, run as open_benchmark};
use self::row::{Row, Rows};
use crate::{files, output};

/// Arguments of the command.
pub(super) struct Wanted<'a> {
    pub(super) out: &'a Path,
    pub(super) scene: Option<&'a str>,
    pub(super) method: Option<&'a str>,
    pub(super) quick: bool,
    /// Number of cases of the flush sweep and its first seed. If this is set, only the sweep runs.
    pub(super) sweep: Option<usize>,
    pub(super) seed: Option<u64>,
}

/// Measures of one method on one scene.
struct Outcome {
    rows: Vec<Row>,
    curve: open::Curve,
    held: Vec<closed::LoopTick>,
}

pub(super) fn feel(wanted: &Wanted<'_>) -> anyhow::Result<ExitCode> {
    files::make_folder(wanted.out)?;
    if let Some(count) = wanted.sweep {
        return flush::sweep::sweep(wanted.out, count, wanted.seed.unwrap_or(flush::sweep::SEED));
    }
    let scenes = chosen_scenes(wanted.scene)?;
    let methods = chosen("--method", wanted.method, &METHODS.map(|entry| entry.name))?;
    let effort = if wanted.quick { Effort::QUICK } else { Effort::FULL };
    let (scripted, flush): (Vec<_>, Vec<_>) = scenes.into_iter().partition(|name| SCENES.contains(name));
    let mut grounds: Vec<Ground> =
        scripted.iter().map(|name| Ground::new(name, effort.seconds)).collect::<anyhow::Result<_>>()?;
    let entries: Vec<Entry> = METHODS.into_iter().filter(|entry| methods.contains(&entry.name)).collect();
    if !wanted.quick && entries.iter().any(|entry| matches!(entry.contact_offset, ContactOffset::Tool)) {
        refine(&mut grounds)?;
    }
    let outcomes = measure_all(&grounds, &entries, &effort)?;
    let count = entries.len();
    let of_scene = |k: usize| &outcomes[k * count..(k + 1) * count];
    let mut figures = Vec::new();
    for (k, ground) in grounds.iter().enumerate() {
        let curves: Vec<_> = entries.iter().map(|entry| entry.name).zip(of_scene(k)).collect();
        figures.push((ground.name, figure::of_scene(ground, &curves)));
    }
    let mut rows: Vec<Row> = outcomes.into_iter().flat_map(|outcome| outcome.rows).collect();
    rows.extend(flush::measure_all(&flush, &entries, &effort)?);
    report::write(
        wanted.out,
        &report::Measured {
            grounds: &grounds,
            flush: &flush,
            entries: &entries,
            rows: &rows,
            figures: &figures,
            quick: wanted.quick,
        },
    )?;
    if let Some(glance) = glance::markdown(&rows) {
        files::write(&wanted.out.join("glance.md"), &glance)?;
        output::line(glance);
    }
    output::line(format!("written to {}: feel.md, feel.html, feel.csv, feel.json and the plots", wanted.out.display()));
    Ok(ExitCode::SUCCESS)
}

/// Computes the refined truths of the scenes that have one.
fn refine(grounds: &mut [Ground]) -> anyhow::Result<()> {
    let refined = shared_out(grounds.len(), |k| Ok(grounds[k].refined_truth()))?;
    for (ground, refined) in grounds.iter_mut().zip(refined) {
        ground.refined = refined;
    }
    Ok(())
}

/// Returns the selected scenes: all except the large scene, or the named scene.
fn chosen_scenes(only: Option<&str>) -> anyhow::Result<Vec<&'static str>> {
    let mut usual = SCENES.to_vec();
    usual.extend(flush::SCENES.map(|(name, _)| name));
    let Some(_) = only else { return Ok(usual) };
    usual.push(flush::LARGE.0);
    chosen("--scene", only, &usual)
}

/// Returns the selected names: all, or only the requested name.
fn chosen(option: &str, only: Option<&str>, all: &[&'static str]) -> anyhow::Result<Vec<&'static str>> {
    let Some(only) = only else { return Ok(all.to_vec()) };
    match all.iter().find(|name| **name == only) {
        Some(name) => Ok(vec![name]),
        None => bail!("there is no {option} {only}; the names are {}", all.join(", ")),
    }
}

/// Extent of the measurements.
struct Effort {
    /// Length of each script, s.
    seconds: f64,
    hands: &'static [&'static str],
    /// Scenes for which the greatest stable stiffness is searched; number of bisection steps.
    searched: &'static [&'static str],
    halvings: usize,
    /// Hands in which slow methods are measured.
    costly_hands: &'static [&'static str],
    /// Contact dampings of the Z-width map, N·s/m; empty for no map.
    dampings: &'static [(f64, &'static str)],
}

impl Effort {
    const FULL: Self = Self {
        seconds: f64::INFINITY,
        hands: &["none", "relaxed", "normal", "firm"],
        searched: &["pen-sphere", "v-groove", "box-rest", "spoon-cup", "torus-torus", "peg-hole"],
        halvings: 2,
        costly_hands: &["none", "normal"],
        dampings: &Z_WIDTH,
    };
    const QUICK: Self = Self {
        seconds: 1.5,
        hands: &["none", "normal"],
        searched: &["pen-sphere", "v-groove", "box-rest"],
        halvings: 0,
        costly_hands: &[],
        dampings: &[],
    };
}

/// Contact dampings of the Z-width map, and the names of its measures.
const Z_WIDTH: [(f64, &str); 5] = [
    (0.0, "Z-width at 0 N·s/m"),
    (0.5, "Z-width at 0.5 N·s/m"),
    (1.0, "Z-width at 1 N·s/m"),
    (2.0, "Z-width at 2 N·s/m"),
    (4.0, "Z-width at 4 N·s/m"),
];

/// Scene of the Z-width map: flat contact, which is also stable without a hand.
const Z_WIDTH_SCENE: &str = "box-rest";

fn measure_all(grounds: &[Ground], entries: &[Entry], effort: &Effort) -> anyhow::Result<Vec<Outcome>> {
    let count = grounds.len() * entries.len();
    let mut outcomes = shared_out(count, |k| {
        // The last scenes are the largest, so they start first.
        let k = count - 1 - k;
        let (ground, entry) = (&grounds[k / entries.len()], &entries[k % entries.len()]);
        measure(ground, entry, effort)
            .with_context(|| format!("{} on {} could not be measured", entry.name, ground.name))
    })?;
    outcomes.reverse();
    Ok(outcomes)
}

/// Returns `work(k)` for each k below `count`, in order. All threads share the work. The terminal
/// shows how many are finished.
fn shared_out<T: Send>(count: usize, work: impl Fn(usize) -> anyhow::Result<T> + Sync) -> anyhow::Result<Vec<T>> {
    let slots: Vec<Mutex<Option<anyhow::Result<T>>>> = (0..count).map(|_| Mutex::new(None)).collect();
    let watched = output::watched();
    let fill = |k: usize| {
        let answer = work(k);
        if let Ok(mut slot) = slots[k].lock() {
            *slot = Some(answer);
        }
    };
    Threads::all().each(count, &fill, &mut |done| {
        if watched {
            output::live(&format!("measured {done} of {count}"));
        }
    });
    if watched {
        output::live_end();
    }
    let taken = |slot: Mutex<Option<_>>| slot.into_inner().ok().flatten();
    slots.into_iter().map(|slot| taken(slot).context("a measuring thread failed").and_then(|answer| answer)).collect()
}

fn measure(ground: &Ground, entry: &Entry, effort: &Effort) -> anyhow::Result<Outcome> {
    let mut rows = Rows::new(ground.name, entry.name);
    let curve = if entry.is_passive { open::Curve::default() } else { open::measure(ground, entry, &mut rows)? };
    let hands = if entry.is_costly { effort.costly_hands } else { effort.hands };
    scripted::measure(ground, entry, hands, &mut rows)?;
    let held = at_rest(ground, entry, hands, effort, &mut rows)?;
    Ok(Outcome { rows: rows.rows, curve, held })
}

/// Contact stiffness of the column "at 5 kN/m", N/m.
const STIFF: f64 = 5000.0;

fn at_rest(
    ground: &Ground,
    entry: &Entry,
    hands: &[&str],
    effort: &Effort,
    rows: &mut Rows,
) -> anyhow::Result<Vec<closed::LoopTick>> {
    let mut shown = Vec::new();
    let Some(rest) = &ground.rest else { return Ok(shown) };
    for (name, hand) in HANDS.iter().filter(|(name, _)| hands.contains(name)) {
        if *name == "none" && !rest.stable {
            continue;
        }
        let own = held::hold(ground, entry, rest, hand, &Tuning::of(ground))?;
        rows.add(name, "limit cycle", "%", own.share() * 100.0);
        rows.add(name, "limit cycle torque", "N·m", own.torque_cycle);
        rows.add(name, "mean force at rest", "N", own.mean_force);
        let stiff = held::hold(ground, entry, rest, hand, &Tuning { stiffness: Some(STIFF), ..Tuning::of(ground) })?;
        rows.add(name, "limit cycle at 5 kN/m", "%", stiff.share() * 100.0);
        if effort.searched.contains(&ground.name) {
            let halvings = if entry.is_costly { 0 } else { effort.halvings };
            let greatest = held::greatest_stiffness(ground, entry, rest, hand, 0.0, halvings)?;
            rows.add(name, "greatest stable stiffness", "N/m", greatest);
        }
        if ground.name == Z_WIDTH_SCENE && entry.has_damping {
            for &(damping, measure) in effort.dampings {
                let greatest = held::greatest_stiffness(ground, entry, rest, hand, damping, effort.halvings)?;
                rows.add(name, measure, "N/m", greatest);
            }
        }
        if *name == "normal" {
            shown = own.ticks;
        }
    }
    Ok(shown)
}
