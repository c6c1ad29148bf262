//! Random damage: mutated messages, and a service that fails often.

use std::time::Duration;

use glam::DVec3;
use palpus::algebra::Random;
use serde_json::json;

use super::super::exchange::ANSWER_TIME;
use super::super::*;
use super::service::{Act, Service, frame, inventory};
use super::{assert_no_force_twice, wrench};

const MUTATION_SEED: u64 = 0x4a91_7e55;

#[test]
fn mutated_message_gives_no_panic_and_no_invalid_number() {
    let mut random = Random::new(MUTATION_SEED);
    let texts = [inventory().to_string(), frame(7).to_string()];
    let pieces =
        ["1e999", "-1e308", "null", "{}", "[]", "\"", "{", "}", "true", "1e-320", "\\ud800", "NaN", ",", "0.5"];
    let mut understood = 0;
    for round in 0..20_000 {
        let mut text = texts[round % 2].clone().into_bytes();
        for _ in 0..=random.below(3) {
            let at = random.below(text.len());
            let until = (at + random.below(12)).min(text.len());
            text.splice(at..until, pieces[random.below(pieces.len())].bytes());
        }
        let text = String::from_utf8_lossy(&text);
        let _ = message::inventory(&text);
        if let Ok(sample) = message::sample(&text, "04C3", Some("1102")) {
            let turned = sample.rotation.is_none_or(|rotation| (rotation.length() - 1.0).abs() < 1e-9);
            assert!(
                sample.position.is_finite() && sample.velocity.is_finite() && turned,
                "seed {MUTATION_SEED:#x}, round {round}: {text}"
            );
            understood += 1;
        }
    }
    assert!(understood > 1000, "seed {MUTATION_SEED:#x}: only {understood} messages were valid");
}

const MISCHIEF_SEED: u64 = 0x11ae_57a1;
/// Number of messages that the failing service answers.
const MISCHIEFS: usize = 700;

/// Returns a random number for each message. The number selects the service's answer; most numbers
/// select a correct answer.
fn mischief() -> Vec<u8> {
    let mut random = Random::new(MISCHIEF_SEED);
    // The opening must succeed.
    (0..MISCHIEFS).map(|k| if k < 5 { 255 } else { random.below(64) as u8 }).collect()
}

#[test]
fn no_force_is_stale_with_a_failing_service() {
    let acts = mischief();
    let script = acts.clone();
    let service = Service::usual(move |count| match script.get(count) {
        Some(0) => Act::Silence,
        Some(1) => Act::After(Duration::from_millis(11)),
        Some(2) => Act::Say(vec!["nonsense".to_owned()]),
        Some(3) => Act::Say(vec![json!({ "inverse3": [] }).to_string()]),
        Some(4..7) => Act::Say(vec![frame(count).to_string(), frame(count).to_string()]),
        Some(7) => Act::Say(vec![frame(count).to_string(), "nonsense".to_owned()]),
        Some(8) => Act::Binary,
        _ => Act::Answer,
    });
    let mut device = service.open();
    while service.received.lock().unwrap().len() < MISCHIEFS {
        // The force encodes the state on which it is based.
        let state = device.read().unwrap();
        device.write(&wrench(DVec3::new(1.0, state.pose.translation.z, 1e-3 * device.serial as f64))).unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
    let counts = device.counts();
    let all = service.received();
    assert_no_force_twice(&all);
    let mut pushed = 0;
    for (k, received) in all.iter().enumerate().take(MISCHIEFS).filter(|(_, received)| received.force != DVec3::ZERO) {
        let knows = (received.force.y * 1e3).round() as usize;
        // Each answer that arrived too late may be taken for the answer to the next message, so the
        // force may be based on an older state.
        let given_up = (knows + 1..=k).filter(|at| all[*at].at - all[at - 1].at >= ANSWER_TIME).count();
        assert!(
            knows < k && k - knows <= 3 + given_up,
            "seed {MISCHIEF_SEED:#x}: message {k} is based on state {knows}"
        );
        // If the earlier answer came twice, its second frame takes the place of the lost answer. On
        // a busy machine an answer may arrive too late. The device then takes such an answer for
        // the answer to the next message, until there is time to discard a message.
        let in_time =
            |lost: &usize| (lost.saturating_sub(4).max(1)..=*lost).all(|at| all[at].at - all[at - 1].at < ANSWER_TIME);
        let is_seen = |lost: &usize| !matches!(acts[lost - 1], 4..8) && in_time(lost);
        let lost = (5..k).rev().filter(|&k| matches!(acts[k], 0 | 2 | 3 | 8)).find(is_seen);
        assert!(
            lost.is_none_or(|lost| knows > lost),
            "seed {MISCHIEF_SEED:#x}: message {k} is based on state {knows}, but answer {lost:?} was lost"
        );
        pushed += 1;
    }
    assert!(pushed > MISCHIEFS / 4 && counts.late + counts.bad > 5, "{pushed} forces, {counts:?}");
}

/// Found by fuzzing: an id with control characters got into lines of text.
#[test]
fn id_with_control_characters_is_ignored() {
    let inventory = json!({ "inverse3": [{ "device_id": "048\u{8}\n" }, { "device_id": "049D" }] });
    let arms = message::inventory(&inventory.to_string()).expect("the inventory is valid").arms;
    assert_eq!(arms.iter().map(|arm| arm.id.as_str()).collect::<Vec<_>>(), ["049D"]);
    assert_eq!(message::sample(&inventory.to_string(), "048\u{8}\n", None).unwrap_err().lines().count(), 1);
}
