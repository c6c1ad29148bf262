//! True contacts of scenes, computed by formulas. These contacts are the reference for rendered
//! forces.
//!
//! * `pen-sphere`: the pen's point against the ideal sphere that the mesh approximates.
//! * `v-groove`: the corners of the ball's mesh against the two walls, which are planes. The forces
//!   act through the ball's centre, because the mesh represents a round body.
//! * `box-tilt`, `box-edge`, `box-rest`: the lowest corner of the box against the table's top. The
//!   force on a flat box acts at the middle of the part of its face over the table. For a tilted
//!   box, the point is not defined.

use std::f64::consts::FRAC_1_SQRT_2;

use glam::DVec3;
use palpus::algebra::Pose;

use crate::catalogue::trial::BOX;
use crate::shape::{GROOVE_DEPTH, PEN_TIP};
use crate::{Scene, catalogue};

/// A true contact, in the environment's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueContact {
    /// Point through which the contact's force acts, if it is defined.
    pub point: Option<DVec3>,
    /// Unit vector from the environment into the probe.
    pub normal: DVec3,
    /// Distance, m; negative where the bodies overlap.
    pub separation: f64,
}

/// The true contacts of one scene.
#[derive(Clone, Debug)]
pub struct Truth {
    law: Law,
    /// Corners of the probe in its frame.
    corners: Vec<DVec3>,
}

#[derive(Clone, Copy, Debug)]
enum Law {
    PointOnSphere,
    BallInGroove,
    BoxOnTable,
}

/// Maximum number of contacts at a time.
const MOST: usize = 2;

impl Truth {
    /// Returns the true contacts of `scene`. `None` if they are not known.
    pub fn of(scene: &Scene) -> Option<Self> {
        let law = match scene.name {
            "pen-sphere" => Law::PointOnSphere,
            "v-groove" => Law::BallInGroove,
            "box-tilt" | "box-edge" | "box-rest" => Law::BoxOnTable,
            _ => return None,
        };
        Some(Self { law, corners: scene.probe.vertices.clone() })
    }

    /// Returns the contacts for the probe at `pose`, at any distance.
    pub fn contacts(&self, pose: &Pose) -> impl Iterator<Item = TrueContact> {
        let found: [Option<TrueContact>; MOST] = match self.law {
            Law::PointOnSphere => {
                let tip = pose.point(PEN_TIP);
                let separation = tip.length() - catalogue::SPHERE_RADIUS;
                [Some(TrueContact { point: Some(tip), normal: tip.normalize_or(DVec3::Z), separation }), None]
            }
            Law::BallInGroove => [1.0, -1.0].map(|side| {
                let normal = DVec3::new(side, 0.0, 1.0) * FRAC_1_SQRT_2;
                let bottom = DVec3::new(0.0, 0.0, -GROOVE_DEPTH);
                Some(TrueContact {
                    point: Some(pose.translation),
                    normal,
                    separation: self.lowest(pose, normal, bottom),
                })
            }),
            Law::BoxOnTable => {
                let point = self.middle_on_table(pose);
                Some(TrueContact { point, normal: DVec3::Z, separation: self.lowest(pose, DVec3::Z, DVec3::ZERO) })
                    .map_or([None; MOST], |contact| [Some(contact), None])
            }
        };
        found.into_iter().flatten()
    }

    /// Returns every contact, at any distance, that the probe at `pose` may get after a small
    /// motion. Each contact has a point. A tool on springs rests on these contacts.
    pub fn supports(&self, pose: &Pose) -> Vec<TrueContact> {
        let at = |point: DVec3| TrueContact { point: Some(point), normal: DVec3::Z, separation: point.z };
        match self.law {
            Law::PointOnSphere | Law::BallInGroove => self.contacts(pose).collect(),
            Law::BoxOnTable => {
                let corners: Vec<DVec3> = self.corners.iter().map(|&corner| pose.point(corner)).collect();
                let on_table = corners.iter().filter(|corner| corner.x <= TABLE_END).map(|&corner| at(corner));
                on_table.chain(self.over_the_end(&corners).into_iter().map(at)).collect()
            }
        }
    }

    /// Returns the points at which edges of the box cross the plane of the table's end.
    fn over_the_end(&self, corners: &[DVec3]) -> Vec<DVec3> {
        let mut crossings = Vec::new();
        for (i, (p, own)) in corners.iter().zip(&self.corners).enumerate() {
            for (q, other) in corners[..i].iter().zip(&self.corners) {
                let is_edge = (*own - *other).to_array().iter().filter(|side| side.abs() > 1e-9).count() == 1;
                if is_edge && (p.x > TABLE_END) != (q.x > TABLE_END) {
                    crossings.push(p.lerp(*q, (TABLE_END - p.x) / (q.x - p.x)));
                }
            }
        }
        crossings
    }

    /// Returns the least height of a corner above the plane through `origin`.
    fn lowest(&self, pose: &Pose, normal: DVec3, origin: DVec3) -> f64 {
        self.corners.iter().map(|&corner| normal.dot(pose.point(corner) - origin)).fold(f64::INFINITY, f64::min)
    }

    /// Returns the centre of the part of the box's face that lies on the table. `None` if the box
    /// is tilted. The box must not be rotated about the vertical.
    fn middle_on_table(&self, pose: &Pose) -> Option<DVec3> {
        if pose.vector(DVec3::Z).z < FLAT_COSINE {
            return None;
        }
        let center = pose.translation;
        let low = center.x - BOX.x / 2.0;
        let high = (center.x + BOX.x / 2.0).min(TABLE_END);
        Some(DVec3::new((low + high) / 2.0, center.y, 0.0))
    }
}

/// Half the length of the table, m.
const TABLE_END: f64 = 0.150;
/// A box that leans by more than 1e-5 rad is not flat.
const FLAT_COSINE: f64 = 1.0 - 0.5e-10;
