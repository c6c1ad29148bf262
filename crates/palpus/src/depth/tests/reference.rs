//! Poses with known depths. The test does nothing if the reference files are absent.

use super::*;

/// Returns the folders of reference pairs; empty if this checkout has no reference files beside it.
fn reference_folders() -> Vec<std::path::PathBuf> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference/convex");
    let Ok(entries) = std::fs::read_dir(root) else { return Vec::new() };
    let mut folders: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    folders.sort();
    folders
}

fn numbers(line: &str, separator: char) -> Vec<f64> {
    line.split(separator).filter_map(|word| word.trim().parse().ok()).collect()
}

fn read_hull(path: &std::path::Path) -> Polytope {
    let text = std::fs::read_to_string(path).unwrap();
    let points: Vec<DVec3> = text
        .lines()
        .filter_map(|line| line.strip_prefix("v "))
        .map(|line| DVec3::from_slice(&numbers(line, ' ')))
        .collect();
    solid(&points)
}

fn read_poses(path: &std::path::Path) -> Vec<Pose> {
    let text = std::fs::read_to_string(path).unwrap();
    let pose = |line: &str| {
        let n = numbers(line, ',');
        Pose::new(DQuat::from_xyzw(n[3], n[4], n[5], n[6]), DVec3::new(n[0], n[1], n[2]))
    };
    text.lines().skip(1).map(pose).collect()
}

/// Returns (frame, depth) for each line of a `.depth` file.
fn read_depths(path: &std::path::Path) -> Vec<(usize, f64)> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().map(|line| numbers(line, ' ')).map(|n| (n[0] as usize, n[1])).collect()
}

#[test]
#[allow(clippy::print_stderr, reason = "the share of local answers is a measurement to be seen")]
fn reference_depths_are_reproduced() {
    let mut scratch = DepthScratch::new();
    let (mut random, mut sliding) = (Tally::default(), Tally::default());
    for folder in reference_folders() {
        let (a, b) = (read_hull(&folder.join("a.obj")), read_hull(&folder.join("b.obj")));
        let size = a.radius() + b.radius();
        let (mut cold, mut warm) = (Tally::default(), Tally::default());
        let poses = read_poses(&folder.join("random.csv"));
        for (frame, exact) in read_depths(&folder.join("random.depth")) {
            let placement = poses[frame].placement();
            let answer = depth(&a, &b, &placement, &[], &mut scratch);
            let what = format!("{folder:?} random {frame}");
            assert_identities(&a, &b, &placement, &answer, &what);
            if exact >= 0.0 {
                assert!(answer.depth >= exact - 1e-9 * size, "{what}: {} below {exact}", answer.depth);
                cold.add(answer.depth, exact, size);
                random.add(answer.depth, exact, size);
            }
        }
        let exact: std::collections::HashMap<_, _> = read_depths(&folder.join("sliding.depth")).into_iter().collect();
        let mut previous: Option<Depth> = None;
        let mut steps = 0;
        for (frame, pose) in read_poses(&folder.join("sliding.csv")).into_iter().enumerate() {
            let placement = pose.placement();
            let seed = previous.map_or(Seed::CentroidLine, |d| d.seed());
            let answer = depth(&a, &b, &placement, &[seed], &mut scratch);
            let what = format!("{folder:?} sliding {frame}");
            assert_identities(&a, &b, &placement, &answer, &what);
            if let Some(&exact) = exact.get(&frame)
                && exact >= 0.0
            {
                assert!(answer.depth >= exact - 1e-9 * size, "{what}: {} below {exact}", answer.depth);
                warm.add(answer.depth, exact, size);
                sliding.add(answer.depth, exact, size);
            }
            steps += answer.steps;
            previous = Some(answer);
        }
        let name = folder.file_name().unwrap_or_default().display();
        let Tally { poses, local, worst } = cold;
        eprintln!(
            "{name}: random {local}/{poses} local only (by {worst:.1e}), sliding {}/{} (by {:.1e}), {steps} moves",
            warm.local, warm.poses, warm.worst
        );
    }
    eprintln!("all: random {}/{} local only, sliding {}/{}", random.local, random.poses, sliding.local, sliding.poses);
    assert!(random.share() <= 0.01);
    assert_eq!(sliding.local, 0);
}
