//! State of the machine during the run: memory of the program, frequency of the cores, load by
//! other programs. Known on Linux; `None` on other systems.

use std::fs::read_to_string;
use std::time::Duration;

use serde::Serialize;

use crate::doctor::load::load_average;

/// State of the machine at one time.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(super) struct Sample {
    /// Resident memory of the program, bytes.
    pub(super) resident: Option<u64>,
    /// Mean frequency of the cores, MHz.
    pub(super) mhz: Option<f64>,
    /// Mean number of running or waiting threads over the last minute.
    pub(super) load_average: Option<f64>,
}

impl Sample {
    pub(super) fn take() -> Self {
        let read = |path: &str| read_to_string(path).ok();
        Self {
            resident: read("/proc/self/statm").and_then(|text| resident(&text)),
            mhz: frequency().or_else(|| read("/proc/cpuinfo").and_then(|text| mean_mhz(&text))),
            load_average: load_average(),
        }
    }
}

/// Returns the resident memory (bytes) from the second number of `/proc/self/statm`, which counts
/// pages.
fn resident(statm: &str) -> Option<u64> {
    let pages: u64 = statm.split_whitespace().nth(1)?.parse().ok()?;
    Some(pages * PAGE)
}

/// Usual page size of Linux, bytes. On processors with larger pages, the memory is underestimated.
const PAGE: u64 = 4096;

/// Returns the frequency that the kernel has set, MHz.
fn frequency() -> Option<f64> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let of = |core: usize| -> Option<f64> {
        let path = format!("/sys/devices/system/cpu/cpu{core}/cpufreq/scaling_cur_freq");
        Some(read_to_string(path).ok()?.trim().parse::<f64>().ok()? / 1e3)
    };
    let all: Vec<f64> = (0..cores).map_while(of).collect();
    mean(&all)
}

/// Returns the mean of the frequencies that the processor reports, MHz.
fn mean_mhz(cpuinfo: &str) -> Option<f64> {
    let of = |line: &str| line.strip_prefix("cpu MHz")?.split_once(':')?.1.trim().parse().ok();
    let all: Vec<f64> = cpuinfo.lines().filter_map(of).collect();
    mean(&all)
}

/// Returns the mean; `None` if there are no values.
pub(super) fn mean(all: &[f64]) -> Option<f64> {
    (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
}

/// Samples over a run of any length in fixed memory: when the memory is full, every second sample
/// is removed and the interval between samples doubles.
#[derive(Debug)]
pub(super) struct Watch {
    every: Duration,
    next: Duration,
}

/// Initial interval between two samples.
const FIRST: Duration = Duration::from_secs(5);
/// Capacity in samples.
pub(super) const KEPT: usize = 1024;

impl Watch {
    pub(super) fn new() -> Self {
        Self { every: FIRST, next: Duration::ZERO }
    }

    /// Adds a sample if the interval has passed.
    pub(super) fn look(&mut self, elapsed: Duration, samples: &mut Vec<(f64, Sample)>) {
        if elapsed < self.next {
            return;
        }
        self.next += self.every;
        if samples.len() >= KEPT {
            let mut keep = false;
            samples.retain(|_| {
                keep = !keep;
                keep
            });
            self.every *= 2;
        }
        samples.push((elapsed.as_secs_f64(), Sample::take()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_from_kernel_files() {
        assert_eq!(resident("5000 250 30 1 0 60 0\n"), Some(250 * 4096));
        assert_eq!(resident(""), None);
        assert_eq!(mean_mhz("processor\t: 0\ncpu MHz\t\t: 2000.0\n\ncpu MHz\t\t: 3000.5\n"), Some(2500.25));
        assert_eq!(mean_mhz("Features: neon"), None);
    }

    #[test]
    fn samples_are_thinned() {
        let (mut watch, mut samples) = (Watch::new(), Vec::with_capacity(KEPT));
        for seconds in 0..20_000 {
            watch.look(Duration::from_secs(seconds), &mut samples);
        }
        assert!((KEPT / 2..=KEPT).contains(&samples.len()), "{}", samples.len());
        assert!(samples.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert_eq!(samples.capacity(), KEPT);
    }
}
