//! Compares the force that the service reports (`current_cursor_force`) with the force that was
//! commanded.
//!
//! The maker does not document how late the report is, nor whether it is taken before or after the
//! service's own filters (force gate, oscillation damper). So a report is correct if it is one of
//! the last three commands. A weaker force along a command is counted, with no other effect.
//! Otherwise:
//!
//! 1. If no force, a stronger one or one along another direction is reported for [`PATIENCE`], the
//!    force is withheld for [`PAUSE`], after which the loop engages anew.
//! 2. If a force is reported for [`LOST_TIME`] although zero is commanded, something else pushes
//!    the arm. The device is then lost.

use glam::DVec3;

/// Number of commands that a report may belong to.
const BACK: usize = 3;
/// Tolerance: N, and a share of the force. Rounding to single precision is far below.
const SLACK: (f64, f64) = (0.05, 0.02);
/// N: a command of this size for which no force is reported is withheld.
const FELT: f64 = 0.5;
/// s: time for which forces may differ. Filters lag by less.
const PATIENCE: f64 = 0.05;
/// s: longer than the safety chain returns a withheld force without a new engagement.
const PAUSE: f64 = 0.4;
/// s.
const LOST_TIME: f64 = 0.25;

/// The last commands, and since when the reports differ.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Echo {
    commanded: [DVec3; BACK],
    /// s: start of the reports that give a reason to withhold.
    differs: Option<f64>,
    /// s: start of the reports of a force that was not commanded.
    unasked: Option<f64>,
    /// s: time until which the force is withheld.
    until: f64,
}

/// How a report compares with the last commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Given {
    /// It is one of them.
    AsTold,
    /// It is a part of one of them.
    Weaker,
    /// It is zero, and the commands are not.
    Nothing,
    /// It is another force.
    Other,
}

impl Echo {
    /// Notes that `force` (N) is commanded.
    pub(super) fn commanded(&mut self, force: DVec3) {
        self.commanded.rotate_right(1);
        self.commanded[0] = force;
    }

    /// Judges a report of `force` (N) at `time` (s).
    pub(super) fn hear(&mut self, force: DVec3, time: f64) -> Given {
        let given = self.compare(force);
        let differs = matches!(given, Given::Nothing | Given::Other);
        self.differs = differs.then(|| self.differs.unwrap_or(time));
        if self.differs.is_some_and(|since| time - since > PATIENCE) {
            self.until = time + PAUSE;
        }
        let idle = self.commanded.iter().all(|commanded| *commanded == DVec3::ZERO);
        self.unasked = (idle && force.length() > FELT).then(|| self.unasked.unwrap_or(time));
        given
    }

    /// True while the force is withheld because of the reports.
    pub(super) fn withholds(&self, time: f64) -> bool {
        time < self.until
    }

    /// True if a force that was not commanded has been reported for too long.
    pub(super) fn is_unasked(&self, time: f64) -> bool {
        self.unasked.is_some_and(|since| time - since > LOST_TIME)
    }

    fn compare(&self, force: DVec3) -> Given {
        let near = |commanded: DVec3| force.distance(commanded) <= SLACK.0 + SLACK.1 * commanded.length();
        if self.commanded.iter().any(|commanded| near(*commanded)) {
            return Given::AsTold;
        }
        if force.length() <= SLACK.0 && self.commanded.iter().all(|commanded| commanded.length() >= FELT) {
            return Given::Nothing;
        }
        // The point nearest to `force` between zero and the command.
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

    /// Returns the result of the command `commanded` with the force `given` from 0 s on, for
    /// `ticks`.
    fn after(commanded: DVec3, given: DVec3, ticks: usize) -> (Echo, Given) {
        let mut echo = Echo::default();
        let mut last = Given::AsTold;
        for k in 0..ticks {
            echo.commanded(commanded);
            last = echo.hear(given, k as f64 * TICK);
        }
        (echo, last)
    }

    #[test]
    fn a_force_of_the_last_messages_is_as_told() {
        let mut echo = Echo::default();
        for k in 0..1000 {
            let force = |k: i32| DVec3::X * f64::from(k.max(0) % 40) * 0.2;
            echo.commanded(force(k));
            assert_eq!(echo.hear(force(k - 2), f64::from(k) * TICK), Given::AsTold, "message {k}");
        }
        assert!(!echo.withholds(1.0) && !echo.is_unasked(1.0));
    }

    #[test]
    fn a_weaker_force_is_counted_and_no_more() {
        let (echo, given) = after(DVec3::X * 5.0, DVec3::X * 1.5, 1000);
        assert_eq!(given, Given::Weaker);
        assert!(!echo.withholds(1.0) && !echo.is_unasked(1.0));
    }

    #[test]
    fn none_or_another_force_is_withheld_after_a_while() {
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
    fn a_force_that_nobody_told_loses_the_device() {
        let (echo, _) = after(DVec3::ZERO, DVec3::Z * 2.0, 200);
        assert!(!echo.is_unasked(0.2));
        let (echo, _) = after(DVec3::ZERO, DVec3::Z * 2.0, 300);
        assert!(echo.is_unasked(0.3));
    }
}
