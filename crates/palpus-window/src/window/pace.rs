//! Computes the waiting time of a window between two frames. The frame rate is then steady, however
//! long the drawing takes.

use std::time::{Duration, Instant};

/// Time between two frames. It is longer with software rendering, because the loop needs the
/// processor.
const FRAME: Duration = Duration::from_millis(16);
const FRAME_OF_PROCESSOR: Duration = Duration::from_millis(30);
/// Shortest wait, so that other threads get the processor.
const LEAST_WAIT: Duration = Duration::from_millis(1);
/// Smoothing factor of the drawing time.
const OF_LATE: f64 = 0.2;

/// See the module's description.
#[derive(Debug)]
pub(super) struct Pace {
    frame: Duration,
    /// When the last frame began, and the wait that it requested.
    last: Option<(Instant, Duration)>,
    /// Recent time of a frame without the wait, s.
    busy: f64,
}

impl Pace {
    pub(super) fn new(by_processor: bool) -> Self {
        Self { frame: if by_processor { FRAME_OF_PROCESSOR } else { FRAME }, last: None, busy: 0.0 }
    }

    /// Returns the wait after a frame that begins `now`.
    pub(super) fn wait(&mut self, now: Instant) -> Duration {
        let frame = self.frame.as_secs_f64();
        if let Some((last, wait)) = self.last {
            // A longer pause means that the window was hidden.
            let busy = now.saturating_duration_since(last).saturating_sub(wait).as_secs_f64().min(2.0 * frame);
            self.busy += OF_LATE * (busy - self.busy);
        }
        let wait = Duration::from_secs_f64((frame - self.busy).max(0.0)).max(LEAST_WAIT);
        self.last = Some((now, wait));
        wait
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawing_time_is_subtracted_from_the_wait() {
        for (drawing, period) in [(0, 30), (5, 30), (20, 30), (50, 51)] {
            let mut pace = Pace::new(true);
            let mut now = Instant::now();
            let mut last = Duration::ZERO;
            for _ in 0..100 {
                last = pace.wait(now) + Duration::from_millis(drawing);
                now += last;
            }
            assert!(last.abs_diff(Duration::from_millis(period)) < Duration::from_millis(1), "{drawing} ms: {last:?}");
        }
    }
}
