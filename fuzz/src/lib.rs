//! Shared parts of the fuzz targets.
//!
//! * [`target!`] — a target: what is done with an input, what an input may cost in memory, and the
//!   inputs to begin with.
//! * `memory` — an allocator that keeps the books, so that "memory is bounded by the input's size"
//!   is held on every input.
//! * [`Bytes`] — numbers, points, poses, bodies and settings out of an input's bytes.
//! * [`check`] — what readers and the engine promise.
//! * [`drive`] — what drives a renderer.
//! * [`mesh_file`] — from the bytes of a mesh file to a body.
//! * [`recording`] — from the bytes of a recording to all formats, and back.
//! * [`sample`] — a recording to begin with.
//! * [`Folder`] — files for readers that want a path.
//!
//! A target says its seeds itself: with `PALPUS_FUZZ_SEEDS=FOLDER` in the environment it writes
//! them there and ends.

mod bytes;
pub mod check;
pub mod drive;
mod folder;
mod memory;
pub mod mesh_file;
pub mod recording;
pub mod sample;
#[path = "../../crates/palpus-io/tests/meshes/samples.rs"]
#[allow(dead_code, missing_docs, unreachable_pub)]
mod samples;

pub use bytes::Bytes;
pub use folder::Folder;
pub use libfuzzer_sys::fuzz_target;
pub use memory::Allowance;

/// An input to begin with: a name for its file, and the bytes.
pub type Seed = (String, Vec<u8>);

/// The small solid of the mesh readers' own tests in every format that they read, by extension.
pub fn mesh_samples() -> Vec<(&'static str, Vec<u8>)> {
    samples::all(&samples::prism())
}

/// Makes a target of `run`, which must not panic on any bytes, may hold `allowance` of memory at
/// any time, and begins with `seeds`.
#[macro_export]
macro_rules! target {
    (run: $run:path, allowance: $allowance:expr, seeds: $seeds:path) => {
        $crate::fuzz_target!(
            init: $crate::begin(&$seeds),
            |data: &[u8]| $crate::one(data, &$allowance, &$run)
        );
    };
}

/// Writes the seeds and ends, if that is what is asked for.
pub fn begin(seeds: &dyn Fn() -> Vec<Seed>) {
    let Some(folder) = std::env::var_os("PALPUS_FUZZ_SEEDS") else { return };
    for (name, bytes) in seeds() {
        let path = std::path::Path::new(&folder).join(format!("seed-{name}"));
        std::fs::write(&path, bytes).expect("a folder that can be written to");
    }
    std::process::exit(0);
}

/// Runs one input within its allowance.
pub fn one(data: &[u8], allowance: &Allowance, run: &dyn Fn(&[u8])) {
    let held = memory::begin();
    run(data);
    let most = memory::most() - held;
    let allowed = allowance.of(data.len());
    assert!(most <= allowed, "an input of {} bytes took {most} bytes of memory; {allowed} are allowed", data.len());
}
