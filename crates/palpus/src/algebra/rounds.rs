//! Rounds: a fixed list of jobs, which the caller and helper threads run together again and again,
//! without a lock that waits, an allocation or a call of the system.
//!
//! A loop at 1 kHz cannot start threads in each tick, and cannot wake threads that sleep: both are
//! calls of the system. So helper threads poll ([`Rounds::help`]) and take jobs from a counter.
//!
//! 1. The caller writes the input of each job ([`Rounds::each`]), and starts a round
//!    ([`Rounds::run`]). A short round is faster without helpers ([`Rounds::run_alone`]).
//! 2. Caller and helpers take jobs, in the order that the caller gave, until none is left.
//! 3. The caller waits, without sleeping, for the jobs that helpers are still running. Then it
//!    reads the results.
//!
//! A job is run once in a round, by any thread, and depends on nothing but its own data. So the
//! results are the same for any number of helpers.
//!
//! Each job has a mutex, but no thread ever waits for one: a job has one owner at a time. A helper
//! that the system stops in the middle of a job stops the caller too. So helpers need the same
//! priority as the caller. If a job panics on a helper, the helper's thread ends and the caller
//! panics too, so that it does not use the results.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A job that is run once in each round.
pub(crate) trait Job: Send {
    /// Runs the job on its own data.
    fn run(&mut self);
}

/// See the module's description.
#[derive(Debug)]
pub(crate) struct Rounds<J> {
    jobs: Vec<Mutex<J>>,
    /// The jobs in the order in which the round takes them.
    order: Vec<AtomicU32>,
    /// The number of the round in the upper half, and how many jobs are taken in the lower half.
    taken: AtomicU64,
    /// Number of finished jobs of the round.
    finished: AtomicU32,
}

/// Counts a job as finished, even if it panics.
struct Finish<'f>(&'f AtomicU32);

impl Drop for Finish<'_> {
    fn drop(&mut self) {
        self.0.fetch_add(1, Ordering::Release);
    }
}

/// Ends a round when it is dropped, also if the caller panics: no further job is taken, and all
/// jobs that helpers have taken are finished.
struct End<'e, J>(&'e Rounds<J>);

impl<J> Drop for End<'_, J> {
    fn drop(&mut self) {
        let Rounds { jobs, taken, finished, .. } = self.0;
        let before = taken.fetch_add(jobs.len() as u64, Ordering::Relaxed) & NUMBER;
        while u64::from(finished.load(Ordering::Acquire)) < before.min(jobs.len() as u64) {
            std::hint::spin_loop();
        }
    }
}

/// The lower half of [`Rounds::taken`].
const NUMBER: u64 = u32::MAX as u64;

impl<J: Job> Rounds<J> {
    /// Returns the jobs, at least one, without a round under way.
    pub(crate) fn new(jobs: Vec<J>) -> Self {
        let count = jobs.len();
        Self {
            order: (0..count as u32).map(AtomicU32::new).collect(),
            taken: AtomicU64::new(count as u64),
            finished: AtomicU32::new(count as u32),
            jobs: jobs.into_iter().map(Mutex::new).collect(),
        }
    }

    /// Calls `act` with each job, in the order of [`Self::new`]. Must not be called during a round.
    pub(crate) fn each(&self, mut act: impl FnMut(&mut J)) {
        self.jobs.iter().for_each(|job| act(&mut lock(job)));
    }

    /// Calls `act` with the first job. Must not be called during a round.
    pub(crate) fn with_first<T>(&self, act: impl FnOnce(&mut J) -> T) -> T {
        act(&mut lock(&self.jobs[0]))
    }

    /// Runs each job once on the calling thread.
    pub(crate) fn run_alone(&self) {
        self.each(Job::run);
    }

    /// Runs each job once, with the helpers, and returns when all are finished. Jobs are taken in
    /// the order of `rank`, the largest first. Only one thread may call this. Panics if a job has
    /// panicked on a helper.
    pub(crate) fn run(&self, rank: impl Fn(usize) -> u64) {
        // An insertion sort: the order hardly changes from round to round.
        for k in 1..self.order.len() {
            let job = self.order[k].load(Ordering::Relaxed);
            let mut at = k;
            while at > 0 {
                let before = self.order[at - 1].load(Ordering::Relaxed);
                if rank(before as usize) >= rank(job as usize) {
                    break;
                }
                self.order[at].store(before, Ordering::Relaxed);
                at -= 1;
            }
            self.order[at].store(job, Ordering::Relaxed);
        }
        self.finished.store(0, Ordering::Relaxed);
        let round = (self.taken.load(Ordering::Relaxed) >> 32).wrapping_add(1);
        self.taken.store(round << 32, Ordering::Release);
        let end = End(self);
        self.help();
        drop(end);
        assert!(!self.jobs.iter().any(Mutex::is_poisoned), "a thread that helps with this step has panicked");
    }

