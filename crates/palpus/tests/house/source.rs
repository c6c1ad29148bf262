//! Splits Rust source into tokens, without comments and the contents of strings, and can leave out
//! test code.

/// A word, the `::` of a path, or any other character, with its line number.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Token {
    pub(crate) text: String,
    pub(crate) line: usize,
}

impl Token {
    pub(crate) fn is(&self, text: &str) -> bool {
        self.text == text
    }

    pub(crate) fn is_word(&self) -> bool {
        self.text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
    }
}

/// Returns the tokens of a file.
pub(crate) fn tokens(text: &str) -> Vec<Token> {
    let bare = without_comments(text);
    let mut tokens = Vec::new();
    let mut line = 1;
    let mut rest = bare.as_str();
    while let Some(first) = rest.chars().next() {
        let word = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
        let length = match first {
            _ if word > 0 => word,
            ':' if rest.starts_with("::") => 2,
            _ => first.len_utf8(),
        };
        if !first.is_whitespace() {
            tokens.push(Token { text: rest[..length].to_string(), line });
        }
        line += usize::from(first == '\n');
        rest = &rest[length..];
    }
    tokens
}

/// Returns the tokens without the items that have the attribute `#[cfg(test)]`.
pub(crate) fn without_tests(tokens: &[Token]) -> Vec<Token> {
    const ATTRIBUTE: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    let mut kept = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let is_test = tokens[at..].len() > ATTRIBUTE.len() && ATTRIBUTE.iter().zip(&tokens[at..]).all(|(a, t)| t.is(a));
        if !is_test {
            kept.push(tokens[at].clone());
            at += 1;
            continue;
        }
        at = item_end(tokens, at + ATTRIBUTE.len());
    }
    kept
}

/// Returns the position after the item that begins at `at`. An item ends with a semicolon or a
/// closing brace.
fn item_end(tokens: &[Token], at: usize) -> usize {
    let mut open = 0;
    let is_use = tokens[at..].iter().take(6).take_while(|t| !t.is("{") && !t.is(";")).any(|t| t.is("use"));
    for (k, token) in tokens.iter().enumerate().skip(at) {
        match token.text.as_str() {
            "{" | "(" | "[" => open += 1,
            ")" | "]" => open -= 1,
            "}" => {
                open -= 1;
                if open == 0 && !is_use {
                    return k + 1;
                }
            }
            ";" if open == 0 => return k + 1,
            _ => {}
        }
    }
    tokens.len()
}

/// Returns the text with comments and literals replaced by spaces. Line breaks are kept.
fn without_comments(text: &str) -> String {
    let mut bare = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = skipped(rest, bare.chars().last());
        if length == 0 {
            bare.push(first);
            rest = &rest[first.len_utf8()..];
            continue;
        }
        bare.extend(rest[..length].chars().map(|c| if c == '\n' { '\n' } else { ' ' }));
        rest = &rest[length..];
    }
    bare
}

/// Returns the length of the comment or literal at the beginning of `text`; 0 if it begins with
/// neither. `before` is the character before the text.
fn skipped(text: &str, before: Option<char>) -> usize {
    let in_word = before.is_some_and(|c| c.is_ascii_alphanumeric() || c == '_');
    if text.starts_with("//") {
        return text.find('\n').unwrap_or(text.len());
    }
    if text.starts_with("/*") {
        return text.find("*/").map_or(text.len(), |end| end + 2);
    }
    if text.starts_with('"') {
        return quoted(text);
    }
    let hashes = text.bytes().skip(1).take_while(|&b| b == b'#').count();
    if text.starts_with('r') && !in_word && text[1 + hashes..].starts_with('"') {
        let close = format!("\"{}", "#".repeat(hashes));
        let begin = 2 + hashes;
        return text[begin..].find(&close).map_or(text.len(), |end| begin + end + close.len());
    }
    // A character literal has a quote after its letter, and a lifetime does not.
    let mut letters = text.chars();
    match (letters.next(), letters.next(), letters.next()) {
        (Some('\''), Some('\\'), _) => text[2..].char_indices().skip(1).find(|c| c.1 == '\'').map_or(0, |c| c.0 + 3),
        (Some('\''), Some(letter), Some('\'')) => 2 + letter.len_utf8(),
        _ => 0,
    }
}

/// Returns the length of the string literal at the beginning of `text`.
fn quoted(text: &str) -> usize {
    let mut escaped = false;
    for (k, c) in text.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return k + 1,
            _ => {}
        }
    }
    text.len()
}
