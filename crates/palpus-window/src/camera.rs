//! The camera: on a sphere about a target, with the scene's z upwards.

use glam::DVec3;

/// A perspective camera that looks at `target` from `distance` away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The point in the middle of the picture, world.
    pub target: DVec3,
    /// Distance from the camera to the target, m.
    pub distance: f64,
    /// Direction of the camera about z, from x towards y, rad.
    pub yaw: f64,
    /// Elevation of the camera above the horizon, rad.
    pub pitch: f64,
}

/// Standard view of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum View {
    /// From the front, the right and above.
    #[default]
    Oblique,
    /// Looks along +y.
    Front,
    /// Looks along −y.
    Back,
    /// Looks along +x.
    Left,
    /// Looks along −x.
    Right,
    /// Looks along −z.
    Top,
    /// Looks along +z.
    Bottom,
}

impl View {
    /// Returns yaw and pitch, degrees.
    fn angles(self) -> (f64, f64) {
        match self {
            Self::Oblique => (-60.0, 28.0),
            Self::Front => (-90.0, 0.0),
            Self::Back => (90.0, 0.0),
            Self::Left => (180.0, 0.0),
            Self::Right => (0.0, 0.0),
            Self::Top => (-90.0, 90.0),
            Self::Bottom => (-90.0, -90.0),
        }
    }
}

/// Position of a point in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projected {
    /// Pixels from the left edge.
    pub x: f64,
    /// Pixels from the upper edge.
    pub y: f64,
    /// Depth: distance ahead of the camera along the middle line of sight, m.
    pub depth: f64,
}

/// Tangent of half the vertical field of view: 15°, with little perspective, as in a drawing.
const HALF_OPENING: f64 = 0.268;
/// Parts that are nearer to the camera than this share of the distance are cut away.
const NEAREST: f64 = 0.01;
/// Largest angle of the camera's direction above or below the horizon, rad. At a larger angle, the
/// picture would be upside down.
const MOST_PITCH: f64 = std::f64::consts::FRAC_PI_2;

impl Camera {
    /// Returns the camera in `view` that sees all `points` with a margin, in a picture `aspect`
    /// times as wide as it is high.
    pub fn framing(points: impl Iterator<Item = DVec3> + Clone, view: View, aspect: f64) -> Self {
        let (yaw, pitch) = view.angles();
        let mut camera = Self { target: DVec3::ZERO, distance: 1.0, yaw: yaw.to_radians(), pitch: pitch.to_radians() };
        camera.frame(points, aspect);
        camera
    }

    /// Moves target and distance, but not the direction, so that all `points` are visible. Does
    /// nothing without points.
    pub fn frame(&mut self, points: impl Iterator<Item = DVec3> + Clone, aspect: f64) {
        let [right, up, back] = self.axes();
        let in_view = points.map(|p| DVec3::new(right.dot(p), up.dot(p), back.dot(p)));
        let (low, high) =
            in_view.clone().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        if !low.is_finite() || !high.is_finite() {
            return;
        }
        let middle = (low + high) * 0.5;
        self.target = right * middle.x + up * middle.y + back * middle.z;
        let (wide, tall) = (HALF_OPENING * aspect * WITHIN, HALF_OPENING * WITHIN);
        let needed = in_view.map(|p| {
            let p = p - middle;
            p.z + (p.x.abs() / wide).max(p.y.abs() / tall)
        });
        self.distance = needed.fold(0.0, f64::max).max(f64::MIN_POSITIVE.sqrt());
    }

    /// Turns the camera about the target, rad.
    pub fn orbit(&mut self, about_z: f64, upwards: f64) {
        self.yaw = (self.yaw + about_z) % std::f64::consts::TAU;
        self.pitch = (self.pitch + upwards).clamp(-MOST_PITCH, MOST_PITCH);
    }

    /// Moves the camera and its target so that the target moves by this many pixels in a picture
    /// `height` pixels high.
    pub fn pan(&mut self, rightwards: f64, downwards: f64, height: f64) {
        let [right, up, _] = self.axes();
        let metres = self.metres_per_pixel(self.distance, height);
        self.target += (up * downwards - right * rightwards) * metres;
    }

    /// Moves the camera nearer to the target by this factor.
    pub fn zoom(&mut self, factor: f64) {
        self.distance /= factor;
    }

    /// Looks at the same target from a standard view.
    pub fn look(&mut self, view: View) {
        let (yaw, pitch) = view.angles();
        self.yaw = yaw.to_radians();
        self.pitch = pitch.to_radians();
    }

