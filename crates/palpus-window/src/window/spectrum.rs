//! Amplitude spectrum of the newest values, in which hum is visible as a peak.
//!
//! 1. The mean of the last values is removed, and a Hann window is applied.
//! 2. The values are Fourier transformed (J. Cooley, J. Tukey, *An algorithm for the machine
//!    calculation of complex Fourier series*, 1965).
//! 3. The amplitude at each frequency is scaled so that a sine of amplitude 1 gives 1.

use std::f64::consts::TAU;

/// Number of values.
pub(super) const LENGTH: usize = 1024;

/// Returns the amplitudes of the last [`LENGTH`] of `values`, from the first frequency above 0 up
/// to half the rate; `None` if there are fewer values.
pub(super) fn amplitudes(values: &[f64]) -> Option<Vec<f64>> {
    let last = &values[values.len().checked_sub(LENGTH)?..];
    let mean = last.iter().sum::<f64>() / LENGTH as f64;
    let hann = |k: usize| 0.5 - 0.5 * (TAU * k as f64 / LENGTH as f64).cos();
    let windowed: Vec<[f64; 2]> = last.iter().enumerate().map(|(k, value)| [(value - mean) * hann(k), 0.0]).collect();
    let transformed = transform(&windowed);
    // The Hann window passes half of a sine's amplitude, and half of that is at the negative
    // frequency.
    let scale = 4.0 / LENGTH as f64;
    Some(transformed[1..=LENGTH / 2].iter().map(|[re, im]| scale * re.hypot(*im)).collect())
}

/// Computes the Fourier transform; the number of values is a power of two.
fn transform(values: &[[f64; 2]]) -> Vec<[f64; 2]> {
    if values.len() < 2 {
        return values.to_vec();
    }
    let half = |first: usize| values.iter().skip(first).step_by(2).copied().collect::<Vec<[f64; 2]>>();
    let (even, odd) = (transform(&half(0)), transform(&half(1)));
    let turned: Vec<[f64; 2]> = (odd.iter().enumerate())
        .map(|(k, [re, im])| {
            let (sin, cos) = (-TAU * k as f64 / values.len() as f64).sin_cos();
            [re * cos - im * sin, re * sin + im * cos]
        })
        .collect();
    let sum = even.iter().zip(&turned).map(|(a, b)| [a[0] + b[0], a[1] + b[1]]);
    let difference = even.iter().zip(&turned).map(|(a, b)| [a[0] - b[0], a[1] - b[1]]);
    sum.chain(difference).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oscillation_is_a_peak_of_its_amplitude() {
        // 125 periods in the window: 122 Hz at a rate of 1000 Hz.
        let value = |k: usize| 3.0 + 0.2 * (TAU * 125.0 * k as f64 / LENGTH as f64).sin();
        let values: Vec<f64> = (0..2000).map(value).collect();
        let amplitudes = amplitudes(&values).expect("there are enough values");
        assert!((amplitudes[124] - 0.2).abs() < 1e-6, "{}", amplitudes[124]);
        assert!(amplitudes.iter().enumerate().all(|(k, a)| k.abs_diff(124) <= 1 || *a < 1e-9));
        assert_eq!(super::amplitudes(&values[..LENGTH - 1]), None);
    }
}
