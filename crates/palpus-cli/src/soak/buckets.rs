//! A histogram of durations in preallocated buckets: 64 buckets for each octave, so that each
//! duration is known to 1.6 %.

/// Number of buckets of an octave.
const PARTS: u64 = 64;
/// Base-2 logarithm of the number of buckets in an octave.
const PARTS_LOG: u32 = 6;
/// log₂ of the longest duration with a bucket of its own, ns: 17 s.
const LONGEST_LOG: u32 = 34;
/// Number of buckets.
const COUNT: usize = (PARTS * (LONGEST_LOG - PARTS_LOG + 1) as u64) as usize;

/// Number of durations in each bucket.
#[derive(Clone, Copy, Debug)]
pub(super) struct Buckets {
    counts: [u64; COUNT],
    total: u64,
    /// Largest duration, ns.
    longest: u64,
}

impl Default for Buckets {
    fn default() -> Self {
        Self { counts: [0; COUNT], total: 0, longest: 0 }
    }
}

impl Buckets {
    /// Counts a duration of `nanos` ns.
    pub(super) fn add(&mut self, nanos: u64) {
        self.counts[place(nanos)] += 1;
        self.total += 1;
        self.longest = self.longest.max(nanos);
    }

    /// Adds all counts of `other`.
    pub(super) fn merge(&mut self, others: &Self) {
        for (count, more) in self.counts.iter_mut().zip(&others.counts) {
            *count += more;
        }
        self.total += others.total;
        self.longest = self.longest.max(others.longest);
    }

    pub(super) fn total(&self) -> u64 {
        self.total
    }

    /// Returns the largest duration, µs.
    pub(super) fn longest(&self) -> f64 {
        self.longest as f64 / 1e3
    }

    /// Returns a quantile, µs: `share` of all durations are at most this long.
    pub(super) fn quantile(&self, share: f64) -> f64 {
        let wanted = ((self.total as f64 * share).ceil() as u64).max(1);
        let mut seen = 0;
        for (k, count) in self.counts.iter().enumerate() {
            seen += count;
            if seen >= wanted {
                return (end(k) as f64 / 1e3).min(self.longest());
            }
        }
        self.longest()
    }

    /// Returns the number of durations in buckets above the bucket of `nanos` (ns).
    pub(super) fn beyond(&self, nanos: u64) -> u64 {
        self.counts[place(nanos) + 1..].iter().sum()
    }
}

fn place(nanos: u64) -> usize {
    let log = nanos.max(1).ilog2();
    if log < PARTS_LOG {
        return nanos as usize;
    }
    let octave = log - PARTS_LOG;
    // The shifted value keeps its leading 1, so it lies between PARTS and 2 PARTS − 1.
    let place = u64::from(octave) * PARTS + (nanos >> octave);
    (place as usize).min(COUNT - 1)
}

/// Returns the longest duration of a bucket, ns.
fn end(place: usize) -> u64 {
    let place = place as u64;
    if place < PARTS {
        return place;
    }
    let octave = place / PARTS - 1;
    ((place - octave * PARTS + 1) << octave) - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_duration_has_a_bucket() {
        for nanos in (0..5000).chain([1 << 20, (1 << 20) - 1, 123_456_789, (1 << 34) - 1]) {
            let place = place(nanos);
            assert!(nanos <= end(place) && (place == 0 || nanos > end(place - 1)), "{nanos}: {place}, {}", end(place));
            assert!(end(place) as f64 <= nanos as f64 * 1.016 + 1.0, "{nanos}");
        }
        assert_eq!(place(u64::MAX), COUNT - 1);
    }

    #[test]
    fn shares_refer_to_all_durations() {
        let mut buckets = Buckets::default();
        assert_eq!((buckets.quantile(0.5), buckets.beyond(0)), (0.0, 0));
        (1..=1000).for_each(|us| buckets.add(us * 1000));
        let mut twice = buckets;
        twice.merge(&buckets);
        for buckets in [buckets, twice] {
            for share in [0.5, 0.99, 0.999, 1.0] {
                let value = buckets.quantile(share);
                assert!((value / (share * 1000.0) - 1.0).abs() < 0.016, "{share}: {value}");
            }
            assert_eq!(buckets.longest(), 1000.0);
        }
        assert_eq!(twice.total(), 2000);
        assert!((buckets.beyond(500_000) as f64 - 500.0).abs() < 10.0);
    }
}
