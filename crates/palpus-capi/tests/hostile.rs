//! Random numbers, handles, sizes and null pointers give a code and a text, never a crash.
#![allow(unsafe_code, reason = "the C library's functions take pointers")]

use std::ffi::CStr;
use std::ptr::{null, null_mut};

use palpus::algebra::Random;
use palpus_capi::body::*;
use palpus_capi::depth::*;
use palpus_capi::query::*;
use palpus_capi::result::{palpus_last_error, palpus_result};
use palpus_capi::settings::*;
use palpus_capi::value::*;
use palpus_capi::version::palpus_check_abi;
use palpus_capi::world::*;
use palpus_capi::world_functions::*;

const SEED: u64 = 0xc0de_cafe;
const CALLS: u32 = 1_000_000;
/// Indices into the lists of handles.
const BODIES: usize = 0;
const QUERIES: usize = 1;
const DEPTHS: usize = 2;
const WORLDS: usize = 3;
/// Index of the list with objects and tools.
const INNER: usize = 4;
/// Number of handles of each kind that are kept at the same time.
const KEPT: usize = 6;

struct Host {
    random: Random,
    /// Handles of each kind; some handles are destroyed.
    lists: [Vec<u64>; 5],
    contacts: [palpus_contact; 8],
}

impl Host {
    fn below(&mut self, n: usize) -> usize {
        self.random.below(n)
    }

    fn chance(&mut self, share: f64) -> bool {
        self.random.unit() < share
    }

