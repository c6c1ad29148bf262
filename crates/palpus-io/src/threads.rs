//! Workers that programs pass to the engine: threads of the operating system.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use palpus::algebra::Workers;

/// A fixed number of threads, including the calling thread. Each thread takes the next part of the
/// work as soon as it is free.
#[derive(Clone, Copy, Debug)]
pub struct Threads {
    count: usize,
}

impl Threads {
    /// Uses one thread for each core that the operating system gives this program.
    pub fn all() -> Self {
        Self { count: thread::available_parallelism().map_or(1, usize::from) }
    }

    /// Uses `count` threads, but at least one thread.
    pub fn of(count: usize) -> Self {
        Self { count: count.max(1) }
    }
}

impl Workers for Threads {
    fn each(&self, count: usize, work: &(dyn Fn(usize) + Sync), finished: &mut dyn FnMut(usize)) {
        let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let take_one = || {
            let k = next.fetch_add(1, Ordering::Relaxed);
            let taken = k < count;
            if taken {
                work(k);
                done.fetch_add(1, Ordering::Relaxed);
            }
            taken
        };
        thread::scope(|scope| {
            for _ in 1..self.count.min(count) {
                scope.spawn(|| while take_one() {});
            }
            while take_one() {
                finished(done.load(Ordering::Relaxed));
            }
        });
        finished(count);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU32;

    use super::*;

    #[test]
    fn each_part_runs_once_and_progress_never_decreases() {
        for threads in [1, 2, 5] {
            for parts in [0, 1, 3, 1000] {
                let times: Vec<AtomicU32> = (0..parts).map(|_| AtomicU32::new(0)).collect();
                let mut last = 0;
                let mut finished = |done| {
                    assert!(done >= last);
                    last = done;
                };
                let work = |k: usize| {
                    times[k].fetch_add(1, Ordering::Relaxed);
                };
                Threads { count: threads }.each(parts, &work, &mut finished);
                assert_eq!(last, parts);
                assert!(times.iter().all(|times| times.load(Ordering::Relaxed) == 1));
            }
        }
    }
}
