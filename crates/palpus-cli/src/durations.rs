//! Parses and formats durations.

use std::str::FromStr;
use std::time::Duration;

use crate::numbers::said;

/// A duration as the user types it: `90s`, `10m`, `1h`, `1h30m`, or seconds without a letter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Span(pub(crate) Duration);

/// Longest duration of a run, s. Longer runs would need another kind of report.
const LONGEST: f64 = 30.0 * 86_400.0;

impl FromStr for Span {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let problem = || format!("`{text}` is not a duration; write 90s, 10m, 1h or 1h30m");
        let mut seconds = 0.0;
        let mut number = String::new();
        for letter in text.chars() {
            let unit = match letter {
                'd' => 86_400.0,
                'h' => 3600.0,
                'm' => 60.0,
                's' => 1.0,
                _ => {
                    number.push(letter);
                    continue;
                }
            };
            seconds += unit * number.parse::<f64>().map_err(|_| problem())?;
            number.clear();
        }
        if !number.is_empty() {
            // A number alone, without a letter, is in seconds.
            let alone = number.len() == text.len();
            seconds += number.parse::<f64>().ok().filter(|_| alone).ok_or_else(problem)?;
        }
        if text.is_empty() || !(0.0..=LONGEST).contains(&seconds) {
            return Err(if seconds > LONGEST { "the longest run is 30d".to_owned() } else { problem() });
        }
        Ok(Self(Duration::from_secs_f64(seconds)))
    }
}

/// Reads a duration as [`Span`] does; returns seconds.
pub(crate) fn seconds(text: &str) -> Result<f64, String> {
    text.parse::<Span>().map(|span| span.0.as_secs_f64())
}

/// Formats the duration of a run, which may be hours: `45 s`, `12 min 30 s`, `1 h`.
pub(crate) fn spoken(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    if seconds < 10.0 {
        return format!("{seconds:.1} s");
    }
    let parts = [(whole / 3600, "h"), (whole / 60 % 60, "min"), (whole % 60, "s")];
    let said: Vec<String> =
        parts.iter().filter(|(count, _)| *count > 0).map(|(count, unit)| format!("{count} {unit}")).collect();
    said.join(" ")
}

/// Formats the duration of work: two significant digits below a hundred seconds, minutes and
/// seconds above.
pub(crate) fn duration(seconds: f64) -> String {
    if seconds < 100.0 {
        return format!("{} s", said(seconds, 2));
    }
    format!("{:.0} min {:.0} s", (seconds / 60.0).floor(), seconds % 60.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_parsed_and_printed() {
        let read = |text: &str| text.parse::<Span>().ok().map(|span| span.0.as_secs_f64());
        for (text, seconds) in [
            ("90s", 90.0),
            ("10m", 600.0),
            ("1h", 3600.0),
            ("1h30m", 5400.0),
            ("2.5", 2.5),
            ("1d", 86_400.0),
            ("0", 0.0),
        ] {
            assert_eq!(read(text), Some(seconds), "{text}");
        }
        for text in ["", "h", "1x", "1h30", "-1", "-1s", "NaN", "infs", "1e9h", "1m2", "31d", "𝟏s"] {
            assert_eq!(read(text), None, "{text}");
        }
        assert_eq!([spoken(3600.0), spoken(750.0), spoken(2.5), spoken(45.0)], ["1 h", "12 min 30 s", "2.5 s", "45 s"]);
        assert_eq!(duration(125.0), "2 min 5 s");
        assert_eq!([seconds("0.3"), seconds("1m30s")], [Ok(0.3), Ok(90.0)]);
    }
}
