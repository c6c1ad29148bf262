//! Mesh readers and the OBJ writer, from the outside.

mod damage;
mod formats;
mod real;
mod samples;
