//! Load of the machine by other programs. Known on Linux; `None` on other systems.

use std::fs::read_to_string;

use serde::Serialize;

/// Times of all cores and of this program, in the kernel's ticks, at an instant.
#[derive(Clone, Debug)]
pub(crate) struct Snapshot {
    all: u64,
    busy: u64,
    stolen: u64,
    own: u64,
    cores: u64,
    /// Every other program: its process id, its name and its time in the kernel's ticks.
    programs: Vec<(u32, String, u64)>,
}

/// A program that kept the machine busy.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Program {
    name: String,
    /// Load by the program, in cores.
    cores: f64,
}

/// Load by other programs during the measurement.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Load {
    pub(crate) cores: u64,
    /// Load by other programs, in cores.
    pub(crate) others_cores: f64,
    /// Share of the time that the host of a virtual machine took (steal time).
    pub(crate) stolen_share: f64,
    /// Mean number of running or waiting threads over the last minute.
    pub(crate) load_average: Option<f64>,
    /// The programs with the highest load, among the programs that ran during the whole
    /// measurement.
    pub(crate) busiest: Vec<Program>,
}

/// Largest number of programs that the report names.
const NAMED: usize = 3;
/// Load (in cores) below which the report does not name a program.
const LEAST_NAMED: f64 = 0.05;

impl Load {
    pub(crate) fn in_words(&self) -> String {
        let Self { cores, others_cores, stolen_share, load_average, .. } = self;
        let average = load_average.map_or(String::new(), |load| format!("; load average {load:.1}"));
        let stolen = match stolen_share {
            share if *share > 0.001 => format!("; the host took {:.1} % of the time", share * 100.0),
            _ => String::new(),
        };
        format!(
            "other programs kept {others_cores:.1} of {cores} cores busy{}{stolen}{average}",
            self.busiest_in_words()
        )
    }

    /// Lists the programs in brackets, the busiest first; empty without programs.
    pub(crate) fn busiest_in_words(&self) -> String {
        let each: Vec<String> = self.busiest.iter().map(|p| format!("{} {:.1}", p.name, p.cores)).collect();
        if each.is_empty() { String::new() } else { format!(" ({})", each.join(", ")) }
    }
}

impl Snapshot {
    pub(crate) fn take() -> Option<Self> {
        let all = read_to_string("/proc/stat").ok()?;
        let own = read_to_string("/proc/self/stat").ok()?;
        let snapshot = Self::of(&all, &own)?;
        Some(Self { programs: programs(), ..snapshot })
    }

    fn of(all: &str, own: &str) -> Option<Self> {
        let numbers = |text: &str| -> Vec<u64> { text.split_whitespace().map_while(|n| n.parse().ok()).collect() };
        let summed = numbers(all.lines().find_map(|line| line.strip_prefix("cpu "))?);
        let [user, nice, system, idle, waiting, interrupts, soft_interrupts, stolen, ..] = summed[..] else {
            return None;
        };
        let busy = user + nice + system + interrupts + soft_interrupts;
        let is_core =
            |line: &&str| line.strip_prefix("cpu").is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
        let cores = all.lines().filter(is_core).count() as u64;
        let (_, own) = program(own)?;
        Some(Self { all: busy + idle + waiting + stolen, busy, stolen, own, cores, programs: Vec::new() })
    }
}

/// Returns name and time from a line of `/proc/PID/stat`. The name is in brackets and may contain
/// any characters; the times are words 14 and 15.
fn program(line: &str) -> Option<(&str, u64)> {
    let (name, rest) = line.split_once('(')?.1.rsplit_once(')')?;
    let words: Vec<&str> = rest.split_whitespace().collect();
    Some((name, words.get(11)?.parse::<u64>().ok()? + words.get(12)?.parse::<u64>().ok()?))
}

/// Returns all other programs that are visible to this user.
fn programs() -> Vec<(u32, String, u64)> {
    let Ok(folder) = std::fs::read_dir("/proc") else { return Vec::new() };
    let numbers = folder.flatten().filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    let read = |number: u32| {
        let line = read_to_string(format!("/proc/{number}/stat")).ok()?;
        let (name, time) = program(&line)?;
        Some((number, name.to_owned(), time))
    };
    numbers.filter(|number| *number != std::process::id()).filter_map(read).collect()
}

/// Returns the programs with the highest load, in cores. Programs of the same name are added up.
fn busiest(before: &Snapshot, after: &Snapshot, ticks_per_core: f64) -> Vec<Program> {
    let spent = |(number, name, time): &(u32, String, u64)| {
        // A program that started during the measurement used all of its time within the
        // measurement.
        let then = before.programs.iter().find(|then| then.0 == *number).map_or(0, |then| then.2);
        Program { name: name.clone(), cores: time.saturating_sub(then) as f64 / ticks_per_core }
    };
    let mut all: Vec<Program> = Vec::new();
    for program in after.programs.iter().map(spent) {
        match all.iter_mut().find(|known| known.name == program.name) {
            Some(known) => known.cores += program.cores,
            None => all.push(program),
        }
    }
    all.retain(|program| program.cores >= LEAST_NAMED);
    all.sort_by(|a, b| b.cores.total_cmp(&a.cores));
    all.truncate(NAMED);
    all
}

/// Returns the load by other programs between two instants.
pub(crate) fn between(before: Option<Snapshot>, after: Option<Snapshot>) -> Option<Load> {
    let (before, after) = before.zip(after)?;
    let all = after.all.saturating_sub(before.all).max(1) as f64;
    let busiest = busiest(&before, &after, all / after.cores.max(1) as f64);
    let others = after.busy.saturating_sub(before.busy).saturating_sub(after.own.saturating_sub(before.own));
    Some(Load {
        cores: after.cores,
        others_cores: others as f64 / all * after.cores as f64,
        stolen_share: after.stolen.saturating_sub(before.stolen) as f64 / all,
        load_average: load_average(),
        busiest,
    })
}

/// Returns the mean number of running or waiting threads of the machine over the last minute.
pub(crate) fn load_average() -> Option<f64> {
    read_to_string("/proc/loadavg").ok()?.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn load_excludes_this_program() {
        let own = |time: u64| format!("1 (a )b) S 1 1 1 0 -1 0 0 0 0 0 {time} 0 0 0 20 0 1");
        let all = |busy: u64, idle: u64| format!("cpu  {busy} 0 0 {idle} 0 0 0 0 0 0\ncpu0 1\ncpu1 1\nintr 5");
        let before = Snapshot::of(&all(100, 100), &own(10));
        let after = Snapshot::of(&all(200, 200), &own(60));
        let with = |snapshot: Option<Snapshot>, time| {
            snapshot
                .map(|s| Snapshot { programs: vec![(7, "a build".to_owned(), time), (8, "idle".to_owned(), 9)], ..s })
        };
        let load = between(with(before, 100), with(after, 140)).unwrap();
        assert!(load.in_words().contains("(a build 0.4)"), "{}", load.in_words());
        // Half of two cores was busy, and half of that load came from this program.
        assert_eq!(load.cores, 2);
        assert!((load.others_cores - 0.5).abs() < 1e-12, "{load:?}");
        assert!(Snapshot::of("", "").is_none());
    }
}
