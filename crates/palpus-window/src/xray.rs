//! Transparency of bodies around a probe that they hide.
//!
//! In the picture, the probe is a capsule about its longest axis. A body is transparent where it
//! covers the capsule and is nearer to the camera, and opaque beyond a soft edge. The touched place
//! is therefore visible, and the body keeps its shape.

use glam::{DVec2, DVec3};
use palpus::algebra::Pose;

use crate::camera::Camera;
use crate::solid::Solid;

/// Width of the transparent margin around the probe, pixels of a nominal picture.
const AROUND: f64 = 16.0;
/// Radius at which a body is opaque again, divided by the radius at which it is transparent.
const SOFT: f64 = 1.45;
/// Distance from the edge within which a pixel counts as on the edge, pixels.
const EDGE: f64 = 3.0;

/// A capsule in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct XRay {
    /// Pixels from the upper left corner, and m from the camera along the line of sight.
    pub(crate) ends: [DVec3; 2],
    /// Radius within which a body is transparent, pixels.
    pub(crate) radius: f64,
    /// How far the probe extends towards the camera and away from it, m.
    pub(crate) reach: f64,
}

impl XRay {
    /// Makes the region around a probe at `pose` (world), in a picture of this many pixels;
    /// `nominal` of them make one pixel of a nominal picture. `None` if the probe is not ahead of
    /// the camera.
    pub(crate) fn around(
        solid: &Solid,
        pose: &Pose,
        camera: &Camera,
        [width, height]: [f64; 2],
        nominal: f64,
    ) -> Option<Self> {
        let (low, high) = solid.bounds();
        let half = 0.5 * (high - low);
        if !half.is_finite() || half.min_element() < 0.0 {
            return None;
        }
        let axes = [(half.x, DVec3::X), (half.y, DVec3::Y), (half.z, DVec3::Z)];
        let (longest, axis) = axes.into_iter().max_by(|one, other| one.0.total_cmp(&other.0))?;
        let reach = axes.iter().filter(|other| other.1 != axis).map(|other| other.0).fold(0.0, f64::max);
        let along = axis * (longest - reach).max(0.0);
        let middle = 0.5 * (low + high);
        let ends = [middle - along, middle + along].map(|end| camera.project(pose.point(end), width, height));
        let [Some(one), Some(other)] = ends else { return None };
        let pixels = reach / camera.metres_per_pixel(0.5 * (one.depth + other.depth), height);
        let ends = [one, other].map(|end| DVec3::new(end.x, end.y, end.depth));
        Some(Self { ends, radius: pixels + AROUND * nominal, reach })
    }

    /// True near the edge beyond which a body is opaque.
    pub(crate) fn is_edge(&self, pixel: DVec2) -> bool {
        ((pixel - self.nearest(pixel).truncate()).length() - SOFT * self.radius).abs() < EDGE
    }

    /// Returns the corners of the rectangle outside of which a body is opaque, pixels.
    #[cfg(feature = "gui")]
    pub(crate) fn bounds(&self) -> [DVec2; 2] {
        let [one, other] = self.ends.map(DVec3::truncate);
        let beside = DVec2::splat(SOFT * self.radius);
        [one.min(other) - beside, one.max(other) + beside]
    }

    /// Returns the nearest point of the capsule's axis in the picture.
    fn nearest(&self, pixel: DVec2) -> DVec3 {
        let [one, other] = self.ends;
        let along = (other - one).truncate();
        let part = (pixel - one.truncate()).dot(along) / along.length_squared().max(1e-9);
        one.lerp(other, part.clamp(0.0, 1.0))
    }

    /// Returns the opacity of a body at a pixel, at the distance `depth` from the camera (m): 0 is
    /// transparent, 1 opaque.
    pub(crate) fn solidity(&self, pixel: DVec2, depth: f64) -> f64 {
        let nearest = self.nearest(pixel);
        let beside = smooth(self.radius, SOFT * self.radius, (pixel - nearest.truncate()).length());
        let behind = smooth(nearest.z - 0.2 * self.reach, nearest.z + 2.0 * self.reach, depth);
        beside.max(behind)
    }
}

/// Returns 0 below `low`, 1 above `high`, and a smooth value between.
fn smooth(low: f64, high: f64, value: f64) -> f64 {
    let part = ((value - low) / (high - low)).clamp(0.0, 1.0);
    part * part * (3.0 - 2.0 * part)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::View;

    #[test]
    fn bodies_are_transparent_only_before_the_probe() {
        let solid = Solid { vertices: vec![-DVec3::new(0.1, 0.1, 1.0), DVec3::new(0.1, 0.1, 1.0)], ..Solid::default() };
        let camera = Camera::framing(solid.vertices.iter().copied(), View::Front, 1.0);
        let xray = XRay::around(&solid, &Pose::IDENTITY, &camera, [800.0; 2], 1.0).expect("the probe is visible");
        let (middle, depth) = (DVec2::splat(400.0), camera.distance);
        assert_eq!(xray.solidity(middle, depth - 1.0), 0.0, "the body must be transparent before the probe");
        assert_eq!(xray.solidity(middle, depth + 1.0), 1.0, "the body must be solid behind the probe");
        assert_eq!(
            xray.solidity(middle + DVec2::new(300.0, 0.0), depth - 1.0),
            1.0,
            "the body must be solid beside the probe"
        );
        let end = xray.ends[1].truncate();
        assert_eq!(xray.solidity(end, depth - 1.0), 0.0, "the body must be transparent along the whole probe");
        #[cfg(feature = "gui")]
        for corner in xray.bounds() {
            assert_eq!(xray.solidity(corner, depth - 1.0), 1.0, "the body must be solid at the corners of the bounds");
        }
    }
}
