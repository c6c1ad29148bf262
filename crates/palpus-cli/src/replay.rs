//! `palpus replay`: computes a recording again and compares every wrench bit for bit.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::process::ExitCode;

use palpus_io::read_recording;
use serde::Serialize;

use crate::args::{ReplayArguments, file_policy};
use crate::divergence::{self, Report};
use crate::rerun::Rerun;
use crate::rerun::places::Places;
use crate::{output, replay_view, tools};

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
    let (_, again) = Rerun::new(&recording, &places)?;
    let which = again.which;
    let reports = again.compare()?;
    if arguments.json {
        let others = reports.iter().enumerate().filter(|(k, _)| *k != which);
        let others = others.map(|(k, report)| (tools::name(k), report)).collect();
        output::json(&Reports { report: &reports[which], others })?;
    } else {
        for (k, report) in reports.iter().enumerate() {
            if reports.len() > 1 {
                output::line(format!("the {} tool:", tools::name(k)));
            }
            divergence::print(report);
        }
    }
    let identical = reports.iter().all(Report::is_identical);
    Ok(if identical { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Document of `--json`: the results of the named recording, and of the recordings of the other
/// tools by their names.
#[derive(Serialize)]
struct Reports<'a> {
    #[serde(flatten)]
    report: &'a Report,
    #[serde(flatten)]
    others: BTreeMap<Cow<'static, str>, &'a Report>,
}
