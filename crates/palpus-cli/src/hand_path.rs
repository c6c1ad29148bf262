//! Files that a hand follows: poses half a second apart, or a recorded hand with times.

use std::path::Path;

use anyhow::{Context, bail};
use palpus::algebra::Pose;
use palpus_io::{HandFile, RecordedHand, read_hand};
use palpus_scenes::{HandPath, Key, Placement};

use crate::output;

/// Seconds between two poses of a file without times.
pub(crate) const POSE_PERIOD: f64 = 0.5;
/// Largest distance of the hand from its start without a warning, in sizes of the probe. Farther
/// away, the probe will hardly touch anything.
const FAR_SIZES: f64 = 20.0;

/// Options for following a file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Following {
    /// Start pose of a recorded hand; poses without times are not moved.
    pub(crate) start: Pose,
    /// Metres for each unit of poses without times.
    pub(crate) metres_per_unit: f64,
    /// Factor of the translations of a recorded hand.
    pub(crate) scale: f64,
    /// Factor of the speed of a recorded hand.
    pub(crate) speed: f64,
    /// Size of the probe, m.
    pub(crate) size: f64,
}

/// Returns the path through the poses of the file.
pub(crate) fn follow(file: &Path, how: &Following) -> anyhow::Result<HandPath> {
    match read_hand(file)? {
        HandFile::Poses(poses) => through(&poses, file, how),
        HandFile::Recorded(hand) => recorded(&hand, file, how),
    }
}

fn through(poses: &[Pose], file: &Path, how: &Following) -> anyhow::Result<HandPath> {
    if poses.len() < 2 {
        bail!("{} has {} poses; a hand's path needs at least two", file.display(), poses.len());
    }
    let last = poses.len() - 1;
    let keys: Vec<Key> = poses
        .iter()
        .enumerate()
        .map(|(k, pose)| {
            let metric = Pose { translation: pose.translation * how.metres_per_unit, ..*pose };
            let time = k as f64 * POSE_PERIOD / how.speed;
            if k == 0 || k == last { Key::rest(time, metric) } else { Key::through(time, metric) }
        })
        .collect();
    Ok(HandPath::through(&keys))
}

fn recorded(hand: &RecordedHand, file: &Path, how: &Following) -> anyhow::Result<HandPath> {
    let Following { start, scale, speed, .. } = *how;
    let path = HandPath::recorded(&hand.samples, &Placement { start, scale, speed })
        .with_context(|| format!("{} cannot be followed", file.display()))?;
    let reach = hand.reach() * scale;
    if reach > FAR_SIZES * how.size {
        output::note(format!(
            "note: the hand of {} moves {:.0} cm from its start, but the probe has only {:.1} cm; scale the path to keep the probe near (--hand-scale, or path_scale under [hand])",
            file.display(),
            reach * 100.0,
            how.size * 100.0
        ));
    }
    Ok(path)
}
