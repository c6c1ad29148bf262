//! palpus in Python. `import palpus` loads the package in `python/palpus`, which re-exports most of
//! its names from this crate.
//!
//! Array arguments can be anything that numpy converts to an array. Results are numpy arrays that
//! take over the engine's output without a copy. Slow functions release Python's global lock.

mod arrays;
mod bodies;
mod depth;
mod looping;
mod program;
mod query;
mod refused;
mod rows;
mod servo_thread;
mod settings;
mod workers;
mod world;

/// The compiled part of the package. `palpus` re-exports its names.
#[pyo3::pymodule(name = "_native", gil_used = false)]
mod native {
    #[pymodule_export]
    use crate::bodies::Body;
    #[pymodule_export]
    use crate::depth::depth;
    #[pymodule_export]
    use crate::looping::Loop;
    #[pymodule_export]
    use crate::program::main;
    #[pymodule_export]
    use crate::query::{contacts, distance, query};
    #[pymodule_export]
    use crate::refused::Error;
    #[pymodule_export]
    use crate::settings::{Settings, contact_tolerance};
    #[pymodule_export]
    use crate::world::World;

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        crate::rows::add_types(module)
    }
}
