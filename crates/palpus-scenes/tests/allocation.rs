//! No step of any scene obtains memory, however it is rendered.

mod counting_clock;

use std::sync::Arc;

use counting_clock::CountingClock;
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::{Clustering, ProbeState, Renderer, Settings, VirtualCoupling};
use palpus_alloc::{CountingAllocator, allocations_of_this_thread};
use palpus_scenes::scenes;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn body(soup: &PolygonSoup) -> Arc<Body> {
    let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    Arc::new(Body::from_soup(soup, &settings, &mut |_| ()).expect("a scene's mesh makes a body"))
}

/// Ticks of each way of rendering, spread over the scene's path in coherent stretches.
const TICKS: u32 = 600;
const STRETCHES: u32 = 6;

#[test]
fn no_step_of_any_scene_obtains_memory() {
    // The first of two tools need not touch the environment.
    for entry in scenes().iter().filter(|entry| entry.build().second.is_none()) {
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
        let hurried = Settings { clustering: Clustering::Smooth, time_budget: Some(20_000), ..paper };
        let coupling = Some(VirtualCoupling::tuned(&paper.limits, 1e-3, paper.contact_tolerance));
        let ways = [
            ("whole", paper),
            ("hurried", hurried),
            ("coupled", Settings { coupling, ..paper }),
            ("coupled and hurried", Settings { coupling, ..hurried }),
        ];
        for (way, settings) in ways {
            let mut renderer = Renderer::new(a.clone(), b.clone(), settings).expect("valid settings");
            // Each look takes a while, so that a budget is spent.
            let clock = CountingClock::new(500);
            let mut touching = 0;
            let before = allocations_of_this_thread();
            assert!(before > 0, "the counter is not installed");
            for stretch in 0..STRETCHES {
                let start = scene.path.duration() * f64::from(stretch) / f64::from(STRETCHES);
                for k in 0..TICKS / STRETCHES {
                    let state = ProbeState::at(scene.path.pose(start + 1e-3 * f64::from(k)));
                    touching += u32::from(!renderer.step(&state, 1e-3, &clock).contacts.is_empty());
                }
            }
            let obtained = allocations_of_this_thread() - before;
            assert_eq!(obtained, 0, "{} ({way}): allocations in {TICKS} steps", entry.name);
            assert!(touching > TICKS / 20, "{} ({way}) touched in {touching} of {TICKS} steps", entry.name);
        }
    }
}
