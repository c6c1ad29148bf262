//! Writes a recording as MCAP.

use glam::{DQuat, DVec3};

use super::cdr::{self, Message};
use super::records::{MAGIC, counted, opcode, record, text};
use crate::record::columns::{Put, put};
use crate::record::{Piece, RecordRow};

/// Name of the metadata record that contains the header, and its key in that record.
pub(super) const METADATA: (&str, &str) = ("palpus", "header");

/// Encoding of all messages and of their definitions.
pub(super) const ENCODINGS: (&str, &str) = ("cdr", "ros2msg");

/// Nanoseconds in a second.
const SECOND: u64 = 1_000_000_000;

/// A channel and its schema, which have the same number.
struct Channel {
    topic: &'static str,
    schema: &'static str,
    /// Returns the definition for a version of the recording format.
    definition: fn(u32) -> String,
}

/// The channels; the number of a channel is its index plus one.
const CHANNELS: [Channel; 6] = [
    Channel { topic: TICKS, schema: "palpus_msgs/msg/Tick", definition: cdr::tick },
    Channel { topic: SETTINGS, schema: "palpus_msgs/msg/Settings", definition: |_| cdr::settings() },
    Channel { topic: "/palpus/device/pose", schema: POSE, definition: |_| cdr::pose_stamped() },
    Channel {
        topic: "/palpus/device/twist",
        schema: "geometry_msgs/msg/TwistStamped",
        definition: |_| cdr::twist_stamped(),
    },
    Channel {
        topic: "/palpus/device/wrench",
        schema: "geometry_msgs/msg/WrenchStamped",
        definition: |_| cdr::wrench_stamped(),
    },
    // This channel has no messages in recordings of format 1.
    Channel { topic: "/palpus/tool/pose", schema: POSE, definition: |_| cdr::pose_stamped() },
];

const POSE: &str = "geometry_msgs/msg/PoseStamped";

/// Topic of the rows.
pub(super) const TICKS: &str = "/palpus/tick";
/// Topic of the changes of settings.
pub(super) const SETTINGS: &str = "/palpus/settings";

/// Indices of the channels.
const OF_TICKS: usize = 0;
const OF_SETTINGS: usize = 1;
const OF_POSES: usize = 2;
const OF_TWISTS: usize = 3;
const OF_WRENCHES: usize = 4;
const OF_TOOLS: usize = 5;

/// Collects messages into chunks.
pub(in crate::record) struct Writer {
    /// Version of the recording format.
    format: u32,
    /// Offset of the next piece, which overwrites the summary.
    data_end: u64,
    /// Bytes before the next chunk: the start of the file, empty after the first piece.
    beginning: Vec<u8>,
    metadata: (u64, u64),
    chunk: Vec<u8>,
    /// Time and offset of each message in the chunk, by channel.
    indices: [Vec<(u64, u64)>; CHANNELS.len()],
    /// The encoded index entries of the chunks for the summary.
    chunk_index: Vec<u8>,
    chunks: u32,
    counts: [u64; CHANNELS.len()],
    /// Times of the first and the last message, in ns.
    times: Option<(u64, u64)>,
}

impl Writer {
    /// Starts a file of version `format` with this header and no messages.
    pub(in crate::record) fn new(header: &str, format: u32) -> Self {
        let mut beginning = MAGIC.to_vec();
        record(&mut beginning, opcode::HEADER, |out| {
            text(out, "ros2");
            text(out, concat!("palpus ", env!("CARGO_PKG_VERSION")));
        });
        let metadata_start = beginning.len() as u64;
        record(&mut beginning, opcode::METADATA, |out| {
            text(out, METADATA.0);
            counted::<4>(out, |out| {
                text(out, METADATA.1);
                text(out, header);
            });
        });
        let metadata = (metadata_start, beginning.len() as u64 - metadata_start);
        schemas(&mut beginning, format);
        channels(&mut beginning);
        Self {
            format,
            data_end: 0,
            beginning,
            metadata,
            chunk: Vec::new(),
            indices: Default::default(),
            chunk_index: Vec::new(),
            chunks: 0,
            counts: [0; CHANNELS.len()],
            times: None,
        }
    }

