//! Two tools in one scene, with arbitrary settings and states. Both wrenches are finite and within
//! their limits.
#![no_main]

use palpus::algebra::Pose;
use palpus::render::{Object, ProbeState, Settings, World};
use palpus_fuzz::{Allowance, Bytes, Seed, drive, target};

fn run(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let [a, b, environment] = [0; 3].map(|_| drive::body(&mut bytes));
    let mut settings = [0; 2].map(|_| drive::settings(&mut bytes));
    let sizes = [&a, &b].map(|tool| tool.size() + environment.size());
    let Ok(mut world) = World::new(settings[0]) else { return };
    let Ok(_) = world.add(Object::fixed(environment, Pose::IDENTITY)) else { return };
    let (Ok(one), Ok(other)) = (world.add_tool(a, settings[0]), world.add_tool(b, settings[1])) else { return };
    let tools = [one, other];
    let clock = drive::Leaps::of(u64::from(bytes.byte()) * 64);
    let mut probes = [0; 2].map(|_| ProbeState::at(bytes.pose(0.01)));
    for _ in 0..16 {
        let dt = drive::step_length(&mut bytes);
        world.step(&probes, dt, &clock);
        let ticks = tools.map(|tool| world.tick(tool));
        // The accuracy of contacts between the tools is limited by the position of the farther
        // tool.
        let away: f64 = ticks.iter().map(|tick| tick.tool_ba.translation.length()).filter(|far| far.is_finite()).sum();
        for ((tick, settings), size) in ticks.into_iter().zip(&settings).zip(sizes) {
            drive::check_tick(tick, settings, size + away);
        }
        match bytes.byte() {
            231.. => world.clear(),
            210..231 => {
                let k = bytes.below(2);
                let others = Settings { capacity: settings[k].capacity, ..drive::settings(&mut bytes) };
                if world.set_tool_settings(tools[k], &others).is_ok() {
                    settings[k] = others;
                }
            }
            _ => {}
        }
        if bytes.is_empty() {
            break;
        }
        probes = probes.map(|last| drive::state(&mut bytes, &last));
    }
}

fn seeds() -> Vec<Seed> {
    let mut seeds = Vec::new();
    for flags in [0, 1, 2, 4, 8 | 16, 32, 64, 128, 1 | 2 | 4, 255] {
        let mut input = vec![0, 1, 2];
        for _ in 0..2 {
            input.push(flags);
            input.extend([60; 22]);
        }
        input.extend([0, 0, 100, 100, 120, 0, 110, 100, 120]);
        for k in 0..12u8 {
            input.extend([0, 0]);
            for side in [90, 100] {
                input.extend([50, 0, side, 100 + (k & 1), 90, 0, 100, 100, 100, 0, 100, 100, 100]);
            }
        }
        seeds.push((format!("two-{flags}"), input));
    }
    seeds
}

target!(run: run, allowance: Allowance { per_byte: 0, always: 256 << 20 }, seeds: seeds);
