//! Contacts as a tool's implicit step sees them: linear in the velocity at the end of the step
//! (outline in `tool.rs`, 3 and 4).
//!
//! All are about one point, the tool's centre of mass. The velocity may be that of a tool over a
//! resting environment, or that of one tool relative to another.

use glam::DVec3;

use super::{Forces, Settings};
use crate::algebra::tolerance::COUPLING_SETTLED;
use crate::algebra::{SpatialMatrix, Twist, Wrench};

/// The linearised contacts of one pair of bodies.
#[derive(Clone, Debug)]
pub(super) struct Touches {
    clusters: Vec<Load>,
    pushes: Vec<Push>,
    rubs: Vec<Rub>,
}

/// Load of a cluster.
#[derive(Clone, Copy, Debug)]
struct Load {
    /// N/m.
    stiffness: f64,
    /// Normal force at the end of the step, N; 0 if the whole cluster loses contact.
    predicted: f64,
}

/// A member's linearised normal force, with its share of the cluster's stiffness according to its
/// weight. The force acts at the member's point. So a wide cluster resists turning, and loses
/// contact only where it is lifted.
#[derive(Clone, Copy, Debug)]
struct Push {
    /// From the centre of mass, m.
    offset: DVec3,
    normal: DVec3,
    /// N, now; negative beyond the skin.
    force: f64,
    /// N/m.
    stiffness: f64,
    /// Normal force at the end of the step, N; 0 if the member loses contact.
    predicted: f64,
    /// True if the force was in the system that was solved last.
    acts: bool,
    cluster: u32,
}

/// A member's friction, linearised.
#[derive(Clone, Copy, Debug)]
struct Rub {
    offset: DVec3,
    normal: DVec3,
    /// z, m.
    strain: DVec3,
    /// N/m while it sticks.
    stiffness: f64,
    /// 1/m: stiffness for each newton that presses it in the step, if it had no load; else 0.
    stiffening: f64,
    /// N: the most of its load that holds.
    most: f64,
    /// N/m: of the line from no strain to the force at the end of the step.
    secant: f64,
    /// N/m: the same in the system that was solved last.
    acting: f64,
    coefficient: f64,
    /// Which carries it.
    cluster: u32,
}

impl Touches {
    /// Memory for `capacity` contacts.
    pub(super) fn new(capacity: usize) -> Self {
        Self {
            clusters: Vec::with_capacity(capacity),
            pushes: Vec::with_capacity(capacity),
            rubs: Vec::with_capacity(capacity),
        }
    }

    /// No contact.
    pub(super) fn clear(&mut self) {
        self.clusters.clear();
        self.pushes.clear();
        self.rubs.clear();
    }

    /// Linearises `forces` about `center`, as far as that does not depend on the solution. Contacts
    /// push below a separation of the skin.
    ///
    /// A contact without load holds in the step with no more than its share of the load that is
    /// known: bodies that jam try loads on the way to the solution that are many times larger.
    pub(super) fn gather(&mut self, forces: &Forces, center: DVec3, settings: &Settings) {
        let skin = settings.skin();
        self.clear();
        for (k, (cluster, &stiffness)) in forces.clusters.iter().zip(&forces.stiffnesses).enumerate() {
            self.clusters.push(Load { stiffness, predicted: 0.0 });
            for k in cluster.members() {
                let stiffness = stiffness * forces.weights[k] / cluster.weight;
                // Negative where it does not push yet.
                let force = stiffness * (skin - forces.separations[k]);
                self.pushes.push(Push {
                    offset: forces.places[k] - center,
                    normal: cluster.normal,
                    force,
                    stiffness,
                    predicted: force,
                    acts: false,
                    cluster: self.clusters.len() as u32 - 1,
                });
            }
            let Some(grips) = forces.grips.get(cluster.members()) else { continue };
            for grip in grips.iter().filter(|grip| grip.stiffening > 0.0) {
                let (stiffening, most) = if grip.stiffness > 0.0 {
                    (0.0, f64::INFINITY)
                } else {
                    (grip.stiffening, forces.most_load * (stiffness / settings.stiffness))
                };
                self.rubs.push(Rub {
                    offset: grip.point - center,
                    normal: cluster.normal,
                    strain: grip.strain,
                    stiffness: grip.stiffness,
                    stiffening,
                    most,
                    secant: grip.stiffness,
                    acting: 0.0,
                    coefficient: grip.coefficient,
                    cluster: k as u32,
                });
            }
        }
    }

