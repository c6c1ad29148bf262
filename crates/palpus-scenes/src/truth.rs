//! True contacts in scenes where they are known in closed form, as reference for felt forces.
//!
//! * `pen-sphere`: the pen's point against the ideal sphere that the mesh stands for.
//! * `v-groove`: the ball's own corners against the two walls, which are planes; the forces go
//!   through its centre, as the ball is meant to be round.
//! * `box-tilt`, `box-edge`, `box-rest`: the lowest corner of the box against the table's top.
//!   The force of a box on its face acts at the middle of its part over the table; for a tilted box
//!   no such point is agreed on.

use std::f64::consts::FRAC_1_SQRT_2;

use glam::DVec3;
use palpus::algebra::Pose;

use crate::catalogue::trial::BOX;
use crate::shape::{GROOVE_DEPTH, PEN_TIP};
use crate::{Scene, catalogue};

/// A true contact, in the environment's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueContact {
    /// Point through which its force acts, if it is defined.
    pub point: Option<DVec3>,
    /// Unit, from the environment into the probe.
    pub normal: DVec3,
    /// m, minus the depth where they overlap.
    pub separation: f64,
}

/// The truth of one scene.
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

/// The most contacts that a truth has at a time.
const MOST: usize = 2;

impl Truth {
    /// The truth of `scene`, if it has one.
    pub fn of(scene: &Scene) -> Option<Self> {
        let law = match scene.name {
            "pen-sphere" => Law::PointOnSphere,
            "v-groove" => Law::BallInGroove,
            "box-tilt" | "box-edge" | "box-rest" => Law::BoxOnTable,
            _ => return None,
        };
        Some(Self { law, corners: scene.probe.vertices.clone() })
    }

    /// The contacts with the probe placed by `pose`, near or far.
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

    /// Every contact that the probe placed by `pose` may come to have while it yields a little,
    /// near or far, each with its point: what a tool on springs rests on.
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

    /// Points at which edges of the box cross the plane of the table's end.
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

    /// The least height of a corner over the plane through `origin`.
    fn lowest(&self, pose: &Pose, normal: DVec3, origin: DVec3) -> f64 {
        self.corners.iter().map(|&corner| normal.dot(pose.point(corner) - origin)).fold(f64::INFINITY, f64::min)
    }

    /// The centre of the part of the box's face that lies on the table, for a flat box that is not
    /// turned about the vertical.
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

/// Half the table's length, m.
const TABLE_END: f64 = 0.150;
/// A box that leans by more than a hundred thousandth of a radian is not flat.
const FLAT_COSINE: f64 = 1.0 - 0.5e-10;
