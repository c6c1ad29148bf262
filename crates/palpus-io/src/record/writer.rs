//! Writes a recording in any format.

use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use palpus::render::Settings;

use super::change::{self, Pending};
use super::{Piece, RecordRow, RecordingHeader, csv, mcap, parquet};

/// Interval between writes. Together with the writer's queue it bounds the loss if the program is
/// killed: less than a second.
const BETWEEN_PIECES: Duration = Duration::from_millis(500);

/// Most rows that wait, since a run with `--fast` produces rows quickly.
const MOST_WAITING: usize = 1 << 12;

/// The formats of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordingFormat {
    /// A table of text.
    Csv,
    /// A table of columns, for data frames.
    Parquet,
    /// Messages, for robotics tools.
    Mcap,
}

impl RecordingFormat {
    /// The format that a file's name asks for: `.csv`, `.parquet` or `.mcap`.
    pub fn of_name(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?;
        let formats = [("csv", Self::Csv), ("parquet", Self::Parquet), ("mcap", Self::Mcap)];
        formats.iter().find(|(name, _)| extension.eq_ignore_ascii_case(name)).map(|(_, format)| *format)
    }

    /// Returns the format of a file by its first bytes. A file that is neither Parquet nor MCAP is
    /// read as CSV.
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

/// Writes a recording. Not for the servo thread: it allocates and waits for the stream.
///
/// Rows are gathered and handed over in one piece, which leaves a whole file each time; see
/// [`RecordingWriter::flush`].
pub struct RecordingWriter<W: Write + Seek> {
    out: W,
    encoder: Encoder,
    pending: Pending,
    waiting: usize,
    handed_over: Instant,
    /// Bytes of the file.
    length: u64,
    /// Length of the file, if it can be truncated.
    path: Option<PathBuf>,
}

enum Encoder {
    Csv(csv::Writer),
    Parquet(parquet::Writer),
    Mcap(mcap::Writer),
}

impl RecordingWriter<File> {
    /// Creates a file for a recording in the format that its name asks for, and writes the header.
    /// Fails if there is such a file already (a recording is never written over), and with
    /// errors of the file, a name that asks for no format, or a header that TOML cannot hold.
    pub fn create(path: &Path, header: &RecordingHeader) -> io::Result<Self> {
        let format = RecordingFormat::of_name(path).ok_or_else(|| {
            io::Error::new(
                io::ErrorKind::InvalidInput,
                "its name must end in .csv, .parquet or .mcap, which choose the format",
            )
        })?;
        let writer = Self::new(File::create_new(path)?, format, header)?;
        Ok(Self { path: Some(path.to_owned()), ..writer })
    }
}

impl<W: Write + Seek> RecordingWriter<W> {
    /// Writes the header to `out`, which must be empty and need not be buffered. Errors are those
    /// of `out`, or a header that TOML cannot hold (a very large integer in `more`).
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

    /// Records new settings of the engine from tick `tick` on. They are written before the first
    /// row from that tick on; without such a row they are not written. Of several changes before
    /// the same tick, only the last is written.
    pub fn change(&mut self, tick: u64, settings: &Settings) {
        self.pending.add(tick, settings);
    }

    /// Takes one tick, and writes the gathered rows when it is time to.
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

    /// Writes the gathered rows if they have waited long enough. Call it regularly while no rows
    /// come.
    pub fn flush_when_due(&mut self) -> io::Result<()> {
        let due = self.waiting >= MOST_WAITING || (self.waiting > 0 && self.handed_over.elapsed() >= BETWEEN_PIECES);
        if due { self.flush() } else { Ok(()) }
    }

    /// Writes the gathered rows, in one piece after which the file is whole.
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

    /// Returns the length of the file so far, in bytes, without what has gathered since the last
    /// [`Self::flush`].
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Hands over the rest and gives `out` back. A Parquet file is then made smaller: into a new
    /// file beside it, which takes its place.
    pub fn finish(mut self) -> io::Result<W> {
        self.flush()?;
        if let (Some(path), Encoder::Parquet(writer)) = (&self.path, &self.encoder) {
            parquet::compact(writer, path);
        }
        Ok(self.out)
    }
}
