//! The objects of a stage in the engine's world, and a simulated host that moves the driven
//! objects.

use palpus::algebra::{Pose, Twist};
use palpus::render::{BodyId, SettingsError, World};
use palpus_io::scene::ObjectMotion;

use crate::engine::Frame;
use crate::stage::Stage;

/// Time between two updates of the host, s, as in a robot's controller or a game.
const HOST_PERIOD: f64 = 1.0 / 60.0;

/// See the module's description.
pub(crate) struct Objects {
    ids: Vec<BodyId>,
    driven: Vec<Driven>,
    /// Time since the run began, s.
    time: f64,
    /// Time of the host's next update, s.
    next: f64,
}

/// A driven object; its start pose is in the engine's frame.
struct Driven {
    body: BodyId,
    start: Pose,
    /// Twist of the frame's origin.
    velocity: Twist,
}

impl Objects {
    /// Adds the objects of `stage` to a world with the frame `frame`.
    pub(crate) fn add(stage: &Stage, world: &mut World, frame: &Frame) -> Result<Self, SettingsError> {
        let mut objects = Self { ids: Vec::new(), driven: Vec::new(), time: 0.0, next: 0.0 };
        world.set_gravity(frame.directed(stage.gravity));
        for object in &stage.objects {
            let (body, pose) = (object.body.clone(), frame.placed(&object.pose));
            let id = world.add(object.motion.object(body, pose))?;
            if let ObjectMotion::Driven(Twist { angular, linear }) = object.motion {
                let [angular, linear] = [angular, linear].map(|vector| frame.directed(vector));
                objects.driven.push(Driven { body: id, start: pose, velocity: Twist { angular, linear } });
            }
            objects.ids.push(id);
        }
        Ok(objects)
    }

    /// Advances the host by `dt` (s). The host sets the poses of driven objects once in
    /// [`HOST_PERIOD`].
    pub(crate) fn drive(&mut self, world: &mut World, dt: f64) {
        if !self.driven.is_empty() && self.time >= self.next {
            self.next += HOST_PERIOD;
            for Driven { body, start, velocity } in &self.driven {
                let turn = glam::DQuat::from_scaled_axis(velocity.angular * self.time);
                let pose = Pose::new(turn * start.rotation, start.translation + velocity.linear * self.time);
                world.drive(*body, pose, *velocity);
            }
        }
        self.time += dt;
    }

    /// Returns the poses of the objects, in the engine's frame.
    pub(crate) fn poses<'a>(&'a self, world: &'a World) -> impl Iterator<Item = Pose> {
        self.ids.iter().map(|&id| world.pose(id))
    }
}
