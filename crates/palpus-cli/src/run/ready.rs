//! A run that can begin: a device and its engine, or two devices and an engine for both.

use super::Plan;
use crate::args::RunArguments;
use crate::engine::Engine;
use crate::stage::Stage;
use crate::two::{NAMES, TwoEngine, second_arguments};
use crate::{output, safety};

/// See the module's description. What holds for the loop and not for one device is the first plan's.
pub(crate) enum Ready {
    /// The scene has one tool.
    One(Box<(Plan, Engine)>),
    /// It has two.
    Two(Box<([Plan; 2], TwoEngine)>),
}

impl Ready {
    /// A run on `stage`, which is called `name`. `in_window`: until it is stopped, where nobody said how long, and with all that changes of
    /// settings may need later on.
    pub(crate) fn new(arguments: &RunArguments, name: &str, stage: Stage, in_window: bool) -> anyhow::Result<Self> {
        let Some(second) = stage.of_second() else {
            let plan = Plan::new(arguments, name, stage, in_window)?;
            let engine = plan.engine(in_window)?;
            return Ok(Self::One(Box::new((plan, engine))));
        };
        let other = second_arguments(arguments)?;
        let plans = [Plan::new(arguments, name, stage, in_window)?, Plan::new(&other, name, second, in_window)?];
        let mut engine =
            TwoEngine::new(plans.each_ref().map(|plan| &plan.stage), plans.each_ref().map(|plan| plan.settings))?;
        if plans[0].keeps_time() {
            engine.pace(plans[0].rate_hz);
        }
        let engine = if in_window { engine.with_surfaces(plans[0].stage.crease_angle()) } else { engine };
        Ok(Self::Two(Box::new((plans, engine))))
    }

    /// The first device's.
    pub(crate) fn plan(&self) -> &Plan {
        self.plans()[0]
    }

    fn plans(&self) -> Vec<&Plan> {
        match self {
            Self::One(run) => vec![&run.0],
            Self::Two(run) => run.0.iter().collect(),
        }
    }

    /// Keeps what tick number `tick` has to show.
    pub(crate) fn keep(&mut self, tick: u64) {
        match self {
            Self::One(run) => run.1.keep(tick),
            Self::Two(run) => run.1.keep(tick),
        }
    }

    /// Room for what a tick has to show.
    #[cfg(feature = "window")]
    pub(crate) fn capacity(&self) -> usize {
        self.plans().iter().map(|plan| plan.settings.capacity).sum()
    }

    /// Leaves what every tick has to show with `publisher`.
    #[cfg(feature = "window")]
    pub(crate) fn publish(&mut self, publisher: palpus_device::Publisher<palpus_window::Moment>) {
        match self {
            Self::One(run) => run.1.publish(publisher),
            Self::Two(run) => run.1.publish(publisher),
        }
    }

    /// Prints the thresholds of the safety chain of each device.
    pub(crate) fn print_limits(&self, json: bool) -> anyhow::Result<()> {
        self.plans().into_iter().try_for_each(|plan| safety::print(plan.spec(), &plan.limits, json))
    }

    /// Says what is about to run; `headless` is why there is no window. True if it said that the pair is heavy.
    pub(crate) fn announce(&self, arguments: &RunArguments, headless: Option<&str>) -> anyhow::Result<bool> {
        let Self::Two(run) = self else {
            return self.plan().announce(arguments, headless);
        };
        let other = second_arguments(arguments)?;
        let mut heavy = false;
        for ((plan, arguments), name) in run.0.iter().zip([arguments, &other]).zip(NAMES) {
            output::note(format!("the {name} hand:"));
            heavy |= plan.announce(arguments, headless)?;
        }
        Ok(heavy)
    }
}