    /// Appends a change of settings before the row at `time` (ns).
    pub(in crate::record) fn change(&mut self, tick: u64, line: &str, time: u64) {
        self.message(OF_SETTINGS, tick, time, |message| {
            message.long(tick);
            message.text(line);
        });
    }

    /// Appends a tick: the whole row, and its pose, twist and wrench as messages for robotics
    /// tools.
    pub(in crate::record) fn row(&mut self, row: &RecordRow) {
        let time = row.time_ns;
        let format = self.format;
        self.message(OF_TICKS, row.tick, time, |message| put(row, format, message));
        for (channel, pose) in [(OF_POSES, Some(row.pose)), (OF_TOOLS, row.tool)] {
            let Some(pose) = pose else { continue };
            self.message(channel, row.tick, time, |message| {
                stamp(message, time);
                vector(message, pose.translation);
                quaternion(message, pose.rotation);
            });
        }
        self.message(OF_TWISTS, row.tick, time, |message| {
            stamp(message, time);
            vector(message, row.twist.linear);
            vector(message, row.twist.angular);
        });
        self.message(OF_WRENCHES, row.tick, time, |message| {
            stamp(message, time);
            vector(message, row.wrench.force);
            vector(message, row.wrench.torque);
        });
    }

    fn message(&mut self, channel: usize, tick: u64, time: u64, body: impl FnOnce(&mut Message<'_>)) {
        self.indices[channel].push((time, self.chunk.len() as u64));
        self.counts[channel] += 1;
        self.times = Some(self.times.map_or((time, time), |(first, last)| (first.min(time), last.max(time))));
        record(&mut self.chunk, opcode::MESSAGE, |out| {
            out.extend(number(channel).to_le_bytes());
            out.extend((tick as u32).to_le_bytes());
            // The log time and the publish time.
            out.extend(time.to_le_bytes());
            out.extend(time.to_le_bytes());
            body(&mut Message::new(out));
        });
    }

    /// Returns the new messages as a chunk, followed by the end of the file.
    pub(in crate::record) fn flush(&mut self) -> Piece {
        let at = self.data_end;
        let mut bytes = std::mem::take(&mut self.beginning);
        if !self.chunk.is_empty() {
            self.chunk(&mut bytes);
        }
        self.data_end += bytes.len() as u64;
        self.ending(at, &mut bytes);
        Piece { at, bytes }
    }

    /// Appends the chunk and its message indices, and starts the next chunk.
    fn chunk(&mut self, out: &mut Vec<u8>) {
        let chunk = std::mem::take(&mut self.chunk);
        let times = self.indices.iter().flatten().map(|(time, _)| *time);
        let (start, end) = (times.clone().min().unwrap_or(0), times.max().unwrap_or(0));
        let size = chunk.len() as u64;
        let place = |out: &Vec<u8>| self.data_end + out.len() as u64;
        let chunk_start = place(out);
        record(out, opcode::CHUNK, |out| {
            [start, end, size].iter().for_each(|value| out.extend(value.to_le_bytes()));
            out.extend(crc32fast::hash(&chunk).to_le_bytes());
            text(out, NOT_COMPRESSED);
            counted::<8>(out, |out| out.extend(&chunk));
        });
        let indices_start = place(out);
        let mut offsets = Vec::new();
        for (channel, index) in self.indices.iter().enumerate().filter(|(_, index)| !index.is_empty()) {
            offsets.push((number(channel), place(out)));
            record(out, opcode::MESSAGE_INDEX, |out| {
                out.extend(number(channel).to_le_bytes());
                counted::<4>(out, |out| {
                    for value in index.iter().flat_map(|(time, offset)| [time, offset]) {
                        out.extend(value.to_le_bytes());
                    }
                });
            });
        }
        let indices_end = place(out);
        record(&mut self.chunk_index, opcode::CHUNK_INDEX, |out| {
            for value in [start, end, chunk_start, indices_start - chunk_start] {
                out.extend(value.to_le_bytes());
            }
            counted::<4>(out, |out| {
                for (channel, offset) in offsets {
                    out.extend(channel.to_le_bytes());
                    out.extend(offset.to_le_bytes());
                }
            });
            out.extend((indices_end - indices_start).to_le_bytes());
            text(out, NOT_COMPRESSED);
            // The compressed size and the uncompressed size, which are equal.
            out.extend(size.to_le_bytes());
            out.extend(size.to_le_bytes());
        });
        self.chunks += 1;
        self.indices.iter_mut().for_each(Vec::clear);
    }

    /// Appends the end of the data, the summary and the footer to a piece that is written at offset
    /// `at`.
    fn ending(&self, at: u64, out: &mut Vec<u8>) {
        // The checksum 0 means that there is no checksum.
        record(out, opcode::DATA_END, |out| out.extend([0; 4]));
        let place = |out: &Vec<u8>| at + out.len() as u64;
        let summary_start = place(out);
        let mut groups = Vec::new();
        let mut group = |out: &mut Vec<u8>, opcode, body: &dyn Fn(&mut Vec<u8>)| {
            let start = place(out);
            body(out);
            groups.push((opcode, start, place(out) - start));
        };
        group(out, opcode::SCHEMA, &|out| schemas(out, self.format));
        group(out, opcode::CHANNEL, &channels);
        group(out, opcode::STATISTICS, &|out| self.statistics(out));
        if self.chunks > 0 {
            group(out, opcode::CHUNK_INDEX, &|out| out.extend(&self.chunk_index));
        }
        group(out, opcode::METADATA_INDEX, &|out| {
            record(out, opcode::METADATA_INDEX, |out| {
                out.extend(self.metadata.0.to_le_bytes());
                out.extend(self.metadata.1.to_le_bytes());
                text(out, METADATA.0);
            });
        });
        let offsets_start = place(out);
        for (group, start, length) in groups {
            record(out, opcode::SUMMARY_OFFSET, |out| {
                out.push(group);
                out.extend(start.to_le_bytes());
                out.extend(length.to_le_bytes());
            });
        }
        record(out, opcode::FOOTER, |out| {
            out.extend(summary_start.to_le_bytes());
            out.extend(offsets_start.to_le_bytes());
            out.extend([0; 4]);
        });
        out.extend(MAGIC);
    }

    fn statistics(&self, out: &mut Vec<u8>) {
        let (start, end) = self.times.unwrap_or((0, 0));
        record(out, opcode::STATISTICS, |out| {
            out.extend(self.counts.iter().sum::<u64>().to_le_bytes());
            out.extend((CHANNELS.len() as u16).to_le_bytes());
            // Numbers of channels, attachments, metadata records and chunks.
            for count in [CHANNELS.len() as u32, 0, 1, self.chunks] {
                out.extend(count.to_le_bytes());
            }
            out.extend(start.to_le_bytes());
            out.extend(end.to_le_bytes());
            counted::<4>(out, |out| {
                for (channel, count) in self.counts.iter().enumerate() {
                    out.extend(number(channel).to_le_bytes());
                    out.extend(count.to_le_bytes());
                }
            });
        });
    }
}

/// Name of the compression of chunks: none.
pub(super) const NOT_COMPRESSED: &str = "";

/// Returns the number of a channel and of its schema. Numbers start at 1, because schema 0 means no
/// schema.
fn number(channel: usize) -> u16 {
    channel as u16 + 1
}

fn schemas(out: &mut Vec<u8>, format: u32) {
    for (k, channel) in CHANNELS.iter().enumerate() {
        record(out, opcode::SCHEMA, |out| {
            out.extend(number(k).to_le_bytes());
            text(out, channel.schema);
            text(out, ENCODINGS.1);
            text(out, &(channel.definition)(format));
        });
    }
}

fn channels(out: &mut Vec<u8>) {
    for (k, channel) in CHANNELS.iter().enumerate() {
        record(out, opcode::CHANNEL, |out| {
            // The number of the channel and the number of its schema.
            out.extend(number(k).to_le_bytes());
            out.extend(number(k).to_le_bytes());
            text(out, channel.topic);
            text(out, ENCODINGS.0);
            counted::<4>(out, |_| {});
        });
    }
}

/// Appends a `std_msgs/Header`.
fn stamp(message: &mut Message<'_>, time: u64) {
    message.whole((time / SECOND) as u32);
    message.whole((time % SECOND) as u32);
    message.text("world");
}

fn vector(message: &mut Message<'_>, vector: DVec3) {
    vector.to_array().into_iter().for_each(|x| message.double(x));
}

fn quaternion(message: &mut Message<'_>, rotation: DQuat) {
    rotation.to_array().into_iter().for_each(|x| message.double(x));
}
