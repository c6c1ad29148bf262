//! Two tools as the step of a servo loop: both devices' states in, a wrench for each out.

use palpus::render::{Duo, Settings};
use palpus_alloc::allocations_of_this_thread;
use palpus_device::{DeviceState, StepOutcome, ToolOutcome};
use palpus_window::Moment;

use crate::clock::WallClock;
use crate::engine::{Detail, Frame};
use crate::stage::Stage;

/// A renderer of two tools between two devices and a scene.
pub(crate) struct TwoEngine {
    duo: Duo,
    frame: Frame,
    clock: WallClock,
    shot: Option<(u64, Moment)>,
    taken: bool,
}

impl TwoEngine {
    /// An engine for both tools; the environment is the first stage's.
    pub(crate) fn new(stages: [&Stage; 2], settings: [Settings; 2]) -> anyhow::Result<Self> {
        let probes = stages.map(|stage| stage.probe.clone());
        let duo = Duo::new(probes, stages[0].environment.clone(), settings)?;
        let frame = Frame::new(stages[0].environment_pose);
        Ok(Self { duo, frame, clock: WallClock::new(), shot: None, taken: false })
    }

    /// Keeps what tick number `tick` has to show, for [`Self::shown`].
    pub(crate) fn keep(&mut self, tick: u64) {
        self.shot = Some((tick, self.moment()));
    }

    /// What the kept tick has to show, or the last one, if there is none; `period` is a tick's, s.
    pub(crate) fn shown(self, period: f64) -> Moment {
        let mut moment = self.moment();
        if let Some((tick, kept)) = self.shot.filter(|_| self.taken) {
            return Moment { time: tick as f64 * period, ..kept };
        }
        fill(&mut moment, &self.duo, period);
        moment
    }

    fn moment(&self) -> Moment {
        let capacity = self.duo.settings().map(|settings| settings.capacity);
        Moment::new(capacity[0] + capacity[1])
    }

    /// One tick of both: what each device is to push with.
    pub(crate) fn step(&mut self, states: &[DeviceState; 2], dt: f64) -> [ToolOutcome<Detail>; 2] {
        let before = allocations_of_this_thread();
        let probes = states.each_ref().map(|state| self.frame.probe(&state.pose, &state.twist));
        let index = self.duo.step(&probes, dt, &self.clock)[0].index;
        if let Some((_, moment)) = self.shot.as_mut().filter(|(tick, _)| *tick == index) {
            fill(moment, &self.duo, dt);
            self.taken = true;
        }
        // Whose it is does not matter: it must be none.
        let allocations = allocations_of_this_thread() - before;
        self.duo.ticks().map(|tick| ToolOutcome {
            outcome: StepOutcome {
                wrench: self.frame.for_device(&tick.commanded),
                saturated: tick.counters.saturated_force + tick.counters.saturated_torque > 0,
                detail: Detail { tick: tick.summary(), allocations, changed: None },
            },
            received: tick.work_from_other,
        })
    }
}

/// Both tools, and all that happens at them; the arrow at the grip is the first one's.
fn fill(moment: &mut Moment, duo: &Duo, period: f64) {
    let [first, second] = duo.ticks();
    moment.fill(first, first.index as f64 * period, duo.settings()[0].grip_a);
    moment.join(second);
}
