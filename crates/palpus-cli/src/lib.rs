//! The palpus program: parses the arguments, resolves them, and makes one call.
//!
//! Exit status: 0 if the program succeeded, 1 if it failed (an error line on standard error names
//! the cause, the place and a remedy), 2 if it was used incorrectly.
//!
//! This is a library for the program and for the Python package, which contains the program and
//! opens devices by the program's names.

mod approach;
mod args;
mod bench;
mod bodies;
mod clearance;
mod convert;
mod depth;
mod devices;
mod divergence;
mod doctor;
mod durations;
mod engine;
mod export;
mod fault_log;
mod faults;
mod files;
mod gaps;
#[cfg(test)]
mod grip_tests;
mod hand_path;
mod inspect;
mod interrupt;
mod lead_out;
mod man;
mod markup;
mod numbers;
mod objects;
mod output;
mod picture;
mod plots;
mod prepare;
mod query;
mod recording;
mod replay;
mod replay_view;
mod report;
mod rerun;
mod run;
mod safety;
mod seen;
mod shots;
mod soak;
mod stage;
mod summary;
mod sweeps;
mod table;
mod tools;
mod untouched;
mod view;
mod view_window;
mod way_out;
mod when;
mod window;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, Parser};
use palpus_io::similar_name;

use args::{Arguments, Command};

pub use devices::open as open_device;
pub use summary::end as end_in_words;

/// Tests count what the servo path allocates.
#[cfg(test)]
#[global_allocator]
static ALLOCATOR: palpus_alloc::CountingAllocator = palpus_alloc::CountingAllocator;

/// Runs the program with these arguments, the first of which is its name, and returns its exit
/// status.
///
/// The program shows correct counts of allocations only if the caller's global allocator is
/// [`palpus_alloc::CountingAllocator`].
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(mut answer) => {
            suggest_command(&mut answer);
            // Also prints help and version; write errors are ignored.
            let _ = answer.print();
            return ExitCode::from(if answer.use_stderr() { 2 } else { 0 });
        }
    };
    match execute(arguments) {
        Ok(code) => code,
        Err(error) => {
            output::error(&error);
            ExitCode::FAILURE
        }
    }
}

/// Adds the most similar command to the error about an unknown command. clap finds none for short
/// names such as `rnu`.
fn suggest_command(error: &mut clap::Error) {
    let unknown = match error.get(ContextKind::InvalidSubcommand) {
        Some(ContextValue::String(name)) if error.get(ContextKind::SuggestedSubcommand).is_none() => name.clone(),
        _ => return,
    };
    let program = Arguments::command();
    let names: Vec<&str> = program.get_subcommands().map(clap::Command::get_name).collect();
    if let Some(similar) = similar_name(&unknown, &names) {
        error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(vec![similar.to_owned()]));
    }
}

fn execute(arguments: Arguments) -> anyhow::Result<ExitCode> {
    output::set_level(arguments.quiet, arguments.verbose);
    let command = arguments.command.unwrap_or_else(Command::demonstration);
    // Benchmarks time preparation, so they bypass the cache.
    bodies::use_cache(!arguments.no_cache && !matches!(command, Command::Bench(_)));
    match command {
        Command::Run(run) => run::run(&run),
        Command::Query(query) => query::query(&query),
        Command::Clearance(arguments) => clearance::clearance(&arguments),
        Command::Depth(arguments) => depth::depth(&arguments),
        Command::Prepare(prepare) => prepare::prepare(&prepare),
        Command::Inspect(inspect) => inspect::inspect(&inspect),
        Command::View(view) => view::view(&view),
        Command::Replay(replay) => replay::replay(&replay),
        Command::Convert(arguments) => convert::convert(&arguments),
        Command::Export(arguments) => export::export(&arguments),
        Command::Report(report) => report::report(&report),
        Command::Devices(arguments) => devices::devices(&arguments),
        Command::Doctor(doctor) => doctor::doctor(&doctor),
        Command::Soak(arguments) => soak::soak(&arguments),
        Command::Bench(bench) => bench::bench(&bench),
        Command::Man(arguments) => man::man(&arguments),
        Command::Completions { shell } => {
            args::completions(shell);
            Ok(ExitCode::SUCCESS)
        }
    }
}
