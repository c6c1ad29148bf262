//! Contacts at many poses, computed by workers that the caller provides.
//!
//! 1. The poses are cut into runs of a fixed length.
//! 2. One worker computes each run, in order. A run starts without cached data of other runs.
//!
//! So the results are bit-identical for any number of workers. If consecutive poses are near each
//! other, most queries still use the cached data of the pose before.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use super::{ContactQuery, QuerySettings};
use crate::algebra::{Workers, map_in_order};
use crate::body::Body;

/// Two bodies whose contacts are queried at many poses.
#[derive(Debug)]
pub struct ContactBatch {
    a: Arc<Body>,
    b: Arc<Body>,
    settings: QuerySettings,
    /// Queries that no worker uses now. Each worker allocates its memory once.
    spare: Mutex<Vec<ContactQuery>>,
}

impl ContactBatch {
    /// Number of consecutive poses that one worker computes.
    pub const RUN: usize = 128;

    /// Returns a batch without any query memory; each worker allocates its own later.
    pub fn new(a: Arc<Body>, b: Arc<Body>, settings: QuerySettings) -> Self {
        Self { a, b, settings, spare: Mutex::default() }
    }

    /// Calls `answer` for each run of the poses with the indices `numbers`, and returns the answers
    /// in order.
    ///
    /// Runs end at multiples of [`Self::RUN`]. So ranges that begin at multiples of `RUN` give the
    /// same results as one range over all poses. The method calls `progress` with the fraction
    /// done.
    ///
    /// ```
    /// use std::sync::Arc;
    /// use palpus::algebra::Alone;
    /// use palpus::detect::ContactBatch;
    /// use palpus::{Body, Pose, QuerySettings, glam::DVec3};
    ///
    /// let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    /// let body = Arc::new(Body::from_convex(&corners)?);
    /// let batch = ContactBatch::new(body.clone(), body, QuerySettings::default());
    /// let pose = |k: u32| Pose::from_translation(DVec3::Z * 0.01 * f64::from(k));
    /// let poses: Vec<Pose> = (0..300).map(pose).collect();
    /// let deep = batch.run(0..poses.len(), &Alone, &mut |_| (), |query, numbers| {
    ///     let mut deep = |k: usize| query.contacts(&poses[k]).iter().any(|c| c.separation < 0.0);
    ///     numbers.filter(|&k| deep(k)).count()
    /// });
    /// assert_eq!(deep.iter().sum::<usize>(), 100);
    /// # Ok::<(), palpus::BodyError>(())
    /// ```
    pub fn run<T: Send + Sync>(
        &self,
        numbers: Range<usize>,
        workers: &dyn Workers,
        progress: &mut dyn FnMut(f64),
        answer: impl Fn(&mut ContactQuery, Range<usize>) -> T + Sync,
    ) -> Vec<T> {
        let first = numbers.start / Self::RUN;
        let runs = numbers.end.div_ceil(Self::RUN).saturating_sub(first);
        let of_run = |run: usize| {
            let begin = (first + run) * Self::RUN;
            let mut query = self.take();
            query.clear();
            let answered = answer(&mut query, begin.max(numbers.start)..(begin + Self::RUN).min(numbers.end));
            self.spare.lock().unwrap_or_else(PoisonError::into_inner).push(query);
            answered
        };
        map_in_order(workers, runs, 1, of_run, progress)
    }

    /// Takes a query that no other worker uses.
    fn take(&self) -> ContactQuery {
        let spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner).pop();
        spare.unwrap_or_else(|| ContactQuery::new(self.a.clone(), self.b.clone(), self.settings))
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;
    use crate::algebra::{Alone, Pose, Random};
    use crate::detect::Contact;

    const SEED: u64 = 0xba7c;

    /// Computes the runs from the last to the first.
    struct Backwards;

    impl Workers for Backwards {
        fn each(&self, count: usize, work: &(dyn Fn(usize) + Sync), finished: &mut dyn FnMut(usize)) {
            (0..count).rev().for_each(work);
            finished(count);
        }
    }

    #[test]
    fn order_of_runs_changes_no_bit() {
        let corners = [-1.0, 1.0].map(|x| [-1.0, 1.0].map(|y| [-1.0, 1.0].map(|z| DVec3::new(x, y, z))));
        let body = Arc::new(Body::from_convex(corners.as_flattened().as_flattened()).unwrap());
        let mut random = Random::new(SEED);
        let count = 3 * ContactBatch::RUN + 5;
        let poses: Vec<Pose> =
            (0..count).map(|_| Pose::new(DQuat::from_scaled_axis(random.vector()), random.vector() * 2.5)).collect();
        let batch = ContactBatch::new(body.clone(), body, QuerySettings { tolerance: 0.1, ..QuerySettings::default() });
        let answers = |numbers: Range<usize>, workers: &dyn Workers| -> Vec<Vec<Contact>> {
            let of_run = |query: &mut ContactQuery, numbers: Range<usize>| -> Vec<Vec<Contact>> {
                numbers.map(|k| query.contacts(&poses[k]).to_vec()).collect()
            };
            batch.run(numbers, workers, &mut |_| (), of_run).into_iter().flatten().collect()
        };
        let all = answers(0..count, &Alone);
        assert_eq!(all.len(), count);
        assert!(all.iter().any(|contacts| !contacts.is_empty()), "seed {SEED}");
        assert_eq!(all, answers(0..count, &Backwards), "seed {SEED}");
        assert_eq!(all[ContactBatch::RUN..], answers(ContactBatch::RUN..count, &Alone), "seed {SEED}");
        assert!(answers(7..7, &Alone).is_empty());
    }
}
