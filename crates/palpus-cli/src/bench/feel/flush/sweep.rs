//! The flush sweep: random cases of parts with play, with every model of a hand. All cases have the
//! same limits.
//!
//! 1. A case's seed decides the parts, their play, twist and tolerance, the contact stiffness and
//!    the hand.
//! 2. The closed loop runs palpus's default behind the coupling, without the safety chain.
//! 3. Limits: hum at rest, energy given to the hand, and true overlap.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

use anyhow::Context;
use palpus::algebra::{Pose, Wrench};
use palpus_device::{HAND_PRESETS, HandImpedance};
use palpus_scenes::flush::{Fit, FlushCase, REST_END};

use super::super::closed::Drive;
use super::super::method::{METHODS, Tuning};
use super::super::row::quantile;
use super::super::shared_out;
use super::{Felt, Judged};
use crate::{files, output};
use palpus::algebra::Random;

/// Seed of the sweep's first case. The seed of each later case is larger by one.
pub(in crate::bench) const SEED: u64 = 0xf1a5_4000;
/// The method that is swept: palpus's default.
const METHOD: &str = "coupled-smooth";
/// Weight that presses sideways if no hand holds the part, N.
const WEIGHT: f64 = 1.0;
/// Largest number of cases that the page lists.
const LISTED: usize = 12;

/// Limits of the hum (N and N·m), the energy (J) and the true overlap (m).
const BARS: [f64; 4] = [1e-3, 0.05e-3, 10e-6, 20e-6];
/// A limit: its name, its unit in tables, and the factor for that unit.
const MEASURES: [(&str, f64); 4] =
    [("hum (mN)", 1e3), ("hum (mN·m)", 1e3), ("energy (µJ)", 1e6), ("true overlap (µm)", 1e6)];

/// One case of the sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Case {
    seed: u64,
    flush: FlushCase,
    /// Contact stiffness, N/m.
    stiffness: f64,
    hand: (&'static str, HandImpedance),
}

impl Case {
    fn draw(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let mut log = |low: f64, high: f64| random.between(low.ln(), high.ln()).exp();
        let (play, tolerance, stiffness) = (log(0.01e-3, 1e-3), log(0.03e-3, 1e-3), log(1e3, 51.2e3));
        let twist = random.between(1.0, 25.0).to_radians();
        // The parts and hands take turns, so that any twenty cases have each combination.
        let count = Fit::ALL.len() as u64;
        let fit = Fit::ALL[(seed % count) as usize];
        let hand = HAND_PRESETS[(seed / count % HAND_PRESETS.len() as u64) as usize];
        Self { seed, flush: FlushCase { fit, play, twist, tolerance }, stiffness, hand }
    }

    /// Runs the case and measures it.
    fn run(&self) -> anyhow::Result<Felt> {
        let judged = Judged::new(&self.flush.scene(), REST_END)?;
        let entry = METHODS.iter().find(|entry| entry.name == METHOD).context("the default method")?;
        let tuning = Tuning { stiffness: Some(self.stiffness), ..Tuning::of(&judged.ground) };
        let is_held = self.hand.1.stiffness > 0.0;
        // Without a hand, a weight presses the part against a wall within its play.
        let free = self.flush.free();
        let intent = |time: f64| -> Pose { if is_held { judged.ground.path.pose(time) } else { free } };
        let load = if is_held { Wrench::ZERO } else { self.flush.fit.weight(WEIGHT) };
        judged.felt(entry, &tuning, &Drive { hand: self.hand.1, intent: &intent, load })
    }

    fn cells(&self) -> [String; 7] {
        [
            format!("{:#x}", self.seed),
            self.flush.fit.name().to_owned(),
            self.hand.0.to_owned(),
            format!("{:.3}", self.flush.play * 1e3),
            format!("{:.1}", self.flush.twist.to_degrees()),
            format!("{:.3}", self.flush.tolerance * 1e3),
            format!("{:.2}", self.stiffness * 1e-3),
        ]
    }
}

const CASE_HEAD: [&str; 7] = ["seed", "scene", "hand", "play (mm)", "twist (°)", "tolerance (mm)", "stiffness (kN/m)"];

/// Returns the measures, in the order of [`BARS`].
fn judged_values(felt: &Felt) -> [f64; 4] {
    [felt.rest[0], felt.rest[1], felt.energy, felt.overlap]
}

/// Returns true if every value is within its limit. NaN counts as outside.
fn passes(felt: &Felt) -> bool {
    judged_values(felt).iter().zip(BARS).all(|(value, bar)| *value <= bar)
}

/// Returns the largest ratio of a value to its limit.
fn badness(felt: &Felt) -> f64 {
    judged_values(felt).iter().zip(BARS).map(|(value, bar)| value / bar).fold(0.0, f64::max)
}

fn run_all(seed: u64, count: usize) -> anyhow::Result<Vec<(Case, Felt)>> {
    shared_out(count, |k| {
        let case = Case::draw(seed.wrapping_add(k as u64));
        let felt = case.run().with_context(|| format!("seed {:#x} could not be measured", case.seed))?;
        Ok((case, felt))
    })
}

/// Runs `count` cases from `seed` on, writes sweep.csv and sweep.md, and prints the table.
pub(in crate::bench::feel) fn sweep(out: &Path, count: usize, seed: u64) -> anyhow::Result<ExitCode> {
    let results = run_all(seed, count)?;
    files::write(&out.join("sweep.csv"), csv(&results)?)?;
    let page = page(&results)?;
    files::write(&out.join("sweep.md"), &page)?;
    output::line(page);
    output::line(format!("written to {}: sweep.md and sweep.csv", out.display()));
    Ok(ExitCode::SUCCESS)
}

