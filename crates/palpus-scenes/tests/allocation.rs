//! Tests that no step of any scene allocates memory, with several settings.

use std::sync::Arc;

use palpus::algebra::NoClock;
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::{Clustering, ProbeState, Renderer, Settings, VirtualCoupling};
use palpus_alloc::{CountingAllocator, allocations_of_this_thread};
use palpus_scenes::scenes;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn body(soup: &PolygonSoup) -> Arc<Body> {
    let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    Arc::new(Body::from_soup(soup, &settings, &mut |_| ()).expect("a scene's mesh is a valid body"))
}

/// Number of ticks of each variant, in several continuous parts of the scene's path.
const TICKS: u32 = 600;
/// Number of continuous parts of the path that a variant runs.
const STRETCHES: u32 = 6;
/// Work limit in units of work, too small for any scene.
const HURRY: u64 = 40;

#[test]
fn no_step_of_any_scene_allocates() {
    // In scenes with two tools, the first tool need not touch the environment.
    for entry in scenes().iter().filter(|entry| entry.build().is_of_two_bodies()) {
        let scene = entry.build();
        let (a, b) = (body(&scene.probe), body(&scene.environment));
        let paper = Settings {
            contact_tolerance: scene.contact.tolerance,
            cluster_radius: scene.contact.cluster_radius,
            stiffness: scene.contact.stiffness,
            friction: Some(FrictionSettings {
                static_coefficient: 0.4,
                dynamic_coefficient: 0.3,
                tangential_stiffness: scene.contact.stiffness,
            }),
            shading: Some(ShadingSettings { crease_angle: 0.6, most_turn: 0.7 }),
            ..Settings::default()
        };
        let smooth = Settings { clustering: Clustering::Smooth, ..paper };
        let coupling = Some(VirtualCoupling::tuned(&paper.limits, 1e-3, paper.contact_tolerance));
        let ways = [
            ("whole", paper, None),
            ("hurried", smooth, Some(HURRY)),
            ("coupled", Settings { coupling, ..paper }, None),
            ("coupled and hurried", Settings { coupling, ..smooth }, Some(HURRY)),
        ];
        for (way, settings, work) in ways {
            let mut renderer = Renderer::new(a.clone(), b.clone(), settings).expect("valid settings");
            renderer.allow(work.into());
            let mut touching = 0;
            let before = allocations_of_this_thread();
            assert!(before > 0, "the counter is not installed");
            for stretch in 0..STRETCHES {
                let start = scene.path.duration() * f64::from(stretch) / f64::from(STRETCHES);
                for k in 0..TICKS / STRETCHES {
                    let state = ProbeState::at(scene.path.pose(start + 1e-3 * f64::from(k)));
                    touching += u32::from(!renderer.step(&state, 1e-3, &NoClock).contacts.is_empty());
                }
            }
            let obtained = allocations_of_this_thread() - before;
            assert_eq!(obtained, 0, "{} ({way}): allocations in {TICKS} steps", entry.name);
            assert!(touching > TICKS / 20, "{} ({way}) touched in {touching} of {TICKS} steps", entry.name);
        }
    }
}
