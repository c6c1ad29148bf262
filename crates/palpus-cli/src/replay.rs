//! `palpus replay`: a recording once more, every wrench compared bit for bit.

use std::process::ExitCode;

use palpus_io::{Recording, read_recording};

use crate::args::{ReplayArguments, file_policy};
use crate::divergence::{self, Comparison};
use crate::rerun::one::run_again;
use crate::rerun::places::Places;
use crate::two::other::other_of;
use crate::{output, replay_view, two};

pub(crate) fn replay(arguments: &ReplayArguments) -> anyhow::Result<ExitCode> {
    let recording = read_recording(&arguments.recording)?;
    if let Some(notice) = &recording.notice {
        output::note(format!("note: {notice}"));
    }
    let places = Places {
        recording: &arguments.recording,
        meshes: &arguments.meshes,
        policy: file_policy(arguments.allow_outside),
    };
    if let Some(file) = &arguments.screenshot {
        replay_view::write_tick(&recording, &places, arguments, file)?;
        return Ok(ExitCode::SUCCESS);
    }
    if arguments.view {
        replay_view::show(&recording, &places, arguments)?;
        return Ok(ExitCode::SUCCESS);
    }
    if other_of(&recording).is_some() {
        return replay_both(arguments, &recording, &places);
    }
    let mut comparison = Comparison::new(&recording);
    run_again(&recording, &places, &mut |row, wrench, contacts| comparison.add(row, wrench, contacts))?;
    let report = comparison.report();
    if arguments.json {
        output::json(&report)?;
    } else {
        divergence::print(&report);
    }
    Ok(if report.is_identical() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// One of the recordings of two tools: both are run again, and both have to come out as they were.
fn replay_both(arguments: &ReplayArguments, recording: &Recording, places: &Places<'_>) -> anyhow::Result<ExitCode> {
    let [report, other] = two::replay::both(recording, places)?;
    if arguments.json {
        output::json(&two::replay::Reports { report: &report, other_tool: &other })?;
    } else {
        divergence::print(&report);
        output::line("the other tool:");
        divergence::print(&other);
    }
    let identical = report.is_identical() && other.is_identical();
    Ok(if identical { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
