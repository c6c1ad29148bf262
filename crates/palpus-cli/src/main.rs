//! The palpus program: what was typed, what it means, one call.

fn main() {}
