//! Worker threads, which the caller provides, for work that consists of independent parts. The
//! engine has no threads of its own.
//!
//! The split of the work depends only on its size, never on the number of workers. The engine
//! combines the results in the order of the parts. So the final result does not depend on the
//! workers.

use std::sync::OnceLock;

/// Runs the parts of a job, one after the other or at the same time.
pub trait Workers: Sync {
    /// Calls `work(k)` once for each `k` below `count`, in any order and on any threads, and
    /// returns when all calls have returned.
    ///
    /// Must call `finished` from time to time on the calling thread, with the number of finished
    /// calls. This number must not decrease.
    fn each(&self, count: usize, work: &(dyn Fn(usize) + Sync), finished: &mut dyn FnMut(usize));
}

/// Runs one part after the other on the calling thread.
#[derive(Clone, Copy, Debug, Default)]
pub struct Alone;

impl Workers for Alone {
    fn each(&self, count: usize, work: &(dyn Fn(usize) + Sync), finished: &mut dyn FnMut(usize)) {
        for k in 0..count {
            work(k);
            finished(k + 1);
        }
    }
}

impl<W: Workers + ?Sized> Workers for &W {
    fn each(&self, count: usize, work: &(dyn Fn(usize) + Sync), finished: &mut dyn FnMut(usize)) {
        (**self).each(count, work, finished);
    }
}

/// Returns the results of `work(k)` for each `k` below `count`, in ascending order. One part of the
/// job makes `batch` calls; `batch` is at least 1.
///
/// Calls `progress` with the finished fraction, which rises to 1.
pub fn map_in_order<T: Send + Sync>(
    workers: &dyn Workers,
    count: usize,
    batch: usize,
    work: impl Fn(usize) -> T + Sync,
    progress: &mut dyn FnMut(f64),
) -> Vec<T> {
    let batch = batch.max(1);
    let parts = count.div_ceil(batch);
    let of_part = |part: usize| (part * batch..count.min((part + 1) * batch)).map(&work).collect::<Vec<T>>();
    let answers: Vec<OnceLock<Vec<T>>> = (0..parts).map(|_| OnceLock::new()).collect();
    workers.each(
        parts,
        &|part| {
            answers[part].get_or_init(|| of_part(part));
        },
        &mut |done| progress(done as f64 / parts as f64),
    );
    let mut all = Vec::with_capacity(count);
    for (part, answer) in answers.into_iter().enumerate() {
        // Workers must not skip a part. If a part is missing, it is computed here, so the result is
        // still correct.
        all.extend(answer.into_inner().unwrap_or_else(|| of_part(part)));
    }
    all
}

/// Returns the results of two jobs, which run at the same time if there are enough workers. Each
/// job may use the same workers again.
pub fn both<A: Send + Sync, B: Send + Sync>(
    workers: &dyn Workers,
    first: impl Fn() -> A + Sync,
    second: impl Fn() -> B + Sync,
) -> (A, B) {
    let (a, b) = (OnceLock::new(), OnceLock::new());
    let work = |k: usize| {
        if k == 0 {
            a.get_or_init(&first);
        } else {
            b.get_or_init(&second);
        }
    };
    workers.each(2, &work, &mut |_| ());
    (a.into_inner().unwrap_or_else(first), b.into_inner().unwrap_or_else(second))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two threads. The second thread starts at the last part and skips the part in the middle.
    struct Pair;

    impl Workers for Pair {
        fn each(&self, count: usize, work: &(dyn Fn(usize) + Sync), finished: &mut dyn FnMut(usize)) {
            std::thread::scope(|scope| {
                scope.spawn(|| (count / 2 + 1..count).rev().for_each(work));
                (0..count / 2).for_each(work);
            });
            finished(count);
        }
    }

    #[test]
    fn results_are_in_order_for_any_workers() {
        for count in [0, 1, 7, 64, 1000] {
            for batch in [0, 1, 3, 64, 2000] {
                let expected: Vec<usize> = (0..count).map(|k| k * k).collect();
                let mut last = 0.0;
                let alone = map_in_order(&Alone, count, batch, |k| k * k, &mut |done| {
                    assert!(done >= last);
                    last = done;
                });
                assert_eq!(alone, expected);
                assert!(count == 0 || last >= 1.0);
                assert_eq!(map_in_order(&&Pair, count, batch, |k| k * k, &mut |_| ()), expected);
            }
        }
    }

    #[test]
    fn both_jobs_are_done_for_any_workers() {
        assert_eq!(both(&Alone, || 1, || "two"), (1, "two"));
        assert_eq!(both(&Pair, || 1, || "two"), (1, "two"));
    }
}
