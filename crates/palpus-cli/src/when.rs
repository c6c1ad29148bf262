//! The wall clock, with the calendar functions that it needs.

use std::time::{SystemTime, UNIX_EPOCH};

/// Returns the time since 1970-01-01 UTC, ns; 0 for earlier times. The function only reads a clock.
pub(crate) fn utc_ns() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as u64)
}

/// Formats the present time, such as `2026-11-21 10:30 UTC`.
pub(crate) fn now() -> String {
    said(utc_ns() / SECOND)
}

/// Formats this many nanoseconds after 1970-01-01 UTC in the format of RFC 3339:
/// `2026-11-21T10:30:00.123456Z`.
pub(crate) fn rfc_3339(utc_ns: u64) -> String {
    let seconds = utc_ns / SECOND;
    let (year, month, day) = date(seconds / 86_400);
    let (hours, minutes) = (seconds / 3600 % 24, seconds / 60 % 60);
    let micros = utc_ns % SECOND / 1000;
    format!("{year}-{month:02}-{day:02}T{hours:02}:{minutes:02}:{:02}.{micros:06}Z", seconds % 60)
}

const SECOND: u64 = 1_000_000_000;

fn said(seconds: u64) -> String {
    let (year, month, day) = date(seconds / 86_400);
    let minutes = seconds / 60;
    format!("{year}-{month:02}-{day:02} {:02}:{:02} UTC", minutes / 60 % 24, minutes % 60)
}

/// Returns the Gregorian date this many days after 1970-01-01. Years begin in March, so that the
/// leap day is the last day of a year.
fn date(days: u64) -> (u64, u64, u64) {
    let days = days + DAYS_TO_1970;
    let era = days / DAYS_OF_400_YEARS;
    let of_era = days % DAYS_OF_400_YEARS;
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let from_march = (5 * of_year + 2) / 153;
    let day = of_year - (153 * from_march + 2) / 5 + 1;
    let month = if from_march < 10 { from_march + 3 } else { from_march - 9 };
    (era * 400 + year_of_era + u64::from(month <= 2), month, day)
}

/// Number of days from 1 March of the year 0 to 1 January 1970.
const DAYS_TO_1970: u64 = 719_468;
/// Number of days in 400 years.
const DAYS_OF_400_YEARS: u64 = 146_097;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_correct() {
        for (seconds, text) in [
            (0, "1970-01-01 00:00 UTC"),
            (951_782_400, "2000-02-29 00:00 UTC"),
            (1_709_251_199, "2024-02-29 23:59 UTC"),
            (4_102_444_800, "2100-01-01 00:00 UTC"),
        ] {
            assert_eq!(said(seconds), text);
        }
        assert!(now().ends_with(" UTC"));
    }

    #[test]
    fn times_are_written_to_the_microsecond() {
        assert_eq!(rfc_3339(0), "1970-01-01T00:00:00.000000Z");
        assert_eq!(rfc_3339(1_709_251_199_000_001_999), "2024-02-29T23:59:59.000001Z");
    }
}
