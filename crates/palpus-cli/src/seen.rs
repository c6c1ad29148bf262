//! A stage as it is seen, in windows, in pictures and on pages: its bodies, and what goes on between them.

use std::sync::Arc;

use palpus::algebra::Pose;
use palpus_window::{Look, Moment, Scene, ShownBody, Solid, Theme, Unit};

use crate::stage::Stage;

/// The arrows of a picture are as long as they may be for the largest force in it, but not for less than this, N.
pub(crate) const LEAST_FORCE_SCALE: f64 = 0.1;

/// The bodies of a stage, made ready once for as many scenes as are wanted.
pub(crate) struct Seen<'a> {
    stage: &'a Stage,
    probe: Arc<Solid>,
    environment: Arc<Solid>,
    /// What a second hand holds, and where it is while nobody says.
    second: Option<(Arc<Solid>, Pose)>,
}

impl<'a> Seen<'a> {
    pub(crate) fn of(stage: &'a Stage) -> Self {
        let solid = |body| Arc::new(Solid::of_body(body));
        let second = stage.second_probe().map(|(body, pose)| (solid(body), pose));
        Self { stage, probe: solid(&stage.probe), environment: solid(&stage.environment), second }
    }

    /// The bodies, with the probe at `probe` (world). If something is seen through, as `look` says, it is the environment: what happens is mostly
    /// behind it.
    pub(crate) fn scene(&self, probe: Pose, theme: Theme, look: Look) -> Scene {
        let Self { stage, .. } = *self;
        let [of_probe, of_environment, of_second] = ShownBody::colours(theme);
        let shown = |solid: &Arc<Solid>, pose, colour, look| ShownBody { solid: Arc::clone(solid), pose, colour, look };
        let mut bodies = vec![
            shown(&self.probe, probe, of_probe, Look { translucent: false, ..look }),
            shown(&self.environment, stage.environment_pose, of_environment, look),
        ];
        // The first may be in the second.
        bodies.extend(self.second.iter().map(|(solid, pose)| shown(solid, *pose, of_second, look)));
        Scene { bodies, moment_pose: stage.environment_pose, unit: Unit::Metre, ..Scene::default() }
    }

    /// The bodies where they are at `moment`, and what went on between them.
    pub(crate) fn scene_at(&self, moment: Moment, theme: Theme, look: Look) -> Scene {
        let mut scene = self.scene(self.stage.environment_pose * moment.tool, theme, look);
        if let Some((body, pose)) = scene.bodies.get_mut(2).zip(moment.second) {
            body.pose = self.stage.environment_pose * pose;
        }
        Scene { moment: Some(moment), ..scene }
    }
}

/// N: for which force an arrow of `moment` is as long as arrows may be: the largest that a cluster pushes with, or `hand` where that is larger.
pub(crate) fn force_scale(moment: &Moment, hand: f64) -> f64 {
    let largest = moment.clusters.iter().map(|cluster| cluster.force.length()).fold(0.0, f64::max);
    largest.max(hand).max(LEAST_FORCE_SCALE)
}
