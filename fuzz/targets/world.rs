//! A world of one to three tools and up to six fixed, driven and free objects, which the host
//! changes between steps, with arbitrary states. Wrenches are finite and within their limits; poses
//! and momenta are finite. Forces between tools are opposite, and the momentum of free bodies that
//! touch only each other is conserved. Equal inputs give equal bits.
#![no_main]

use glam::DVec3;
use palpus::algebra::{Pose, Twist};
use palpus::render::{BodyId, Limits, Material, Object, ProbeState, Settings, ToolId, World};
use palpus_fuzz::{Allowance, Bytes, Seed, drive, target};

/// Number of steps of a world.
const STEPS: usize = 32;
/// Forces and momenta above this value may overflow when they are added or squared.
const LARGEST: f64 = 1e120;
/// Allowed rounding error of sums that cancel out, relative to their terms.
const SUM_SLACK: f64 = 1e-9;
/// Allowed rounding error of momenta, which is larger because a linear system is solved.
const MOMENTUM_SLACK: f64 = 1e-6;

/// Kind of an object; mass in kg for free objects.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Fixed,
    Driven,
    Free(f64),
}

/// A world and its content.
struct Scene {
    world: World,
    tools: Vec<(ToolId, Settings)>,
    objects: Vec<(BodyId, Kind)>,
    gravity: DVec3,
    /// True if the settings and masses have usual magnitudes, for which the linear systems are well
    /// conditioned.
    is_usual: bool,
}

/// Builds a scene; `None` if the world rejects the settings.
fn scene(bytes: &mut Bytes<'_>) -> Option<Scene> {
    let own = drive::settings(bytes);
    let mut scene = Scene {
        world: World::new(own).ok()?,
        tools: Vec::new(),
        objects: Vec::new(),
        gravity: DVec3::ZERO,
        is_usual: is_usual(&own),
    };
    let (tools, objects) = (1 + bytes.below(3), bytes.below(7));
    // Adds objects before, between and after the tools.
    for k in 0..tools.max(objects) {
        if k < objects {
            add_object(bytes, &mut scene);
        }
        if k < tools {
            let (body, mut settings) = (drive::body(bytes), drive::settings(bytes));
            settings.material =
                [None, Some(Material::RUBBER), Some(Material::WOOD), Some(Material::STEEL)][bytes.below(4)];
            let tool = scene.world.add_tool(body, settings).ok()?;
            if bytes.rarely() {
                scene.world.prepare_shading(tool, 3.1 * bytes.share());
            }
            scene.is_usual &= is_usual(&settings);
            scene.tools.push((tool, settings));
        }
    }
    Some(scene)
}

fn add_object(bytes: &mut Bytes<'_>, scene: &mut Scene) {
    let (body, kind) = (drive::body(bytes), bytes.byte());
    let pose = pose(bytes);
    let (object, kind) = match kind {
        0..=63 => (Object::fixed(body, pose), Kind::Fixed),
        64..=127 => (Object::driven(body, pose), Kind::Driven),
        128..=191 => {
            let density = drive::positive(bytes, 700.0);
            let mass = density * body.mass().volume;
            (Object::free(body, pose, density), Kind::Free(mass))
        }
        _ => {
            let mass = drive::positive(bytes, 0.05);
            (Object::free_of_mass(body, pose, mass), Kind::Free(mass))
        }
    };
    let valid = pose.is_valid() && !matches!(kind, Kind::Free(mass) if !(mass > 0.0 && mass.is_finite()));
    let added = scene.world.add(object);
    assert_eq!(added.is_ok(), valid, "{kind:?} at {pose:?}");
    if let Ok(body) = added {
        scene.is_usual &= !matches!(kind, Kind::Free(mass) if !(1e-3..1e2).contains(&mass));
        scene.objects.push((body, kind));
    }
}

