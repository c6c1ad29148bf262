//! Which of the written wrenches acted on the device between two ticks.

use glam::DVec3;
use palpus::algebra::Wrench;

/// Largest delay, in ticks. No real servo loop has so long a delay.
pub(crate) const DELAY_MAX: usize = 8;
/// Time, relative to the elapsed time, below which a remainder counts as a rounding error.
const SLIVER: f64 = 1e-9;

/// The last written wrenches, and their delay.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Acting {
    /// The written wrenches, newest first.
    written: [Wrench; DELAY_MAX + 1],
    /// Time from each write to the next write, s, newest first. For the newest write, the time
    /// until the last tick.
    held: [f64; DELAY_MAX + 1],
    /// Time from a write until the wrench acts, s.
    delay: f64,
}

impl Acting {
    /// Takes a delay of `delay` seconds between a write and its action, rounded to ticks of
    /// `period` seconds, at most [`DELAY_MAX`] ticks.
    pub(crate) fn new(delay: f64, period: f64) -> Self {
        let ticks = (delay / period).round().clamp(0.0, DELAY_MAX as f64);
        let held = [period; DELAY_MAX + 1];
        Self { written: [Wrench::ZERO; DELAY_MAX + 1], held, delay: ticks * period }
    }

    /// Stores the wrench written in this tick.
    pub(crate) fn write(&mut self, wrench: &Wrench) {
        self.written.copy_within(0..DELAY_MAX, 1);
        self.held.copy_within(0..DELAY_MAX, 1);
        self.written[0] = *wrench;
    }

    /// Returns the wrench that acted on the device in the `elapsed` seconds since the last write.
    /// If several wrenches acted, returns their mean, weighted by time.
    pub(crate) fn over(&mut self, elapsed: f64) -> Wrench {
        self.held[0] = elapsed;
        let sliver = elapsed * SLIVER;
        // Wrenches written in the last `delay` seconds have not reached the device yet.
        let (mut ahead, mut left) = (self.delay, elapsed);
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        for (k, (wrench, held)) in self.written.iter().zip(self.held).enumerate() {
            let skipped = held.min(ahead);
            ahead -= skipped;
            // The oldest stored wrench also stands for all earlier wrenches.
            let acted = if k == DELAY_MAX { left } else { (held - skipped).min(left) };
            if ahead <= sliver && acted >= elapsed - sliver {
                return *wrench;
            }
            if acted > sliver {
                force += wrench.force * (acted / elapsed);
                torque += wrench.torque * (acted / elapsed);
                left -= acted;
                if left <= sliver {
                    break;
                }
            }
        }
        Wrench { torque, force }
    }

    /// Discards the stored wrenches, as if only zero had been written.
    pub(crate) fn clear(&mut self) {
        self.written = [Wrench::ZERO; DELAY_MAX + 1];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pull(newtons: f64) -> Wrench {
        Wrench { torque: DVec3::ZERO, force: DVec3::X * newtons }
    }

    #[test]
    fn delayed_wrench_acts_for_its_share_of_long_tick() {
        let mut acting = Acting::new(1e-3, 1e-3);
        acting.write(&pull(1.0));
        assert_eq!(acting.over(1e-3), Wrench::ZERO);
        acting.write(&pull(2.0));
        assert_eq!(acting.over(1e-3), pull(1.0), "exactly the wrench of one tick earlier");
        // This tick lasts ten periods: the last wrench acts in nine of them.
        acting.write(&pull(12.0));
        assert!((acting.over(1e-2).force.x - (0.1 * 2.0 + 0.9 * 12.0)).abs() < 1e-12);
        acting.write(&pull(5.0));
        assert_eq!(acting.over(1e-3), pull(12.0));
        assert_eq!(acting.over(0.0), pull(12.0));
    }
}
