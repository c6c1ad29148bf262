//! One measured number, and statistics of lists.

use std::borrow::Cow;

use serde::Serialize;

/// A measured number.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
    pub(super) scene: &'static str,
    pub(super) method: Cow<'static, str>,
    /// Empty if no hand takes part.
    pub(super) hand: &'static str,
    pub(super) measure: &'static str,
    pub(super) unit: &'static str,
    pub(super) value: f64,
}

/// The rows of one run.
pub(super) struct Rows {
    scene: &'static str,
    method: Cow<'static, str>,
    pub(super) rows: Vec<Row>,
}

impl Rows {
    pub(super) fn new(scene: &'static str, method: impl Into<Cow<'static, str>>) -> Self {
        Self { scene, method: method.into(), rows: Vec::new() }
    }

    pub(super) fn add(&mut self, hand: &'static str, measure: &'static str, unit: &'static str, value: f64) {
        let (scene, method) = (self.scene, self.method.clone());
        self.rows.push(Row { scene, method, hand, measure, unit, value });
    }
}

/// Returns the quantile of `values`; 0 for an empty list.
pub(super) fn quantile(values: &[f64], share: f64) -> f64 {
    palpus::algebra::quantile(&mut values.to_vec(), share).unwrap_or(0.0)
}

/// Returns the largest value; 0 for an empty list.
pub(super) fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

/// Returns the mean; 0 for an empty list.
pub(super) fn mean(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_list_has_figures_of_zero() {
        let values: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        assert_eq!((quantile(&values, 0.99), quantile(&values, 1.0)), (99.0, 100.0));
        assert_eq!((quantile(&[], 0.5), largest(&[]), mean(&[])), (0.0, 0.0, 0.0));
        assert_eq!((largest(&values), mean(&values)), (100.0, 50.5));
    }
}
