//! Bounding volumes of a node: cheap to test, never smaller than what they hold.

use glam::{DMat3, DVec3};

use crate::algebra::eigen;

/// A ball that holds a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// In the body's frame.
    pub center: DVec3,
    /// Model units.
    pub radius: f64,
}

/// A box that holds a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    /// In the body's frame.
    pub center: DVec3,
    /// Its columns are the box's axes, unit and right-handed.
    pub axes: DMat3,
    /// Half the sides along the axes.
    pub half: DVec3,
}

impl OrientedBox {
    /// A small box around points: along their principal axes or along the frame's, whichever has less surface.
    pub fn around(points: &[DVec3]) -> Self {
        let aligned = Self::along(DMat3::IDENTITY, points);
        let turned = Self::along(eigen(covariance(points)).1, points);
        if turned.surface() < aligned.surface() { turned } else { aligned }
    }

    fn along(axes: DMat3, points: &[DVec3]) -> Self {
        let to_box = axes.transpose();
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &p in points {
            let q = to_box * p;
            low = low.min(q);
            high = high.max(q);
        }
        Self { center: axes * ((low + high) * 0.5), axes, half: (high - low) * 0.5 }
    }

    /// Surface instead of volume, since flat nodes have none of the latter.
    fn surface(&self) -> f64 {
        let h = self.half;
        h.x * h.y + h.y * h.z + h.z * h.x
    }
}

impl Sphere {
    /// The ball about the box's centre that holds the points.
    pub fn around(points: &[DVec3], center: DVec3) -> Self {
        let radius = points.iter().map(|p| p.distance_squared(center)).fold(0.0, f64::max).sqrt();
        Self { center, radius }
    }
}

/// Second moments about the mean.
pub(crate) fn covariance(points: &[DVec3]) -> DMat3 {
    let mean = points.iter().copied().sum::<DVec3>() / points.len().max(1) as f64;
    points.iter().fold(DMat3::ZERO, |sum, &p| {
        let d = p - mean;
        sum + DMat3::from_cols(d * d.x, d * d.y, d * d.z)
    })
}
