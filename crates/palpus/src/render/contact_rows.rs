//! Contacts in the implicit step, linear in the velocity at the end of the step (see `tool.rs`,
//! steps 3 and 4).
//!
//! Friction is linearised as by Newton's method \[Wriggers 2006\]. While a contact slides, its
//! force has the size of the limit and opposes the strain. A motion across the strain turns the
//! force, and a motion along it changes nothing. A spring in all directions, with the ratio of
//! force and strain as its stiffness, would also give this force, but the error would only halve
//! in each round.
//!
//! All vectors are relative to the tool's centre of mass. The velocity is relative to the other
//! body, which may move.

use glam::DVec3;

use super::{Forces, Settings};
use crate::algebra::tolerance::COUPLING_SETTLED;
use crate::algebra::{SpatialMatrix, Twist, Wrench};

/// The linearised contacts of one pair of bodies.
#[derive(Clone, Debug)]
pub(super) struct ContactRows {
    clusters: Vec<Load>,
    normal_rows: Vec<NormalRow>,
    friction_rows: Vec<FrictionRow>,
}

/// Load of a cluster.
#[derive(Clone, Copy, Debug)]
struct Load {
    /// Stiffness, N/m.
    stiffness: f64,
    /// Normal force at the end of the step, N; 0 if the whole cluster loses contact.
    predicted: f64,
}

/// A member's linearised normal force. The member has a part of the cluster's stiffness in
/// proportion to its weight. The force acts at the member's point, so a wide cluster resists
/// rotation, and loses contact only where it is lifted.
#[derive(Clone, Copy, Debug)]
struct NormalRow {
    /// Vector from the centre of mass, m.
    offset: DVec3,
    normal: DVec3,
    /// Normal force at the beginning of the step, N; negative beyond the contact offset.
    force: f64,
    /// Stiffness, N/m.
    stiffness: f64,
    /// Normal force at the end of the step, N; 0 if the member loses contact.
    predicted: f64,
    /// True if the last solved system contained this force.
    acts: bool,
    cluster: u32,
}

/// A member's linearised friction.
#[derive(Clone, Copy, Debug)]
struct FrictionRow {
    offset: DVec3,
    normal: DVec3,
    /// z, the strain, m.
    strain: DVec3,
    /// Tangential stiffness while the contact sticks, N/m.
    stiffness: f64,
    /// Stiffness for each newton of load at the end of the step, 1/m; 0 if the contact already had
    /// a load.
    stiffening: f64,
    /// Largest load that counts for friction, N.
    most: f64,
    coefficient: f64,
    /// The predicted friction.
    predicted: Friction,
    /// The friction in the last solved system.
    acting: Friction,
    /// Index of the cluster that has this member.
    cluster: u32,
}

/// A friction force, linear in the strain at the end of the step.
#[derive(Clone, Copy, Debug)]
enum Friction {
    /// The contact has no load.
    None,
    /// The contact sticks with this stiffness, N/m.
    Sticks(f64),
    /// The contact slides.
    Slides {
        /// The force without strain along `across`, N.
        force: DVec3,
        /// Direction in the tangent plane, perpendicular to the force.
        across: DVec3,
        /// Stiffness along `across`, N/m.
        stiffness: f64,
    },
}

impl Friction {
    /// Returns the force on the tool with this `strain` (m) at the end of the step, N.
    fn force(&self, strain: DVec3) -> DVec3 {
        match *self {
            Self::None => DVec3::ZERO,
            Self::Sticks(stiffness) => strain * -stiffness,
            Self::Slides { force, across, stiffness } => force - across * (stiffness * across.dot(strain)),
        }
    }
}

impl FrictionRow {
    /// Returns the strain at the end of a step of `h` seconds with `twist`, m.
    fn strain_after(&self, twist: &Twist, h: f64) -> DVec3 {
        self.strain + twist.at(self.offset).reject_from_normalized(self.normal) * h
    }

    /// Returns the impulse of `friction` on the tool in a step of `h` seconds with `twist`.
    fn impulse(&self, friction: &Friction, twist: &Twist, h: f64) -> Wrench {
        Wrench::of_force_at(friction.force(self.strain_after(twist, h)) * h, self.offset)
    }
}

impl ContactRows {
    /// Allocates memory for `capacity` contacts.
    pub(super) fn new(capacity: usize) -> Self {
        Self {
            clusters: Vec::with_capacity(capacity),
            normal_rows: Vec::with_capacity(capacity),
            friction_rows: Vec::with_capacity(capacity),
        }
    }

    /// Removes all contacts.
    pub(super) fn clear(&mut self) {
        self.clusters.clear();
        self.normal_rows.clear();
        self.friction_rows.clear();
    }

