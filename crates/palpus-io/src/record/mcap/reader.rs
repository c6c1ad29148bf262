//! Reads an MCAP recording from beginning to end, record by record. The index and the footer are
//! not needed.
//!
//! 1. The header is in the metadata record `palpus`, which precedes all messages.
//! 2. Channels are identified by topic, encoding and definition.
//! 3. A chunk is accepted only if it is complete and its checksum is right. The first truncated or
//!    damaged chunk ends the recording, and the recording contains a notice.

use std::io::{BufRead, Read};

use super::cdr::{self, Fields};
use super::records::{MAGIC, Values, opcode};
use super::writer::{ENCODINGS, METADATA, NOT_COMPRESSED, SETTINGS, TICKS};
use crate::TableError;
use crate::record::columns::{Take, take};
use crate::record::{FORMAT, Recording, RecordingHeader, change};

/// Reads a recording; `name` is the name of the file in error messages.
pub(in crate::record) fn read(mut input: impl BufRead, name: &str) -> Result<Recording, TableError> {
    let wrong = |problem: String| TableError::at(name, 0, problem);
    let unreadable = |error: std::io::Error| TableError::at(name, 0, format!("cannot be read ({error})"));
    let mut magic = Vec::new();
    input.by_ref().take(MAGIC.len() as u64).read_to_end(&mut magic).map_err(unreadable)?;
    if magic != MAGIC {
        return Err(wrong("it is not an MCAP file".to_owned()));
    }
    let mut state = State::default();
    let mut at = magic.len() as u64;
    let end = loop {
        match next(&mut input).map_err(unreadable)? {
            Next::End => break None,
            Next::CutOff => break Some(End::Damaged),
            Next::Record(opcode::DATA_END, _) => break None,
            Next::Record(opcode, body) => {
                if let Err(end) = state.record(opcode, &body) {
                    break Some(end);
                }
                at += 9 + body.len() as u64;
            }
        }
    };
    let Some(mut recording) = state.recording else {
        let none = "it has no header of palpus (metadata `palpus`); is it a recording?";
        return Err(wrong(match end {
            Some(End::Wrong(problem)) => problem,
            _ => none.to_owned(),
        }));
    };
    match end {
        None => {}
        Some(End::Wrong(problem)) => return Err(wrong(format!("at byte {at}: {problem}"))),
        Some(End::Damaged) => {
            let whole = recording.rows.len();
            let notice = format!("{name}, byte {at}: truncated or damaged from here on; {whole} ticks are complete");
            recording.notice = Some(notice);
        }
    }
    Ok(recording)
}

/// Next item of a file.
enum Next {
    Record(u8, Vec<u8>),
    CutOff,
    End,
}

/// Reads the next record. Memory is allocated as the bytes arrive, so a false length costs nothing.
fn next(input: &mut impl BufRead) -> std::io::Result<Next> {
    let mut head = Vec::new();
    input.by_ref().take(9).read_to_end(&mut head)?;
    let mut values = Values(&head);
    let (Some(opcode), Some(length)) = (values.number::<1>(), values.number::<8>()) else {
        return Ok(if head.is_empty() { Next::End } else { Next::CutOff });
    };
    let mut body = Vec::new();
    input.by_ref().take(length).read_to_end(&mut body)?;
    Ok(if body.len() as u64 == length { Next::Record(opcode as u8, body) } else { Next::CutOff })
}

/// Why reading stops before the end of the data.
enum End {
    /// The file is damaged from here on; all earlier content is valid.
    Damaged,
    /// The file is not a supported recording; the text describes the problem.
    Wrong(String),
}

/// The content read so far.
#[derive(Default)]
struct State {
    recording: Option<Recording>,
    /// Numbers of the schemas of rows and of changes of settings.
    schemas: [Option<u64>; 2],
    /// Numbers of the channels of rows and of changes of settings.
    channels: [Option<u64>; 2],
}

impl State {
    /// Processes a record, which may be part of a chunk.
    fn record(&mut self, opcode: u8, body: &[u8]) -> Result<(), End> {
        let values = Values(body);
        match opcode {
            opcode::METADATA => self.metadata(values),
            opcode::SCHEMA => self.schema(values).ok_or(End::Damaged),
            opcode::CHANNEL => self.channel(values).ok_or(End::Damaged)?,
            opcode::MESSAGE => self.message(values),
            opcode::CHUNK => self.chunk(values),
            _ => Ok(()),
        }
    }