fn csv(results: &[(Case, Felt)]) -> anyhow::Result<String> {
    let mut text = String::from(
        "seed,scene,hand,play_m,twist_rad,tolerance_m,stiffness_n_per_m,hum_rest_n,hum_rest_nm,\
         hum_worst_n,hum_worst_nm,energy_j,overlap_m,mean_force_n\n",
    );
    for (case, felt) in results {
        let Case { seed, flush, stiffness, hand } = case;
        let Felt { rest, worst, energy, overlap, mean_force } = felt;
        writeln!(
            text,
            "{seed:#x},{},{},{},{},{},{stiffness},{},{},{},{},{energy},{overlap},{mean_force}",
            flush.fit.name(),
            hand.0,
            flush.play,
            flush.twist,
            flush.tolerance,
            rest[0],
            rest[1],
            worst[0],
            worst[1],
        )?;
    }
    Ok(text)
}

fn page(results: &[(Case, Felt)]) -> anyhow::Result<String> {
    let mut text = format!("# Flush sweep\n\n{} cases of {METHOD}. ", results.len());
    let bars: Vec<String> =
        MEASURES.iter().zip(BARS).map(|((name, factor), bar)| format!("{name} ≤ {}", bar * factor)).collect();
    writeln!(text, "Limits: {}.\n", bars.join(", "))?;
    let passed = results.iter().filter(|(_, felt)| passes(felt)).count();
    writeln!(text, "{passed} of {} are within all limits.\n", results.len())?;
    let measures = MEASURES.map(|(name, _)| format!("{name}: median / p90 / max, passed"));
    writeln!(text, "| scene | hand | cases | passed | {} |", measures.join(" | "))?;
    writeln!(text, "|---|---|---:|---:|{}", "---:|".repeat(MEASURES.len()))?;
    let mut row = |scene: &str, hand: &str, kept: &dyn Fn(&Case) -> bool| -> anyhow::Result<()> {
        let felt: Vec<&Felt> = results.iter().filter(|(case, _)| kept(case)).map(|(_, felt)| felt).collect();
        if felt.is_empty() {
            return Ok(());
        }
        let passed = felt.iter().filter(|felt| passes(felt)).count();
        write!(text, "| {scene} | {hand} | {} | {passed} |", felt.len())?;
        for (k, (_, factor)) in MEASURES.iter().enumerate() {
            let values: Vec<f64> = felt.iter().map(|felt| judged_values(felt)[k]).collect();
            let [median, high, most] = [0.5, 0.9, 1.0].map(|share| quantile(&values, share) * factor);
            let passed = values.iter().filter(|value| **value <= BARS[k]).count();
            write!(text, " {median:.3} / {high:.3} / {most:.3}, {passed} |")?;
        }
        writeln!(text)?;
        Ok(())
    };
    row("all", "all", &|_| true)?;
    for fit in Fit::ALL {
        row(fit.name(), "all", &|case| case.flush.fit == fit)?;
    }
    for (hand, _) in HAND_PRESETS {
        row("all", hand, &|case| case.hand.0 == hand)?;
    }
    let mut order: Vec<&(Case, Felt)> = results.iter().filter(|(_, felt)| !passes(felt)).collect();
    order.sort_by(|a, b| badness(&b.1).total_cmp(&badness(&a.1)));
    if !order.is_empty() {
        writeln!(text, "\nWorst cases (`palpus bench feel --sweep 1 --seed SEED` repeats a case):\n")?;
        let head: Vec<&str> = CASE_HEAD.into_iter().chain(MEASURES.map(|(name, _)| name)).collect();
        writeln!(text, "| {} |\n|{}", head.join(" | "), "---:|".repeat(head.len()))?;
        for (case, felt) in order.into_iter().take(LISTED) {
            let values = judged_values(felt).into_iter().zip(MEASURES).map(|(value, (_, factor))| value * factor);
            let cells: Vec<String> =
                case.cells().into_iter().chain(values.map(|value| format!("{value:.3}"))).collect();
            writeln!(text, "| {} |", cells.join(" | "))?;
        }
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_all_pass(count: usize) {
        let results = run_all(SEED, count).expect("every case can be measured");
        let wrong = results.iter().filter(|(_, felt)| !passes(felt)).count();
        assert!(
            wrong == 0,
            "{wrong} of {count} cases fail, seed {SEED:#x}\n{}",
            page(&results).expect("the page can be read")
        );
    }

    #[test]
    fn short_flush_sweep_meets_its_bars() {
        assert_all_pass(20);
    }

    #[test]
    #[ignore = "takes minutes"]
    fn long_flush_sweep_meets_its_bars() {
        assert_all_pass(400);
    }

    #[test]
    fn case_is_reproducible_from_its_seed() {
        let case = Case::draw(SEED);
        assert_eq!(case, Case::draw(SEED));
        let felt = case.run().expect("the case can be measured");
        assert_eq!(felt, case.run().expect("the case can be measured"), "seed {SEED:#x}");
        assert!(judged_values(&felt).iter().all(|value| value.is_finite()), "{felt:?}");
    }

    #[test]
    fn cases_stay_within_their_ranges() {
        for seed in SEED..SEED + 200 {
            let Case { flush, stiffness, .. } = Case::draw(seed);
            assert!((0.01e-3..1e-3).contains(&flush.play), "{seed:#x}");
            assert!((0.03e-3..1e-3).contains(&flush.tolerance), "{seed:#x}");
            assert!((1.0..25.0).contains(&flush.twist.to_degrees()), "{seed:#x}");
            assert!((1e3..51.2e3).contains(&stiffness), "{seed:#x}");
        }
    }
}
