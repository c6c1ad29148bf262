//! Draws triangles into a layer of light and depth.
//!
//! 1. Corners are transformed into the view's frame. Parts nearer than the camera's nearest
//!    distance are cut away.
//! 2. Row by row, the samples in the triangle are found by the signs of three edge functions. A
//!    sample on an edge belongs to both triangles, and the depths decide.
//! 3. A sample keeps the nearest fragment. Nearness, the inverse of depth, is linear over the
//!    picture, so it needs no correction. The second difference of a plane's nearness is zero,
//!    which is used to find outlines.
//!
//! There is one thread, and every sum has a fixed order, so every run gives the same layer.

use glam::{DVec2, DVec3};

use crate::camera::Camera;

/// The part of a triangle in one sample.
pub(crate) struct Fragment {
    /// Unit normal towards the viewer, view's frame.
    pub(crate) normal: DVec3,
    /// Unit vector from the surface to the camera, view's frame.
    pub(crate) to_eye: DVec3,
    /// Distance to the nearest side of the triangle, in samples.
    pub(crate) side: f64,
    /// Position of the sample, in samples from the upper left corner.
    pub(crate) at: DVec2,
    /// Distance from the camera along the middle line of sight, m.
    pub(crate) depth: f64,
}

/// A corner of a triangle, world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    pub(crate) point: DVec3,
    pub(crate) normal: DVec3,
}

/// The visible side of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Facing {
    Any,
    Front,
    Back,
}

/// Light (red, green, blue) and opacity.
pub(crate) type Light = [f32; 4];

/// The transformation of the world into samples of the camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lens {
    camera: Camera,
    eye: DVec3,
    axes: [DVec3; 3],
    width: f64,
    height: f64,
}

impl Lens {
    pub(crate) fn new(camera: &Camera, width: usize, height: usize) -> Self {
        let axes = camera.axes();
        Self { camera: *camera, eye: camera.eye(), axes, width: width as f64, height: height as f64 }
    }

    /// Intersects the line of sight through a sample (from the upper left corner) with the plane
    /// through `point` (world) across `normal`; `None` if they do not meet.
    pub(crate) fn on_plane(&self, at: DVec2, point: DVec3, normal: DVec3) -> Option<DVec3> {
        let metres = self.camera.metres_per_pixel(1.0, self.height);
        let [right, up, back] = self.axes;
        let (x, y) = ((at.x - 0.5 * self.width) * metres, (0.5 * self.height - at.y) * metres);
        let direction = right * x + up * y - back;
        let along = (point - self.eye).dot(normal) / direction.dot(normal);
        (along > 0.0 && along.is_finite()).then(|| self.eye + direction * along)
    }

    pub(crate) fn vector_in_view(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.axes[0].dot(v), self.axes[1].dot(v), self.axes[2].dot(v))
    }

    pub(crate) fn point_in_view(&self, p: DVec3) -> DVec3 {
        self.vector_in_view(p - self.eye)
    }

    /// Returns the length in metres of `samples` samples at a point of the world.
    pub(crate) fn metres(&self, point: DVec3, samples: f64) -> f64 {
        let depth = (-self.point_in_view(point).z).max(self.camera.nearest());
        samples * self.camera.metres_per_pixel(depth, self.height)
    }
}

/// Samples, row by row from the top.
pub(crate) struct Layer {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Inverse of the depth, 1/m; 0 where nothing is drawn.
    pub(crate) nearness: Vec<f32>,
    pub(crate) light: Vec<Light>,
    /// Number of the body that is drawn there; 0 if no body is drawn.
    pub(crate) name: Vec<u16>,
}

