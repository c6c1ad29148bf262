//! Messages of Haply's service: the inventory, and the states of all its arms and grips.
#![no_main]

use palpus_device::haply_messages::{inventory, sample};
use palpus_fuzz::{Allowance, Seed, target};

fn run(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let (mut arms, mut grips) = (vec!["049D".to_owned()], vec![None, Some("G1".to_owned())]);
    match inventory(text) {
        Ok(there) => {
            for arm in there.arms {
                assert!((1..=64).contains(&arm.id.len()));
                arms.push(arm.id);
            }
            for grip in there.grips {
                assert!((1..=64).contains(&grip.id.len()));
                grips.push(Some(grip.id));
            }
        }
        Err(why) => assert!(why.len() < 400 && !why.contains('\n'), "{why}"),
    }
    // If the input contains arms or grips, the last arm or grip comes from the input.
    for arm in [arms.first(), arms.last()].into_iter().flatten() {
        for grip in [grips.first(), grips.last()].into_iter().flatten() {
            match sample(text, arm, grip.as_deref()) {
                Ok(sample) => {
                    assert!(sample.position.is_finite() && sample.velocity.is_finite());
                    assert!(sample.rotation.is_none_or(|q| q.is_finite() && (q.length() - 1.0).abs() < 1e-9));
                }
                Err(why) => assert!(why.len() < 400 && !why.contains('\n'), "{why}"),
            }
        }
    }
}

fn seeds() -> Vec<Seed> {
    let full = r#"{"inverse3":[{"device_id":"049D","config":{"device_info":{"device_type":"inverse3"},"type":4,"handedness":"right",
"filters":{"damping":{"enabled":true},"force_gate":0.5},"basis":{"permutation":"XZY"},"extended_firmware_version":"1.2","mount":{}},
"state":{"cursor_position":{"x":0.1,"y":-2e-2,"z":0},"cursor_velocity":{"x":0,"y":0,"z":1},"body_orientation":{"w":1,"x":0,"y":0,"z":0}},
"status":{"calibrated":true,"in_use":false,"power_supply":true,"ready":true,"started":true}}],
"wireless_verse_grip":[{"device_id":"G1","state":{"orientation":{"w":0.8,"x":0.6,"y":0,"z":0},"buttons":{"a":true,"b":false,"c":true}}}],
"verse_grip":[{"device_id":"G1","state":{"orientation":{},"button":true,"hall":3}}],"custom_verse_grip":[]}"#;
    let old = r#"{"inverse3":[{"device_id":"049D","config":{"type":"minverse"},"state":{"cursor_position":{"x":1e400,"y":"0","z":null},
"cursor_velocity":{}},"status":{"ready":false}},{"device_id":7}],"verse_grip":{}}"#;
    let deep = format!("{{\"inverse3\":{}{}}}", "[".repeat(140), "]".repeat(140));
    vec![("full".to_owned(), full.into()), ("old".to_owned(), old.into()), ("deep".to_owned(), deep.into())]
}

target!(run: run, allowance: Allowance { per_byte: 400, always: 1 << 20 }, seeds: seeds);
