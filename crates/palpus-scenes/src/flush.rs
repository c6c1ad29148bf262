//! Scenes with two parts that fit into each other with flush faces. The hand twists one part
//! against the other. The scenes have parameters.
//!
//! The times are equal in all cases. The part moves to its held position. The hand holds the part
//! there from [`REST_START`] to [`REST_END`], with a larger rotation than the play allows. Then the
//! part goes back.

use std::f64::consts::FRAC_1_SQRT_2;

use glam::{DQuat, DVec2, DVec3};
use palpus::algebra::{Pose, Wrench};
use palpus::body::PolygonSoup;

use crate::scene::{ContactSettings, Scene};
use crate::shape::{self, ChannelSection, KEY_SIDE, KEY_TIP, PEG_TIP, SQUARE_PEG};
use crate::{HandPath, Key};

/// Time at which the hand stops with the turned part, s.
pub const REST_START: f64 = 1.8;
/// Time at which the hand moves again, s.
pub const REST_END: f64 = 3.8;

/// The two parts that fit into each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// A plate of 2 mm in a slot, twisted about the slot's depth.
    Slot,
    /// A drawer of 60 mm × 40 mm × 20 mm in its frame, tilted about y.
    Drawer,
    /// A key with a square shaft of 6 mm in a through hole, twisted about its shaft.
    Key,
    /// A peg of 10 mm × 6 mm, tilted about x in its hole.
    Peg,
}

impl Fit {
    /// All fits.
    pub const ALL: [Self; 4] = [Self::Slot, Self::Drawer, Self::Key, Self::Peg];

    /// Returns the name of the built-in scene.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Slot => "slot",
            Self::Drawer => "drawer",
            Self::Key => "key",
            Self::Peg => "square-peg",
        }
    }

    /// Returns a summary in one line, for a list.
    pub const fn summary(self) -> &'static str {
        match self {
            Self::Slot => "a 2 mm plate is twisted in a slot of 2.2 mm: two flush faces on each side",
            Self::Drawer => "a drawer with 0.3 mm of play is tilted in its frame and held",
            Self::Key => "a square key with 0.05 mm of play is twisted in its hole",
            Self::Peg => "a square peg with 0.015 mm of play is tilted in its hole",
        }
    }

    /// Returns the case of the built-in scene.
    pub fn usual(self) -> FlushCase {
        let (play, twist_degrees, tolerance) = match self {
            Self::Slot => (0.1e-3, 15.0, 0.5e-3),
            Self::Drawer => (0.3e-3, 10.0, 0.5e-3),
            Self::Key => (0.05e-3, 20.0, 0.3e-3),
            Self::Peg => (0.015e-3, 4.0, 0.2e-3),
        };
        FlushCase { fit: self, play, twist: f64::to_radians(twist_degrees), tolerance }
    }

    /// Returns a force of `newtons` that presses the part sideways against a wall, as a wrench
    /// about the grip. The force acts in the middle of the touching faces, so the part does not tip
    /// over.
    pub fn weight(self, newtons: f64) -> Wrench {
        let (direction, place) = match self {
            Self::Slot => (DVec3::Y, DVec3::Z * -0.010),
            Self::Drawer => (DVec3::NEG_Z, DVec3::X * -0.0075),
            Self::Key => (DIAGONAL, DVec3::Z * (0.005 - KEY_TIP)),
            Self::Peg => (DIAGONAL, PEG_TIP + DVec3::Z * 0.0075),
        };
        let force = direction * newtons;
        Wrench { torque: place.cross(force), force }
    }
}

/// Unit vector into the corner of a rectangular hole.
const DIAGONAL: DVec3 = DVec3::new(FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0);

/// A fit with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlushCase {
    /// The two parts.
    pub fit: Fit,
    /// Gap on each side, m.
    pub play: f64,
    /// Angle by which the hand turns the part, rad.
    pub twist: f64,
    /// Contact tolerance, m.
    pub tolerance: f64,
}