    fn metadata(&mut self, mut values: Values<'_>) -> Result<(), End> {
        if values.text() != Some(METADATA.0) || self.recording.is_some() {
            return Ok(());
        }
        let mut entries = Values(values.counted::<4>().ok_or(End::Damaged)?);
        while let (Some(key), Some(value)) = (entries.text(), entries.text()) {
            if key == METADATA.1 {
                let header = RecordingHeader::of_text(value).map_err(|error| End::Wrong(error.problem))?;
                self.recording = Some(Recording::empty(header));
            }
        }
        Ok(())
    }

    fn schema(&mut self, mut values: Values<'_>) -> Option<()> {
        let number = values.number::<2>()?;
        let (_name, encoding, definition) = (values.text()?, values.text()?, values.text()?);
        if encoding == ENCODINGS.1 {
            let [ticks, settings] = &mut self.schemas;
            if (1..=FORMAT).any(|format| definition == cdr::tick(format)) {
                *ticks = Some(number);
            } else if definition == cdr::settings() {
                *settings = Some(number);
            }
        }
        Some(())
    }

    fn channel(&mut self, mut values: Values<'_>) -> Option<Result<(), End>> {
        let (number, schema) = (values.number::<2>()?, values.number::<2>()?);
        let (topic, encoding) = (values.text()?, values.text()?);
        let Some(k) = [TICKS, SETTINGS].iter().position(|own| *own == topic) else { return Some(Ok(())) };
        if encoding != ENCODINGS.0 || self.schemas[k] != Some(schema) {
            let problem = format!(
                "the messages of {topic} do not have the expected definition; was the file written by another version?"
            );
            return Some(Err(End::Wrong(problem)));
        }
        self.channels[k] = Some(number);
        Some(Ok(()))
    }

    fn message(&mut self, mut values: Values<'_>) -> Result<(), End> {
        let number = values.number::<2>().ok_or(End::Damaged)?;
        let Some(k) = self.channels.iter().position(|known| *known == Some(number)) else { return Ok(()) };
        let Some(recording) = &mut self.recording else {
            return Err(End::Wrong("its messages begin before its header (metadata `palpus`)".to_owned()));
        };
        // Skips the sequence number, the log time and the publish time.
        let message = values.0.get(4 + 8 + 8..).and_then(|message| Fields::new(message).ok()).ok_or(End::Damaged)?;
        if k == 0 {
            let mut message = message;
            recording.rows.push(take(recording.header.format, &mut message).map_err(|_| End::Damaged)?);
        } else {
            let mut message = message;
            let text = message.long().and_then(|_tick| message.text()).map_err(|_| End::Damaged)?;
            recording.changes.push(change::read(text).map_err(End::Wrong)?);
        }
        Ok(())
    }

    fn chunk(&mut self, mut values: Values<'_>) -> Result<(), End> {
        let head =
            (values.number::<8>(), values.number::<8>(), values.number::<8>(), values.number::<4>(), values.text());
        let (Some(_start), Some(_end), Some(_size), Some(checksum), Some(compression)) = head else {
            return Err(End::Damaged);
        };
        if compression != NOT_COMPRESSED {
            let shown: String = compression.chars().take(20).collect();
            let problem = format!(
                "a chunk is compressed ({shown:?}); palpus reads only uncompressed chunks: decompress the file first"
            );
            return Err(End::Wrong(problem));
        }
        let bytes = values.counted::<8>().ok_or(End::Damaged)?;
        if checksum != 0 && u64::from(crc32fast::hash(bytes)) != checksum {
            return Err(End::Damaged);
        }
        let mut records = Values(bytes);
        while !records.0.is_empty() {
            match records.record() {
                // A chunk must not contain a chunk.
                Some((opcode::CHUNK, _)) | None => return Err(End::Damaged),
                Some((opcode, body)) => self.record(opcode, body)?,
            }
        }
        Ok(())
    }
}