fn is_usual(settings: &Settings) -> bool {
    (1.0..1e4).contains(&settings.stiffness)
        && settings.damping < 100.0
        && settings.friction.is_none_or(|friction| friction.tangential_stiffness < 1e4)
}

/// Returns a pose near the origin, far away, or of arbitrary numbers.
fn pose(bytes: &mut Bytes<'_>) -> Pose {
    match bytes.byte() {
        0..=219 => bytes.pose(0.01),
        220..=239 => {
            let scale = bytes.between(1e-6, 1e12);
            bytes.pose(scale)
        }
        _ => bytes.wild_pose(),
    }
}

/// Applies a change of the host between two steps.
fn change(bytes: &mut Bytes<'_>, scene: &mut Scene) {
    let Scene { world, tools, objects, gravity, is_usual: usual } = scene;
    let number = bytes.below(16);
    let place = number % tools.len();
    let (tool, settings) = &mut tools[place];
    let object = objects.get(number % objects.len().max(1)).copied();
    match bytes.byte() {
        0..=99 => {}
        100..=139 => {
            let (pose, twist) = (pose(bytes), bytes.twist());
            let Some((body, kind)) = object else { return };
            let valid = pose.is_valid() && is_finite(&twist);
            assert_eq!(world.drive(body, pose, twist), valid && kind == Kind::Driven);
        }
        140..=159 => {
            let pose = pose(bytes);
            let Some((body, _)) = object else { return };
            assert_eq!(world.put(body, pose), pose.is_valid());
            assert!(!world.put(world.body_of(*tool), pose), "the pose of a tool was set");
        }
        160..=179 => {
            let twist = bytes.twist();
            let Some((body, kind)) = object else { return };
            let thrown = world.throw(body, twist);
            assert!(!thrown || is_finite(&twist) && is_free(&kind), "{kind:?} got the velocity {twist:?}");
        }
        180..=199 => {
            let given =
                if bytes.rarely() { DVec3::new(bytes.any(), bytes.any(), bytes.any()) } else { 2.5 * bytes.point() };
            world.set_gravity(given);
            *gravity = if given.is_finite() { given } else { DVec3::ZERO };
        }
        200..=214 => {
            let others = drive::settings(bytes);
            let others = Settings { capacity: settings.capacity, material: settings.material, ..others };
            if world.set_tool_settings(*tool, &others).is_ok() {
                *settings = others;
                *usual &= is_usual(&others);
            }
            assert_eq!(world.tool_settings(*tool).validate(), Ok(()));
        }
        215..=229 => world.allow((!bytes.rarely()).then(|| u64::from(bytes.short()) / 16).into()),
        230..=239 => {
            let share = bytes.share();
            let Limits { force, torque } = settings.limits;
            world.set_available(*tool, &Limits { force: share * force, torque: share * torque });
        }
        _ => world.clear(),
    }
}

fn is_finite(twist: &Twist) -> bool {
    twist.angular.is_finite() && twist.linear.is_finite()
}

/// Runs an input and returns the numbers of every step as bits.
fn play(data: &[u8]) -> Vec<u64> {
    let mut bytes = Bytes::new(data);
    let Some(mut scene) = scene(&mut bytes) else { return Vec::new() };
    let clock = drive::Leaps::of(u64::from(bytes.byte()) * 64);
    let mut probes: Vec<_> = scene.tools.iter().map(|_| ProbeState::at(bytes.pose(0.01))).collect();
    let mut bits = Vec::new();
    for _ in 0..STEPS {
        let dt = drive::step_length(&mut bytes);
        // A device may be missing.
        let there = if bytes.rarely() { bytes.below(probes.len() + 1) } else { probes.len() };
        let (before, size) = (momentum(&scene), extent(&scene));
        scene.world.step(&probes[..there], dt, &clock);
        check(&scene, size);
        check_momentum(&scene, before, dt);
        record(&scene, &mut bits);
        change(&mut bytes, &mut scene);
        if bytes.is_empty() {
            break;
        }
        probes = probes.iter().map(|last| drive::state(&mut bytes, last)).collect();
    }
    bits
}

