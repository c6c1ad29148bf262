//! Values out of an input's bytes: small changes of the bytes are small changes of the values, and
//! special cases are common.

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist};
use palpus::body::{Body, BodySettings, PolygonSoup};

/// Bytes to be used up; behind the end there are zeros.
pub struct Bytes<'a> {
    rest: &'a [u8],
}

impl<'a> Bytes<'a> {
    /// Reads from an input.
    pub fn new(data: &'a [u8]) -> Self {
        Self { rest: data }
    }

    /// Nothing is left.
    pub fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    /// All that is left.
    pub fn rest(self) -> &'a [u8] {
        self.rest
    }

    /// Up to `count` bytes.
    pub fn take(&mut self, count: usize) -> &'a [u8] {
        let (taken, rest) = self.rest.split_at(count.min(self.rest.len()));
        self.rest = rest;
        taken
    }

    /// The next byte.
    pub fn byte(&mut self) -> u8 {
        self.take(1).first().copied().unwrap_or(0)
    }

    /// The next two bytes as a number.
    pub fn short(&mut self) -> u16 {
        u16::from_le_bytes([self.byte(), self.byte()])
    }

    /// Less than `limit`.
    pub fn below(&mut self, limit: usize) -> usize {
        usize::from(self.byte()) % limit
    }

    /// Once in a while.
    pub fn rarely(&mut self) -> bool {
        self.byte() > 230
    }

    /// Any double.
    pub fn any(&mut self) -> f64 {
        let mut bytes = [0; 8];
        let taken = self.take(8);
        bytes[..taken.len()].copy_from_slice(taken);
        f64::from_le_bytes(bytes)
    }

    /// From −4 to 4: mostly of a grid of 1/32, sometimes a little beside it.
    pub fn coordinate(&mut self) -> f64 {
        let byte = self.byte();
        if byte < 200 {
            return (f64::from(byte) - 100.0) / 32.0;
        }
        let (grid, beside, size) = (self.byte() as i8, self.byte() as i8, self.byte() % 18);
        f64::from(grid) / 32.0 + f64::from(beside) * 0.1f64.powi(i32::from(size))
    }

    /// From 0 to 1.
    pub fn share(&mut self) -> f64 {
        f64::from(self.short()) / 65535.0
    }

    /// Between two positive numbers, by size.
    pub fn between(&mut self, least: f64, most: f64) -> f64 {
        (least * (most / least).powf(self.share())).clamp(least, most)
    }

    /// Near the origin.
    pub fn point(&mut self) -> DVec3 {
        DVec3::new(self.coordinate(), self.coordinate(), self.coordinate())
    }

    /// Any pose near the origin; quarter turns are common.
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

    /// A pose as a device that is out of order may say it.
    pub fn wild_pose(&mut self) -> Pose {
        let mut any = || self.any();
        Pose { rotation: DQuat::from_xyzw(any(), any(), any(), any()), translation: DVec3::new(any(), any(), any()) }
    }

    /// A velocity; sometimes any numbers.
    pub fn twist(&mut self) -> Twist {
        let vector = |bytes: &mut Self| {
            if bytes.rarely() { DVec3::new(bytes.any(), bytes.any(), bytes.any()) } else { bytes.point() }
        };
        Twist { angular: vector(self), linear: vector(self) }
    }

    /// Settings for making a body.
    pub fn body_settings(&mut self) -> BodySettings {
        let flags = self.byte();
        BodySettings {
            scale: if flags & 4 == 0 { 1.0 } else { self.between(1e-6, 1e6) },
            flatness: if flags & 1 == 0 { BodySettings::EXACT } else { BodySettings::HAPTIC },
            thick: flags & 2 == 0,
        }
    }

    /// A few points and polygons between them, well made or not.
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

    /// A small body: the hull of some points, a prism over a star, or what some polygons give,
    /// times `unit`. `None` if they give none.
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

    /// A closed prism over a polygon of any radii: blocks, stars, wedges, plates.
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
