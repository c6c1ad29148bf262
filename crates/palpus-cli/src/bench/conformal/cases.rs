//! Pairs of close-fitting parts and their motions.

use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;
use palpus::body::{Body, BodySettings};
use palpus::render::contact_tolerance;
use palpus_scenes::shape;

use crate::bench::scale::motion::{PERIOD, nearest_query};
use crate::bench::scale::pairs::{PAIRS, posed};
use crate::bench::table::find;
use crate::bodies;

/// A case before its bodies are prepared.
pub(super) struct Plan {
    pub(super) name: &'static str,
    kind: Kind,
    tolerance: Tolerance,
    /// True: behind a coupling with limited work. False: direct rendering without a limit.
    coupled: bool,
}

enum Kind {
    /// The M16 nut turns on its bolt. Along the axis, the nut overlaps the bolt by this share of
    /// the pitch, first upward, then downward.
    Pressed(f64),
    /// A pair of `palpus bench scale`, with the same motion.
    Scale(&'static str),
    /// A round peg that is pressed this deep (m) into the wall of its hole. The peg turns and moves
    /// round the hole.
    Peg(f64),
    /// A box that is pressed this deep (m) into a table and slides about.
    Flush(f64),
}

enum Tolerance {
    /// Tolerance, m.
    Given(f64),
    /// The tolerance of a scene file that has the first pose and states no tolerance.
    Chosen,
}

const fn direct(name: &'static str, kind: Kind, tolerance: f64) -> Plan {
    Plan { name, kind, tolerance: Tolerance::Given(tolerance), coupled: false }
}

const fn chosen(name: &'static str, kind: Kind, coupled: bool) -> Plan {
    Plan { name, kind, tolerance: Tolerance::Chosen, coupled }
}

/// All cases.
pub(super) const CASES: [Plan; 17] = [
    direct("nut-0.2%", Kind::Pressed(0.002), 5e-6),
    direct("nut-1%", Kind::Pressed(0.01), 5e-6),
    direct("nut-5%", Kind::Pressed(0.05), 5e-6),
    chosen("nut-0.2%-chosen", Kind::Pressed(0.002), false),
    chosen("nut-1%-chosen", Kind::Pressed(0.01), false),
    chosen("nut-5%-chosen", Kind::Pressed(0.05), false),
    chosen("nut-1%-coupled", Kind::Pressed(0.01), true),
    direct("nut-bolt", Kind::Scale("nut-bolt"), 5e-6),
    chosen("nut-bolt-coupled", Kind::Scale("nut-bolt"), true),
    direct("gears", Kind::Scale("gears"), 1e-4),
    chosen("gears-coupled", Kind::Scale("gears"), true),
    direct("drill-blade", Kind::Scale("drill-blade"), 5e-4),
    direct("lucy-embryo", Kind::Scale("lucy-embryo"), 3e-4),
    direct("armadillo-intestine", Kind::Scale("armadillo-intestine"), 2e-3),
    direct("spoon-cup", Kind::Scale("spoon-cup"), 1e-3),
    direct("peg-hole", Kind::Peg(2e-5), 5e-5),
    direct("flush", Kind::Flush(2e-5), 1e-4),
];

pub(super) fn names() -> Vec<&'static str> {
    CASES.iter().map(|case| case.name).collect()
}

/// Two bodies and their motion.
pub(super) struct Case {
    pub(super) name: &'static str,
    pub(super) a: Arc<Body>,
    pub(super) b: Arc<Body>,
    /// Poses of a in b's frame. The engine drops all contacts before each stretch.
    pub(super) stretches: Vec<Vec<Pose>>,
    /// Contact tolerance, m.
    pub(super) tolerance: f64,
    pub(super) coupled: bool,
    pub(super) analytic: Option<Analytic>,
}

/// A known property of the force on a.
pub(super) enum Analytic {
    /// The force points from the origin of a's frame towards b's axis, z.
    ToAxis,
    /// The force points up (+z) and equals the force of one contact of this depth (m).
    Up(f64),
}