impl Layer {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let count = width * height;
        Self { width, height, nearness: vec![0.0; count], light: vec![[0.0; 4]; count], name: vec![0; count] }
    }

    /// Empties the layer. Only fragments nearer than the fragments of `other` will be drawn.
    pub(crate) fn restart_before(&mut self, other: &Self) {
        self.nearness.copy_from_slice(&other.nearness);
        self.name.fill(0);
    }

    /// Draws a triangle with number `name`. `light` returns the look of a fragment, or `None` if it
    /// is not drawn.
    pub(crate) fn triangle(
        &mut self,
        lens: &Lens,
        name: u16,
        corners: [Corner; 3],
        facing: Facing,
        light: impl Fn(&Fragment) -> Option<Light>,
    ) {
        let seen =
            corners.map(|c| Corner { point: lens.point_in_view(c.point), normal: lens.vector_in_view(c.normal) });
        let nearest = lens.camera.nearest();
        let behind = seen.iter().filter(|c| -c.point.z < nearest).count();
        match behind {
            0 => self.whole_triangle(lens, name, seen, facing, true, light),
            3 => (),
            _ => {
                let cut = cut_nearest(&seen, -nearest);
                for k in 2..cut.len() {
                    self.whole_triangle(lens, name, [cut[0], cut[k - 1], cut[k]], facing, false, &light);
                }
            }
        }
    }

    /// Draws a triangle that is wholly ahead of the camera, in the view's frame.
    fn whole_triangle(
        &mut self,
        lens: &Lens,
        name: u16,
        corners: [Corner; 3],
        facing: Facing,
        sides: bool,
        light: impl Fn(&Fragment) -> Option<Light>,
    ) {
        let Some(flat) = Flat::new(lens, &corners) else { return };
        if facing != Facing::Any && flat.is_front() != (facing == Facing::Front) {
            return;
        }
        let turned = if flat.is_front() { 1.0 } else { -1.0 };
        let rows = span(flat.y.iter().copied(), self.height);
        for row in rows {
            let y = row as f64 + 0.5;
            for column in flat.columns(y, self.width) {
                let [u, v, w] = flat.weights(column as f64 + 0.5, y);
                if u < 0.0 || v < 0.0 || w < 0.0 {
                    continue;
                }
                let [u, v, w] = [u * flat.nearness[0], v * flat.nearness[1], w * flat.nearness[2]];
                let nearness = u + v + w;
                let at = row * self.width + column;
                if nearness as f32 <= self.nearness[at] {
                    continue;
                }
                let mix = |of: fn(&Corner) -> DVec3| {
                    (of(&corners[0]) * u + of(&corners[1]) * v + of(&corners[2]) * w) / nearness
                };
                let fragment = Fragment {
                    normal: (mix(|c| c.normal) * turned).normalize_or(DVec3::Z),
                    to_eye: (-mix(|c| c.point)).normalize_or(DVec3::Z),
                    side: if sides { flat.to_side(column as f64 + 0.5, y) } else { f64::INFINITY },
                    at: DVec2::new(column as f64 + 0.5, row as f64 + 0.5),
                    depth: 1.0 / nearness,
                };
                if let Some(light) = light(&fragment) {
                    self.nearness[at] = nearness as f32;
                    self.light[at] = light;
                    self.name[at] = name;
                }
            }
        }
    }

    /// Draws a round dot of `radius` samples at a point of the world, `nearer` metres nearer to the
    /// camera. `light` gets the distance from the dot's middle, in radii.
    pub(crate) fn dot(
        &mut self,
        lens: &Lens,
        name: u16,
        point: DVec3,
        radius: f64,
        nearer: f64,
        light: impl Fn(f64) -> Light,
    ) {
        let Some(at) = lens.camera.project_view(lens.point_in_view(point), lens.width, lens.height) else { return };
        let nearness = (1.0 / (at.depth - nearer).max(lens.camera.nearest())) as f32;
        for row in span([at.y - radius, at.y + radius].into_iter(), self.height) {
            for column in span([at.x - radius, at.x + radius].into_iter(), self.width) {
                let (dx, dy) = (column as f64 + 0.5 - at.x, row as f64 + 0.5 - at.y);
                let part = (dx * dx + dy * dy).sqrt() / radius;
                let k = row * self.width + column;
                if part <= 1.0 && nearness > self.nearness[k] {
                    self.nearness[k] = nearness;
                    self.light[k] = light(part);
                    self.name[k] = name;
                }
            }
        }
    }

    /// Calls `draw` with each sample within `radius` samples of a point of the world: its index,
    /// and its position from the upper left corner.
    pub(crate) fn about(&self, lens: &Lens, point: DVec3, radius: f64, mut draw: impl FnMut(usize, DVec2)) {
        let Some(at) = lens.camera.project_view(lens.point_in_view(point), lens.width, lens.height) else { return };
        for row in span([at.y - radius, at.y + radius].into_iter(), self.height) {
            for column in span([at.x - radius, at.x + radius].into_iter(), self.width) {
                draw(row * self.width + column, DVec2::new(column as f64 + 0.5, row as f64 + 0.5));
            }
        }
    }

    /// Mixes `colour` into the samples where a drawn body ends before something farther away.
    /// Leaves out the places where a body is transparent (`cut`).
    pub(crate) fn outline(&mut self, colour: DVec3, strength: f64, cut: impl Fn(DVec2) -> bool) {
        let (width, height) = (self.width, self.height);
        let mut edges = Vec::new();
        for row in 1..height.saturating_sub(1) {
            for column in 1..width.saturating_sub(1) {
                let at = row * width + column;
                let name = self.name[at];
                if name == 0 {
                    continue;
                }
                let own = self.nearness[at];
                let ends = |a: usize, b: usize| {
                    let fall = 2.0 * own - self.nearness[a] - self.nearness[b];
                    let meets = |k: usize| self.name[k] != name && self.nearness[k] < own;
                    fall > OUTLINE_FALL * own || meets(a) || meets(b)
                };
                let is_end = ends(at - 1, at + 1) || ends(at - width, at + width);
                if is_end && !cut(DVec2::new(column as f64 + 0.5, row as f64 + 0.5)) {
                    edges.push(at);
                }
            }
        }
        let colour = colour.as_vec3().to_array();
        for at in edges {
            let light = &mut self.light[at];
            for (part, ink) in light.iter_mut().zip(colour) {
                *part += (ink - *part) * strength as f32;
            }
            light[3] = light[3].max(strength as f32);
        }
    }
}

