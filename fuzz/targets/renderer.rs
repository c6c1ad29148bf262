//! A renderer with arbitrary valid settings, which change between steps, and with arbitrary states.
//! In every tick, the commanded wrench is finite and within the limits.
#![no_main]

use palpus::render::{ProbeState, Renderer, Settings};
use palpus_fuzz::{Allowance, Bytes, Seed, drive, target};

fn run(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let (a, b) = (drive::body(&mut bytes), drive::body(&mut bytes));
    let mut settings = drive::settings(&mut bytes);
    let size = a.size() + b.size();
    let Ok(mut renderer) = Renderer::new(a, b, settings) else { return };
    if bytes.byte() > 128 {
        renderer = renderer.with_surfaces(3.1 * bytes.share());
    }
    let clock = drive::Leaps::of(u64::from(bytes.byte()) * 64);
    let mut probe = ProbeState::at(bytes.pose(0.01));
    for _ in 0..24 {
        let dt = drive::step_length(&mut bytes);
        let tick = renderer.step(&probe, dt, &clock);
        drive::check_tick(tick, &settings, size);
        assert!(tick.contacts.len() <= settings.capacity);
        match bytes.byte() {
            231.. => renderer.clear(),
            210..231 => {
                let others = drive::settings(&mut bytes);
                let others = Settings { capacity: settings.capacity, ..others };
                if renderer.set_settings(&others).is_ok() {
                    settings = others;
                }
                assert_eq!(renderer.settings().validate(), Ok(()));
            }
            _ => {}
        }
        if bytes.is_empty() {
            break;
        }
        probe = drive::state(&mut bytes, &probe);
    }
}

fn seeds() -> Vec<Seed> {
    // A block moves into an L step by step, with each kind of settings.
    let mut seeds = Vec::new();
    for flags in [0, 1, 2, 4, 8 | 16, 32, 64, 128, 1 | 2 | 4, 255] {
        let mut input = vec![0, 2, flags];
        input.extend([60; 24]);
        input.extend([0, 100, 100, 120]);
        for k in 0..20u8 {
            input.extend([0, 0, 50, 0, 100, 100 + (k & 1), 90, 100, 100, 100, 0, 100, 100, 100]);
        }
        seeds.push((format!("block-{flags}"), input));
    }
    seeds
}

target!(run: run, allowance: Allowance { per_byte: 0, always: 128 << 20 }, seeds: seeds);
