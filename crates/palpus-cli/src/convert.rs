//! `palpus convert`: writes a recording in another format.

use std::io::{BufReader, Cursor, Seek, Write};
use std::process::ExitCode;

use anyhow::Context;
use palpus_io::record::{RecordingFormat, read_recording_from};
use palpus_io::{Recording, RecordingWriter, read_recording};

use crate::args::ConvertArguments;
use crate::{files, output};

pub(crate) fn convert(arguments: &ConvertArguments) -> anyhow::Result<ExitCode> {
    let ConvertArguments { recording: from, out, force } = arguments;
    let to_stdout = files::is_standard(out);
    if same_file(from, out) {
        anyhow::bail!("{} cannot be converted onto itself; name another file", from.display());
    }
    if !to_stdout && out.exists() && !force {
        anyhow::bail!("{} exists already; name another file, or overwrite it with --force", out.display());
    }
    let recording = if files::is_standard(from) {
        read_recording_from(BufReader::new(Cursor::new(files::read_standard()?)), &files::input_name(from))?
    } else {
        read_recording(from)?
    };
    if let Some(notice) = &recording.notice {
        output::note(format!("note: {notice}"));
    }
    if to_stdout {
        // A writer of recordings goes back to the header, which a pipe cannot do.
        let writer = RecordingWriter::new(Cursor::new(Vec::new()), RecordingFormat::Csv, &recording.header)?;
        output::Answer::new().write_all(written(writer, &recording)?.get_ref())?;
        return Ok(ExitCode::SUCCESS);
    }
    let problem = || format!("{} could not be written", out.display());
    if out.exists() {
        std::fs::remove_file(out).with_context(problem)?;
    }
    let writer = RecordingWriter::create(out, &recording.header).with_context(problem)?;
    written(writer, &recording).with_context(problem)?;
    output::line(format!("{}: {} ticks", out.display(), recording.rows.len()));
    Ok(ExitCode::SUCCESS)
}

/// Writes all ticks and returns what the writer wrote to.
fn written<W: Write + Seek>(mut writer: RecordingWriter<W>, recording: &Recording) -> std::io::Result<W> {
    let mut changes = recording.changes.iter().peekable();
    for row in &recording.rows {
        while let Some((tick, settings)) = changes.next_if(|(tick, _)| *tick <= row.tick) {
            writer.change(*tick, settings);
        }
        writer.write(row)?;
    }
    writer.finish()
}

fn same_file(a: &std::path::Path, b: &std::path::Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
