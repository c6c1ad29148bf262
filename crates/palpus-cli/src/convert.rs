//! `palpus convert`: writes a recording in another format.

use std::process::ExitCode;

use anyhow::Context;
use palpus_io::{RecordingWriter, read_recording};

use crate::args::ConvertArguments;
use crate::output;

pub(crate) fn convert(arguments: &ConvertArguments) -> anyhow::Result<ExitCode> {
    let ConvertArguments { recording: from, out, force } = arguments;
    if same_file(from, out) {
        anyhow::bail!("{} cannot be converted onto itself; name another file", from.display());
    }
    if out.exists() && !force {
        anyhow::bail!("{} exists already; name another file, or overwrite it with --force", out.display());
    }
    let recording = read_recording(from)?;
    if let Some(notice) = &recording.notice {
        output::note(format!("note: {notice}"));
    }
    let problem = || format!("{} could not be written", out.display());
    if out.exists() {
        std::fs::remove_file(out).with_context(problem)?;
    }
    let mut writer = RecordingWriter::create(out, &recording.header).with_context(problem)?;
    let mut changes = recording.changes.iter().peekable();
    for row in &recording.rows {
        while let Some((tick, settings)) = changes.next_if(|(tick, _)| *tick <= row.tick) {
            writer.change(*tick, settings);
        }
        writer.write(row).with_context(problem)?;
    }
    writer.finish().with_context(problem)?;
    output::line(format!("{}: {} ticks", out.display(), recording.rows.len()));
    Ok(ExitCode::SUCCESS)
}

fn same_file(a: &std::path::Path, b: &std::path::Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
