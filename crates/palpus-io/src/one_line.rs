//! Converts another library's error message, which may quote the content of a file, to one readable
//! line.

/// Largest number of characters that are kept.
const MOST: usize = 240;

/// Returns the text with control characters replaced by blanks, truncated to [`MOST`] characters.
pub(crate) fn one_line(words: &str) -> String {
    let clean = |c: char| if c.is_control() { ' ' } else { c };
    let mut line: String = words.trim().chars().map(clean).take(MOST).collect();
    if words.trim().chars().nth(MOST).is_some() {
        line.push('…');
    }
    line
}

#[cfg(test)]
mod tests {
    use super::one_line;

    #[test]
    fn message_becomes_one_short_line() {
        assert_eq!(one_line(" invalid type:\nstring \"a\tb\"\n"), "invalid type: string \"a b\"");
        let long = one_line(&"ä".repeat(1000));
        assert!(long.chars().count() == 241 && long.ends_with('…'));
        assert_eq!(one_line(&"ä".repeat(240)), "ä".repeat(240));
    }
}