/// Side lengths of the plate, m.
const PLATE: DVec3 = DVec3::new(0.050, 0.002, 0.040);
/// Side lengths of the drawer, m.
const DRAWER: DVec3 = DVec3::new(0.060, 0.040, 0.020);
/// Length of the slot, m.
const SLOT_LENGTH: f64 = 0.080;
/// Length of the drawer's frame, m.
const FRAME_LENGTH: f64 = 0.050;
/// Thickness of the walls of the drawer's frame and of the blocks with holes, m.
const WALL: f64 = 0.010;
/// Height of the block with the key's hole, m.
const KEY_BLOCK_HEIGHT: f64 = 0.012;
/// Height of the block with the peg's hole, m.
const PEG_BLOCK_HEIGHT: f64 = 0.025;

impl FlushCase {
    /// Builds the scene.
    pub fn scene(&self) -> Scene {
        let path = HandPath::through(&self.keys());
        Scene {
            name: self.fit.name(),
            summary: self.fit.summary(),
            probe: self.probe(),
            environment: self.environment(),
            contact: ContactSettings {
                tolerance: self.tolerance,
                cluster_radius: 4.0 * self.tolerance,
                stiffness: 800.0,
                friction: None,
                shading: false,
                crease: 0.0,
            },
            start: path.pose(0.0),
            path,
            second: None,
            objects: Vec::new(),
            gravity: DVec3::ZERO,
        }
    }

    fn probe(&self) -> PolygonSoup {
        match self.fit {
            Fit::Slot => shape::cuboid(PLATE),
            Fit::Drawer => shape::cuboid(DRAWER),
            Fit::Key => shape::key(),
            Fit::Peg => shape::square_peg(),
        }
    }

    fn environment(&self) -> PolygonSoup {
        match self.fit {
            Fit::Slot => shape::channel(SLOT_LENGTH, &self.slot()),
            Fit::Drawer => {
                let hole = self.hole();
                shape::along_x(shape::sleeve((hole + 2.0 * WALL).extend(FRAME_LENGTH), hole))
            }
            Fit::Key | Fit::Peg => {
                let hole = self.hole();
                shape::sleeve((hole + 2.0 * WALL).extend(self.block_height()), hole)
            }
        }
    }

    fn slot(&self) -> ChannelSection {
        ChannelSection { half_gap: PLATE.y / 2.0 + self.play, half_width: 0.015, floor: -0.022, bottom: -0.030 }
    }

    /// Returns the side lengths of the hole, m. For the drawer's frame, these are perpendicular to
    /// x.
    fn hole(&self) -> DVec2 {
        let part = match self.fit {
            Fit::Slot => DVec2::ZERO,
            Fit::Drawer => DVec2::new(DRAWER.y, DRAWER.z),
            Fit::Key => DVec2::splat(KEY_SIDE),
            Fit::Peg => SQUARE_PEG,
        };
        part + 2.0 * self.play
    }

    fn block_height(&self) -> f64 {
        if self.fit == Fit::Key { KEY_BLOCK_HEIGHT } else { PEG_BLOCK_HEIGHT }
    }

    /// Returns the pose in which the part is free within its play, before it is turned.
    pub fn free(&self) -> Pose {
        self.keys()[1].pose
    }

    fn keys(&self) -> Vec<Key> {
        let at = |place: DVec3, axis: DVec3, turn: f64| Pose::new(DQuat::from_axis_angle(axis, turn), place);
        // Two poses: free in the play, and turned and shifted a little sideways, as a person would
        // press.
        let (free, held, axis) = match self.fit {
            Fit::Slot => (DVec3::new(0.0, 0.0, -0.0005), DVec3::new(0.002, 0.0, -0.0005), DVec3::Z),
            Fit::Drawer => (DVec3::new(-0.015, 0.0, 0.0), DVec3::new(-0.025, 0.001, 0.0005), DVec3::Y),
            Fit::Key => {
                let place = DVec3::Z * (KEY_TIP - 0.010);
                (place, place, DVec3::Z)
            }
            Fit::Peg => {
                let place = DVec3::Z * (-PEG_TIP.z - 0.015);
                (place, place + DVec3::new(0.0002, 0.0, 0.0), DVec3::X)
            }
        };
        let inside = at(free, axis, 0.0);
        vec![
            Key::rest(0.0, inside),
            Key::rest(1.0, inside),
            Key::rest(REST_START, at(held, axis, self.twist)),
            Key::rest(REST_END, at(held, axis, self.twist)),
            Key::rest(4.6, inside),
        ]
    }
}