    /// Runs jobs of the present round until none is left. Returns false if there was none.
    pub(crate) fn help(&self) -> bool {
        let mut helped = false;
        // Threads that poll only read, so that they do not slow the others down.
        while self.is_open(self.taken.load(Ordering::Relaxed)) {
            let taken = self.taken.fetch_add(1, Ordering::Acquire);
            if !self.is_open(taken) {
                break;
            }
            let _finish = Finish(&self.finished);
            let job = self.order[(taken & NUMBER) as usize].load(Ordering::Relaxed);
            lock(&self.jobs[job as usize]).run();
            helped = true;
        }
        helped
    }

    /// Returns true if jobs are left.
    fn is_open(&self, taken: u64) -> bool {
        (taken & NUMBER) < self.jobs.len() as u64
    }
}

/// Locks a job that no other thread holds. If it has panicked in an earlier round, it is used
/// again: the caller knows of the panic, and clears the job's data.
fn lock<J>(job: &Mutex<J>) -> MutexGuard<'_, J> {
    job.clear_poison();
    job.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<J: Clone + Job> Clone for Rounds<J> {
    fn clone(&self) -> Self {
        Self::new(self.jobs.iter().map(|job| lock(job).clone()).collect())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;

    struct Sum {
        terms: u64,
        sum: u64,
        runs: u64,
    }

    impl Job for Sum {
        fn run(&mut self) {
            self.sum = (0..self.terms).fold(0, |sum, k| sum.wrapping_mul(31).wrapping_add(k));
            self.runs += 1;
        }
    }

    #[test]
    fn each_job_runs_once_in_a_round_with_any_number_of_helpers() {
        for helpers in 0..4 {
            let rounds = Rounds::new((0..17).map(|_| Sum { terms: 0, sum: 0, runs: 0 }).collect());
            let stop = AtomicBool::new(false);
            std::thread::scope(|scope| {
                for _ in 0..helpers {
                    scope.spawn(|| {
                        while !stop.load(Ordering::Relaxed) {
                            if !rounds.help() {
                                std::thread::yield_now();
                            }
                        }
                    });
                }
                for round in 0..300 {
                    let mut k = 0;
                    rounds.each(|job| {
                        job.terms = (round * 7 + k) % 101;
                        k += 1;
                    });
                    rounds.run(|job| (job as u64 * 5 + round) % 17);
                    let mut k = 0;
                    rounds.each(|job| {
                        let mut alone = Sum { terms: (round * 7 + k) % 101, sum: 0, runs: 0 };
                        alone.run();
                        assert_eq!((job.sum, job.runs), (alone.sum, round + 1), "{helpers} helpers, job {k}");
                        k += 1;
                    });
                }
                stop.store(true, Ordering::Relaxed);
            });
            let order: Vec<u32> = rounds.order.iter().map(|job| job.load(Ordering::Relaxed)).collect();
            let ranks: Vec<u64> = order.iter().map(|&job| (u64::from(job) * 5 + 299) % 17).collect();
            assert!(ranks.is_sorted_by(|one, next| one >= next), "{ranks:?}");
        }
    }

    /// Panics once, on the caller or on another thread.
    struct Failing {
        fails: bool,
        on_caller: bool,
        caller: std::thread::ThreadId,
    }

    impl Job for Failing {
        fn run(&mut self) {
            let is_caller = std::thread::current().id() == self.caller;
            if self.fails && is_caller == self.on_caller {
                self.fails = false;
                panic!("a job that fails for the test");
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
    }

    #[test]
    fn panic_of_a_job_reaches_the_caller() {
        let caller = std::thread::current().id();
        for on_caller in [false, true] {
            let fail = |_| Failing { fails: true, on_caller, caller };
            let rounds = &Rounds::new((0..8).map(fail).collect());
            let stop = &AtomicBool::new(false);
            std::thread::scope(|scope| {
                let helper = scope.spawn(move || {
                    while !stop.load(Ordering::Relaxed) {
                        rounds.help();
                    }
                });
                let run = || std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| rounds.run(|_| 0)));
                let first = (0..1000).map(|_| run()).find(Result::is_err);
                assert!(first.is_some(), "no round failed: {on_caller}");
                rounds.each(|job| job.fails = false);
                assert!(run().is_ok(), "a later round fails too: {on_caller}");
                stop.store(true, Ordering::Relaxed);
                assert_eq!(helper.join().is_err(), !on_caller);
            });
        }
    }

    #[test]
    fn without_a_round_there_is_no_job() {
        let rounds = Rounds::new(vec![Sum { terms: 3, sum: 0, runs: 0 }]);
        assert!(!rounds.help());
        rounds.each(|job| assert_eq!(job.runs, 0));
    }
}
