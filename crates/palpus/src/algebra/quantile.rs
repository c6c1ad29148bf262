//! Quantiles by nearest rank. The result is always one of the given values, never an interpolated
//! value.

/// Returns the quantile `share` (0 to 1) of the `sorted` values by nearest rank. This is the
/// smallest value for which at least this share of all values is not larger. `None` if `sorted` is
/// empty.
pub fn quantile_of_sorted<T: Copy>(sorted: &[T], share: f64) -> Option<T> {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.clamp(1, sorted.len().max(1)) - 1).copied()
}

/// Sorts `values` and returns the result of [`quantile_of_sorted`].
pub fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    quantile_of_sorted(values, share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_given_values() {
        let mut values: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        let at = [0.0, 0.005, 0.5, 0.99, 0.991, 1.0].map(|share| quantile(&mut values, share));
        assert_eq!(at, [1.0, 1.0, 50.0, 99.0, 100.0, 100.0].map(Some));
        assert_eq!(quantile_of_sorted(&[7_u64], 0.3), Some(7));
        assert_eq!(quantile(&mut [], 0.5), None);
    }
}
