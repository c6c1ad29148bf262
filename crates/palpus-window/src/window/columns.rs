//! Reduces many values to few columns of pixels. Each column shows its smallest and its largest
//! value, so that no peak is lost.

/// Smallest and largest value in a column; `None` if the column has no value yet.
pub(super) type Column = Option<[f64; 2]>;

/// Puts `values`, each with a position from 0 (left) to 1 (right) in ascending order, into `width`
/// columns. A column also contains the last value before it, so that the curve has no gaps. Columns
/// without a value repeat the previous value. Values that are not numbers are left out.
pub(super) fn columns(values: impl Iterator<Item = (f64, f64)>, width: usize) -> Vec<Column> {
    let mut columns: Vec<Column> = vec![None; width];
    let values = values.filter(|(place, value)| value.is_finite() && *place >= 0.0);
    let mut last: Option<(usize, f64)> = None;
    for (place, value) in values {
        let column = ((place * width as f64) as usize).min(width.saturating_sub(1));
        if let Some((before, held)) = last {
            columns[(before + 1).min(column)..column].fill(Some([held; 2]));
        }
        if let Some(slot) = columns.get_mut(column) {
            let before = last.map_or(value, |(_, before)| before);
            let range = slot.get_or_insert([before; 2]);
            *range = [range[0].min(value), range[1].max(value)];
        }
        last = Some((column, value));
    }
    columns
}

/// Returns the smallest and the largest of all columns' values and 0.
pub(super) fn extent(columns: &[Column]) -> [f64; 2] {
    columns.iter().flatten().fold([0.0, 0.0], |[low, high], range| [low.min(range[0]), high.max(range[1])])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_peak_is_lost_at_any_width() {
        let values = |k: usize| if k == 4321 { 9.0 } else { 1.0 };
        for width in [1, 37, 640, 20_000] {
            let found = columns((0..10_000).map(|k| (k as f64 / 9999.0, values(k))), width);
            assert_eq!(extent(&found), [0.0, 9.0]);
            assert!(found.iter().all(Option::is_some), "{width}");
        }
    }

    #[test]
    fn gaps_repeat_the_previous_value() {
        let found = columns([(0.25, 1.0), (0.5, f64::NAN), (0.8, 3.0)].into_iter(), 10);
        assert_eq!(&found[..2], [None, None]);
        assert!(found[2..8].iter().all(|column| *column == Some([1.0; 2])), "{found:?}");
        assert_eq!(&found[8..], [Some([1.0, 3.0]), None]);
    }
}
