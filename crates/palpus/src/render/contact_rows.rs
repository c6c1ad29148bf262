//! Contacts in the implicit step, linear in the velocity at the end of the step (see `tool.rs`,
//! steps 3 and 4).
//!
//! The force of a pressing contact can act along a shaded normal, but its gap changes along its own
//! normal. So the matrix is not symmetric. With one direction for both, the loads of the step would
//! differ from those of the next tick by several per cent where a tool slides over facets, and load
//! and friction would change in turns. The members of a cluster of several contacts have the
//! cluster's normal in both places: as one contact, they have one gap.
//!
//! Friction is linearised as by Newton's method \[Wriggers 2006\]. While a contact slides, its
//! force has the size of the limit and opposes the strain. A motion across the strain turns the
//! force, and a motion along it changes nothing. The limit changes with the load. A spring in all
//! directions, with the ratio of force and strain as its stiffness, would also give this force, but
//! the error would only halve in each round.
//!
//! All vectors are relative to the tool's centre of mass. The velocity is relative to the other
//! body, which may move.

use glam::DVec3;

use super::{Forces, Settings};
use crate::algebra::tolerance::COUPLING_SETTLED;
use crate::algebra::{SpatialMatrix, Twist, Wrench};
use crate::detect::Contact;

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
    /// The power of this wrench in a twist is the decrease of the predicted force, N.
    decrease: Wrench,
}