    /// Adds what presses and holds to a step of `h` seconds; `lag` (s) is the contacts' damping
    /// over their stiffness.
    pub(super) fn add_to(&self, system: &mut SpatialMatrix, load: &mut Wrench, h: f64, lag: f64) {
        for push in self.pushes.iter().filter(|push| push.predicted > 0.0) {
            system.add_along(push.normal, push.offset, h * push.stiffness * (h + lag));
            *load = *load + Wrench::of_force_at(push.normal * (push.force * h), push.offset);
        }
        for rub in self.rubs.iter().filter(|rub| rub.secant > 0.0) {
            system.add_at(rub.offset, h * h * rub.secant);
            system.add_along(rub.normal, rub.offset, -h * h * rub.secant);
            *load = *load + Wrench::of_force_at(rub.strain * (-rub.secant * h), rub.offset);
        }
    }

    /// Normals of the contacts that press at the end of the step, and their places relative to the
    /// centre of mass.
    pub(super) fn pressing(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        self.pushes.iter().filter(|push| push.predicted > 0.0).map(|push| (push.normal, push.offset))
    }

    /// Predicts normal and friction forces at the end of the step if the tool moves with `twist`;
    /// true if the set of active ones has changed.
    pub(super) fn revise(&mut self, twist: &Twist, h: f64, lag: f64) -> bool {
        let mut news = false;
        self.clusters.iter_mut().for_each(|cluster| cluster.predicted = 0.0);
        for push in &mut self.pushes {
            let speed = push.normal.dot(twist.at(push.offset));
            let predicted = (push.force - push.stiffness * (h + lag) * speed).max(0.0);
            push.acts = push.predicted > 0.0;
            news |= (predicted > 0.0) != push.acts;
            push.predicted = predicted;
            self.clusters[push.cluster as usize].predicted += predicted;
        }
        for rub in &mut self.rubs {
            let load = self.clusters[rub.cluster as usize].predicted.min(rub.most);
            if rub.stiffening > 0.0 {
                rub.stiffness = rub.stiffening * load;
                if rub.stiffness.max(rub.secant) <= 0.0 {
                    rub.acting = 0.0;
                    continue;
                }
            }
            let strain = rub.strain + twist.at(rub.offset).reject_from_normalized(rub.normal) * h;
            let most = rub.coefficient * load;
            let length = strain.length();
            let secant = if rub.stiffness * length > most { most / length } else { rub.stiffness };
            news |= (secant - rub.secant).abs() * length > COUPLING_SETTLED * most;
            (rub.acting, rub.secant) = (rub.secant, secant);
        }
        news
    }

    /// N·s and N·m·s about the tool's centre of mass: what contacts gave the tool in the step of
    /// `h` seconds whose solution was `twist`, as the system had it that was solved.
    pub(super) fn impulse(&self, twist: &Twist, h: f64, lag: f64) -> Wrench {
        let pushes = self.pushes.iter().filter(|push| push.acts).map(|push| {
            let speed = push.normal.dot(twist.at(push.offset));
            Wrench::of_force_at(push.normal * (h * (push.force - push.stiffness * (h + lag) * speed)), push.offset)
        });
        let rubs = self.rubs.iter().filter(|rub| rub.acting > 0.0).map(|rub| {
            let strain = rub.strain + twist.at(rub.offset).reject_from_normalized(rub.normal) * h;
            Wrench::of_force_at(strain * (-rub.acting * h), rub.offset)
        });
        pushes.chain(rubs).fold(Wrench::ZERO, |sum, given| sum + given)
    }

    /// The load that the hardest pressed contact would bear alone at the end of the step, N, at
    /// `stiffness` (N/m).
    pub(super) fn pressed(&self, stiffness: f64) -> f64 {
        let alone =
            |load: &Load| if load.stiffness > 0.0 { load.predicted * (stiffness / load.stiffness) } else { 0.0 };
        self.clusters.iter().map(alone).fold(0.0, f64::max)
    }

    /// Number of clusters that lose contact within the step.
    pub(super) fn released(&self) -> u32 {
        self.clusters.iter().filter(|load| load.predicted <= 0.0).count() as u32
    }
}
