//! The verdict and the advice.

use serde::Serialize;

use super::load::Load;
use super::machine::Machine;
use super::scene::{PERIOD_SHARE, SceneTimes};
use super::timer::Timer;
use super::{ClaimLine, RATE_HZ};

/// The verdict: how well the machine can hold the loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Fitness {
    Fit,
    FitWithNotes,
    NotFit,
}

/// Result of the judgement.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Verdict {
    pub(super) fitness: Fitness,
    /// The verdict in one sentence.
    pub(super) words: String,
    /// Problems. The problems that are easiest to solve come first.
    pub(super) notes: Vec<Note>,
}

/// A problem of the machine.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Note {
    pub(super) what: String,
    /// Advice, one line each.
    pub(super) mends: Vec<String>,
}

impl Verdict {
    /// Returns all advice without repetition.
    pub(super) fn mends(&self) -> Vec<&str> {
        let mut mends: Vec<&str> = Vec::new();
        for mend in self.notes.iter().flat_map(|note| &note.mends) {
            if !mends.contains(&mend.as_str()) {
                mends.push(mend);
            }
        }
        mends
    }
}

/// Share of late wake-ups above which the report has a note. One late tick in a thousand is not
/// felt.
const NOTED_LATE: f64 = 1e-3;
/// Share of late wake-ups above which the machine is not fast enough: ten late ticks per second
/// feel rough.
const UNFIT_LATE: f64 = 1e-2;
/// Share of ticks at the work limit above which the report has a note.
const NOTED_BOUNDED: f64 = 0.01;
/// Load by other programs (in cores) that can delay a loop without priority.
const NOTED_LOAD: f64 = 0.5;
/// Share of the time that the host of a virtual machine may take.
const NOTED_STOLEN: f64 = 5e-3;

const CLOSE_OTHERS: &str = "close other programs on this machine, browsers and builds first, and measure again";

/// Advice for a real-time right that is refused because another right is missing.
const FOLLOWS: &str = "get the priority first";

/// Derives the verdict from the measurements.
pub(super) fn of(
    timer: &Timer,
    scene: &SceneTimes,
    claims: &[ClaimLine],
    machine: &Machine,
    load: Option<&Load>,
) -> Verdict {
    let too_slow = scene.p999_us > PERIOD_SHARE * 1e6 / RATE_HZ;
    let unfit = timer.late_share > UNFIT_LATE || too_slow;
    // Problems that one line in a configuration file solves come first.
    let missing = claims.iter().filter(|claim| !claim.granted && claim.mend.as_deref() != Some(FOLLOWS));
    let mut notes: Vec<Note> = missing.map(not_granted).collect();
    if timer.late_share > NOTED_LATE {
        notes.push(late(timer, machine));
    }
    if too_slow {
        notes.push(slow(scene));
    }
    if scene.bounded_share > NOTED_BOUNDED {
        notes.push(bounded(scene));
    }
    notes.extend(load.and_then(busy));
    notes.extend(load.and_then(stolen));
    if machine.has_slow_governor() {
        notes.push(Note {
            what: "cores lower their frequency when they are idle, such as between two ticks".to_owned(),
            mends: vec!["sudo cpupower frequency-set -g performance".to_owned()],
        });
    }
    let scene_name = &scene.name;
    let (fitness, words) = match (unfit, notes.is_empty()) {
        (true, _) => (Fitness::NotFit, format!("not fit for 1 kHz with {scene_name} as it is now:")),
        (false, true) => (Fitness::Fit, format!("fit for 1 kHz with {scene_name}")),
        (false, false) => (Fitness::FitWithNotes, format!("fit for 1 kHz with {scene_name}, with notes:")),
    };
    Verdict { fitness, words, notes }
}

fn not_granted(claim: &ClaimLine) -> Note {
    let what = format!("the loop gets no {} ({})", claim.name, claim.what.trim_start_matches("no: "));
    Note { what, mends: claim.mend.iter().cloned().collect() }
}

fn late(timer: &Timer, machine: &Machine) -> Note {
    let mut mends = vec![CLOSE_OTHERS.to_owned()];
    if machine.real_time_kernel == Some(false) {
        mends.push(
            "boot a kernel with PREEMPT_RT (Debian: linux-image-rt-amd64; Ubuntu Pro: real-time kernel)".to_owned(),
        );
    }
    if machine.isolated_cores.as_deref() == Some("") && machine.cores.is_some_and(|cores| cores > 2) {
        mends.push("keep a core for the loop: boot with isolcpus=N, N being the last core's number".to_owned());
    }
    if machine.virtual_machine == Some(true) {
        mends.push("use a machine of its own: this one is virtual, and its host decides when it runs".to_owned());
    }
    Note {
        what: format!(
            "{:.2} % of wake-ups are over 0.5 ms late; at most {:.1} % should be",
            timer.late_share * 100.0,
            NOTED_LATE * 100.0
        ),
        mends,
    }
}

