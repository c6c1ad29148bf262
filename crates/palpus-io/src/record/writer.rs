//! Writes a recording in any format.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use palpus::render::Settings;

use super::change::{self, Pending};
use super::{Piece, RecordRow, RecordingHeader, csv, mcap, parquet};

/// Time between writes. This time and the writer's queue limit the loss to less than a second if
/// the program is killed.
const BETWEEN_PIECES: Duration = Duration::from_millis(500);

/// Largest number of rows that are collected before a write; a run with `--fast` produces rows
/// quickly.
const MOST_WAITING: usize = 1 << 12;

/// The file formats of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordingFormat {
    /// A text table (CSV).
    Csv,
    /// A table stored by columns, for data frames.
    Parquet,
    /// Messages for robotics tools.
    Mcap,
}

impl RecordingFormat {
    /// Returns the format for the extension of a file name: `.csv`, `.parquet` or `.mcap`; `None`
    /// for other extensions.
    pub fn of_name(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        let formats = [("csv", Self::Csv), ("parquet", Self::Parquet), ("mcap", Self::Mcap)];
        formats.iter().find(|(name, _)| extension.eq_ignore_ascii_case(name)).map(|(_, format)| *format)
    }

    /// Returns the format of a file, recognised by its first bytes. A file that is neither Parquet
    /// nor MCAP is read as CSV.
    pub fn of_content(beginning: &[u8]) -> Self {
        if beginning.starts_with(parquet::MAGIC) {
            Self::Parquet
        } else if beginning.starts_with(mcap::MAGIC) {
            Self::Mcap
        } else {
            Self::Csv
        }
    }
}

/// Writes a recording. Do not use the writer on the servo thread: it allocates memory and waits for
/// the stream.
///
/// Rows are collected and written as one piece. After each piece the file is complete; see
/// [`RecordingWriter::flush`].
pub struct RecordingWriter<W: Write + Seek> {
    out: W,
    encoder: Encoder,
    pending: Pending,
    waiting: usize,
    handed_over: Instant,
    /// Length of the file in bytes.
    length: u64,
    /// Path of the file, if it can be made smaller at the end.
    path: Option<PathBuf>,
}

enum Encoder {
    Csv(csv::Writer),
    Parquet(parquet::Writer),
    Mcap(mcap::Writer),
}

impl RecordingWriter<File> {
    /// Creates a file for a recording, in the format of its extension, and writes the header. Fails
    /// if the file already exists (a recording is never overwritten), if the extension is unknown,
    /// if TOML cannot represent the header, or if the file cannot be written.
    pub fn create(path: &Path, header: &RecordingHeader) -> io::Result<Self> {
        let format = RecordingFormat::of_name(path).ok_or_else(|| {
            io::Error::new(
                io::ErrorKind::InvalidInput,
                "its name must end in .csv, .parquet or .mcap, which select the format",
            )
        })?;
        let writer = Self::new(File::create_new(path)?, format, header)?;
        Ok(Self { path: Some(path.to_owned()), ..writer })
    }
}

impl<W: Write + Seek> RecordingWriter<W> {
    /// Writes the header to `out`, which must be empty and needs no buffer. Fails if writing to
    /// `out` fails, or if TOML cannot represent the header (for example a very large integer in
    /// `more`).
    pub fn new(out: W, format: RecordingFormat, header: &RecordingHeader) -> io::Result<Self> {
        let text = header.to_text()?;
        let encoder = match format {
            RecordingFormat::Csv => Encoder::Csv(csv::Writer::new(&text, header.format)),
            RecordingFormat::Parquet => Encoder::Parquet(parquet::Writer::new(&text, header.format)),
            RecordingFormat::Mcap => Encoder::Mcap(mcap::Writer::new(&text, header.format)),
        };
        let pending = Pending::default();
        let mut writer = Self { out, encoder, pending, waiting: 0, handed_over: Instant::now(), length: 0, path: None };
        writer.flush()?;
        Ok(writer)
    }

    /// Records new settings of the engine from tick `tick` on. The settings are written before the
    /// first row of that tick or of a later tick; without such a row the settings are not written.
    /// If there are several changes before the same tick, only the last is written.
    pub fn change(&mut self, tick: u64, settings: &Settings) {
        self.pending.add(tick, settings);
    }

    /// Adds one tick, and writes the collected rows if enough time has passed.
    pub fn write(&mut self, row: &RecordRow) -> io::Result<()> {
        for (tick, settings) in self.pending.before(row.tick) {
            let text = change::write(tick, &settings)?;
            match &mut self.encoder {
                Encoder::Csv(writer) => writer.change(&text),
                Encoder::Parquet(writer) => writer.change(&text),
                Encoder::Mcap(writer) => writer.change(tick, &text, row.time_ns),
            }
        }
        match &mut self.encoder {
            Encoder::Csv(writer) => writer.row(row),
            Encoder::Parquet(writer) => writer.row(row),
            Encoder::Mcap(writer) => writer.row(row),
        }
        self.waiting += 1;
        self.flush_when_due()
    }

    /// Writes the collected rows if enough time has passed. Call this function regularly while
    /// there are no new rows.
    pub fn flush_when_due(&mut self) -> io::Result<()> {
        let due = self.waiting >= MOST_WAITING || (self.waiting > 0 && self.handed_over.elapsed() >= BETWEEN_PIECES);
        if due { self.flush() } else { Ok(()) }
    }

    /// Writes the collected rows as one piece, after which the file is complete.
    pub fn flush(&mut self) -> io::Result<()> {
        let Piece { at, bytes } = match &mut self.encoder {
            Encoder::Csv(writer) => writer.flush(),
            Encoder::Parquet(writer) => writer.flush(),
            Encoder::Mcap(writer) => writer.flush(),
        };
        self.waiting = 0;
        self.handed_over = Instant::now();
        self.length = at + bytes.len() as u64;
        self.out.seek(SeekFrom::Start(at))?;
        self.out.write_all(&bytes)?;
        self.out.flush()
    }

    /// Returns the current length of the file in bytes, without the rows added since the last
    /// [`Self::flush`].
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Writes the remaining rows and returns `out`. A Parquet file is then made smaller: its
    /// content is copied to a new file, which replaces it.
    pub fn finish(mut self) -> io::Result<W> {
        self.flush()?;
        if let (Some(path), Encoder::Parquet(writer)) = (&self.path, &self.encoder) {
            parquet::compact(writer, path);
        }
        Ok(self.out)
    }
}
