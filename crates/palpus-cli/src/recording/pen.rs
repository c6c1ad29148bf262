//! The writer of a recording: its file, and further parts when the file becomes too large.
//!
//! **Limit.** The first file may take half of the total size. The first file begins with the run,
//! so that it can be replayed. Later ticks go into parts (`run-part2.csv` and so on), each of a
//! quarter of the total size. The newest two parts are kept, because the ticks before a fault are
//! at the end of a run.

use std::collections::VecDeque;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use palpus_device::Sink;
use palpus_io::{RecordingHeader, RecordingWriter};
use toml::{Table, Value};

use super::Entry;
use crate::{files, output};

/// Header key under which a part names its recording and its number.
const SECTION: &str = "part";

/// Number of later parts that are kept.
const KEPT: usize = 2;

/// Messages of the writer while it writes.
#[derive(Default)]
pub(super) struct Messages(Mutex<Words>);

#[derive(Default)]
struct Words {
    #[cfg_attr(not(feature = "window"), allow(dead_code, reason = "the window asks for it"))]
    trouble: Option<String>,
    parts: Option<String>,
}

impl Messages {
    /// Returns the write error after which nothing is written.
    #[cfg(feature = "window")]
    pub(super) fn trouble(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).trouble.clone()
    }

    /// Returns a note with the files of the later parts.
    pub(super) fn parts(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).parts.clone()
    }

    fn tell(&self, change: impl FnOnce(&mut Words)) {
        change(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner));
    }
}

/// Writes the entries.
pub(super) struct Pen {
    /// `None` after the end.
    writer: Option<RecordingWriter<File>>,
    path: PathBuf,
    /// Header of the next part, with the current settings.
    header: RecordingHeader,
    limit: Option<u64>,
    /// The number of this part, from 1.
    part: u32,
    /// Existing later parts, the newest last.
    later: VecDeque<PathBuf>,
    /// Bytes of this part before its newest block.
    before: u64,
    /// Bytes of the largest block.
    piece: u64,
    messages: Arc<Messages>,
}

impl Pen {
    /// Creates the file.
    pub(super) fn new(
        path: &Path,
        header: RecordingHeader,
        limit: Option<u64>,
        messages: Arc<Messages>,
    ) -> io::Result<Self> {
        let writer = Some(RecordingWriter::create(path, &header)?);
        let path = path.to_owned();
        Ok(Self { writer, path, header, limit, part: 1, later: VecDeque::new(), before: 0, piece: 0, messages })
    }

    fn take(&mut self, entry: &Entry) -> io::Result<()> {
        if matches!(entry, Entry::Row(_)) && self.is_full() {
            self.next_part()?;
        }
        match (entry, &mut self.writer) {
            (Entry::Row(row), Some(writer)) => writer.write(row)?,
            (Entry::Change(tick, settings), Some(writer)) => {
                writer.change(*tick, settings);
                self.header.scene.render = *settings;
            }
            (_, None) => {}
        }
        Ok(())
    }

    /// True if the next block might exceed the size limit.
    fn is_full(&mut self) -> bool {
        let (Some(limit), Some(writer)) = (self.limit, &self.writer) else { return false };
        let length = writer.length();
        if length == self.before {
            return false;
        }
        self.piece = self.piece.max(length - self.before);
        self.before = length;
        length + self.piece > if self.part == 1 { limit / 2 } else { limit / 4 }
    }

    /// Ends this file and continues in another file.
    fn next_part(&mut self) -> io::Result<()> {
        if let Some(writer) = self.writer.take() {
            writer.finish()?;
        }
        if self.later.len() == KEPT
            && let Some(oldest) = self.later.pop_front()
        {
            std::fs::remove_file(oldest)?;
        }
        self.part += 1;
        let path = files::free(&files::beside(&self.path, format!("part{}", self.part)));
        let first = self.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let of = Table::from_iter([
            ("number".to_owned(), Value::from(i64::from(self.part))),
            ("first".to_owned(), first.into()),
        ]);
        self.header.scene.more.insert(SECTION.into(), of.into());
        self.writer = Some(RecordingWriter::create(&path, &self.header)?);
        self.before = 0;
        if self.part == 2 {
            let (full, next) = (self.path.display(), path.display());
            output::note(format!("note: {full} is full; the recording continues in {next} (see --record-limit)"));
        }
        self.later.push_back(path);
        let kept: Vec<String> = self.later.iter().map(|path| path.display().to_string()).collect();
        let dropped = self.part as usize - 1 - self.later.len();
        let words = format!(
            "note: the recording continues in {}{}",
            kept.join(" and "),
            if dropped > 0 { format!("; {dropped} older parts were removed (--record-limit)") } else { String::new() }
        );
        self.messages.tell(|messages| messages.parts = Some(words));
        Ok(())
    }

    /// Reports an error at once.
    fn check(&mut self, result: io::Result<()>) -> io::Result<()> {
        if let Err(error) = &result {
            let file = self.later.back().unwrap_or(&self.path).display();
            let words = format!("{file} cannot be written any more ({error}); the run goes on without a recording");
            output::note(format!("note: {words}"));
            self.messages.tell(|messages| messages.trouble = Some(words));
        }
        result
    }
}

impl Sink<Entry> for Pen {
    fn write(&mut self, entry: &Entry) -> io::Result<()> {
        let taken = self.take(entry);
        self.check(taken)
    }

    fn idle(&mut self) -> io::Result<()> {
        let flushed = self.writer.as_mut().map_or(Ok(()), RecordingWriter::flush_when_due);
        self.check(flushed)
    }

    fn finish(&mut self) -> io::Result<()> {
        let finished = self.writer.take().map_or(Ok(()), |writer| writer.finish().map(drop));
        self.check(finished)
    }
}

/// If `recording` is a later part, returns the name of the file in which it began.
pub(crate) fn first_part(header: &RecordingHeader) -> Option<&str> {
    header.scene.more.get(SECTION)?.as_table()?.get("first")?.as_str()
}
