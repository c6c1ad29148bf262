//! From polygon soup to a validated triangle mesh.
