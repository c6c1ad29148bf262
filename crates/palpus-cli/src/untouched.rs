//! Finds out why a run had no contact: how near the hand's path comes to the environment.

use std::sync::Arc;

use palpus::algebra::Pose;
use palpus::body::Body;
use palpus::detect::{ContactQuery, QuerySettings};
use palpus_scenes::HandPath;

use crate::gaps::length;
use crate::stage::Stage;

/// Number of examined poses of the path.
const LOOKS: u32 = 120;

/// A probe on its path near an environment.
pub(crate) struct Untouched {
    probe: Arc<Body>,
    environment: Arc<Body>,
    environment_pose: Pose,
    path: HandPath,
    /// Contact tolerance, m.
    tolerance: f64,
    /// True if the scene has objects, which may be the target of the hand.
    has_objects: bool,
}

impl Untouched {
    pub(crate) fn of(stage: &Stage) -> Self {
        Self {
            probe: stage.probe.clone(),
            environment: stage.environment.clone(),
            environment_pose: stage.environment_pose,
            path: stage.path.clone(),
            tolerance: stage.settings.contact_tolerance,
            has_objects: !stage.objects.is_empty(),
        }
    }

    /// Returns why `seconds` of a run had no contact, and a remedy. `scripted`: a simulated hand
    /// followed the path.
    pub(crate) fn reason(&self, scripted: bool, seconds: f64) -> String {
        if !scripted {
            return "no contact: the device did not bring the probe to the part".to_owned();
        }
        if self.has_objects {
            return "no contact: the hand's path did not bring the probe to any body".to_owned();
        }
        let (gap, time) = self.nearest();
        let (gap, tolerance) = (length(gap), length(self.tolerance));
        match time {
            None => format!(
                "no contact: the hand's path stays {gap} away from the part, and contacts begin at {tolerance}; \
                 set `position` under [probe] nearer to the part, or change the hand's path"
            ),
            Some(time) if time > seconds => format!(
                "no contact: the hand's path reaches the part after {time:.1} s, but the run took only \
                {seconds:.1} s; run longer, or set `position` under [probe] nearer to the part"
            ),
            Some(time) => format!(
                "no contact: the hand's path reaches the part after {time:.1} s, but the probe did not follow it; \
                 try a firmer hand (--hand firm)"
            ),
        }
    }

    /// Returns the smallest distance along the path (m), and the first time (s) at which the
    /// distance is within the tolerance; `None` if it is never within the tolerance.
    fn nearest(&self) -> (f64, Option<f64>) {
        let settings = QuerySettings { tolerance: 0.0, ..QuerySettings::default() };
        let mut query = ContactQuery::new(self.probe.clone(), self.environment.clone(), settings);
        let to_environment = self.environment_pose.inverse();
        let mut least = f64::INFINITY;
        for k in 0..=LOOKS {
            let time = self.path.duration() * f64::from(k) / f64::from(LOOKS);
            let contact = query.nearest(&(to_environment * self.path.pose(time)));
            least = least.min(contact.map_or(f64::INFINITY, |contact| contact.separation));
            if least <= self.tolerance {
                return (least, Some(time));
            }
        }
        (least, None)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use palpus_io::scene::FilePolicy;

    use super::*;
    use crate::stage;

    #[test]
    fn missed_part_is_explained() {
        crate::bodies::use_cache(false);
        let stage = stage::prepare("box-table", FilePolicy::Inside).expect("the scene is built in");
        let of = |away: f64| Untouched {
            environment_pose: Pose::from_translation(DVec3::Z * -away),
            ..Untouched::of(&stage)
        };
        let far = of(1.0).reason(true, 10.0);
        assert!(far.contains("stays") && far.contains("away") && far.contains("position"), "{far}");
        let short = of(0.0).reason(true, 1e-3);
        assert!(short.contains("run longer"), "{short}");
        let weak = of(0.0).reason(true, 1e3);
        assert!(weak.contains("--hand firm"), "{weak}");
        assert!(of(0.0).reason(false, 10.0).contains("the device"));
    }
}
