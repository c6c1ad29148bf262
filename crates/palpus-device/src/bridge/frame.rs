//! The frames of the bridge protocol: fixed sizes, little-endian, no padding. `docs/bridge.md`
//! specifies the frames.
//!
//! [`decode`] accepts any bytes as input. The function allocates only for the texts of
//! [`Body::Welcome`] and [`Body::Close`]. A frame is returned only if the whole frame follows the
//! specification: all numbers are finite, the quaternion has unit length and all counts are within
//! their ranges.

use std::borrow::Cow;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};

use super::fields::{Reader, Writer};
use crate::device::{Axes, DeviceSpec};

/// First bytes of every frame.
pub const MAGIC: [u8; 4] = *b"PLPB";
/// Version of the protocol. Frames of other versions are refused.
pub const VERSION: u16 = 1;
/// Size of the largest frame, bytes.
pub const LONGEST: usize = 208;
/// Longest time for which the wrench of a command may be valid, µs.
pub const MOST_VALID_FOR_US: u32 = 100_000;
/// Largest number of buttons of a device. The loop uses the other bits for its keys.
pub const MOST_BUTTONS: u8 = 30;
/// State flag: the device is powered, calibrated and gives the commanded force.
pub const READY: u32 = 1;
/// State flag: the device gives no force now, whatever wrench is commanded.
pub const WITHHELD: u32 = 2;

/// Size of the header of a frame, bytes.
const HEADER: usize = 32;
/// Offset of the header's CRC-32.
const CHECK: std::ops::Range<usize> = 12..16;
/// Size of the device's name in a welcome, bytes.
const NAME: usize = 64;
/// Size of the reason in a close frame, bytes.
const REASON: usize = 96;
/// Largest deviation of a quaternion from unit length. This limit allows single precision and
/// decimal fractions of a few digits.
const UNIT_SLACK: f64 = 1e-3;
/// Largest absolute value of a number in a frame (N, N·m, m, m/s, rad/s). A larger number is an
/// error, and might overflow when squared.
const LARGEST: f64 = 1e9;

/// A frame: session, sequence number and content.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Nonce of the session. A [`Body::Hello`] has its own nonce, and the [`Body::Welcome`] repeats
    /// it.
    pub nonce: u64,
    /// Number of the frame among the sender's frames of this session, from 1.
    pub sequence: u64,
    /// The content.
    pub body: Body,
}

/// The content of a frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Body {
    /// palpus requests a session.
    Hello {
        /// Rate at which palpus will send commands, Hz.
        rate_hz: f64,
    },
    /// The driver offers a session.
    Welcome(Welcome),
    /// palpus commands a wrench.
    Command(Command),
    /// The driver reports the state of the device.
    State(State),
    /// Either side ends the session; the text is the reason.
    Close(Cow<'static, str>),
}

/// A driver's answer to a hello.
#[derive(Clone, Debug, PartialEq)]
pub struct Welcome {
    /// Nonce of the session.
    pub session: u64,
    /// Rate at which the driver sends states, Hz.
    pub rate_hz: f64,
    /// Description of the device.
    pub spec: DeviceSpec,
}

/// A command: the wrench for the device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// Sequence of the newest state on which the wrench is based; 0 before the first state.
    pub echo: u64,
    /// Time of that state by the device's clock, ns.
    pub time_ns: u64,
    /// Wrench about the grip's origin, in the axes of the device's frame (N, N·m).
    pub wrench: Wrench,
    /// Time after `time_ns` for which the wrench is valid, µs.
    pub valid_for_us: u32,
}

/// State of the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Time by the device's own clock, ns. The origin of this clock is arbitrary.
    pub time_ns: u64,
    /// Pose of the grip in the device's frame (m).
    pub pose: Pose,
    /// Velocity of the grip (m/s at its origin, and rad/s), in the device's frame.
    pub twist: Twist,
    /// Wrench that the device applies now (N, N·m).
    pub applied: Wrench,
    /// Sequence of the newest command that the driver has accepted; 0 before the first command.
    pub echo: u64,
    /// Bit k is set while button k is pressed.
    pub buttons: u32,
    /// [`READY`] and [`WITHHELD`] flags.
    pub flags: u32,
}

/// Reason why bytes are not a valid frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// The first bytes are not [`MAGIC`].
    #[error("it does not begin with PLPB")]
    Magic,
    /// The frame has another version of the protocol.
    #[error("it has version {0} of the protocol, but this palpus uses version 1")]
    Version(u16),
    /// There is no such kind of frame.
    #[error("its kind {0} does not exist")]
    Kind(u16),
    /// The size does not fit the kind of frame, or differs from the size in the header.
    #[error("its size of {0} bytes does not fit its kind")]
    Size(usize),
    /// The CRC-32 does not match the bytes.
    #[error("its CRC-32 is wrong")]
    Check,
    /// A field is out of range.
    #[error("its field `{0}` is out of range")]
    Value(&'static str),
}

