//! The header of a recording.

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
    /// Version of the recording format, from 1 to [`FORMAT`](super::FORMAT).
    pub format: u32,
    /// Version of palpus that wrote the recording.
    pub palpus_version: String,
    /// Name of the device.
    pub device: String,
    /// Nominal rate of the loop, Hz.
    pub rate_hz: f64,
    /// Start of the recording (UTC, RFC 3339); `None` before format 3.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_utc: Option<String>,
    /// Seed of all random numbers of the run.
    #[serde(with = "seed_as_text")]
    pub seed: u64,
    /// The scene, with everything that affects the results.
    pub scene: RecordedScene,
}

/// The parts of a scene that a replay needs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedScene {
    /// Source of the scene.
    pub source: SceneSource,
    /// Text of the scene file, so that the recording can be replayed without the file. `None` for a
    /// built-in scene, for a text of more than [`MOST_SCENE_TEXT`] bytes, and before format 3.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// Length of one unit of the mesh files, in metres.
    pub metres_per_unit: f64,
    /// Body a, the probe.
    pub probe: RecordedBody,
    /// Body b, the environment.
    pub environment: RecordedBody,
    /// Objects in addition to the environment; empty in recordings that were written before objects
    /// existed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub objects: Vec<RecordedBody>,
    /// The engine's settings.
    #[serde(deserialize_with = "valid_settings")]
    pub render: Settings,
    /// Other settings of the run: coupling, safety chain, simulated operator, preparation of the
    /// bodies.
    #[serde(default)]
    pub more: toml::Table,
}

/// Source of a scene.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SceneSource {
    /// Name of a built-in scene.
    BuiltIn(String),
    /// Path of a scene file.
    File(String),
}

/// A body of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedBody {
    /// Path of the mesh file, or name of the built-in mesh.
    pub mesh: String,
    /// Content hash of the mesh before scaling; a replay rejects a mesh with another hash.
    pub content: ContentHash,
    /// Pose in the world at the start, in metres.
    pub pose: Pose,
}

/// The version of the format, which is read first because the other fields depend on it.
#[derive(Deserialize)]
struct Version {
    format: i64,
}

/// Size of the largest scene file that a header contains, in bytes.
pub const MOST_SCENE_TEXT: usize = 1 << 18;

/// Size of the largest text that is accepted as a header: hundreds of times the usual size.
pub(super) const MOST_TEXT: usize = 1 << 20;

/// Why a header cannot be read.
pub(super) struct HeaderError {
    /// Line in the header's text, counted from 1; 0 if unknown.
    pub(super) line: u64,
    /// Description of the problem, on one line.
    pub(super) problem: String,
}

impl RecordingHeader {
    /// Returns true if the recorded device poses are poses of the grip, as devices report them. In
    /// format 1 they are poses of the origin of the probe's mesh. Both poses are equal only if the
    /// grip is at that origin.
    pub fn has_grip_poses(&self) -> bool {
        self.format >= 2 || self.scene.render.grip_a == DVec3::ZERO
    }

    /// Returns the header as TOML. Fails if TOML cannot represent a value, for example a very large
    /// integer in `more`.
    pub(super) fn to_text(&self) -> io::Result<String> {
        toml::to_string(self).map_err(io::Error::other)
    }

    /// Parses a header from TOML.
    pub(super) fn of_text(text: &str) -> Result<Self, HeaderError> {
        let wrong = |error: toml::de::Error| HeaderError {
            line: error.span().map_or(0, |span| 1 + text[..span.start.min(text.len())].matches('\n').count() as u64),
            problem: format!("the header is invalid: {}", one_line(error.message())),
        };
        if text.len() > MOST_TEXT {
            return Err(HeaderError { line: 0, problem: "the header is too long; is it a recording?".to_owned() });
        }
        let version: Version = toml::from_str(text).map_err(wrong)?;
        if !(1..=i64::from(FORMAT)).contains(&version.format) {
            let problem = format!(
                "recordings of format {} are not supported, only 1 to {FORMAT}; use the palpus version that wrote it",
                version.format
            );
            return Err(HeaderError { line: 1, problem });
        }
        toml::from_str(text).map_err(wrong)
    }
}

/// Writes seeds as text, because seeds have 64 bits and TOML integers only 63.
mod seed_as_text {
    use super::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(seed: &u64, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(seed)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// Reads settings. Fails if the settings are invalid.
pub(super) fn valid_settings<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Settings, D::Error> {
    let settings = Settings::deserialize(deserializer)?;
    settings.validate().map_err(serde::de::Error::custom)?;
    Ok(settings)
}
