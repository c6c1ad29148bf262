//! Header of a recording.

use std::io;

use glam::DVec3;
use palpus::algebra::Pose;
use palpus::render::Settings;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::FORMAT;
use crate::mesh::ContentHash;
use crate::one_line::one_line;

/// Describes a run: scene, device, settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordingHeader {
    /// Version of the recording's format, from 1 to [`FORMAT`](super::FORMAT).
    pub format: u32,
    /// Version of palpus that wrote the recording.
    pub palpus_version: String,
    /// The device, as the program names it.
    pub device: String,
    /// Nominal rate of the loop, Hz.
    pub rate_hz: f64,
    /// When the recording was begun, UTC, as RFC 3339 has it; `None` before format 3.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_utc: Option<String>,
    /// Seed of everything random in the run.
    #[serde(with = "seed_as_text")]
    pub seed: u64,
    /// The scene with everything that changes an answer.
    pub scene: RecordedScene,
}

/// A scene, as far as a replay needs it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedScene {
    /// Source of the scene.
    pub source: SceneSource,
    /// The text of the scene's file, so that the recording can be replayed without it; `None` for a
    /// built-in scene, a text of more than [`MOST_SCENE_TEXT`] bytes, and before format 3.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// Metres for each unit of the mesh files.
    pub metres_per_unit: f64,
    /// Body a.
    pub probe: RecordedBody,
    /// Body b.
    pub environment: RecordedBody,
    /// Objects beside the environment; empty in recordings from before there were any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub objects: Vec<RecordedBody>,
    /// The engine's settings.
    #[serde(deserialize_with = "valid_settings")]
    pub render: Settings,
    /// Whatever else decided the run: coupling, safety chain, hand, preparation.
    #[serde(default)]
    pub more: toml::Table,
}

/// Source of a scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SceneSource {
    /// One of the program's own scenes, by name.
    BuiltIn(String),
    /// A scene file, by path.
    File(String),
}

/// A body of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedBody {
    /// Its mesh file or built-in name.
    pub mesh: String,
    /// Content hash of the mesh before scaling: a replay refuses another mesh.
    pub content: ContentHash,
    /// Its placement in the world at the start, m.
    pub pose: Pose,
}

/// The format's number, which decides how the rest is read.
#[derive(Deserialize)]
struct Version {
    format: i64,
}

/// Bytes of the longest scene file that a header holds.
pub const MOST_SCENE_TEXT: usize = 1 << 18;

/// Bytes of the longest text that is taken for a header: hundreds of times one.
pub(super) const MOST_TEXT: usize = 1 << 20;

/// Why a header was not read.
pub(super) struct HeaderError {
    /// Line of the header's text, from 1; 0 if unknown.
    pub(super) line: u64,
    /// The problem, in one line.
    pub(super) problem: String,
}

impl RecordingHeader {
    /// True if the recorded device poses are those of the grip, as devices report them. In format 1
    /// they are those of the origin of the probe's mesh, which is the same only if the grip is
    /// there.
    pub fn has_grip_poses(&self) -> bool {
        self.format >= 2 || self.scene.render.grip_a == DVec3::ZERO
    }

    /// Returns the header as TOML. Fails for values that TOML cannot represent (a very large
    /// integer in `more`).
    pub(super) fn to_text(&self) -> io::Result<String> {
        toml::to_string(self).map_err(io::Error::other)
    }

    /// Parses a header from TOML.
    pub(super) fn of_text(text: &str) -> Result<Self, HeaderError> {
        let wrong = |error: toml::de::Error| HeaderError {
            line: error.span().map_or(0, |span| 1 + text[..span.start.min(text.len())].matches('\n').count() as u64),
            problem: format!("the header is wrong: {}", one_line(error.message())),
        };
        if text.len() > MOST_TEXT {
            return Err(HeaderError { line: 0, problem: "the header is far too long; is it a recording?".to_owned() });
        }
        let version: Version = toml::from_str(text).map_err(wrong)?;
        if !(1..=i64::from(FORMAT)).contains(&version.format) {
            let problem = format!(
                "recordings of format {} are not read, only 1 to {FORMAT}; use the palpus that wrote it",
                version.format
            );
            return Err(HeaderError { line: 1, problem });
        }
        toml::from_str(text).map_err(wrong)
    }
}

/// Seeds use all 64 bits and TOML's integers have 63.
mod seed_as_text {
    use super::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(seed: &u64, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(seed)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// Fails if the settings are invalid.
pub(super) fn valid_settings<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Settings, D::Error> {
    let settings = Settings::deserialize(deserializer)?;
    settings.validate().map_err(serde::de::Error::custom)?;
    Ok(settings)
}
