//! The palpus program; see the library beside it.

use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: palpus_alloc::CountingAllocator = palpus_alloc::CountingAllocator;

fn main() -> ExitCode {
    palpus_cli::main(std::env::args_os())
}
