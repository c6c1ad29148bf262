//! The visible states of a run's ticks, within a memory limit. A thread that replays a recording
//! writes them, and a window reads them in any order.
//!
//! All ticks are kept while they fit. When the memory is full, every second tick is dropped, so the
//! kept ticks stay evenly spaced in a run of any length.

use std::sync::Mutex;

use palpus::algebra::Pose;

use crate::moment::{Moment, ShownAnchor, ShownCluster, ShownContact};

/// See the module's description.
#[derive(Debug)]
pub struct Moments {
    most_bytes: usize,
    store: Mutex<Store>,
}

#[derive(Debug)]
struct Store {
    /// Moment number `k` is tick `k × every`.
    kept: Vec<Moment>,
    every: usize,
    bytes: usize,
    progress: Progress,
}

/// Progress of a replay.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Number of replayed ticks.
    pub ticks: usize,
    /// Number of replayed ticks whose wrench differs from the recorded wrench in any bit.
    pub differing: usize,
    /// The first tick whose wrench differs.
    pub first_difference: Option<usize>,
    /// Message about why the replay stopped early, if it did.
    pub failed: Option<String>,
}

impl Moments {
    /// Creates a list with room for this many bytes, and for at least one moment.
    pub fn new(most_bytes: usize) -> Self {
        let store = Store { kept: Vec::new(), every: 1, bytes: 0, progress: Progress::default() };
        Self { most_bytes, store: Mutex::new(store) }
    }

    /// Adds the next tick. `same`: its wrench equals the recorded wrench.
    pub fn push(&self, moment: &Moment, same: bool) {
        let Ok(mut store) = self.store.lock() else { return };
        let tick = store.progress.ticks;
        store.progress.ticks += 1;
        if !same {
            store.progress.differing += 1;
            store.progress.first_difference.get_or_insert(tick);
        }
        if tick % store.every != 0 {
            return;
        }
        // A copy has no spare capacity.
        store.bytes += bytes(moment);
        store.kept.push(moment.clone());
        while store.bytes > self.most_bytes && store.kept.len() > 1 {
            store.thin();
        }
    }

    /// Ends the list early, for the reason `why`.
    pub fn fail(&self, why: String) {
        if let Ok(mut store) = self.store.lock() {
            store.progress.failed = Some(why);
        }
    }

    /// Returns the last kept moment up to `tick`, and its tick; `None` before the first moment.
    pub fn at(&self, tick: usize) -> Option<(usize, Moment)> {
        let store = self.store.lock().ok()?;
        if tick >= store.progress.ticks {
            return None;
        }
        let k = (tick / store.every).min(store.kept.len().checked_sub(1)?);
        Some((k * store.every, store.kept[k].clone()))
    }

    /// Returns the progress of the replay, and the interval between kept ticks.
    pub fn progress(&self) -> (Progress, usize) {
        self.store.lock().map(|store| (store.progress.clone(), store.every)).unwrap_or_default()
    }
}

impl Store {
    /// Drops every second moment.
    fn thin(&mut self) {
        let mut k = 0;
        self.kept.retain(|_| {
            k += 1;
            k % 2 == 1
        });
        self.every *= 2;
        self.bytes = self.kept.iter().map(bytes).sum();
    }
}

fn bytes(moment: &Moment) -> usize {
    size_of::<Moment>()
        + moment.contacts.len() * size_of::<ShownContact>()
        + moment.clusters.len() * size_of::<ShownCluster>()
        + moment.anchors.len() * size_of::<ShownAnchor>()
        + moment.others.len() * size_of::<Pose>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn moment(tick: usize) -> Moment {
        let mut moment = Moment::new(20);
        moment.time = tick as f64;
        moment.contacts.resize(tick % 7, ShownContact { point: DVec3::ZERO, separation: 0.0 });
        moment
    }

    #[test]
    fn all_moments_are_kept_while_there_is_room() {
        let moments = Moments::new(1 << 20);
        (0..100).for_each(|tick| moments.push(&moment(tick), tick != 30 && tick != 40));
        for tick in 0..100 {
            let (kept, moment) = moments.at(tick).expect("the moment is stored");
            assert_eq!((kept, moment.time, moment.contacts.len()), (tick, tick as f64, tick % 7));
        }
        assert!(moments.at(100).is_none());
        let (progress, every) = moments.progress();
        assert_eq!((progress.ticks, progress.differing, progress.first_difference, every), (100, 2, Some(30), 1));
    }

    #[test]
    fn full_store_keeps_evenly_spaced_moments() {
        let most = 50 * (size_of::<Moment>() + 3 * size_of::<ShownContact>());
        let moments = Moments::new(most);
        (0..5000).for_each(|tick| moments.push(&moment(tick), true));
        let every = moments.progress().1;
        assert!(every.is_power_of_two() && every >= 128, "{every}");
        for tick in 0..5000 {
            let (kept, moment) = moments.at(tick).expect("the moment is stored");
            assert_eq!((kept, moment.time), (tick / every * every, kept as f64));
        }
        let store = moments.store.lock().expect("no thread has panicked");
        assert!(store.kept.iter().map(bytes).sum::<usize>() <= most && store.kept.len() >= 24);
    }
}
