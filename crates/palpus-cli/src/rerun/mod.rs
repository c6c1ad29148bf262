//! A recording that is run again to be looked at: by itself, or with that of the other tool.

pub(crate) mod one;
pub(crate) mod places;

use std::ops::ControlFlow;

use palpus::algebra::Wrench;
#[cfg(feature = "window")]
use palpus_device::Publisher;
use palpus_io::Recording;
use palpus_window::Moment;

use self::one::{engine_of, replayable, run_again_on};
use self::places::Places;
use crate::engine::Engine;
use crate::stage::Stage;
use crate::stopped::Stopped;
use crate::two::other::other_of;
use crate::two::{self, TwoEngine};

/// A recording and what it is run again on: an engine of its own, or one for both tools and the other tool's recording.
pub(crate) enum Rerun<'a> {
    One(&'a Recording, Box<Engine>),
    Two { which: usize, recording: &'a Recording, other: Box<Recording>, engine: Box<TwoEngine> },
}

impl<'a> Rerun<'a> {
    /// The stage as well.
    pub(crate) fn new(recording: &'a Recording, places: &Places<'_>) -> anyhow::Result<(Stage, Self)> {
        let Some((which, _)) = other_of(recording) else {
            let stage = replayable(recording, None, places)?;
            let engine = engine_of(recording, &stage)?;
            return Ok((stage, Self::One(recording, Box::new(engine))));
        };
        let other = Box::new(two::replay::read_other(places.recording, recording)?);
        let (stage, engine) = two::replay::ready(two::replay::in_order(which, recording, &other), places)?;
        Ok((stage, Self::Two { which, recording, other, engine: Box::new(engine) }))
    }

    /// The recording of the first tool, of two, or the only one.
    pub(crate) fn first(&self) -> &Recording {
        match self {
            Self::One(recording, _) => recording,
            Self::Two { which, recording, other, .. } => two::replay::in_order(*which, recording, other)[0],
        }
    }

    /// Keeps what tick number `tick` has to show.
    pub(crate) fn keep(&mut self, tick: u64) {
        match self {
            Self::One(_, engine) => engine.keep(tick),
            Self::Two { engine, .. } => engine.keep(tick),
        }
    }

    /// Tells `each` of every row of the recording, until it breaks off: which one, and the wrench for the device.
    pub(crate) fn run(&mut self, each: &mut dyn FnMut(usize, &Wrench) -> ControlFlow<()>) -> anyhow::Result<()> {
        match self {
            Self::One(recording, engine) => run_again_on(recording, engine, &mut |k, wrench, _| each(k, wrench)),
            Self::Two { which, recording, other, engine } => {
                let recordings = two::replay::in_order(*which, recording, other);
                two::replay::run_again(recordings, engine, &mut |tool, k, wrench, _| {
                    if tool == *which { each(k, wrench) } else { ControlFlow::Continue(()) }
                })
            }
        }
    }

    /// The engine.
    pub(crate) fn stop(self) -> Stopped {
        match self {
            Self::One(_, engine) => Stopped::One(engine),
            Self::Two { engine, .. } => Stopped::Two(engine),
        }
    }

    /// Room for what a tick has to show.
    #[cfg(feature = "window")]
    pub(crate) fn capacity(&self) -> usize {
        match self {
            Self::One(recording, _) => recording.header.scene.render.capacity,
            Self::Two { recording, other, .. } => {
                recording.header.scene.render.capacity + other.header.scene.render.capacity
            }
        }
    }

    /// Leaves what every tick has to show with `publisher`.
    #[cfg(feature = "window")]
    pub(crate) fn publish(&mut self, publisher: Publisher<Moment>) {
        match self {
            Self::One(_, engine) => engine.publish(publisher),
            Self::Two { engine, .. } => engine.publish(publisher),
        }
    }

    /// What the kept ticks that came have to show, in the order in which they were asked for; `period` is a tick's, s.
    pub(crate) fn kept(&mut self, period: f64) -> Vec<Moment> {
        match self {
            Self::One(_, engine) => engine.kept(period),
            Self::Two { engine, .. } => engine.kept(period),
        }
    }
}