/// A member's linearised normal force. The member has a part of the cluster's stiffness in
/// proportion to its weight. The force acts at the member's point, so a wide cluster resists
/// rotation, and loses contact only where it is lifted.
#[derive(Clone, Copy, Debug)]
struct NormalRow {
    /// Vector from the centre of mass, m.
    offset: DVec3,
    /// Direction of the force.
    normal: DVec3,
    /// Direction in which the gap widens.
    apart: DVec3,
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

impl NormalRow {
    /// Returns the wrench whose power in a twist is the decrease of the normal force in a step of
    /// `h` seconds, N. The damper of `lag` seconds (damping over stiffness) acts along the force.
    fn decrease(&self, h: f64, lag: f64) -> Wrench {
        Wrench::of_force_at((self.apart * h + self.normal * lag) * self.stiffness, self.offset)
    }
}

/// A member's linearised friction.
#[derive(Clone, Copy, Debug)]
struct FrictionRow {
    offset: DVec3,
    normal: DVec3,
    /// z, the strain, m.
    strain: DVec3,
    /// Tangential stiffness at the beginning of the step, N/m; 0 without a load.
    least_stiffness: f64,
    /// Stiffness for each newton of load at the end of the step, 1/m.
    stiffening: f64,
    /// Largest load that counts for the stiffness, N. It also limits the friction of a contact that
    /// had no load.
    most: f64,
    coefficient: f64,
    /// The predicted friction.
    predicted: Friction,
    /// The friction in the last solved system.
    acting: Friction,
    /// Index of the cluster that has this member.
    cluster: u32,
}

/// A friction force, linear in the twist of the step.
#[derive(Clone, Copy, Debug)]
enum Friction {
    /// The contact has no load.
    None,
    /// The contact sticks with this stiffness, N/m.
    Sticks(f64),
    /// The contact slides.
    Slides {
        /// Direction of the strain.
        along: DVec3,
        /// Direction in the tangent plane, perpendicular to `along`.
        across: DVec3,
        /// Stiffness along `across`, N/m.
        stiffness: f64,
        /// Size of the force without a twist, N.
        limit: f64,
        /// The power of this wrench in a twist is the decrease of the limit, N.
        decrease: Wrench,
    },
}

impl Friction {
    /// Returns the force on the tool in a step with `twist` and this `strain` (m) at its end, N.
    fn force(&self, strain: DVec3, twist: &Twist) -> DVec3 {
        match *self {
            Self::None => DVec3::ZERO,
            Self::Sticks(stiffness) => strain * -stiffness,
            Self::Slides { along, across, stiffness, limit, decrease } => {
                along * (decrease.power(twist) - limit) - across * (stiffness * across.dot(strain))
            }
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
        Wrench::of_force_at(friction.force(self.strain_after(twist, h), twist) * h, self.offset)
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

    /// Linearises the `forces` of `contacts` about `center`, the centre of mass.
    ///
    /// A contact can take over the load of another one within a step, for example where a tool
    /// slides over an edge. So its friction stiffens with its load, up to its share of `most_load`.
    /// If a contact has no load yet, this share also limits its friction. Without this limit,
    /// bodies that jam would reach loads that are many times larger during the rounds.
    pub(super) fn gather(&mut self, contacts: &[Contact], forces: &Forces, center: DVec3, settings: &Settings) {
        let contact_offset = settings.contact_offset();
        self.clear();
        for (k, (cluster, &stiffness)) in forces.clusters.iter().zip(&forces.stiffnesses).enumerate() {
            self.clusters.push(Load { stiffness, predicted: 0.0, decrease: Wrench::ZERO });
            // A contact whose tilt share is 0 has no stiffness.
            if stiffness <= 0.0 {
                continue;
            }
            let is_alone = cluster.members().len() == 1;
            for k in cluster.members() {
                let stiffness = stiffness * forces.weights[k] / cluster.weight;
                // The force is negative if the contact does not push yet.
                let force = stiffness * (contact_offset - forces.separations[k]);
                let own = contacts[forces.members[k] as usize].normal;
                self.normal_rows.push(NormalRow {
                    offset: forces.places[k] - center,
                    normal: cluster.normal,
                    apart: if is_alone { own } else { cluster.normal },
                    force,
                    stiffness,
                    predicted: force,
                    acts: false,
                    cluster: self.clusters.len() as u32 - 1,
                });
            }
            let Some(grips) = forces.grips.get(cluster.members()) else { continue };
            for grip in grips.iter().filter(|grip| grip.stiffening > 0.0) {
                self.friction_rows.push(FrictionRow {
                    offset: grip.point - center,
                    normal: cluster.normal,
                    strain: grip.strain,
                    least_stiffness: grip.stiffness,
                    stiffening: grip.stiffening,
                    most: forces.most_load * (stiffness / settings.stiffness),
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
            system.add_product(&Wrench::of_force_at(row.normal * h, row.offset), &row.decrease(h, lag));
            *load = *load + Wrench::of_force_at(row.normal * (row.force * h), row.offset);
        }
        for row in &self.friction_rows {
            match row.predicted {
                Friction::None => continue,
                Friction::Sticks(stiffness) => {
                    system.add_at(row.offset, h * h * stiffness);
                    system.add_along(row.normal, row.offset, -h * h * stiffness);
                }
                Friction::Slides { along, across, stiffness, decrease, .. } => {
                    system.add_along(across, row.offset, h * h * stiffness);
                    system.add_product(&Wrench::of_force_at(along * -h, row.offset), &decrease);
                }
            }
            let unmoved = row.predicted.force(row.strain, &Twist::default());
            *load = *load + Wrench::of_force_at(unmoved * h, row.offset);
        }
    }

    /// Returns the normals of the contacts that press at the end of the step, and their points
    /// relative to the centre of mass.
    pub(super) fn pressing(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        self.normal_rows.iter().filter(|row| row.predicted > 0.0).map(|row| (row.normal, row.offset))
    }

    /// Predicts normal and friction forces at the end of the step if the tool moves with `twist`.
    /// Returns true if the set of pressing contacts or a friction force has changed. If `follows`,
    /// the system of the next round contains the change of friction limits with the loads.
    pub(super) fn revise(&mut self, twist: &Twist, h: f64, lag: f64, follows: bool) -> bool {
        let mut news = false;
        self.clusters.iter_mut().for_each(|load| (load.predicted, load.decrease) = (0.0, Wrench::ZERO));
        for row in &mut self.normal_rows {
            let decrease = row.decrease(h, lag);
            let predicted = (row.force - decrease.power(twist)).max(0.0);
            row.acts = row.predicted > 0.0;
            news |= (predicted > 0.0) != row.acts;
            row.predicted = predicted;
            if predicted > 0.0 {
                let load = &mut self.clusters[row.cluster as usize];
                load.predicted += predicted;
                load.decrease = load.decrease + decrease;
            }
        }
        for row in &mut self.friction_rows {
            let Load { predicted, decrease, .. } = self.clusters[row.cluster as usize];
            let stiffness = row.least_stiffness.max(row.stiffening * predicted.min(row.most));
            let is_limited = row.least_stiffness <= 0.0 && predicted > row.most;
            let load = if is_limited { row.most } else { predicted };
            let strain = row.strain_after(twist, h);
            let (limit, length) = (row.coefficient * load, strain.length());
            let friction = if stiffness <= 0.0 || limit <= 0.0 {
                Friction::None
            } else if stiffness * length > limit {
                let along = strain / length;
                let decrease = if follows && !is_limited { decrease * row.coefficient } else { Wrench::ZERO };
                Friction::Slides {
                    along,
                    across: row.normal.cross(along),
                    stiffness: limit / length,
                    limit: limit + decrease.power(twist),
                    decrease,
                }
            } else {
                Friction::Sticks(stiffness)
            };
            news |=
                row.predicted.force(strain, twist).distance(friction.force(strain, twist)) > COUPLING_SETTLED * limit;
            (row.acting, row.predicted) = (row.predicted, friction);
        }
        news
    }

    /// Returns the impulse of the contacts on the tool (N·s, and N·m·s about its centre of mass) in
    /// a step of `h` seconds. The forces are those of the last solved system, and `twist` is its
    /// solution.
    pub(super) fn impulse(&self, twist: &Twist, h: f64, lag: f64) -> Wrench {
        let normal_forces = self.normal_rows.iter().filter(|row| row.acts);
        let pressing = normal_forces.map(|row| {
            let force = row.force - row.decrease(h, lag).power(twist);
            Wrench::of_force_at(row.normal * (h * force), row.offset)
        });
        let friction_forces = self.friction_rows.iter().map(|row| row.impulse(&row.acting, twist, h));
        pressing.chain(friction_forces).fold(Wrench::ZERO, |sum, given| sum + given)
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