    /// Returns a number as a host may send it: usually `good`, sometimes an unusual or invalid
    /// number.
    fn number(&mut self, good: f64) -> f64 {
        if self.chance(0.98) {
            return good;
        }
        let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -0.0, -1.0, 1e300, -1e300, 5e-324, 1e-12];
        odd[self.below(odd.len())]
    }

    fn vector(&mut self, size: f64) -> [f64; 3] {
        [(); 3].map(|()| {
            let good = (self.random.unit() - 0.5) * size;
            self.number(good)
        })
    }

    fn pose(&mut self) -> palpus_pose {
        let half = self.random.unit() * 3.0;
        let rotation = [half.sin(), 0.0, 0.0, half.cos()].map(|x| self.number(x));
        palpus_pose { position: self.vector(0.1), rotation }
    }

    fn twist(&mut self) -> palpus_twist {
        palpus_twist { linear: self.vector(1.0), angular: self.vector(10.0) }
    }

    /// Returns usually a handle of the list, sometimes a handle of another list or any number.
    fn id(&mut self, list: usize) -> u64 {
        if self.chance(0.03) {
            return self.random.bits() >> self.below(64);
        }
        let list = if self.chance(0.03) { self.below(self.lists.len()) } else { list };
        let count = self.lists[list].len();
        if count == 0 { 0 } else { self.lists[list][self.random.below(count)] }
    }

    fn body(&mut self) -> palpus_body {
        palpus_body { id: self.id(BODIES) }
    }

    fn world(&mut self) -> palpus_world {
        palpus_world { id: self.id(WORLDS) }
    }

    fn object(&mut self) -> palpus_object {
        palpus_object { id: self.id(INNER) }
    }

    fn tool(&mut self) -> palpus_tool {
        palpus_tool { id: self.object().id }
    }

    fn settings(&mut self) -> palpus_settings {
        let mut settings =
            palpus_settings::from(&palpus::Settings::coupled(palpus::Limits { force: 8.5, torque: 0.19 }, 1e-3, 2e-4));
        settings.capacity = [0, 1, 64, 64, 64, 256, u64::MAX][self.below(7)];
        for place in [
            &mut settings.contact_tolerance,
            &mut settings.stiffness,
            &mut settings.damping,
            &mut settings.split_angle,
            &mut settings.coupling.contact_offset,
            &mut settings.coupling.mass,
            &mut settings.limits.force,
            &mut settings.grip[1],
            &mut settings.time_budget,
        ] {
            *place = self.number(*place);
        }
        settings.saturation = self.below(30) as u32 / 9;
        settings.has_friction = u32::from(self.chance(0.3));
        settings.has_shading = u32::from(self.chance(0.1));
        settings.has_coupling = u32::from(self.chance(0.8)) + u32::from(self.chance(0.02));
        settings
    }

    fn pointer<T>(&mut self, value: *const T) -> *const T {
        if self.chance(0.02) { null() } else { value }
    }

    fn place<T>(&mut self, value: &mut T) -> *mut T {
        if self.chance(0.02) { null_mut() } else { value }
    }

    fn keep(&mut self, result: palpus_result, id: u64, list: usize) -> palpus_result {
        if result == palpus_result::PalpusOk {
            self.lists[list].push(id);
        }
        result
    }

    /// Makes a random call. Calls that create or destroy values are rare, because they take long.
    fn call(&mut self) -> palpus_result {
        if self.chance(0.003) { self.make_or_destroy() } else { self.use_something() }
    }

    fn make_or_destroy(&mut self) -> palpus_result {
        match self.below(10) {
            0 => {
                let points = [(); 12].map(|()| self.vector(0.04));
                let (mut body, count) = (palpus_body::default(), [0, 3, 4, 8, 12, usize::MAX][self.below(6)]);
                let (from, to) = (self.pointer(points.as_flattened().as_ptr()), self.place(&mut body));
                // SAFETY: each pointer is null or points to as many values as the count says. A
                // count larger than the memory is rejected before anything is read.
                let result = unsafe { palpus_body_from_convex(from, count, to) };
                self.keep(result, body.id, BODIES)
            }
            1 => {
                let vertices = [(); 4].map(|()| self.vector(0.04));
                let mut faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
                if self.chance(0.2) {
                    faces[self.below(4)][self.below(3)] = [4, 0, u32::MAX][self.below(3)];
                }
                let (scale, flatness) = (self.number(1.0), self.number(3e-5));
                let settings = palpus_body_settings { scale, flatness, thick: self.below(20) as u32 / 9 };
                let mut body = palpus_body::default();
                let counts = [[4, 4], [0, 4], [4, 0], [4, usize::MAX], [usize::MAX / 8, 4]][self.below(9) % 5];
                let (from, corners) =
                    (self.pointer(vertices.as_flattened().as_ptr()), self.pointer(faces.as_flattened().as_ptr()));
                let (settings, to) = (self.pointer(&settings), self.place(&mut body));
                // SAFETY: each pointer is null or points to as many values as the counts say.
                // Counts larger than the memory are rejected.
                let result = unsafe { palpus_body_from_triangles(from, counts[0], corners, counts[1], settings, to) };
                self.keep(result, body.id, BODIES)
            }
            2 => {
                let (mut query, mut settings) = (
                    palpus_query::default(),
                    palpus_query_settings {
                        tolerance: self.number(1e-3),
                        capacity: [0, 1, 64, u64::MAX][self.below(4)],
                        prove: self.below(9) as u32 / 4,
                        patch_angle: self.number(0.1),
                    },
                );
                if self.chance(0.5) {
                    settings.capacity = 64;
                }
                let [a, b] = [self.body(), self.body()];
                let (settings, to) = (self.pointer(&settings), self.place(&mut query));
                // SAFETY: each pointer is null or points to a value or to memory for a result.
                let result = unsafe { palpus_query_create(a, b, settings, to) };
                self.keep(result, query.id, QUERIES)
            }
            3 => {
                let mut depth = palpus_depth::default();
                let settings = palpus_depth_settings { gap: self.number(1e-3), budget: 200, outside: 0 };
                let [a, b] = [self.body(), self.body()];
                let (settings, to) = (self.pointer(&settings), self.place(&mut depth));
                // SAFETY: same as above.
                let result = unsafe { palpus_depth_create(a, b, settings, to) };
                self.keep(result, depth.id, DEPTHS)
            }
            4 => {
                let (mut world, settings) = (palpus_world::default(), self.settings());
                let (settings, to) = (self.pointer(&settings), self.place(&mut world));
                // SAFETY: same as above.
                let result = unsafe { palpus_world_create(settings, to) };
                self.keep(result, world.id, WORLDS)
            }
            5 => self.add(),
            6 if self.lists[BODIES].len() > KEPT => {
                palpus_body_destroy(palpus_body { id: self.lists[BODIES].remove(0) })
            }
            7 if self.lists[QUERIES].len() > KEPT => {
                palpus_query_destroy(palpus_query { id: self.lists[QUERIES].remove(0) })
            }
            8 if self.lists[DEPTHS].len() > KEPT => {
                palpus_depth_destroy(palpus_depth { id: self.lists[DEPTHS].remove(0) })
            }
            9 if self.lists[WORLDS].len() > KEPT => {
                self.lists[INNER].drain(..self.lists[INNER].len() / KEPT);
                palpus_world_destroy(palpus_world { id: self.lists[WORLDS].remove(0) })
            }
            // Handles that are destroyed or of another kind continue to be used.
            _ => palpus_body_destroy(self.body()),
        }
    }

    fn add(&mut self) -> palpus_result {
        let (world, body, pose) = (self.world(), self.body(), self.pose());
        let (mut object, mut tool) = (palpus_object::default(), palpus_tool::default());
        let (pose, to) = (self.pointer(&pose), self.place(&mut object));
        let mass = self.number(0.1);
        // SAFETY: each pointer is null or points to a value or to memory for a result.
        let (result, id) = unsafe {
            match self.below(4) {
                0 => (palpus_world_add_fixed(world, body, pose, to), object.id),
                1 => (palpus_world_add_driven(world, body, pose, to), object.id),
                2 => (palpus_world_add_free(world, body, pose, mass, to), object.id),
                _ => {
                    let settings = self.settings();
                    let (settings, to) = (self.pointer(&settings), self.place(&mut tool));
                    (palpus_world_add_tool(world, body, settings, to), tool.id)
                }
            }
        };
        self.keep(result, id, INNER)
    }

    fn use_something(&mut self) -> palpus_result {
        let (world, object, tool) = (self.world(), self.object(), self.tool());
        let (pose, twist, settings) = (self.pose(), self.twist(), self.settings());
        let (pose, twist) = (self.pointer(&pose), self.pointer(&twist));
        let query = palpus_query { id: self.id(QUERIES) };
        let room = [0, 1, 8, usize::MAX][self.below(9) % 4];
        let (mut count, mut place, mut velocity) = (0, palpus_pose::default(), palpus_twist::default());
        let (mut contact, mut tick) = (palpus_contact::default(), palpus_tick::default());
        let (mut facts, mut bounds) = (palpus_body_facts::default(), palpus_depth_bounds::default());
        let mut tolerance = 0.0;
        let to: *mut palpus_contact = if self.chance(0.02) { null_mut() } else { self.contacts.as_mut_ptr() };
        let count = self.place(&mut count);
        // SAFETY: each pointer is null or points to values or to memory for results. A capacity
        // larger than the memory is rejected.
        unsafe {
            match self.below(22) {
                0 => palpus_query_contacts(query, pose, to, room, count),
                1 => palpus_query_nearest(query, pose, self.place(&mut contact)),
                2 => palpus_query_set_tolerance(query, self.number(1e-3)),
                3 => palpus_query_clear(query),
                4 if self.chance(0.1) => {
                    let depth = palpus_depth { id: self.id(DEPTHS) };
                    palpus_depth_bound(depth, pose, self.place(&mut bounds))
                }
                5 => palpus_body_get_facts(self.body(), self.place(&mut facts)),
                6 => palpus_world_get_tick(world, tool, self.place(&mut tick)),
                7 => palpus_world_contacts(world, tool, to, room, count),
                8 => palpus_world_contacts_between(world, object, self.object(), to, room, count),
                9 => palpus_world_get_pose(world, object, self.place(&mut place)),
                10 => palpus_world_get_twist(world, object, self.place(&mut velocity)),
                11 => palpus_world_drive(world, object, pose, twist),
                12 => palpus_world_put(world, object, pose),
                13 => palpus_world_throw(world, object, twist),
                14 => palpus_world_set_tool_settings(world, tool, &settings),
                15 => palpus_world_allow(world, self.below(1000) as u64),
                16 => palpus_world_clear(world),
                17 => palpus_world_set_gravity(world, self.vector(20.0).as_ptr()),
                18 => palpus_check_abi(self.below(3) as u32),
                19 => palpus_world_tool_object(world, tool, self.place(&mut palpus_object::default())),
                20 if self.chance(0.01) => {
                    palpus_contact_tolerance(self.body(), self.body(), pose, self.place(&mut tolerance))
                }
                _ => self.step(world),
            }
        }
    }

    fn step(&mut self, world: palpus_world) -> palpus_result {
        let probes = [(); 3].map(|()| palpus_probe { pose: self.pose(), twist: self.twist() });
        let mut wrenches = [palpus_wrench { force: [f64::NAN; 3], torque: [f64::NAN; 3] }; 3];
        let (count, dt) = ([0, 1, 1, 1, 2, 3, usize::MAX][self.below(7)], self.number(1e-3));
        let from = self.pointer(probes.as_ptr());
        // SAFETY: each pointer is null or points to as many values as the count says. A count
        // larger than the memory is rejected.
        let result = unsafe { palpus_world_step(world, from, wrenches.as_mut_ptr(), count, dt) };
        let written =
            wrenches.iter().take(if count > 3 { 0 } else { count }).flat_map(|wrench| [wrench.force, wrench.torque]);
        assert!(written.flatten().all(f64::is_finite), "seed {SEED:#x}: a step must write every wrench");
        result
    }
}

#[test]
fn million_random_calls_never_crash() {
    let (lists, contacts) = ([const { Vec::new() }; 5], [palpus_contact::default(); 8]);
    let mut host = Host { random: Random::new(SEED), lists, contacts };
    let mut counts = [0_u32; 9];
    for call in 0..CALLS {
        let result = host.call();
        counts[result as usize] += 1;
        // SAFETY: the pointer points to the library's text, which is read before the next call.
        let text = unsafe { CStr::from_ptr(palpus_last_error()) };
        assert!(result == palpus_result::PalpusOk || !text.is_empty(), "seed {SEED:#x}, call {call}");
        assert_ne!(result, palpus_result::PalpusErrorInternal, "seed {SEED:#x}, call {call}: {text:?}");
        assert!(text.to_str().is_ok());
    }
    let [done, pointer, handle, _, value, mesh, ..] = counts;
    assert!([done, pointer, handle, value, mesh].iter().all(|&count| count > 100), "{counts:?}");
}
