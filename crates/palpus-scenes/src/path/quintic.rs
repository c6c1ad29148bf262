//! The minimum-jerk polynomial between two states.

use std::ops::{Add, Mul, Sub};

/// Value and derivatives of a coordinate at one instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach<V> {
    pub(super) position: V,
    /// Change per second.
    pub(super) velocity: V,
    /// Change per second squared.
    pub(super) acceleration: V,
}

/// The polynomial c₀ + c₁ t + … + c₅ t⁵, with t in seconds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quintic<V> {
    coefficients: [V; 6],
}

impl<V: Copy + Add<Output = V> + Sub<Output = V> + Mul<f64, Output = V>> Quintic<V> {
    /// Returns the unique quintic that goes from `start` to `end` in `span` seconds. This quintic
    /// is also the minimum-jerk motion.
    pub(super) fn between(start: Reach<V>, end: Reach<V>, span: f64) -> Self {
        // The unit of time here is the span.
        let c1 = start.velocity * span;
        let c2 = start.acceleration * (span * span / 2.0);
        let position = end.position - start.position - c1 - c2;
        let velocity = end.velocity * span - c1 - c2 * 2.0;
        let acceleration = end.acceleration * (span * span) - c2 * 2.0;
        let c3 = position * 10.0 - velocity * 4.0 + acceleration * 0.5;
        let c4 = velocity * 7.0 - position * 15.0 - acceleration;
        let c5 = position * 6.0 - velocity * 3.0 + acceleration * 0.5;
        let scaled = |c: V, power: i32| c * span.powi(-power);
        Self {
            coefficients: [
                start.position,
                start.velocity,
                start.acceleration * 0.5,
                scaled(c3, 3),
                scaled(c4, 4),
                scaled(c5, 5),
            ],
        }
    }

    pub(super) fn at(&self, t: f64) -> V {
        let [c0, c1, c2, c3, c4, c5] = self.coefficients;
        ((((c5 * t + c4) * t + c3) * t + c2) * t + c1) * t + c0
    }

    /// Applies a linear map to each coefficient.
    pub(super) fn map(&self, linear: impl Fn(V) -> V) -> Self {
        Self { coefficients: self.coefficients.map(linear) }
    }

    /// Adds a constant.
    pub(super) fn shift(&mut self, by: V) {
        self.coefficients[0] = self.coefficients[0] + by;
    }

    /// Returns the derivative, per second.
    pub(super) fn rate(&self, t: f64) -> V {
        let [_, c1, c2, c3, c4, c5] = self.coefficients;
        (((c5 * (5.0 * t) + c4 * 4.0) * t + c3 * 3.0) * t + c2 * 2.0) * t + c1
    }
}
