//! Integration tests of the mesh readers and the OBJ writer.

mod damage;
mod formats;
mod real;
mod samples;
