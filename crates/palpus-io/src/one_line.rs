//! Makes one readable line of another library's error message, which may quote the content of a
//! file.

/// Characters that are kept.
const MOST: usize = 240;

/// The words without line feeds and other control characters, and without what goes on for too
/// long.
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
    fn words_are_one_line_of_a_readable_length() {
        assert_eq!(one_line(" invalid type:\nstring \"a\tb\"\n"), "invalid type: string \"a b\"");
        let long = one_line(&"ä".repeat(1000));
        assert!(long.chars().count() == 241 && long.ends_with('…'));
        assert_eq!(one_line(&"ä".repeat(240)), "ä".repeat(240));
    }
}