/// An outline is drawn at a sample if the nearness falls towards its two neighbours by more than
/// this share in total: half a percent of the distance to the camera.
const OUTLINE_FALL: f32 = 0.005;

/// A triangle in the coordinates of the samples.
struct Flat {
    x: [f64; 3],
    y: [f64; 3],
    nearness: [f64; 3],
    area: f64,
}

impl Flat {
    fn new(lens: &Lens, corners: &[Corner; 3]) -> Option<Self> {
        let mut flat = Self { x: [0.0; 3], y: [0.0; 3], nearness: [0.0; 3], area: 0.0 };
        for (k, corner) in corners.iter().enumerate() {
            // The cut corner lies on the limit, up to round-off.
            let ahead = DVec3 { z: corner.point.z.min(-lens.camera.nearest()), ..corner.point };
            let at = lens.camera.project_view(ahead, lens.width, lens.height)?;
            (flat.x[k], flat.y[k], flat.nearness[k]) = (at.x, at.y, 1.0 / at.depth);
        }
        flat.area = flat.twice_area(1, 2, flat.x[0], flat.y[0]);
        (flat.area != 0.0 && flat.area.is_finite()).then_some(flat)
    }

    /// True if the triangle faces the viewer. Rows count downwards, so a counter-clockwise triangle
    /// has a negative area.
    fn is_front(&self) -> bool {
        self.area < 0.0
    }

    /// Returns twice the signed area of the triangle of two corners and a point.
    fn twice_area(&self, i: usize, j: usize, x: f64, y: f64) -> f64 {
        (self.x[j] - self.x[i]) * (y - self.y[i]) - (self.y[j] - self.y[i]) * (x - self.x[i])
    }

    /// Returns the weight of each corner at a position.
    fn weights(&self, x: f64, y: f64) -> [f64; 3] {
        [(1, 2), (2, 0), (0, 1)].map(|(i, j)| self.twice_area(i, j, x, y) / self.area)
    }

    /// Returns the distance in samples from a point inside to the nearest side.
    fn to_side(&self, x: f64, y: f64) -> f64 {
        let distance = |(i, j): (usize, usize)| {
            let length = (self.x[j] - self.x[i]).hypot(self.y[j] - self.y[i]);
            self.twice_area(i, j, x, y).abs() / length.max(f64::MIN_POSITIVE)
        };
        [(1, 2), (2, 0), (0, 1)].map(distance).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Returns the columns that the row through `y` may have in the triangle, with one more column
    /// on each side.
    fn columns(&self, y: f64, width: usize) -> std::ops::Range<usize> {
        let crossings = [(0, 1), (1, 2), (2, 0)].into_iter().filter_map(|(i, j)| {
            let (low, high) = (self.y[i].min(self.y[j]), self.y[i].max(self.y[j]));
            (low <= y && y <= high && low < high)
                .then(|| self.x[i] + (self.x[j] - self.x[i]) * ((y - self.y[i]) / (self.y[j] - self.y[i])))
        });
        span(crossings, width)
    }
}

/// Returns the range from the smallest to the largest value, within 0 to `end`; empty without
/// values.
fn span(values: impl Iterator<Item = f64>, end: usize) -> std::ops::Range<usize> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return 0..0;
    }
    // The conversion saturates: negative values become 0.
    ((low - 1.0).floor() as usize).min(end)..((high + 1.0).ceil() as usize).min(end)
}

