//! Frames on which no driver may act: damaged, old, of another session, or random bytes.

use palpus::algebra::{Random, Wrench};

use super::peer::Numbered;
use super::{VALID_FOR_US, nonce_but};
use crate::bridge::frame::{self, Body, Command, Frame, LONGEST, State};

const SEED: u64 = 0xb41d_6e00;
/// Offset of the CRC-32.
const CHECK: std::ops::Range<usize> = 12..16;

/// Generates hostile frames. Each frame contains a wrench, so that a wrong reaction causes a force.
pub(super) struct Hostile {
    session: u64,
    wrench: Wrench,
    random: Random,
    kind: u64,
    bytes: Vec<u8>,
}

impl Hostile {
    pub(super) fn new(session: u64, wrench: Wrench) -> Self {
        Self { session, wrench, random: Random::new(SEED), kind: 0, bytes: Vec::new() }
    }

    /// Returns the next frame. `newest` is the driver's newest state; `sent` is the number of sent
    /// commands.
    pub(super) fn next(&mut self, newest: &Numbered, sent: u64) -> &[u8] {
        self.kind = (self.kind + 1) % 11;
        let command = Command {
            echo: newest.sequence,
            time_ns: newest.state.time_ns,
            wrench: self.wrench,
            valid_for_us: VALID_FOR_US,
        };
        let good = Frame { nonce: self.session, sequence: sent + 1000, body: Body::Command(command) };
        match self.kind {
            0 => self.set(&Frame { nonce: nonce_but(self.session), ..good }),
            1 => self.set(&Frame { sequence: sent, ..good }),
            2 => {
                // One bit of the frame is flipped.
                self.set(&good);
                let bit = self.random.below(8 * self.bytes.len());
                self.bytes[bit / 8] ^= 1 << (bit % 8);
            }
            3 => {
                self.set(&good);
                let length = self.random.below(self.bytes.len());
                self.bytes.truncate(length.max(1));
            }
            4 => {
                self.set(&good);
                self.bytes.push(0);
            }
            5 => self.with_field(&good, 48, &f64::NAN.to_le_bytes()),
            6 => self.with_field(&good, 96, &u32::MAX.to_le_bytes()),
            7 => self.with_field(&good, 4, &2u16.to_le_bytes()),
            8 => {
                // A frame that only a driver may send.
                let state = State { applied: self.wrench, ..newest.state };
                self.set(&Frame { body: Body::State(state), ..good });
            }
            9 => {
                self.set(&Frame { nonce: nonce_but(self.session), sequence: 1, body: Body::Hello { rate_hz: 1000.0 } })
            }
            _ => {
                let length = 1 + self.random.below(LONGEST);
                self.bytes.clear();
                for _ in 0..length {
                    let byte = self.random.below(256) as u8;
                    self.bytes.push(byte);
                }
            }
        }
        &self.bytes
    }

    /// Returns a description of the last frame.
    pub(super) fn last(&self) -> &'static str {
        match self.kind {
            0 => "a command with another nonce",
            1 => "a command whose sequence is not larger than the last one's",
            2 => "a command with one flipped bit: check the CRC-32",
            3 => "a command that is cut off: check the size",
            4 => "a command that is too long: check the size",
            5 => "a command with a force that is NaN",
            6 => "a command that is valid for more than 100 000 µs",
            7 => "a command of another version",
            8 => "a state, which only a driver may send",
            9 => "a hello in the middle of a session",
            _ => "random bytes",
        }
    }

    fn set(&mut self, frame: &Frame) {
        self.bytes.clear();
        self.bytes.extend_from_slice(frame::encode(frame, &mut [0; LONGEST]));
    }

    /// Replaces the bytes of one field, and corrects the CRC-32.
    fn with_field(&mut self, frame: &Frame, at: usize, field: &[u8]) {
        self.set(frame);
        self.bytes[at..at + field.len()].copy_from_slice(field);
        self.bytes[CHECK].fill(0);
        let check = crc32fast::hash(&self.bytes);
        self.bytes[CHECK].copy_from_slice(&check.to_le_bytes());
    }
}
