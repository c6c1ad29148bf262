//! Penalty force and torque \[K02 §4.3, eq. 6–9\].
//!
//! 1. The normal force of a cluster: its engagement times the stiffness, plus damping.
//! 2. The sum of the clusters' wrenches on each body, about that body's centre of mass.
//!
//! Deviations. The paper's eq. 6 has no stiffness, so its force is in metres; here the stiffness k
//! (N/m) is explicit. The paper has no damping. Here damping opposes the speed of approach at the
//! midpoint, and never exceeds the elastic force. So the total force is between 0 and 2 k w: a
//! contact never pulls, and its force does not jump when the contact begins or ends (w = 0).

use glam::DVec3;

use super::Cluster;
use crate::algebra::Wrench;

/// Parameters of a cluster's normal force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PenaltySettings {
    /// k, stiffness of a cluster, N/m.
    pub stiffness: f64,
    /// Damping of the normal motion, N·s/m; 0 for none.
    pub damping: f64,
}

/// Centres of mass of the two bodies, in b's frame: the points about which torques are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Centers {
    /// o₁ of \[K02\], for the probe.
    pub a: DVec3,
    /// o₂ of \[K02\], for the environment.
    pub b: DVec3,
}

/// The wrenches on both bodies, in b's frame, each about its body's centre of mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NetWrench {
    /// Wrench on the probe, about its centre of mass.
    pub on_a: Wrench,
    /// Wrench on the environment, about its centre of mass.
    pub on_b: Wrench,
}

/// Returns the magnitude of the cluster's normal force, N, never negative. `separating_speed` (m/s)
/// is the speed of a away from b, at the midpoint and along the normal. `share` is the cluster's
/// fraction of stiffness and damping: 1 if no other cluster pushes in a similar direction.
pub fn normal_force(cluster: &Cluster, share: f64, separating_speed: f64, settings: &PenaltySettings) -> f64 {
    let elastic = settings.stiffness * (share * cluster.engagement);
    elastic + (-settings.damping * share * separating_speed).clamp(-elastic, elastic)
}

impl NetWrench {
    /// Adds the force `force_a` that b exerts on a at `point`, and its reaction on b.
    pub fn add(&mut self, force_a: DVec3, point: DVec3, centers: &Centers) {
        let force_b = -force_a; // Eq. 7
        self.on_a = self.on_a + Wrench::of_force_at(force_a, point - centers.a); // Eq. 8
        self.on_b = self.on_b + Wrench::of_force_at(force_b, point - centers.b); // Eq. 9
    }
}

#[cfg(test)]
mod tests {
    use super::super::represent;
    use super::super::testing::{Random, contact};
    use super::*;
    use crate::algebra::{Pose, Twist};
    use crate::detect::Contact;
    use glam::DQuat;

    const SEED: u64 = 0x9E4A;
    const T: f64 = 1e-3;
    const SETTINGS: PenaltySettings = PenaltySettings { stiffness: 800.0, damping: 2.0 };

    fn alone(contact: Contact) -> Cluster {
        represent(&[contact], &[0], &[contact.normal], &[T - contact.separation], 0, T)
    }

    #[test]
    fn forces_on_both_bodies_are_opposite() {
        let mut random = Random::new(SEED);
        let centers = Centers { a: random.point(0.1), b: random.point(0.1) };
        let mut net = NetWrench::default();
        for _ in 0..50 {
            net.add(random.point(5.0), random.point(0.1), &centers);
        }
        assert_eq!(net.on_a.force, -net.on_b.force);
        // If both torques are taken about the same point, they are opposite too.
        let on_b = net.on_b.about(centers.a - centers.b);
        assert!((net.on_a.torque + on_b.torque).length() < 1e-12, "seed {SEED:#x}");
    }

    #[test]
    fn damping_never_pulls_and_starts_continuously() {
        let cluster = alone(contact((0, 0), DVec3::ZERO, DVec3::Z, 5e-4));
        let elastic = 0.4;
        for (speed, force) in [(0.0, elastic), (-0.1, 0.6), (0.1, 0.2), (-9.0, 0.8), (9.0, 0.0)] {
            assert!((normal_force(&cluster, 1.0, speed, &SETTINGS) - force).abs() < 1e-12, "at {speed} m/s");
        }
        let entering = alone(contact((0, 0), DVec3::ZERO, DVec3::Z, T * (1.0 - 1e-12)));
        assert!(normal_force(&entering, 1.0, -9.0, &SETTINGS) < 1e-11);
    }

    /// Returns the contact of a vertex of a, at `vertex` in a's frame, with b's plane z = 0.
    fn vertex_on_plane(pose_ba: &Pose, vertex: DVec3) -> Contact {
        let point = pose_ba.point(vertex);
        contact((0, 0), point - DVec3::Z * (0.5 * point.z), DVec3::Z, point.z)
    }

    #[test]
    fn the_wrench_is_the_gradient_of_the_elastic_energy() {
        let mut random = Random::new(SEED ^ 1);
        let energy = |pose: &Pose, vertex| {
            let engagement = T - vertex_on_plane(pose, vertex).separation;
            0.5 * SETTINGS.stiffness * engagement * engagement
        };
        for round in 0..50 {
            let mut pose = random.pose(0.05);
            let vertex = random.point(0.05);
            pose.translation.z -= pose.point(vertex).z + random.between(1e-4, 2e-3);
            let contact = vertex_on_plane(&pose, vertex);
            let cluster = alone(contact);
            // a's centre of mass is its origin.
            let centers = Centers { a: pose.translation, b: DVec3::ZERO };
            let mut net = NetWrench::default();
            net.add(cluster.normal * normal_force(&cluster, 1.0, 0.0, &SETTINGS), cluster.midpoint, &centers);
            let h = 1e-7;
            for axis in DVec3::AXES {
                for (turn, push) in [(DVec3::ZERO, axis), (axis, DVec3::ZERO)] {
                    let at = |s: f64| Pose {
                        rotation: DQuat::from_scaled_axis(turn * s) * pose.rotation,
                        translation: pose.translation + push * s,
                    };
                    let slope = (energy(&at(h), vertex) - energy(&at(-h), vertex)) / (2.0 * h);
                    let power = net.on_a.power(&Twist { angular: turn, linear: push });
                    assert!((power + slope).abs() < 1e-6, "seed {SEED:#x}, round {round}: {power} against {slope}");
                }
            }
        }
    }
}
