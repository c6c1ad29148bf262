//! The palpus program; the library of this crate does all work.

use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: palpus_alloc::CountingAllocator = palpus_alloc::CountingAllocator;

fn main() -> ExitCode {
    palpus_cli::main(std::env::args_os())
}
