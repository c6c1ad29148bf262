//! Identities that hold for any two bodies.

use super::*;

const SEED: u64 = 0x1de7_717e;

/// Returns true if the bounds of two results for the same depth overlap.
fn agree(p: &DepthBracket, q: &DepthBracket, slack: f64) -> bool {
    p.lower <= q.upper + slack && q.lower <= p.upper + slack
}

#[test]
fn exchanging_bodies_keeps_the_depth() {
    let mut random = Random::new(SEED);
    let (a, b) = (body(&ell()), body(&groove()));
    let (inside_a, inside_b) = (interior(&a), interior(&b));
    let forth = GlobalDepth::new(&a, &inside_a, &b, &inside_b);
    let back = GlobalDepth::new(&b, &inside_b, &a, &inside_a);
    let settings = GlobalSettings { gap: 1e-3, ..GlobalSettings::new(&a, &b) };
    for case in 0..20 {
        let pose = random_pose(&mut random, 1.0);
        let p = forth.run(&pose, &settings, &mut GlobalMemory::default());
        let q = back.run(&pose.inverse(), &settings, &mut GlobalMemory::default());
        assert!(agree(&p, &q, 1e-9), "seed {SEED}, case {case}: {p:?} {q:?}");
        // Moving body a by t is equivalent to moving b by −t.
        let surfaces = Surfaces::new((&a, &inside_a.components), (&b, &inside_b.components), &pose);
        assert!(surfaces.is_free(-pose.vector(q.translation)), "seed {SEED}, case {case}");
        assert!(p.upper <= a.size() + b.size());
    }
}

#[test]
fn moving_both_bodies_keeps_the_depth() {
    let mut random = Random::new(SEED);
    let settings = |a: &Body, b: &Body| GlobalSettings { gap: 1e-3, ..GlobalSettings::new(a, b) };
    for case in 0..6 {
        let (pose, moved) = (random_pose(&mut random, 1.0), random_pose(&mut random, 2.0));
        let (a, b) = (body(&ell()), body(&groove()));
        let (inside_a, inside_b) = (interior(&a), interior(&b));
        let p =
            GlobalDepth::new(&a, &inside_a, &b, &inside_b).run(&pose, &settings(&a, &b), &mut GlobalMemory::default());
        let (c, d) = (body(&placed(placed(ell(), &pose), &moved)), body(&placed(groove(), &moved)));
        let (inside_c, inside_d) = (interior(&c), interior(&d));
        let query = GlobalDepth::new(&c, &inside_c, &d, &inside_d);
        let q = query.run(&Pose::IDENTITY, &settings(&c, &d), &mut GlobalMemory::default());
        assert!(agree(&p, &q, 1e-8), "seed {SEED}, case {case}: {p:?} {q:?}");
    }
}

#[test]
fn depth_changes_no_faster_than_the_motion() {
    let mut random = Random::new(SEED);
    let (a, b) = (body(&ell()), body(&groove()));
    let (inside_a, inside_b) = (interior(&a), interior(&b));
    let query = GlobalDepth::new(&a, &inside_a, &b, &inside_b);
    let settings = GlobalSettings { gap: 1e-3, ..GlobalSettings::new(&a, &b) };
    let mut pose = random_pose(&mut random, 0.5);
    let mut memory = GlobalMemory::default();
    let mut last: Option<DepthBracket> = None;
    for frame in 0..60 {
        let answer = query.run(&pose, &settings, &mut memory);
        let anew = query.run(&pose, &settings, &mut GlobalMemory::default());
        assert!(agree(&answer, &anew, 1e-12), "seed {SEED}, frame {frame}: {answer:?} {anew:?}");
        if let Some(last) = last {
            let low = answer.lower <= last.upper + 0.02 && last.lower <= answer.upper + 0.02;
            assert!(low, "seed {SEED}, frame {frame}: {last:?} {answer:?}");
        }
        last = Some(answer);
        pose.translation += random.direction() * 0.02;
    }
}

/// Two threads. The second thread takes its tasks in reverse order.
struct Pair;

impl Workers for Pair {
    fn each(&self, count: usize, work: &(dyn Fn(usize) + Sync), finished: &mut dyn FnMut(usize)) {
        std::thread::scope(|scope| {
            scope.spawn(|| (count / 2..count).rev().for_each(work));
            (0..count / 2).for_each(work);
        });
        finished(count);
    }
}

#[test]
fn results_do_not_depend_on_workers() {
    let (a, b) = (body(&ell()), body(&groove()));
    let alone = (interior(&a), interior(&b));
    let both = (Interior::new(&a, &Pair, &mut |_| ()), Interior::new(&b, &Pair, &mut |_| ()));
    let mut random = Random::new(SEED);
    for _ in 0..5 {
        let pose = random_pose(&mut random, 1.0);
        let settings = GlobalSettings::new(&a, &b);
        let p = GlobalDepth::new(&a, &alone.0, &b, &alone.1).run(&pose, &settings, &mut GlobalMemory::default());
        let q = GlobalDepth::new(&a, &both.0, &b, &both.1).run(&pose, &settings, &mut GlobalMemory::default());
        assert_eq!(p, q);
    }
}
