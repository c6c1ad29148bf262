//! palpus in Python: what `import palpus` finds is in `python/palpus`, and most of it comes from
//! here.
//!
//! Array arguments can be anything that numpy converts to an array. Results are numpy arrays that
//! own the engine's output without a copy. Slow functions release Python's lock.

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

/// The compiled part of the package; `palpus` shows its names.
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
    use crate::settings::Settings;
    #[pymodule_export]
    use crate::world::World;

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        crate::rows::add_types(module)
    }
}