impl Case {
    /// Prepares a case; `None` if its meshes are not in `models`.
    pub(super) fn of(plan: &Plan, models: Option<&Path>, ticks: usize) -> anyhow::Result<Option<Self>> {
        let (a, b, stretches, analytic) = match plan.kind {
            Kind::Scale(name) => {
                let Some(pair) = PAIRS.iter().find(|pair| pair.name == name) else { return Ok(None) };
                let Some(files) = models.and_then(|models| pair.files(models)) else { return Ok(None) };
                let (bodies, stretches) = posed(pair, &files, ticks)?;
                (bodies.a, bodies.b, stretches, None)
            }
            Kind::Pressed(share) => {
                let found = |name| models.and_then(|models| find(models, name));
                let (Some(nut), Some(bolt)) = (found("nut_m16_loose.obj"), found("bolt_m16_loose.obj")) else {
                    return Ok(None);
                };
                let prepare = |file: &Path| anyhow::Ok(Arc::new(bodies::prepare_file(file, &haptic())?.body));
                let (a, b) = (prepare(&nut)?, prepare(&bolt)?);
                let stretches = pressed(&a, &b, share * PITCH, ticks / 2);
                (a, b, stretches, None)
            }
            Kind::Peg(depth) => {
                let prepare = |name, soup| anyhow::Ok(Arc::new(bodies::prepare_soup(name, &soup, &haptic())?.body));
                let (a, b) = (
                    prepare("the peg", shape::disc(shape::PEG_RADIUS, 0.02, SIDES))?,
                    prepare("the hole", shape::hole_block(shape::DEFAULT_CLEARANCE))?,
                );
                let away = 0.5 * shape::DEFAULT_CLEARANCE + depth;
                let pose = |k: usize| {
                    let phase = TAU * k as f64 / PERIOD;
                    let side = 0.3 * phase.sin();
                    let turn = DQuat::from_rotation_z(0.2 * (0.7 * phase).sin());
                    Pose::new(turn, DVec3::new(away * side.cos(), away * side.sin(), -0.0125))
                };
                (a, b, vec![(0..=ticks).map(pose).collect()], Some(Analytic::ToAxis))
            }
            Kind::Flush(depth) => {
                let prepare = |name, soup| anyhow::Ok(Arc::new(bodies::prepare_soup(name, &soup, &haptic())?.body));
                let (a, b) =
                    (prepare("the box", shape::cuboid(DVec3::splat(0.04)))?, prepare("the table", shape::table())?);
                let pose = |k: usize| {
                    let phase = TAU * k as f64 / PERIOD;
                    let turn = DQuat::from_rotation_z(0.2 * phase.sin());
                    Pose::new(turn, DVec3::new(0.01 * phase.cos(), 0.01 * phase.sin(), 0.02 - depth))
                };
                (a, b, vec![(0..=ticks).map(pose).collect()], Some(Analytic::Up(depth)))
            }
        };
        let tolerance = match plan.tolerance {
            Tolerance::Given(tolerance) => tolerance,
            Tolerance::Chosen => contact_tolerance(&a, &b, &stretches[0][0]),
        };
        Ok(Some(Self { name: plan.name, a, b, stretches, tolerance, coupled: plan.coupled, analytic }))
    }
}

/// Pitch of an M16 thread, m.
const PITCH: f64 = 0.002;
/// Number of sides of the peg and of the hole.
const SIDES: usize = 32;

fn haptic() -> BodySettings {
    BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() }
}

/// Returns the poses of the nut at `depth` (m) beyond first touch along the axis, upward and
/// downward. The nut turns to and fro on its thread.
fn pressed(nut: &Arc<Body>, bolt: &Arc<Body>, depth: f64, ticks: usize) -> Vec<Vec<Pose>> {
    /// Height of the nut in the middle of its play, m.
    const FREE: f64 = 0.002_098 - 0.000_03;
    /// Largest rotation to each side, rad.
    const SWING: f64 = 0.05;
    let mut query = nearest_query(nut, bolt);
    let stretch = |way: f64| {
        let mut height = FREE;
        // Conservative advancement: a step of the current distance cannot cause overlap.
        for _ in 0..ADVANCES {
            let gap = query.nearest(&Pose::from_translation(DVec3::Z * height)).map_or(0.0, |near| near.separation);
            if gap <= TOUCHING {
                break;
            }
            height += way * gap;
        }
        let pose = |k: usize| {
            let angle = SWING * (TAU * k as f64 / PERIOD).sin();
            let along = height + way * depth + PITCH * angle / TAU;
            Pose::new(DQuat::from_rotation_z(angle), DVec3::Z * along)
        };
        (0..=ticks).map(pose).collect()
    };
    [1.0, -1.0].map(stretch).into()
}

const ADVANCES: usize = 200;
/// Gap that counts as touching, m.
const TOUCHING: f64 = 1e-8;
