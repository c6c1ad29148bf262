//! Header of a recording.

use std::io;

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::{Clustering, Limits, Material, Saturation, Settings, VirtualCoupling};
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
    #[serde(with = "RenderText")]
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
    #[serde(with = "PoseText")]
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

    /// As TOML. Errors are of what TOML cannot hold (a very large integer in `more`).
    pub(super) fn to_text(&self) -> io::Result<String> {
        toml::to_string(self).map_err(io::Error::other)
    }

    /// The header that such a text spells.
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

/// A [`Pose`] in TOML.
#[derive(Serialize, Deserialize)]
struct PoseText {
    translation: [f64; 3],
    rotation: [f64; 4],
}

impl PoseText {
    fn serialize<S: Serializer>(pose: &Pose, serializer: S) -> Result<S::Ok, S::Error> {
        let text = Self { translation: pose.translation.to_array(), rotation: pose.rotation.to_array() };
        Serialize::serialize(&text, serializer)
    }

    /// Not through `Pose::new`: normalising again could change bits.
    fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Pose, D::Error> {
        let text = <Self as Deserialize>::deserialize(deserializer)?;
        Ok(Pose { rotation: DQuat::from_array(text.rotation), translation: DVec3::from_array(text.translation) })
    }
}

/// The engine's [`Settings`] in TOML. That none is forgotten is what the test below is for: its
/// literal names every field.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RenderText {
    contact_tolerance: f64,
    cluster_radius: f64,
    /// Absent from recordings that were made before there was a choice.
    #[serde(default)]
    clustering: ClusteringText,
    split_angle: Option<f64>,
    stiffness: f64,
    damping: f64,
    /// Called `blend_angle` in recordings that were made before there were patches, and absent from
    /// older ones.
    #[serde(default, alias = "blend_angle")]
    patch_angle: Option<f64>,
    saturation: SaturationText,
    grip_a: [f64; 3],
    capacity: u64,
    /// ns; absent without one.
    #[serde(default)]
    time_budget: Option<u64>,
    shading: Option<ShadingText>,
    friction: Option<FrictionText>,
    /// Absent where impacts do not ring.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    material: Option<MaterialText>,
    limits: LimitsText,
    /// Absent with direct rendering.
    #[serde(default)]
    coupling: Option<CouplingText>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CouplingText {
    stiffness: f64,
    damping: f64,
    angular_stiffness: f64,
    angular_damping: f64,
    skin: f64,
    mass: f64,
}

#[derive(Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ClusteringText {
    #[default]
    Linkage,
    Smooth,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum SaturationText {
    Separate,
    Joint,
    UnderActuated,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ShadingText {
    crease_angle: f64,
    most_turn: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FrictionText {
    static_coefficient: f64,
    dynamic_coefficient: f64,
    tangential_stiffness: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialText {
    frequency: f64,
    decay: f64,
    gain: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitsText {
    force: f64,
    torque: f64,
}

impl RenderText {
    pub(super) fn serialize<S: Serializer>(settings: &Settings, serializer: S) -> Result<S::Ok, S::Error> {
        let Settings {
            contact_tolerance,
            cluster_radius,
            clustering,
            split_angle,
            stiffness,
            damping,
            patch_angle,
            shading,
            friction,
            material,
            limits: Limits { force, torque },
            saturation,
            grip_a,
            capacity,
            time_budget,
            coupling,
            ..
        } = *settings;
        let text =
            Self {
                contact_tolerance,
                cluster_radius,
                clustering: match clustering {
                    Clustering::Linkage => ClusteringText::Linkage,
                    Clustering::Smooth => ClusteringText::Smooth,
                },
                split_angle,
                stiffness,
                damping,
                patch_angle,
                saturation: match saturation {
                    Saturation::Separate => SaturationText::Separate,
                    Saturation::Joint => SaturationText::Joint,
                    Saturation::UnderActuated => SaturationText::UnderActuated,
                },
                grip_a: grip_a.to_array(),
                capacity: capacity as u64,
                time_budget,
                shading: shading
                    .map(|ShadingSettings { crease_angle, most_turn }| ShadingText { crease_angle, most_turn }),
                friction: friction.map(
                    |FrictionSettings { static_coefficient, dynamic_coefficient, tangential_stiffness }| FrictionText {
                        static_coefficient,
                        dynamic_coefficient,
                        tangential_stiffness,
                    },
                ),
                material: material.map(|Material { frequency, decay, gain }| MaterialText { frequency, decay, gain }),
                limits: LimitsText { force, torque },
                coupling: coupling.map(
                    |VirtualCoupling { stiffness, damping, angular_stiffness, angular_damping, skin, mass }| {
                        CouplingText { stiffness, damping, angular_stiffness, angular_damping, skin, mass }
                    },
                ),
            };
        Serialize::serialize(&text, serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Settings, D::Error> {
        let text = <Self as Deserialize>::deserialize(deserializer)?;
        #[allow(
            clippy::needless_update,
            reason = "a setting that is new in the engine must not stop this crate from building"
        )]
        let settings = Settings {
            contact_tolerance: text.contact_tolerance,
            cluster_radius: text.cluster_radius,
            clustering: match text.clustering {
                ClusteringText::Linkage => Clustering::Linkage,
                ClusteringText::Smooth => Clustering::Smooth,
            },
            split_angle: text.split_angle,
            stiffness: text.stiffness,
            damping: text.damping,
            patch_angle: text.patch_angle,
            shading: text
                .shading
                .map(|ShadingText { crease_angle, most_turn }| ShadingSettings { crease_angle, most_turn }),
            friction: text.friction.map(
                |FrictionText { static_coefficient, dynamic_coefficient, tangential_stiffness }| FrictionSettings {
                    static_coefficient,
                    dynamic_coefficient,
                    tangential_stiffness,
                },
            ),
            material: text.material.map(|MaterialText { frequency, decay, gain }| Material { frequency, decay, gain }),
            limits: Limits { force: text.limits.force, torque: text.limits.torque },
            saturation: match text.saturation {
                SaturationText::Separate => Saturation::Separate,
                SaturationText::Joint => Saturation::Joint,
                SaturationText::UnderActuated => Saturation::UnderActuated,
            },
            grip_a: DVec3::from_array(text.grip_a),
            capacity: usize::try_from(text.capacity).map_err(serde::de::Error::custom)?,
            time_budget: text.time_budget,
            coupling: text.coupling.map(
                |CouplingText { stiffness, damping, angular_stiffness, angular_damping, skin, mass }| VirtualCoupling {
                    stiffness,
                    damping,
                    angular_stiffness,
                    angular_damping,
                    skin,
                    mass,
                },
            ),
            ..Settings::default()
        };
        settings.validate().map_err(serde::de::Error::custom)?;
        Ok(settings)
    }
}