impl Body {
    const fn kind(&self) -> u16 {
        match self {
            Self::Hello { .. } => 1,
            Self::Welcome(_) => 2,
            Self::Command(_) => 3,
            Self::State(_) => 4,
            Self::Close(_) => 5,
        }
    }
}

/// Returns the size of a frame of this kind, header included, bytes; `None` for an unknown kind.
const fn size(kind: u16) -> Option<usize> {
    match kind {
        1 => Some(HEADER + 8),
        2 => Some(184),
        3 => Some(104),
        4 => Some(LONGEST),
        5 => Some(HEADER + REASON),
        _ => None,
    }
}

/// Encodes `frame` into `buffer` and returns its bytes. Does not allocate.
pub fn encode<'a>(frame: &Frame, buffer: &'a mut [u8; LONGEST]) -> &'a [u8] {
    let kind = frame.body.kind();
    let size = size(kind).unwrap_or(HEADER);
    buffer.fill(0);
    let mut to = Writer::new(buffer);
    to.put(MAGIC).put(VERSION.to_le_bytes()).put(kind.to_le_bytes()).put((size as u32).to_le_bytes());
    to.skip(CHECK.len()).put(frame.nonce.to_le_bytes()).put(frame.sequence.to_le_bytes());
    match &frame.body {
        Body::Hello { rate_hz } => {
            to.number(*rate_hz);
        }
        Body::Welcome(welcome) => write_welcome(welcome, &mut to),
        Body::Command(Command { echo, time_ns, wrench, valid_for_us }) => {
            to.put(echo.to_le_bytes()).put(time_ns.to_le_bytes()).vector(wrench.force).vector(wrench.torque);
            to.put(valid_for_us.to_le_bytes());
        }
        Body::State(state) => write_state(state, &mut to),
        Body::Close(reason) => to.text::<REASON>(reason),
    }
    let check = crc32fast::hash(&buffer[..size]);
    buffer[CHECK].copy_from_slice(&check.to_le_bytes());
    &buffer[..size]
}

fn write_welcome(welcome: &Welcome, to: &mut Writer<'_>) {
    let Welcome { session, rate_hz, spec } = welcome;
    to.put(session.to_le_bytes());
    to.text::<NAME>(&spec.name);
    to.number(spec.force_max).number(spec.torque_max);
    to.number(spec.force_continuous.unwrap_or(0.0)).number(spec.torque_continuous.unwrap_or(0.0));
    to.vector(spec.workspace.unwrap_or(DVec3::ZERO)).number(spec.delay).number(*rate_hz);
    for Axes { translation, rotation, gripper } in [spec.actuated, spec.sensed] {
        to.put([translation, rotation, gripper]);
    }
    to.put([spec.buttons, 0]);
}

fn write_state(state: &State, to: &mut Writer<'_>) {
    let State { time_ns, pose, twist, applied, echo, buttons, flags } = state;
    to.put(time_ns.to_le_bytes()).vector(pose.translation);
    for part in pose.rotation.to_array() {
        to.number(part);
    }
    to.vector(twist.linear).vector(twist.angular).vector(applied.force).vector(applied.torque);
    to.put(echo.to_le_bytes()).put(buttons.to_le_bytes()).put(flags.to_le_bytes());
}

/// Decodes the frame in `bytes`, which must be one datagram.
///
/// # Errors
/// Fails if any part does not follow the specification; the [`Refusal`] names the part.
pub fn decode(bytes: &[u8]) -> Result<Frame, Refusal> {
    let mut from = Reader::new(bytes);
    if from.take() != MAGIC {
        return Err(Refusal::Magic);
    }
    let version = u16::from_le_bytes(from.take());
    if version != VERSION {
        return Err(Refusal::Version(version));
    }
    let kind = u16::from_le_bytes(from.take());
    let size = size(kind).ok_or(Refusal::Kind(kind))?;
    if bytes.len() != size || u32::from_le_bytes(from.take()) as usize != size {
        return Err(Refusal::Size(bytes.len()));
    }
    let check = u32::from_le_bytes(from.take());
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&bytes[..CHECK.start]);
    hasher.update(&[0; CHECK.end - CHECK.start]);
    hasher.update(&bytes[CHECK.end..]);
    if hasher.finalize() != check {
        return Err(Refusal::Check);
    }
    let (nonce, sequence) = (from.count(), from.count());
    let body = match kind {
        1 => Body::Hello { rate_hz: rate(&mut from)? },
        2 => Body::Welcome(read_welcome(&mut from)?),
        3 => Body::Command(read_command(&mut from)?),
        4 => Body::State(read_state(&mut from)?),
        _ => Body::Close(Cow::Owned(from.text::<REASON>().ok_or(Refusal::Value("reason"))?)),
    };
    Ok(Frame { nonce, sequence, body })
}

