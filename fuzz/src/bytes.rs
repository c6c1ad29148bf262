//! Converts the bytes of an input to values. Small changes of the bytes give small changes of the
//! values, and special cases are frequent.

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist};
use palpus::body::{Body, BodySettings, PolygonSoup};

/// The remaining bytes of an input; after its end, all bytes are zero.
pub struct Bytes<'a> {
    rest: &'a [u8],
}

impl<'a> Bytes<'a> {
    /// Starts at the beginning of an input.
    pub fn new(data: &'a [u8]) -> Self {
        Self { rest: data }
    }

    /// Returns true if no bytes remain.
    pub fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    /// Returns all remaining bytes.
    pub fn rest(self) -> &'a [u8] {
        self.rest
    }

    /// Returns the next `count` bytes, or fewer at the end of the input.
    pub fn take(&mut self, count: usize) -> &'a [u8] {
        let (taken, rest) = self.rest.split_at(count.min(self.rest.len()));
        self.rest = rest;
        taken
    }

    /// Returns the next byte.
    pub fn byte(&mut self) -> u8 {
        self.take(1).first().copied().unwrap_or(0)
    }

    /// Returns the next two bytes as a number.
    pub fn short(&mut self) -> u16 {
        u16::from_le_bytes([self.byte(), self.byte()])
    }

    /// Returns a number less than `limit`.
    pub fn below(&mut self, limit: usize) -> usize {
        usize::from(self.byte()) % limit
    }

    /// Returns true in rare cases.
    pub fn rarely(&mut self) -> bool {
        self.byte() > 230
    }

    /// Returns any double.
    pub fn any(&mut self) -> f64 {
        let mut bytes = [0; 8];
        let taken = self.take(8);
        bytes[..taken.len()].copy_from_slice(taken);
        f64::from_le_bytes(bytes)
    }

    /// Returns a number from −4 to 4: usually on a grid of 1/32, sometimes slightly off the grid.
    pub fn coordinate(&mut self) -> f64 {
        let byte = self.byte();
        if byte < 200 {
            return (f64::from(byte) - 100.0) / 32.0;
        }
        let (grid, beside, size) = (self.byte() as i8, self.byte() as i8, self.byte() % 18);
        f64::from(grid) / 32.0 + f64::from(beside) * 0.1f64.powi(i32::from(size))
    }

    /// Returns a number from 0 to 1.
    pub fn share(&mut self) -> f64 {
        f64::from(self.short()) / 65535.0
    }

    /// Returns a number between two positive numbers, distributed logarithmically.
    pub fn between(&mut self, least: f64, most: f64) -> f64 {
        (least * (most / least).powf(self.share())).clamp(least, most)
    }

    /// Returns a point near the origin.
    pub fn point(&mut self) -> DVec3 {
        DVec3::new(self.coordinate(), self.coordinate(), self.coordinate())
    }

    /// Returns a pose near the origin; quarter turns are frequent.
    pub fn pose(&mut self, scale: f64) -> Pose {
        let kind = self.byte();
        let rotation = if kind < 64 {
            let quarter = |turns: u8| f64::from(turns & 3) * std::f64::consts::FRAC_PI_2;
            DQuat::from_euler(glam::EulerRot::XYZ, quarter(kind), quarter(kind >> 2), quarter(kind >> 4))
        } else {
            let axis = self.point();
            DQuat::from_scaled_axis(if axis.is_finite() { axis } else { DVec3::ZERO })
        };
        Pose::new(rotation, self.point() * scale)
    }

    /// Returns a pose as a faulty device may report it.
    pub fn wild_pose(&mut self) -> Pose {
        let mut any = || self.any();
        Pose { rotation: DQuat::from_xyzw(any(), any(), any(), any()), translation: DVec3::new(any(), any(), any()) }
    }

    /// Returns a twist, which sometimes consists of arbitrary numbers.
    pub fn twist(&mut self) -> Twist {
        let vector = |bytes: &mut Self| {
            if bytes.rarely() { DVec3::new(bytes.any(), bytes.any(), bytes.any()) } else { bytes.point() }
        };
        Twist { angular: vector(self), linear: vector(self) }
    }

    /// Returns settings for the preparation of a body.
    pub fn body_settings(&mut self) -> BodySettings {
        let flags = self.byte();
        BodySettings {
            scale: if flags & 4 == 0 { 1.0 } else { self.between(1e-6, 1e6) },
            flatness: if flags & 1 == 0 { BodySettings::EXACT } else { BodySettings::HAPTIC },
            thick: flags & 2 == 0,
        }
    }

    /// Returns a few points and polygons between them, which may be invalid.
    pub fn soup(&mut self, most_vertices: usize, most_faces: usize) -> PolygonSoup {
        let vertices = 3 + self.below(most_vertices - 2);
        let faces = 1 + self.below(most_faces);
        let mut soup = PolygonSoup::new();
        soup.vertices = (0..vertices).map(|_| self.point()).collect();
        for _ in 0..faces {
            let byte = self.byte();
            let corners = if byte < 200 { 3 } else { 3 + usize::from(byte) % 5 };
            let face: Vec<u32> = (0..corners).map(|_| self.below(vertices) as u32).collect();
            soup.push_face(&face);
        }
        soup
    }

    /// Returns a small body: the hull of some points, a prism over a star, or the body of some
    /// polygons, scaled by `unit`. `None` if the input gives no valid body.
    pub fn body(&mut self, unit: f64) -> Option<Body> {
        match self.byte() % 4 {
            0 => {
                let count = 4 + self.below(20);
                let points: Vec<DVec3> = (0..count).map(|_| unit * self.point()).collect();
                Body::from_convex(&points).ok()
            }
            1 => {
                let soup = self.star();
                let settings = self.body_settings();
                Body::from_soup(&soup, &BodySettings { scale: unit, ..settings }, &mut |_| ()).ok()
            }
            _ => {
                let soup = self.soup(12, 16);
                let settings = self.body_settings();
                Body::from_soup(&soup, &BodySettings { scale: unit, ..settings }, &mut |_| ()).ok()
            }
        }
    }

    /// Returns a closed prism over a polygon of arbitrary radii: a block, a star, a wedge or a
    /// plate.
    fn star(&mut self) -> PolygonSoup {
        let sides = 3 + self.below(8) as u32;
        let height = 0.01 + 2.0 * self.share();
        let mut soup = PolygonSoup::new();
        for z in [0.0, height] {
            let mut radii = Bytes::new(self.rest);
            for k in 0..sides {
                let (sin, cos) = (f64::from(k) / f64::from(sides) * std::f64::consts::TAU).sin_cos();
                let radius = 0.05 + f64::from(radii.byte()) / 128.0;
                soup.vertices.push(DVec3::new(radius * cos, radius * sin, z));
            }
        }
        self.take(sides as usize);
        soup.push_face(&(0..sides).rev().collect::<Vec<_>>());
        soup.push_face(&(sides..2 * sides).collect::<Vec<_>>());
        for k in 0..sides {
            let next = (k + 1) % sides;
            soup.push_face(&[k, next, sides + next, sides + k]);
        }
        soup
    }
}
