//! Quantiles, which are values that were there.

/// Of values in order, the least that `share` of all are not above; none of none.
pub(crate) fn of_sorted<T: Copy>(values: &[T], share: f64) -> Option<T> {
    let place = (share * values.len() as f64).ceil() as usize;
    values.get(place.clamp(1, values.len().max(1)) - 1).copied()
}