    /// Linearises `forces` about `center`, the centre of mass.
    ///
    /// If a contact has no load yet, its friction is limited by its share of `most_load`. Without
    /// this limit, bodies that jam would reach loads that are many times larger during the rounds.
    pub(super) fn gather(&mut self, forces: &Forces, center: DVec3, settings: &Settings) {
        let contact_offset = settings.contact_offset();
        self.clear();
        for (k, (cluster, &stiffness)) in forces.clusters.iter().zip(&forces.stiffnesses).enumerate() {
            self.clusters.push(Load { stiffness, predicted: 0.0 });
            for k in cluster.members() {
                let stiffness = stiffness * forces.weights[k] / cluster.weight;
                // The force is negative if the contact does not push yet.
                let force = stiffness * (contact_offset - forces.separations[k]);
                self.normal_rows.push(NormalRow {
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
                self.friction_rows.push(FrictionRow {
                    offset: grip.point - center,
                    normal: cluster.normal,
                    strain: grip.strain,
                    stiffness: grip.stiffness,
                    stiffening,
                    most,
                    coefficient: grip.coefficient,
                    predicted: if grip.stiffness > 0.0 { Friction::Sticks(grip.stiffness) } else { Friction::None },
                    acting: Friction::None,
                    cluster: k as u32,
                });
            }
        }
    }

    /// Adds pressing and friction forces to the system of a step of `h` seconds. `lag` (s) is the
    /// contacts' damping over their stiffness.
    pub(super) fn add_to(&self, system: &mut SpatialMatrix, load: &mut Wrench, h: f64, lag: f64) {
        for row in self.normal_rows.iter().filter(|row| row.predicted > 0.0) {
            system.add_along(row.normal, row.offset, h * row.stiffness * (h + lag));
            *load = *load + Wrench::of_force_at(row.normal * (row.force * h), row.offset);
        }
        for row in &self.friction_rows {
            match row.predicted {
                Friction::None => continue,
                Friction::Sticks(stiffness) => {
                    system.add_at(row.offset, h * h * stiffness);
                    system.add_along(row.normal, row.offset, -h * h * stiffness);
                }
                Friction::Slides { across, stiffness, .. } => {
                    system.add_along(across, row.offset, h * h * stiffness);
                }
            }
            *load = *load + Wrench::of_force_at(row.predicted.force(row.strain) * h, row.offset);
        }
    }

    /// Returns the normals of the contacts that press at the end of the step, and their points
    /// relative to the centre of mass.
    pub(super) fn pressing(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        self.normal_rows.iter().filter(|row| row.predicted > 0.0).map(|row| (row.normal, row.offset))
    }

    /// Predicts normal and friction forces at the end of the step if the tool moves with `twist`.
    /// Returns true if the set of pressing contacts or a friction force has changed.
    pub(super) fn revise(&mut self, twist: &Twist, h: f64, lag: f64) -> bool {
        let mut news = false;
        self.clusters.iter_mut().for_each(|cluster| cluster.predicted = 0.0);
        for row in &mut self.normal_rows {
            let speed = row.normal.dot(twist.at(row.offset));
            let predicted = (row.force - row.stiffness * (h + lag) * speed).max(0.0);
            row.acts = row.predicted > 0.0;
            news |= (predicted > 0.0) != row.acts;
            row.predicted = predicted;
            self.clusters[row.cluster as usize].predicted += predicted;
        }
        for row in &mut self.friction_rows {
            let load = self.clusters[row.cluster as usize].predicted.min(row.most);
            if row.stiffening > 0.0 {
                row.stiffness = row.stiffening * load;
            }
            let strain = row.strain_after(twist, h);
            let (limit, length) = (row.coefficient * load, strain.length());
            let friction = if row.stiffness <= 0.0 || limit <= 0.0 {
                Friction::None
            } else if row.stiffness * length > limit {
                let along = strain / length;
                Friction::Slides { force: along * -limit, across: row.normal.cross(along), stiffness: limit / length }
            } else {
                Friction::Sticks(row.stiffness)
            };
            news |= row.predicted.force(strain).distance(friction.force(strain)) > COUPLING_SETTLED * limit;
            (row.acting, row.predicted) = (row.predicted, friction);
        }
        news
    }

    /// Returns the impulse of the contacts on the tool (N·s, and N·m·s about its centre of mass) in
    /// a step of `h` seconds. The forces are those of the last solved system, and `twist` is its
    /// solution.
    pub(super) fn impulse(&self, twist: &Twist, h: f64, lag: f64) -> Wrench {
        let normal_forces = self.normal_rows.iter().filter(|row| row.acts).map(|row| {
            let speed = row.normal.dot(twist.at(row.offset));
            Wrench::of_force_at(row.normal * (h * (row.force - row.stiffness * (h + lag) * speed)), row.offset)
        });
        let friction_forces = self.friction_rows.iter().map(|row| row.impulse(&row.acting, twist, h));
        normal_forces.chain(friction_forces).fold(Wrench::ZERO, |sum, given| sum + given)
    }

    /// Returns the impulse of the contacts on the tool, as in [`Self::impulse`], with the forces
    /// that [`Self::revise`] predicted for this `twist`.
    pub(super) fn predicted_impulse(&self, twist: &Twist, h: f64) -> Wrench {
        let normal_forces = self.normal_rows.iter().filter(|row| row.predicted > 0.0);
        let pressing = normal_forces.map(|row| Wrench::of_force_at(row.normal * (h * row.predicted), row.offset));
        let holding = self.friction_rows.iter().map(|row| row.impulse(&row.predicted, twist, h));
        pressing.chain(holding).fold(Wrench::ZERO, |sum, given| sum + given)
    }

    /// Returns the largest load that a contact with `stiffness` (N/m) would have alone at the
    /// end of the step, before load sharing, N.
    pub(super) fn pressed(&self, stiffness: f64) -> f64 {
        let alone =
            |load: &Load| if load.stiffness > 0.0 { load.predicted * (stiffness / load.stiffness) } else { 0.0 };
        self.clusters.iter().map(alone).fold(0.0, f64::max)
    }

    /// Returns the number of clusters that lose contact within the step.
    pub(super) fn released(&self) -> u32 {
        self.clusters.iter().filter(|load| load.predicted <= 0.0).count() as u32
    }
}