    /// Returns the view's axes in the world: right, up and towards the viewer.
    pub fn axes(&self) -> [DVec3; 3] {
        let ((sy, cy), (sp, cp)) = (self.yaw.sin_cos(), self.pitch.sin_cos());
        let back = DVec3::new(cp * cy, cp * sy, sp);
        let right = DVec3::new(-sy, cy, 0.0);
        [right, back.cross(right), back]
    }

    /// Returns the position of the camera, world.
    pub fn eye(&self) -> DVec3 {
        self.target + self.axes()[2] * self.distance
    }

    /// Returns the tangent of half the vertical field of view.
    pub fn half_opening(&self) -> f64 {
        HALF_OPENING
    }

    /// Returns the distance ahead of the camera below which nothing is drawn, m.
    pub fn nearest(&self) -> f64 {
        self.distance * NEAREST
    }

    /// Returns the length of a pixel at `depth`, in a picture `height` pixels high, m.
    pub fn metres_per_pixel(&self, depth: f64, height: f64) -> f64 {
        2.0 * depth * HALF_OPENING / height
    }

    /// Projects a point of the world into a picture of this size, pixels; `None` if the point is
    /// behind the camera.
    pub fn project(&self, point: DVec3, width: f64, height: f64) -> Option<Projected> {
        let [right, up, back] = self.axes();
        let p = point - self.eye();
        self.project_view(DVec3::new(right.dot(p), up.dot(p), back.dot(p)), width, height)
    }

    /// Projects a point of the view's frame, whose origin is the camera.
    pub fn project_view(&self, p: DVec3, width: f64, height: f64) -> Option<Projected> {
        let depth = -p.z;
        if depth < self.nearest() {
            return None;
        }
        let scale = 1.0 / self.metres_per_pixel(depth, height);
        Some(Projected { x: 0.5 * width + p.x * scale, y: 0.5 * height - p.y * scale, depth })
    }
}

/// Share of a picture's width and height that the framed points may fill.
const WITHIN: f64 = 0.84;

#[cfg(test)]
mod tests {
    use super::*;

    const VIEWS: [View; 7] = [View::Oblique, View::Front, View::Back, View::Left, View::Right, View::Top, View::Bottom];

    fn corners() -> Vec<DVec3> {
        let side = |k: usize, bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
        (0..8).map(|k| DVec3::new(4.0 + side(k, 0), 0.1 * side(k, 1) - 7.0, 3.0 * side(k, 2))).collect()
    }

    #[test]
    fn framed_bodies_fill_the_picture() {
        for view in VIEWS {
            let camera = Camera::framing(corners().into_iter(), view, 1.6);
            let seen: Vec<Projected> = corners()
                .iter()
                .map(|p| camera.project(*p, 1600.0, 1000.0).expect("the point is in front of the camera"))
                .collect();
            assert!(seen.iter().all(|p| p.x > 100.0 && p.x < 1500.0 && p.y > 70.0 && p.y < 930.0), "{view:?} {seen:?}");
            let wide = seen.iter().map(|p| (p.x - 800.0).abs() / 800.0).fold(0.0, f64::max);
            let tall = seen.iter().map(|p| (p.y - 500.0).abs() / 500.0).fold(0.0, f64::max);
            assert!(wide.max(tall) > 0.7, "{view:?} does not fill the picture: {wide} {tall}");
        }
    }

    #[test]
    fn axes_are_right_handed_and_upright() {
        for view in VIEWS {
            let [right, up, back] = Camera::framing(corners().into_iter(), view, 1.0).axes();
            assert!((right.cross(up) - back).length() < 1e-12 && up.z > -1e-12);
        }
    }

    #[test]
    fn pan_moves_the_target_by_the_given_pixels() {
        let mut camera = Camera::framing(corners().into_iter(), View::Oblique, 1.6);
        let before = camera.target;
        camera.pan(30.0, -20.0, 1000.0);
        let now = camera.project(before, 1600.0, 1000.0).expect("the point is in front of the camera");
        assert!((now.x - 830.0).abs() < 1e-6 && (now.y - 480.0).abs() < 1e-6, "{now:?}");
    }

    #[test]
    fn eye_stays_upright() {
        let mut camera = Camera::framing(corners().into_iter(), View::Oblique, 1.0);
        camera.orbit(1.0, 10.0);
        assert!(camera.axes()[1].z.abs() < 1e-9 && camera.axes()[2].z > 0.999);
    }
}
