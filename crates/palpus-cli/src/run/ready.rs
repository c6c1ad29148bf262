//! A prepared run: a plan for each of the scene's tools, and an engine for all of them.

use super::Plan;
use crate::args::RunArguments;
use crate::engine::Engine;
use crate::stage::Stage;
use crate::tools::{self, ToolArguments};
use crate::{output, safety};

/// See the module's description. The first plan has the values that apply to the loop as a whole.
pub(crate) struct Ready {
    pub(crate) plans: Vec<Plan>,
    pub(crate) engine: Engine,
}

impl Ready {
    /// Prepares a run on `stage`, called `name`. `in_window`: without a duration the run lasts
    /// until it is stopped, and its engine has memory for all later changes of settings.
    pub(crate) fn new(arguments: &RunArguments, name: &str, stage: Stage, in_window: bool) -> anyhow::Result<Self> {
        let typed = ToolArguments::of(arguments, stage.tools().count())?;
        // The paths of several hands are not repeated: they have different lengths and would drift
        // apart.
        let stage = Stage { to_and_fro: in_window && stage.others.is_empty(), ..stage };
        let others: Vec<Stage> = stage.of_others().collect();
        let tools: Vec<_> = stage.tools().map(|(body, pose)| (body.clone(), pose)).collect();
        let stages = std::iter::once(stage).chain(others);
        let plan = |(k, (stage, typed)): (usize, (Stage, ToolArguments<'_>))| {
            Plan::new(arguments, &typed, name, stage, &tools[k + 1..], in_window)
        };
        let plans: Vec<Plan> = stages.zip(typed).enumerate().map(plan).collect::<anyhow::Result<_>>()?;
        let settings: Vec<_> = plans.iter().map(|plan| plan.settings).collect();
        let mut engine = plans[0].engine(&settings, in_window)?;
        plans.iter().enumerate().for_each(|(which, plan)| engine.lead_out(which, plan.lead.clone()));
        Ok(Self { plans, engine })
    }

    /// Returns the first device's plan.
    pub(crate) fn plan(&self) -> &Plan {
        &self.plans[0]
    }

    /// Prints the thresholds of the safety chain of each device.
    pub(crate) fn print_limits(&self, json: bool) -> anyhow::Result<()> {
        self.plans.iter().try_for_each(|plan| safety::print(plan.spec(), &plan.limits, json))
    }

    /// Describes the run before it starts. `headless`: the reason why there is no window. Returns
    /// true if it printed a note about a heavy pair.
    pub(crate) fn announce(&self, arguments: &RunArguments, headless: Option<&str>) -> anyhow::Result<bool> {
        let mut heavy = false;
        for (k, plan) in self.plans.iter().enumerate() {
            if self.plans.len() > 1 {
                output::note(format!("the {} hand:", tools::name(k)));
            }
            heavy |= plan.announce(arguments, headless)?;
        }
        Ok(heavy)
    }
}