/// Returns the bodies of the tools and the objects.
fn bodies(scene: &Scene) -> impl Iterator<Item = BodyId> + Clone {
    let tools = scene.tools.iter().map(|(tool, _)| scene.world.body_of(*tool));
    tools.chain(scene.objects.iter().map(|(body, _)| *body))
}

/// Checks the guarantees of a step; `before` is the extent of the scene (m) at its start.
fn check(scene: &Scene, before: f64) {
    let Scene { world, tools, objects, .. } = scene;
    // The accuracy of contacts is limited by the farthest body.
    let size = before + extent(scene);
    let (mut sum, mut terms) = (DVec3::ZERO, 0.0);
    for (tool, settings) in tools {
        let tick = world.tick(*tool);
        drive::check_tick(tick, settings, size);
        sum += tick.from_other.force;
        terms += tick.from_other.force.length();
    }
    let is_exact = terms < LARGEST;
    assert!(
        !is_exact || sum.length() <= SUM_SLACK * terms,
        "the forces between tools sum to {sum} N (terms: {terms} N)"
    );
    for body in bodies(scene) {
        let (pose, twist, momentum) = (world.pose(body), world.twist(body), world.momentum(body));
        assert!(pose.is_valid(), "{body:?} is at {pose:?}");
        assert!(is_finite(&twist), "{body:?} moves with {twist:?}");
        assert!(momentum.is_finite(), "{body:?} has {momentum:?}");
    }
    let still = |kind: &Kind| *kind == Kind::Fixed;
    for (i, (one, a)) in objects.iter().enumerate() {
        for (other, b) in &objects[..i] {
            assert_eq!(world.settings_between(*one, *other).is_none(), [a, b].into_iter().all(|k| !is_free(k)));
            assert!(!(still(a) && still(b)) || world.contacts(*one, *other).next().is_none());
            for (own, turned) in world.contacts(*one, *other).zip(world.contacts(*other, *one)) {
                assert_eq!((own.normal, own.separation), (-turned.normal, turned.separation));
                assert_eq!((own.point_a, own.point_b), (turned.point_b, turned.point_a));
            }
        }
    }
}

fn is_free(kind: &Kind) -> bool {
    matches!(kind, Kind::Free(_))
}

/// Returns the sum of the sizes of all bodies and their distances from the origin (m); may be
/// infinite.
fn extent(scene: &Scene) -> f64 {
    let world = &scene.world;
    bodies(scene).map(|body| world.body(body).size() + world.pose(body).translation.length()).sum()
}

/// Returns the total linear momentum of all free bodies (N·s) and the sum of the lengths of its
/// terms.
fn momentum(scene: &Scene) -> (DVec3, f64) {
    let each = scene.objects.iter().map(|(body, _)| scene.world.momentum(*body).force);
    each.fold((DVec3::ZERO, 0.0), |(sum, terms), p| (sum + p, terms + p.length()))
}

/// Checks that free bodies that touch only each other change their total momentum only by their
/// weight.
fn check_momentum(scene: &Scene, (before, terms): (DVec3, f64), dt: f64) {
    let Scene { world, objects, gravity, is_usual, .. } = scene;
    let (free, others): (Vec<_>, Vec<_>) = objects.iter().copied().partition(|(_, kind)| is_free(kind));
    let others = others.iter().map(|(body, _)| *body);
    let others = others.chain(scene.tools.iter().map(|(tool, _)| world.body_of(*tool)));
    let is_touched = |body: BodyId| others.clone().any(|other| world.contacts(body, other).next().is_some());
    let is_step = dt > 0.0 && dt <= 0.1;
    if !is_usual || !is_step || world.counters().reset > 0 || free.iter().any(|(body, _)| is_touched(*body)) {
        return;
    }
    let mass: f64 = free.iter().map(|(_, kind)| if let Kind::Free(mass) = kind { *mass } else { 0.0 }).sum();
    let weight = *gravity * mass * dt;
    let (after, terms_after) = momentum(scene);
    let terms = terms + terms_after + weight.length();
    let left = (after - before - weight).length();
    let is_exact = terms < LARGEST;
    assert!(
        !is_exact || left <= MOMENTUM_SLACK * terms,
        "the momentum changed by {left:e} N·s without cause (terms: {terms:e} N·s)"
    );
}

