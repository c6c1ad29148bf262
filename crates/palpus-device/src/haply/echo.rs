//! Compares the force that the service reports (`current_cursor_force`) with the commanded force.
//!
//! The maker does not document how late the report is. It is also unknown whether the report is
//! taken before or after the service's filters (force gate, oscillation damper). So a report counts
//! as correct if it is near one of the last three commands. A weaker force along a command is only
//! counted. Other reports have these consequences:
//!
//! 1. If no force, a stronger force or a force in another direction is reported for [`PATIENCE`],
//!    the force is withheld for [`PAUSE`]. The loop must then engage again.
//! 2. If a force is reported for [`LOST_TIME`] although zero is commanded, another program moves
//!    the arm. The device then counts as lost.

use glam::DVec3;

/// Number of recent commands to which a report may belong.
const BACK: usize = 3;
/// Tolerance of a report: absolute (N), and relative to the force. Rounding errors of single
/// precision are far smaller than this tolerance.
const SLACK: (f64, f64) = (0.05, 0.02);
/// A report counts as missing or uncommanded only from this force on, N. A hand can feel such a
/// force.
const FELT: f64 = 0.5;
/// Time for which the forces may differ, s. The delay of filters is shorter.
const PATIENCE: f64 = 0.05;
/// Time for which the force is withheld, s. After so long a time, the safety chain requires that
/// the device is engaged again.
const PAUSE: f64 = 0.4;
/// Time for which an uncommanded force may be reported, s.
const LOST_TIME: f64 = 0.25;

/// The last commands, and the start of differing reports.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Echo {
    commanded: [DVec3; BACK],
    /// Start of the reports that are a reason to withhold the force, s.
    differs: Option<f64>,
    /// Start of the reports of an uncommanded force, s.
    uncommanded: Option<f64>,
    /// Time until which the force is withheld, s.
    until: f64,
}

/// Comparison of a report with the last commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Given {
    /// The reported force is near one of the commands.
    AsCommanded,
    /// The reported force is a weaker force along one of the commands.
    Weaker,
    /// The reported force is zero, but all commands have a force.
    Nothing,
    /// The reported force has another size or direction.
    Other,
}

impl Echo {
    /// Stores the commanded `force` (N).
    pub(super) fn commanded(&mut self, force: DVec3) {
        self.commanded.rotate_right(1);
        self.commanded[0] = force;
    }

    /// Compares a reported `force` (N) at `time` (s) with the last commands.
    pub(super) fn hear(&mut self, force: DVec3, time: f64) -> Given {
        let given = self.compare(force);
        let differs = matches!(given, Given::Nothing | Given::Other);
        self.differs = differs.then(|| self.differs.unwrap_or(time));
        if self.differs.is_some_and(|since| time - since > PATIENCE) {
            self.until = time + PAUSE;
        }
        let idle = self.commanded.iter().all(|commanded| *commanded == DVec3::ZERO);
        self.uncommanded = (idle && force.length() > FELT).then(|| self.uncommanded.unwrap_or(time));
        given
    }

    /// Returns true while the force is withheld because of the reports.
    pub(super) fn withholds(&self, time: f64) -> bool {
        time < self.until
    }

    /// Returns true if an uncommanded force has been reported for too long.
    pub(super) fn is_uncommanded(&self, time: f64) -> bool {
        self.uncommanded.is_some_and(|since| time - since > LOST_TIME)
    }

    fn compare(&self, force: DVec3) -> Given {
        let near = |commanded: DVec3| force.distance(commanded) <= SLACK.0 + SLACK.1 * commanded.length();
        if self.commanded.iter().any(|commanded| near(*commanded)) {
            return Given::AsCommanded;
        }
        if force.length() <= SLACK.0 && self.commanded.iter().all(|commanded| commanded.length() >= FELT) {
            return Given::Nothing;
        }
        // The point between zero and the command that is nearest to `force`.
        let between = |commanded: DVec3| {
            commanded * (force.dot(commanded) / commanded.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
        };
        if self.commanded.iter().any(|commanded| near(between(*commanded))) { Given::Weaker } else { Given::Other }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: f64 = 1e-3;

    /// Returns the result of `ticks` commands of `commanded` with reports of `given`.
    fn after(commanded: DVec3, given: DVec3, ticks: usize) -> (Echo, Given) {
        let mut echo = Echo::default();
        let mut last = Given::AsCommanded;
        for k in 0..ticks {
            echo.commanded(commanded);
            last = echo.hear(given, k as f64 * TICK);
        }
        (echo, last)
    }

    #[test]
    fn recently_commanded_force_is_correct() {
        let mut echo = Echo::default();
        for k in 0..1000 {
            let force = |k: i32| DVec3::X * f64::from(k.max(0) % 40) * 0.2;
            echo.commanded(force(k));
            assert_eq!(echo.hear(force(k - 2), f64::from(k) * TICK), Given::AsCommanded, "message {k}");
        }
        assert!(!echo.withholds(1.0) && !echo.is_uncommanded(1.0));
    }

    #[test]
    fn weaker_force_is_only_counted() {
        let (echo, given) = after(DVec3::X * 5.0, DVec3::X * 1.5, 1000);
        assert_eq!(given, Given::Weaker);
        assert!(!echo.withholds(1.0) && !echo.is_uncommanded(1.0));
    }

    #[test]
    fn missing_or_other_force_is_withheld_after_a_while() {
        for (given, name) in
            [(DVec3::ZERO, Given::Nothing), (DVec3::X * 8.0, Given::Other), (DVec3::Y * 5.0, Given::Other)]
        {
            let (echo, last) = after(DVec3::X * 5.0, given, 40);
            assert_eq!(last, name);
            assert!(!echo.withholds(0.04), "{given}");
            let (echo, _) = after(DVec3::X * 5.0, given, 60);
            assert!(echo.withholds(0.06) && echo.withholds(0.4) && !echo.withholds(0.5), "{given}");
        }
    }

    #[test]
    fn uncommanded_force_loses_the_device() {
        let (echo, _) = after(DVec3::ZERO, DVec3::Z * 2.0, 200);
        assert!(!echo.is_uncommanded(0.2));
        let (echo, _) = after(DVec3::ZERO, DVec3::Z * 2.0, 300);
        assert!(echo.is_uncommanded(0.3));
    }
}
