//! Name and version of the service, and the message format that follows from the version.

use serde_json::Value;

/// Supported major version. A newer one is tried, with a note.
const UNDERSTOOD: u32 = 3;

/// JSON key of a force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ForceKey {
    /// The key from version 3.5 on.
    Vector,
    /// The key before version 3.5.
    Values,
}

impl ForceKey {
    pub(super) fn key(self) -> &'static str {
        match self {
            Self::Vector => "vector",
            Self::Values => "values",
        }
    }
}

/// Name and version of a service.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Identity {
    /// Version as the service writes it; `None` if the service states no version.
    pub(super) version: Option<String>,
    /// A remark for the recording.
    pub(super) note: Option<String>,
}

impl Identity {
    /// Reads the answer to `/version`.
    ///
    /// # Errors
    /// Returns a description of the problem if the answer is from another program or from an
    /// unsupported version.
    pub(super) fn of(answer: Option<&Value>) -> Result<Self, String> {
        let Some(answer) = answer else { return Ok(Self::default()) };
        let word = |key: &str| {
            let word = answer.get(key)?.as_str()?;
            (word.len() <= 64).then(|| word.chars().filter(|letter| !letter.is_control()).collect::<String>())
        };
        if let Some(name) = word("project_name")
            && !["haply", "inverse"].iter().any(|part| name.to_lowercase().contains(part))
        {
            return Err(format!("it calls itself `{name}`"));
        }
        let version = word("project_version").or_else(|| word("version"));
        let note = match version.as_deref().and_then(number) {
            Some((major, _)) if major < UNDERSTOOD => {
                return Err(format!("its version is {major}, but version {UNDERSTOOD} is needed: update the service"));
            }
            Some((major, _)) if major > UNDERSTOOD => {
                Some(format!("the service's version {major} is newer than the supported version {UNDERSTOOD}"))
            }
            _ => None,
        };
        Ok(Self { version, note })
    }
}

/// Parses the major and the minor version.
fn number(version: &str) -> Option<(u32, u32)> {
    let mut parts = version.trim_start_matches('v').split(['.', '-', '+']);
    Some((parts.next()?.parse().ok()?, parts.next().unwrap_or("0").parse().ok()?))
}

/// Returns the force key for a service of this version; without a version, the key of the newest
/// version.
pub(super) fn spelling(version: Option<&str>) -> ForceKey {
    match version.and_then(number) {
        Some(number) if number < (3, 5) => ForceKey::Values,
        _ => ForceKey::Vector,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn version_decides_the_force_key() {
        for (version, spelled) in [
            (Some("3.5.0"), ForceKey::Vector),
            (Some("v3.10.2-rc1"), ForceKey::Vector),
            (Some("4"), ForceKey::Vector),
            (Some("3.4.9"), ForceKey::Values),
            (Some("3.0"), ForceKey::Values),
            (Some("2"), ForceKey::Values),
            (Some("nightly"), ForceKey::Vector),
            (None, ForceKey::Vector),
        ] {
            assert_eq!(spelling(version), spelled, "{version:?}");
        }
    }

    #[test]
    fn other_program_or_old_service_is_refused() {
        let of = |answer: Value| Identity::of(Some(&answer));
        let known = of(json!({ "project_name": "haply-inverse-service", "project_version": "3.5.1" })).unwrap();
        assert_eq!((known.version.as_deref(), known.note), (Some("3.5.1"), None));
        assert!(of(json!({ "project_name": "toaster", "project_version": "3.5.1" })).unwrap_err().contains("toaster"));
        assert!(of(json!({ "project_version": "2.9" })).unwrap_err().contains("update"));
        assert!(of(json!({ "project_version": "4.0" })).unwrap().note.is_some());
        assert_eq!(Identity::of(None), Ok(Identity::default()));
    }
}
