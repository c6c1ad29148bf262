//! Which service it is: its name and version, and how it wants forces to be spelled.

use serde_json::Value;

/// Major versions whose messages are understood. A newer one is tried, and said.
const UNDERSTOOD: u32 = 3;

/// How a force is spelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spelling {
    /// From 3.5 on.
    Vector,
    /// Before.
    Values,
}

impl Spelling {
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
    /// As the service writes it; `None` when it does not say.
    pub(super) version: Option<String>,
    /// Worth writing down.
    pub(super) note: Option<String>,
}

impl Identity {
    /// Out of the answer to `/version`.
    ///
    /// # Errors
    /// In words, if it is another program, or one whose messages are not understood.
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
                return Err(format!("its version is {major}, and {UNDERSTOOD} is needed: update it"));
            }
            Some((major, _)) if major > UNDERSTOOD => {
                Some(format!("the service's version {major} is newer than this program knows ({UNDERSTOOD})"))
            }
            _ => None,
        };
        Ok(Self { version, note })
    }
}

/// Major and minor.
fn number(version: &str) -> Option<(u32, u32)> {
    let mut parts = version.trim_start_matches('v').split(['.', '-', '+']);
    Some((parts.next()?.parse().ok()?, parts.next().unwrap_or("0").parse().ok()?))
}

/// The spelling of a service of this version; without one, of the newest that is known.
pub(super) fn spelling(version: Option<&str>) -> Spelling {
    match version.and_then(number) {
        Some(number) if number < (3, 5) => Spelling::Values,
        _ => Spelling::Vector,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_version_decides_the_spelling() {
        for (version, spelled) in [
            (Some("3.5.0"), Spelling::Vector),
            (Some("v3.10.2-rc1"), Spelling::Vector),
            (Some("4"), Spelling::Vector),
            (Some("3.4.9"), Spelling::Values),
            (Some("3.0"), Spelling::Values),
            (Some("2"), Spelling::Values),
            (Some("nightly"), Spelling::Vector),
            (None, Spelling::Vector),
        ] {
            assert_eq!(spelling(version), spelled, "{version:?}");
        }
    }

    #[test]
    fn another_program_or_an_old_service_is_refused() {
        let of = |answer: Value| Identity::of(Some(&answer));
        let known = of(json!({ "project_name": "haply-inverse-service", "project_version": "3.5.1" })).unwrap();
        assert_eq!((known.version.as_deref(), known.note), (Some("3.5.1"), None));
        assert!(of(json!({ "project_name": "toaster", "project_version": "3.5.1" })).unwrap_err().contains("toaster"));
        assert!(of(json!({ "project_version": "2.9" })).unwrap_err().contains("update"));
        assert!(of(json!({ "project_version": "4.0" })).unwrap().note.is_some());
        assert_eq!(Identity::of(None), Ok(Identity::default()));
    }
}
