//! Ticks that are kept for display.

use palpus_window::Moment;

/// The kept ticks of a run, in the order of the requests.
#[derive(Default)]
pub(crate) struct Shots(Vec<Shot>);

struct Shot {
    tick: u64,
    taken: bool,
    moment: Moment,
}

impl Shots {
    /// Keeps tick number `tick` in `moment`, which has the necessary capacity.
    pub(crate) fn keep(&mut self, tick: u64, moment: Moment) {
        self.0.push(Shot { tick, taken: false, moment });
    }

    /// Calls `fill` if the current tick, number `index`, is requested. Allocates no memory.
    pub(crate) fn take(&mut self, index: u64, fill: impl Fn(&mut Moment)) {
        for shot in self.0.iter_mut().filter(|shot| shot.tick == index) {
            fill(&mut shot.moment);
            shot.taken = true;
        }
    }

    /// Returns the kept ticks. `period`: length of a tick, s.
    pub(crate) fn kept(&mut self, period: f64) -> Vec<Moment> {
        let timed = |shot: Shot| Moment { time: shot.tick as f64 * period, ..shot.moment };
        self.0.drain(..).filter(|shot| shot.taken).map(timed).collect()
    }
}