fn slow(scene: &SceneTimes) -> Note {
    let mut mends = vec![SMALLER.to_owned()];
    if scene.achievable_hz.is_some() {
        mends.push("run slower: `palpus run --rate 500`".to_owned());
    }
    Note { what: format!("a step takes {:.0} µs (p99.9), too long for a period of 1 ms", scene.p999_us), mends }
}

fn bounded(scene: &SceneTimes) -> Note {
    let percent = 100.0 * scene.bounded_share;
    Note {
        what: format!("{percent:.0} % of the ticks reached the work limit: some contacts are several ticks late"),
        mends: vec![SMALLER.to_owned()],
    }
}

const SMALLER: &str = "use smaller meshes, with fewer convex pieces where they touch (`palpus inspect`)";

fn busy(load: &Load) -> Option<Note> {
    (load.others_cores > NOTED_LOAD).then(|| Note {
        what: format!(
            "other programs kept {:.1} of {} cores busy meanwhile{}",
            load.others_cores,
            load.cores,
            load.busiest_in_words()
        ),
        mends: vec![CLOSE_OTHERS.to_owned()],
    })
}

fn stolen(load: &Load) -> Option<Note> {
    (load.stolen_share > NOTED_STOLEN).then(|| Note {
        what: format!("the host of this virtual machine took {:.1} % of the time", load.stolen_share * 100.0),
        mends: vec!["use a machine of its own: this one is virtual, and its host decides when it runs".to_owned()],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timer(late_share: f64) -> Timer {
        Timer { turns: 5000, p50_us: 1.0, p99_us: 5.0, p999_us: 20.0, max_us: 100.0, late_share }
    }

    fn scene(achievable_hz: Option<f64>) -> SceneTimes {
        SceneTimes {
            name: "a-scene".to_owned(),
            ticks: 5000,
            p50_us: 30.0,
            p99_us: 60.0,
            p999_us: if achievable_hz.is_some() { 90.0 } else { 5000.0 },
            max_us: 200.0,
            bounded_share: 0.0,
            overrun_share: 0.0,
            achievable_hz,
        }
    }

    fn claim(granted: bool) -> ClaimLine {
        let mend = (!granted).then(|| "ask for it".to_owned());
        ClaimLine { name: "priority", granted, what: "no: a reason".to_owned(), mend }
    }

    #[test]
    fn quiet_machine_is_fit() {
        let verdict = of(&timer(0.0), &scene(Some(4000.0)), &[claim(true)], &Machine::default(), None);
        assert_eq!((verdict.fitness, verdict.notes.len()), (Fitness::Fit, 0));
    }

    #[test]
    fn refused_claim_and_load_are_noted_with_remedy() {
        let load =
            Load { cores: 2, others_cores: 1.5, stolen_share: 0.02, load_average: Some(3.0), busiest: Vec::new() };
        let machine = Machine { governors: Some(vec![("powersave".to_owned(), 2)]), ..Machine::default() };
        let verdict = of(&timer(0.002), &scene(Some(1000.0)), &[claim(false)], &machine, Some(&load));
        assert_eq!((verdict.fitness, verdict.notes.len()), (Fitness::FitWithNotes, 5));
        let mends = verdict.mends();
        assert!(mends.contains(&"ask for it") && mends.iter().any(|mend| mend.contains("cpupower")));
        // Late turns and load have the same remedy, which is printed once.
        assert_eq!(mends.iter().filter(|mend| mend.contains("browsers")).count(), 1);
    }

    #[test]
    fn late_turns_or_slow_steps_are_not_fit() {
        let by_timer = of(&timer(0.05), &scene(Some(4000.0)), &[], &Machine::default(), None);
        let by_step = of(&timer(0.0), &scene(None), &[], &Machine::default(), None);
        assert_eq!((by_timer.fitness, by_step.fitness), (Fitness::NotFit, Fitness::NotFit));
        assert!(by_step.mends().iter().any(|mend| mend.contains("smaller meshes")));
    }
}
