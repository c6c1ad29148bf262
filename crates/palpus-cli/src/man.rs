//! `palpus man`: prints the help of all commands as man pages, or as the page docs/command-line.md.

use std::fmt::Write as _;
use std::process::ExitCode;

use anyhow::Context;
use clap::Command;

use crate::args::{ManArguments, command_tree};
use crate::{files, output};

/// Width of the help texts on the page, in columns.
const WIDTH: usize = 100;

pub(crate) fn man(arguments: &ManArguments) -> anyhow::Result<ExitCode> {
    if arguments.markdown {
        output::line(page().trim_end());
        return Ok(ExitCode::SUCCESS);
    }
    let tree = command_tree();
    if let Some(folder) = &arguments.out {
        files::make_folder(folder)?;
        clap_mangen::generate_to(tree, folder)
            .with_context(|| format!("the man pages could not be written to {}", folder.display()))?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut text = Vec::new();
    clap_mangen::Man::new(tree).render(&mut text).context("the man page could not be generated")?;
    output::line(String::from_utf8_lossy(&text).trim_end());
    Ok(ExitCode::SUCCESS)
}

/// Returns the help of every command, as Markdown.
fn page() -> String {
    let mut page = String::from(
        "# Command line\n\n`palpus man --markdown` prints this page; a test compares the two. `palpus COMMAND \
        --help` prints one section, and `palpus man` prints a man page.\n\nExit status: 0 if the command \
        succeeded, 1 if it failed (one line on standard error names the error, its place and a remedy), 2 if it \
        was used incorrectly. Results go to standard output, everything else goes to standard error. For a file \
        of poses, `-` means standard input. For a table of results, `-` means standard output.\n",
    );
    let tree = command_tree().term_width(WIDTH);
    add(&mut page, tree, 2);
    page
}

fn add(page: &mut String, mut command: Command, level: usize) {
    let help = command.render_long_help().to_string();
    let title = command.get_bin_name().unwrap_or(command.get_name()).to_owned();
    let _ = write!(page, "\n{} {title}\n\n```text\n", "#".repeat(level));
    for line in help.trim_end().lines() {
        page.push_str(line.trim_end());
        page.push('\n');
    }
    page.push_str("```\n");
    for inner in command.get_subcommands().filter(|inner| inner.get_name() != "help") {
        add(page, inner.clone().term_width(WIDTH), 2);
    }
}
