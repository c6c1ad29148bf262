//! Names of units of length.

/// Names and lengths in metres, with the usual spellings first.
const UNITS: [(&str, f64); 17] = [
    ("mm", 1e-3),
    ("cm", 1e-2),
    ("m", 1.0),
    ("inch", 0.0254),
    ("um", 1e-6),
    ("dm", 0.1),
    ("km", 1e3),
    ("ft", 0.3048),
    ("in", 0.0254),
    ("µm", 1e-6),
    ("μm", 1e-6),
    ("micrometre", 1e-6),
    ("millimetre", 1e-3),
    ("centimetre", 1e-2),
    ("metre", 1.0),
    ("meter", 1.0),
    ("foot", 0.3048),
];

/// Number of names that an error lists.
const LISTED: usize = 8;

/// Returns the length of a unit in metres.
///
/// # Errors
/// Fails if the name is unknown; the error lists the usual names.
pub fn metres(name: &str) -> Result<f64, String> {
    match UNITS.iter().find(|(known, _)| *known == name) {
        Some(&(_, metres)) => Ok(metres),
        None => Err(UNITS[..LISTED].iter().map(|(known, _)| format!("\"{known}\"")).collect::<Vec<_>>().join(", ")),
    }
}