/// Cuts a triangle at z = `limit` (view's frame); returns the three or four corners of the farther
/// part.
fn cut_nearest(corners: &[Corner; 3], limit: f64) -> Vec<Corner> {
    let mut cut = Vec::with_capacity(4);
    for k in 0..3 {
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        let (hp, hq) = (p.point.z - limit, q.point.z - limit);
        if hp <= 0.0 {
            cut.push(p);
        }
        if (hp <= 0.0) != (hq <= 0.0) {
            let part = hp / (hp - hq);
            cut.push(Corner { point: p.point.lerp(q.point, part), normal: p.normal.lerp(q.normal, part) });
        }
    }
    cut
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::View;

    fn flat(points: [DVec3; 3]) -> [Corner; 3] {
        points.map(|point| Corner { point, normal: DVec3::Z })
    }

    fn drawn(points: [DVec3; 3], camera: &Camera, facing: Facing) -> usize {
        let mut layer = Layer::new(100, 100);
        layer.triangle(&Lens::new(camera, 100, 100), 1, flat(points), facing, |_| Some([1.0; 4]));
        layer.name.iter().filter(|name| **name == 1).count()
    }

    #[test]
    fn triangle_covers_its_area_and_shows_one_side() {
        let points = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let camera = Camera::framing(points.into_iter(), View::Top, 1.0);
        // The triangle is half of a square of 84 % of the picture.
        let front = drawn(points, &camera, Facing::Front);
        assert!((front as f64 - 0.5 * 84.0 * 84.0).abs() < 100.0, "{front}");
        assert_eq!(drawn(points, &camera, Facing::Any), front);
        assert_eq!(drawn(points, &camera, Facing::Back), 0);
    }

    #[test]
    fn two_halves_of_a_square_have_no_gap() {
        let [a, b, c, d] = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.3), DVec3::Y];
        let camera = Camera::framing([a, b, c, d].into_iter(), View::Top, 1.0);
        let mut layer = Layer::new(100, 100);
        let lens = Lens::new(&camera, 100, 100);
        layer.triangle(&lens, 1, flat([a, b, c]), Facing::Any, |_| Some([1.0; 4]));
        layer.triangle(&lens, 1, flat([a, c, d]), Facing::Any, |_| Some([1.0; 4]));
        let row = |y: usize| (0..100).filter(|x| layer.name[y * 100 + x] == 1).collect::<Vec<usize>>();
        for y in 15..85 {
            let columns = row(y);
            assert_eq!(columns.len(), columns[columns.len() - 1] - columns[0] + 1, "row {y}");
        }
    }

    #[test]
    fn triangle_behind_the_eye_is_clipped() {
        let points = [DVec3::new(0.0, 0.0, 100.0), DVec3::new(-1.0, 0.1, -5.0), DVec3::new(1.0, 0.1, -5.0)];
        let camera = Camera { target: DVec3::ZERO, distance: 2.0, yaw: -1.5, pitch: 1.2 };
        let count = drawn(points, &camera, Facing::Any);
        assert!(count > 0 && count < 10_000, "{count}");
    }

    #[test]
    fn nearer_triangle_wins_in_any_order() {
        let near = [DVec3::new(0.0, 0.0, 0.5), DVec3::new(1.0, 0.0, 0.5), DVec3::new(0.0, 1.0, 0.5)];
        let far = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let camera = Camera::framing(far.into_iter(), View::Top, 1.0);
        let lens = Lens::new(&camera, 60, 60);
        let draw = |order: [(u16, [DVec3; 3]); 2]| {
            let mut layer = Layer::new(60, 60);
            for (name, points) in order {
                layer.triangle(&lens, name, flat(points), Facing::Any, |_| Some([1.0; 4]));
            }
            layer.name
        };
        let one = draw([(1, near), (2, far)]);
        assert_eq!(one, draw([(2, far), (1, near)]));
        assert!(one.contains(&1) && one.iter().filter(|n| **n == 2).count() < one.iter().filter(|n| **n == 1).count());
    }
}