fn rate(from: &mut Reader<'_>) -> Result<f64, Refusal> {
    number(from, "rate_hz", 1.0, 100_000.0)
}

fn number(from: &mut Reader<'_>, name: &'static str, least: f64, most: f64) -> Result<f64, Refusal> {
    let value = from.number();
    if (least..=most).contains(&value) { Ok(value) } else { Err(Refusal::Value(name)) }
}

fn vector(from: &mut Reader<'_>, name: &'static str) -> Result<DVec3, Refusal> {
    let value = from.vector();
    // This comparison also refuses non-finite values.
    if value.abs().cmple(DVec3::splat(LARGEST)).all() { Ok(value) } else { Err(Refusal::Value(name)) }
}

fn read_welcome(from: &mut Reader<'_>) -> Result<Welcome, Refusal> {
    let session = from.count();
    let name = from.text::<NAME>().filter(|name| !name.trim().is_empty()).ok_or(Refusal::Value("name"))?;
    let force_max = number(from, "force_max", 0.0, LARGEST)?;
    let torque_max = number(from, "torque_max", 0.0, LARGEST)?;
    let stated = |value: f64| Some(value).filter(|value| *value > 0.0);
    let force_continuous = stated(number(from, "force_continuous", 0.0, LARGEST)?);
    let torque_continuous = stated(number(from, "torque_continuous", 0.0, LARGEST)?);
    let workspace = vector(from, "workspace")?;
    if workspace.min_element() < 0.0 {
        return Err(Refusal::Value("workspace"));
    }
    let delay = number(from, "delay_s", 0.0, 0.1)?;
    let rate_hz = rate(from)?;
    let (actuated, sensed) = (axes(from, "actuated")?, axes(from, "sensed")?);
    let [buttons, reserved] = from.take();
    if buttons > MOST_BUTTONS {
        return Err(Refusal::Value("buttons"));
    }
    if reserved != 0 {
        return Err(Refusal::Value("reserved"));
    }
    let spec = DeviceSpec {
        name: Cow::Owned(name),
        force_max,
        torque_max,
        force_continuous,
        torque_continuous,
        actuated,
        sensed,
        buttons,
        workspace: Some(workspace).filter(|sides| sides.min_element() > 0.0),
        delay,
        position_step: 0.0,
        angle_step: 0.0,
    };
    Ok(Welcome { session, rate_hz, spec })
}

fn axes(from: &mut Reader<'_>, name: &'static str) -> Result<Axes, Refusal> {
    let [translation, rotation, gripper] = from.take();
    if translation > 3 || rotation > 3 || gripper > 1 {
        return Err(Refusal::Value(name));
    }
    Ok(Axes { translation, rotation, gripper })
}

fn read_command(from: &mut Reader<'_>) -> Result<Command, Refusal> {
    let (echo, time_ns) = (from.count(), from.count());
    let (force, torque) = (vector(from, "force")?, vector(from, "torque")?);
    let valid_for_us = u32::from_le_bytes(from.take());
    if valid_for_us > MOST_VALID_FOR_US {
        return Err(Refusal::Value("valid_for_us"));
    }
    if from.take() != [0; 4] {
        return Err(Refusal::Value("reserved"));
    }
    Ok(Command { echo, time_ns, wrench: Wrench { torque, force }, valid_for_us })
}

fn read_state(from: &mut Reader<'_>) -> Result<State, Refusal> {
    let time_ns = from.count();
    let translation = vector(from, "position")?;
    let rotation = DQuat::from_array([from.number(), from.number(), from.number(), from.number()]);
    let off = (rotation.length() - 1.0).abs();
    if off > UNIT_SLACK || off.is_nan() {
        return Err(Refusal::Value("orientation"));
    }
    let (linear, angular) = (vector(from, "linear")?, vector(from, "angular")?);
    let (force, torque) = (vector(from, "applied_force")?, vector(from, "applied_torque")?);
    let echo = from.count();
    let (buttons, flags) = (u32::from_le_bytes(from.take()), u32::from_le_bytes(from.take()));
    if buttons >> MOST_BUTTONS != 0 {
        return Err(Refusal::Value("buttons"));
    }
    if flags & !(READY | WITHHELD) != 0 {
        return Err(Refusal::Value("flags"));
    }
    let pose = Pose { rotation, translation }.unstretched();
    Ok(State {
        time_ns,
        pose,
        twist: Twist { angular, linear },
        applied: Wrench { torque, force },
        echo,
        buttons,
        flags,
    })
}
