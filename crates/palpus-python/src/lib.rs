//! palpus in Python: what `import palpus` finds is in `python/palpus`, and most of it comes from
//! here.
//!
//! Arrays come in as anything that numpy makes an array of, and go out as numpy arrays that
//! own what the engine wrote, without a copy. Whatever takes long lets other Python threads run
//! meanwhile.

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
