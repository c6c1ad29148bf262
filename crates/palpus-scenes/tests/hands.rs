//! Tests paths from recorded motions of real hands. The test does nothing if the recordings are
//! absent.

use std::path::Path;

use palpus_io::{HandFile, read_hand};
use palpus_scenes::{HandPath, Placement};

/// File names, and the largest allowed changes of velocity (m/s) and angular velocity (rad/s) in
/// one millisecond. The recordings show a person with a hand-held camera, and a person who leads a
/// robot's arm.
const HANDS: [(&str, f64, f64); 2] =
    [("tum_fr2_desk_300hz.txt", 0.05, 0.3), ("ur_kinesthetic_teaching_500hz.csv", 0.03, 0.1)];

#[test]
fn recorded_hands_give_smooth_accurate_paths() {
    for (name, linear, angular) in HANDS {
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/models/trajectories"));
        let Ok(HandFile::Recorded(hand)) = read_hand(&folder.join(name)) else { continue };
        let first = hand.samples[0].1;
        let path = HandPath::recorded(&hand.samples, &Placement::at(first)).expect("a path");
        assert!((path.duration() - hand.duration()).abs() < 0.02, "{name}: {} s", path.duration());
        let (mut last, mut largest) = (path.twist(0.0), [0f64; 2]);
        for k in 1..(path.duration() * 1e3) as u32 {
            let twist = path.twist(f64::from(k) * 1e-3);
            let steps = [twist.linear.distance(last.linear), twist.angular.distance(last.angular)];
            largest = [0, 1].map(|which| largest[which].max(steps[which]));
            last = twist;
        }
        assert!(largest[0] < linear && largest[1] < angular, "{name}: {largest:?}");
        let mut worst: f64 = 0.0;
        let inside = |time: &f64| (0.4..hand.duration() - 0.4).contains(time);
        for (time, pose) in hand.samples.iter().filter(|(time, _)| inside(time)) {
            worst = worst.max(path.pose(*time).translation.distance(pose.translation));
        }
        assert!(worst < 3e-3, "{name}: {worst} m off");
    }
}
