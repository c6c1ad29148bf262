//! Directions in groups of four, so that the compiler compares one direction with four at a time.

use glam::DVec3;

/// Number of directions in a group.
pub(crate) const LANES: usize = 4;

/// Four directions. Lanes without a direction have the zero vector, which is like no direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Directions {
    x: [f64; LANES],
    y: [f64; LANES],
    z: [f64; LANES],
}

impl Directions {
    /// No directions.
    pub(crate) const NONE: Self = Self { x: [0.0; LANES], y: [0.0; LANES], z: [0.0; LANES] };

    /// Sets one of the directions (unit vector).
    pub(crate) fn set(&mut self, lane: usize, direction: DVec3) {
        (self.x[lane], self.y[lane], self.z[lane]) = direction.into();
    }

    /// Returns the similarity of `direction` to each of the four directions: the square of the
    /// cosine between them, or 0 beyond a right angle.
    #[inline]
    pub(crate) fn alike(&self, direction: DVec3) -> [f64; LANES] {
        let mut alike = [0.0; LANES];
        for (k, alike) in alike.iter_mut().enumerate() {
            let cosine = direction.x * self.x[k] + direction.y * self.y[k] + direction.z * self.z[k];
            let cosine = if cosine > 0.0 { cosine } else { 0.0 };
            *alike = cosine * cosine;
        }
        alike
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alike_is_the_squared_cosine() {
        let mut four = Directions::NONE;
        let slanted = DVec3::new(0.6, 0.8, 0.0);
        for (lane, direction) in [DVec3::X, slanted, DVec3::NEG_X].into_iter().enumerate() {
            four.set(lane, direction);
        }
        let alike = four.alike(DVec3::X);
        assert!((alike[1] - 0.36).abs() < 1e-15, "{alike:?}");
        assert_eq!([alike[0], alike[2], alike[3]], [1.0, 0.0, 0.0]);
    }
}
