//! Shared parts of the fuzz targets.
//!
//! * [`target!`] defines a target: the code that runs on an input, its memory limit, and its seeds.
//! * `memory` is an allocator that counts bytes. The memory of every input is compared with a
//!   limit that depends on the size of the input.
//! * [`Bytes`] converts the bytes of an input to numbers, points, poses, bodies and settings.
//! * [`check`] checks the guarantees of the readers and the engine.
//! * [`drive`] generates the inputs of a renderer.
//! * [`mesh_file`] converts the bytes of a mesh file to a body.
//! * [`recording`] reads a recording, writes it in all formats, and reads it again.
//! * [`sample`] contains a small recording, used as a seed.
//! * [`Folder`] contains files for readers that need a path.
//!
//! Each target can write its seeds. With `PALPUS_FUZZ_SEEDS=FOLDER` in the environment, a target
//! writes its seeds to that folder and exits.

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

/// A seed: a file name and the bytes.
pub type Seed = (String, Vec<u8>);

/// Returns the small solid of the mesh readers' tests in every supported format, with the file
/// extension.
pub fn mesh_samples() -> Vec<(&'static str, Vec<u8>)> {
    samples::all(&samples::prism())
}

/// Defines a target from `run`, which must not panic on any input and must not use more memory than
/// `allowance` at any time. `seeds` returns its seeds.
#[macro_export]
macro_rules! target {
    (run: $run:path, allowance: $allowance:expr, seeds: $seeds:path) => {
        $crate::fuzz_target!(
            init: $crate::begin(&$seeds),
            |data: &[u8]| $crate::one(data, &$allowance, &$run)
        );
    };
}

/// If the environment asks for the seeds, writes the seeds and exits.
pub fn begin(seeds: &dyn Fn() -> Vec<Seed>) {
    let Some(folder) = std::env::var_os("PALPUS_FUZZ_SEEDS") else { return };
    for (name, bytes) in seeds() {
        let path = std::path::Path::new(&folder).join(format!("seed-{name}"));
        std::fs::write(&path, bytes).expect("a writable folder");
    }
    std::process::exit(0);
}

/// Runs one input and checks that it stays within its memory limit.
pub fn one(data: &[u8], allowance: &Allowance, run: &dyn Fn(&[u8])) {
    let held = memory::begin();
    run(data);
    let most = memory::most() - held;
    let allowed = allowance.of(data.len());
    assert!(
        most <= allowed,
        "an input of {} bytes used {most} bytes of memory; the limit is {allowed} bytes",
        data.len()
    );
}
