//! Makes the drawable scene of a stage for windows, pictures and pages: its bodies, contacts and
//! forces.

use std::sync::Arc;

use palpus::algebra::{Pose, both};
use palpus::body::Body;
use palpus_io::Threads;
use palpus_io::scene::ObjectMotion;
use palpus_window::{BodyPart, Look, Moment, Scene, ShownBody, Solid, Theme, Unit};

use crate::stage::Stage;

/// The longest arrow stands for at least this force, N, so that small forces have short arrows.
pub(crate) const LEAST_FORCE_SCALE: f64 = 0.1;

/// The bodies of a stage, prepared once for any number of scenes.
pub(crate) struct Seen<'a> {
    stage: &'a Stage,
    probe: Arc<Solid>,
    environment: Arc<Solid>,
    /// The other tools and the objects, with their poses at the start.
    others: Vec<(BodyPart, Arc<Solid>, Pose)>,
}

impl<'a> Seen<'a> {
    pub(crate) fn of(stage: &'a Stage) -> Self {
        let solid = |body| Arc::new(Solid::of_body(body));
        let tools = stage.tools().enumerate().skip(1);
        let tools = tools.map(|(k, (body, pose))| (BodyPart::OtherProbe(k + 1), solid(body), pose));
        let mut shapes: Vec<(*const Body, Arc<Solid>)> = Vec::new();
        let objects = stage.objects.iter().enumerate().map(|(k, object)| {
            // Objects with the same mesh are drawn from one shape.
            let known =
                shapes.iter().find(|(body, _)| *body == Arc::as_ptr(&object.body)).map(|(_, solid)| solid.clone());
            let shape = known.unwrap_or_else(|| {
                let shape = solid(&object.body);
                shapes.push((Arc::as_ptr(&object.body), shape.clone()));
                shape
            });
            let part = if object.motion == ObjectMotion::Fixed {
                BodyPart::FixedObject(k + 1)
            } else {
                BodyPart::Object(k + 1)
            };
            (part, shape, object.pose)
        });
        let others = tools.chain(objects).collect();
        let (probe, environment) = both(&Threads::all(), || solid(&stage.probe), || solid(&stage.environment));
        Self { stage, probe, environment, others }
    }

    /// Returns the bodies, with the probe at `probe` (world). The probe is opaque; `look` may make
    /// the environment transparent, because the environment hides most contacts.
    pub(crate) fn scene(&self, probe: Pose, theme: Theme, look: Look) -> Scene {
        let Self { stage, .. } = *self;
        let shown = |part: BodyPart, solid: &Arc<Solid>, pose, look| ShownBody {
            part,
            solid: Arc::clone(solid),
            pose,
            colour: part.colour(theme),
            look,
        };
        let opaque = Look { translucent: false, xray: false, ..look };
        let mut bodies = vec![
            shown(BodyPart::Probe, &self.probe, probe, opaque),
            shown(BodyPart::Environment, &self.environment, stage.environment_pose, look),
        ];
        bodies.extend(self.others.iter().map(|(part, solid, pose)| {
            // Moving objects are opaque, like the probe.
            let look = if matches!(part, BodyPart::Object(_)) { opaque } else { look };
            shown(*part, solid, *pose, look)
        }));
        Scene { bodies, moment_pose: stage.environment_pose, unit: Unit::Metre, ..Scene::default() }
    }

    /// Returns the bodies at their poses at `moment`, with its contacts and forces.
    pub(crate) fn scene_at(&self, moment: Moment, theme: Theme, look: Look) -> Scene {
        let mut scene = self.scene(self.stage.environment_pose * moment.tool, theme, look);
        for (body, pose) in scene.bodies.iter_mut().skip(2).zip(&moment.others) {
            body.pose = self.stage.environment_pose * *pose;
        }
        Scene { moment: Some(moment), ..scene }
    }
}

/// Returns the force (N) that is drawn with the longest arrow in a picture of `moment`: the largest
/// force of a cluster, or `hand` if that is larger.
pub(crate) fn force_scale(moment: &Moment, hand: f64) -> f64 {
    let largest = moment.clusters.iter().map(|cluster| cluster.force.length()).fold(0.0, f64::max);
    largest.max(hand).max(LEAST_FORCE_SCALE)
}