/// Appends the results of a step that a user can read.
fn record(scene: &Scene, bits: &mut Vec<u64>) {
    let mut put = |v: DVec3| bits.extend(v.to_array().map(f64::to_bits));
    for (tool, _) in &scene.tools {
        let tick = scene.world.tick(*tool);
        for wrench in [tick.commanded, tick.computed, tick.from_other, tick.from_objects] {
            put(wrench.force);
            put(wrench.torque);
        }
    }
    for body in bodies(scene) {
        let (pose, twist) = (scene.world.pose(body), scene.world.twist(body));
        for v in [pose.translation, pose.rotation.xyz(), twist.linear, twist.angular] {
            put(v);
        }
    }
}

fn run(data: &[u8]) {
    assert!(play(data) == play(data), "two runs of the same input differ");
}

fn seeds() -> Vec<Seed> {
    let mut seeds = Vec::new();
    for flags in [0u8, 1, 2, 3, 4, 8 | 16, 32, 64, 128, 1 | 2 | 4, 255] {
        for (tools, objects) in [(1u8, 1u8), (1, 6), (2, 3), (3, 4)] {
            let settings = |input: &mut Vec<u8>| {
                // The number of bytes that `drive::settings` reads for each flag.
                let optional = [(1, 10), (2, 3), (4, 4), (16, 2), (32, 2), (64, 3), (128, 3)];
                let taken: usize =
                    optional.iter().map(|&(flag, count)| if flags & flag != 0 { count } else { 0 }).sum();
                input.push(flags);
                input.extend(std::iter::repeat_n(60, 14 + taken));
            };
            let mut input = Vec::new();
            settings(&mut input);
            input.extend([tools - 1, objects]);
            for k in 0..tools.max(objects) {
                if k < objects {
                    // Stacks objects of each kind in turn.
                    let kind = [0, 200, 140, 80, 150, 210][usize::from(k)];
                    input.extend([k & 1, kind, 0, 0, 100, 100, 30 + 62 * (k & 1)]);
                    if kind >= 128 {
                        input.push(60);
                    }
                }
                if k < tools {
                    input.push(k);
                    settings(&mut input);
                    input.extend([k, 0]);
                }
            }
            input.push(0);
            for k in 0..tools {
                input.extend([0, 90 + 20 * k, 100, 150]);
            }
            for step in 0..24u8 {
                // Changes of gravity come first, then changes of driven bodies and of velocities.
                input.extend([0, 0]);
                match step {
                    0 => input.extend([0, 190, 0, 100, 100, 0]),
                    4 | 9 | 14 => input.extend([3, 120, 0, 0, 100, 110, 100, 0, 100, 100, 100, 0, 100, 110, 100]),
                    12 => input.extend([1, 170, 0, 110, 100, 100, 0, 100, 100, 120]),
                    _ => input.extend([0, 0]),
                }
                for k in 0..tools {
                    let height = 150 - 3 * step;
                    input.extend([150, 0, 90 + 10 * k, 100, height, 0, 100, 100, 100, 0, 100, 100, 90]);
                }
            }
            seeds.push((format!("world-{flags}-{tools}-{objects}"), input));
        }
    }
    seeds
}

target!(run: run, allowance: Allowance { per_byte: 0, always: 512 << 20 }, seeds: seeds);
