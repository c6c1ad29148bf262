//! Runs the sweeps of [`palpus_scenes::sweep`] over the scenes and over real models: the depth to
//! which contact persists, and its errors.
//!
//! Limitation: the asserted bounds are the measured figures plus a margin. Ideally all points would
//! be correct.

use std::path::Path;
use std::sync::Arc;

use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus_io::read_mesh;
use palpus_scenes::sweep::{DepthErrors, PopThrough, depth_errors, pop_through};
use palpus_scenes::{scene, scenes};

const SEED: u64 = 0x2002_0809;

fn build(soup: &PolygonSoup) -> Arc<Body> {
    let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    Arc::new(Body::from_soup(soup, &settings, &mut |_| ()).unwrap())
}

/// Sweeps a body and asserts the guaranteed bounds. Contact persists in 98 % of the pushes. The
/// median error of the depth is at most 2 %. Except for rounding and edge–edge contacts, no depth
/// exceeds 1.25 times the true depth.
fn sweep_and_hold(name: &str, body: &Arc<Body>, samples: usize) {
    let (push, errors) = sweep(name, body, samples);
    assert!(push.held >= 0.98 && push.grew >= 0.8, "{name}, seed {SEED:#x}: {push:?}");
    assert!(errors.error[0] <= 0.02 && errors.unseen <= 0.05, "{name}, seed {SEED:#x}: {errors:?}");
    assert!(errors.beyond <= 0.002 && errors.worst <= 1.6, "{name}, seed {SEED:#x}: {errors:?}");
}

/// Sweeps a body, and prints and returns the figures.
#[allow(clippy::print_stderr, reason = "figures for the record")]
fn sweep(name: &str, body: &Arc<Body>, samples: usize) -> (PopThrough, DepthErrors) {
    let push = PopThrough::of(&pop_through(body, samples, SEED));
    let errors = DepthErrors::of(&depth_errors(body, samples, SEED));
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    eprintln!(
        "{name:>36} {:>6} pieces  held {:>7} grew {:>7}  unseen {:>6} error {:>6} {:>6} turn {:.1}° {:.1}° beyond {:>6} worst {:.2}",
        body.pieces().len(),
        percent(push.held),
        percent(push.grew),
        percent(errors.unseen),
        percent(errors.error[0]),
        percent(errors.error[1]),
        errors.turn[0].to_degrees(),
        errors.turn[1].to_degrees(),
        percent(errors.beyond),
        errors.worst,
    );
    (push, errors)
}

#[test]
fn small_scenes_have_deep_accurate_contact() {
    for name in ["spoon-cup", "torus-torus", "v-groove"] {
        let scene = scene(name).unwrap();
        for (part, soup) in [("probe", &scene.probe), ("environment", &scene.environment)] {
            sweep_and_hold(&format!("{name} {part}"), &build(soup), 100);
        }
    }
}

#[test]
#[ignore = "minutes over real models: cargo test --release -p palpus-scenes -- --ignored --nocapture sweeps"]
fn sweeps_over_scenes_and_models() {
    for entry in scenes() {
        let scene = entry.build();
        for (part, soup) in [("probe", &scene.probe), ("environment", &scene.environment)] {
            let body = build(soup);
            if body.mesh().is_closed() {
                sweep_and_hold(&format!("{} {part}", scene.name), &body, 1000);
            }
        }
    }
    let models = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/models"));
    for folder in ["paper", "parts", "pairs"] {
        let Ok(listing) = std::fs::read_dir(models.join(folder)) else { continue };
        let mut files: Vec<_> = listing.filter_map(|entry| Some(entry.ok()?.path())).collect();
        files.sort();
        for file in files.iter().filter(|file| file.extension().is_some_and(|end| end == "obj")) {
            let body = build(&read_mesh(file).unwrap());
            if body.mesh().is_closed() {
                sweep_and_hold(&file.file_name().unwrap().to_string_lossy(), &body, 1000);
            }
        }
    }
}
