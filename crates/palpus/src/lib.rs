//! palpus: what a hand feels when the tool it holds touches another object, both being arbitrary triangle meshes.
//!
//! The engine is a set of pure functions of values: no input or output, no thread, no clock, no global. Its rooms,
//! in alphabetical order, follow the paper's sections and may import only rooms that sort before them:
//!
//! `algebra` → `body` → `collision` → `depth` → `detect` → `force` → `render`
//!
//! Source: Kim, Otaduy, Lin, Manocha, *Six-Degree-of-Freedom Haptic Display Using Localized Contact Computations*,
//! 2002, cited as \[K02\]. Units are SI (metres, seconds, newtons, newton-metres, radians) unless a name says otherwise;
//! frames are right-handed. Body **a** is the probe, body **b** the environment; a contact normal is unit and points
//! from b into a; `point_a − point_b = separation · normal`.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod algebra;
pub mod body;
pub mod collision;
pub mod depth;
pub mod detect;
pub mod force;
pub mod render;
