//! Reads keys and values of a TOML text with their locations. Each getter returns the value, `None`
//! if the key is missing, or an error that names the line, the column and the expected type.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::SceneError;

/// The text that locations refer to.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) file: &'a str,
    pub(super) text: &'a str,
}

impl Source<'_> {
    /// Returns an error at a location in the text.
    pub(super) fn error(&self, span: &Range<usize>, problem: impl Into<String>) -> SceneError {
        let before = self.text.get(..span.start).unwrap_or(self.text);
        let line = 1 + before.matches('\n').count();
        let column = 1 + before.rsplit('\n').next().unwrap_or(before).chars().count();
        SceneError { file: self.file.to_owned(), line, column, problem: problem.into() }
    }
}

/// A table of the file, all of whose keys are valid.
#[derive(Clone)]
pub(super) struct Section<'a> {
    source: Source<'a>,
    /// The title with brackets, as written; empty for the top-level table.
    title: String,
    table: Option<&'a DeTable<'a>>,
    span: Range<usize>,
}

impl<'a> Section<'a> {
    /// Returns the top-level table, whose keys must be among `keys`.
    pub(super) fn top(source: Source<'a>, root: &'a Spanned<DeTable<'a>>, keys: &[&str]) -> Result<Self, SceneError> {
        let section = Self { source, title: String::new(), table: Some(root.get_ref()), span: 0..0 };
        section.refuse_others(keys)?;
        Ok(section)
    }

    /// Returns the table under a key; an empty table if the key is missing.
    pub(super) fn section(&self, key: &str, keys: &[&str]) -> Result<Section<'a>, SceneError> {
        let title = if self.title.is_empty() { format!("[{key}]") } else { format!("{}, {key}", self.title) };
        let (table, span) = match self.find(key) {
            None => (None, 0..0),
            Some(value) => match value.get_ref() {
                DeValue::Table(table) => (Some(table), value.span()),
                other => return Err(self.wrong(key, value.span(), "a table", other)),
            },
        };
        let section = Section { source: self.source, title, table, span };
        section.refuse_others(keys)?;
        Ok(section)
    }

    /// Returns the tables of the list under a key, in their order.
    pub(super) fn sections(&self, key: &str, keys: &[&str]) -> Result<Vec<Section<'a>>, SceneError> {
        let Some(value) = self.find(key) else { return Ok(Vec::new()) };
        let DeValue::Array(tables) = value.get_ref() else {
            return Err(self.wrong(
                key,
                value.span(),
                &format!("a list of tables, each starting with [[{key}]]"),
                value.get_ref(),
            ));
        };
        let section = |table: &'a Spanned<DeValue<'a>>| match table.get_ref() {
            DeValue::Table(entries) => {
                let title = format!("[[{key}]]");
                let section = Section { source: self.source, title, table: Some(entries), span: table.span() };
                section.refuse_others(keys)?;
                Ok(section)
            }
            other => {
                Err(self.wrong(key, table.span(), &format!("a list of tables, each starting with [[{key}]]"), other))
            }
        };
        tables.iter().map(section).collect()
    }

    /// Returns true if the table has one of `keys`.
    pub(super) fn has(&self, keys: &[&str]) -> bool {
        keys.iter().any(|key| self.find(key).is_some())
    }

    /// Returns true if the table under `key` has one of `keys`.
    pub(super) fn says(&self, key: &str, keys: &[&str]) -> bool {
        let Some(DeValue::Table(table)) = self.find(key).map(Spanned::get_ref) else { return false };
        table.keys().any(|name| keys.contains(&name.get_ref().as_ref()))
    }

    /// Returns the location of the value under `key`; `None` if the key is missing.
    pub(super) fn place(&self, key: &str) -> Option<Range<usize>> {
        self.find(key).map(Spanned::span)
    }

    /// Returns the title of the table as written: `[probe]`, `[[tool]]`.
    pub(super) fn title(&self) -> &str {
        &self.title
    }

    /// Returns true if the file contains this table.
    pub(super) fn exists(&self) -> bool {
        self.table.is_some()
    }

    /// Returns an error about the whole table.
    pub(super) fn error(&self, problem: impl Into<String>) -> SceneError {
        self.source.error(&self.span, problem)
    }

    /// Returns an error at a location in the file.
    pub(super) fn error_at(&self, span: &Range<usize>, problem: impl Into<String>) -> SceneError {
        self.source.error(span, problem)
    }

    fn find(&self, key: &str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.table?.iter().find(|(name, _)| name.get_ref() == key).map(|(_, value)| value)
    }

    /// Fails if a key is not one of `keys`.
    fn refuse_others(&self, keys: &[&str]) -> Result<(), SceneError> {
        let Some(table) = self.table else { return Ok(()) };
        // Reports the first unknown key in the file, not the alphabetically first unknown key.
        let unknown =
            table.keys().filter(|key| !keys.contains(&key.get_ref().as_ref())).min_by_key(|key| key.span().start);
        let Some(key) = unknown else { return Ok(()) };
        let name: String = key.get_ref().chars().take(40).collect();
        let nearest = nearest_name(&name, keys).unwrap_or_default();
        let here = if self.title.is_empty() { "a scene file" } else { self.title.as_str() };
        let problem =
            format!("{here} has no key {name:?}; did you mean {nearest:?}? (valid keys: {})", keys.join(", "));
        Err(self.source.error(&key.span(), problem))
    }

    fn wrong(&self, key: &str, span: Range<usize>, expected: &str, found: &DeValue<'_>) -> SceneError {
        self.source.error(&span, format!("{key} must be {expected} but has type {}", found.type_str()))
    }

    /// Returns a finite number for which `holds` returns true; `rule` describes the condition in
    /// error messages.
    pub(super) fn number(&self, key: &str, rule: &str, holds: impl Fn(f64) -> bool) -> Result<Option<f64>, SceneError> {
        let Some(value) = self.find(key) else { return Ok(None) };
        match number_of(value.get_ref()) {
            Some(number) if number.is_finite() && holds(number) => Ok(Some(number)),
            Some(number) => Err(self.source.error(&value.span(), format!("{key} is {number:?} but must be {rule}"))),
            None => Err(self.wrong(key, value.span(), "a number", value.get_ref())),
        }
    }

    /// Returns a boolean.
    pub(super) fn boolean(&self, key: &str) -> Result<Option<bool>, SceneError> {
        let Some(value) = self.find(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::Boolean(boolean) => Ok(Some(*boolean)),
            other => Err(self.wrong(key, value.span(), "true or false", other)),
        }
    }

    /// Returns true if the key is present and its value is `false`.
    pub(super) fn is_false(&self, key: &str) -> bool {
        matches!(self.find(key).map(Spanned::get_ref), Some(DeValue::Boolean(false)))
    }

    /// Returns true if the key is present and its value is text.
    pub(super) fn is_text(&self, key: &str) -> bool {
        matches!(self.find(key).map(Spanned::get_ref), Some(DeValue::String(_)))
    }

    /// Returns text and its location.
    pub(super) fn text(&self, key: &str) -> Result<Option<(&'a str, Range<usize>)>, SceneError> {
        let Some(value) = self.find(key) else { return Ok(None) };
        match value.get_ref() {
            DeValue::String(text) => Ok(Some((text.as_ref(), value.span()))),
            other => Err(self.wrong(key, value.span(), "a text in quotes", other)),
        }
    }

    /// Returns the value for one of the names in `choices`.
    pub(super) fn choice<T: Copy>(&self, key: &str, choices: &[(&str, T)]) -> Result<Option<T>, SceneError> {
        let Some((text, span)) = self.text(key)? else { return Ok(None) };
        if let Some(&(_, choice)) = choices.iter().find(|(name, _)| *name == text) {
            return Ok(Some(choice));
        }
        let names: Vec<String> = choices.iter().map(|(name, _)| format!("\"{name}\"")).collect();
        Err(self.source.error(&span, format!("{key} is {text:?} but must be {}", names.join(" or "))))
    }

    /// Returns `N` finite numbers.
    pub(super) fn vector<const N: usize>(&self, key: &str) -> Result<Option<Spanned<[f64; N]>>, SceneError> {
        let Some(value) = self.find(key) else { return Ok(None) };
        let numbers: Option<Vec<f64>> = match value.get_ref() {
            DeValue::Array(array) => {
                array.iter().map(|item| number_of(item.get_ref()).filter(|x| x.is_finite())).collect()
            }
            _ => None,
        };
        match numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok()) {
            Some(vector) => Ok(Some(Spanned::new(value.span(), vector))),
            None => Err(self.source.error(&value.span(), format!("{key} must be a list of {N} finite numbers"))),
        }
    }
}

/// Returns a number, which may be written as an integer.
fn number_of(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|n| n as f64),
        _ => None,
    }
}

/// Returns the name of `known` that `name` probably misspells; `None` if all names are too
/// different.
pub fn similar_name<'k>(name: &str, known: &[&'k str]) -> Option<&'k str> {
    let most = 1 + name.chars().count() / 3;
    nearest_name(name, known).filter(|nearest| edits(name, nearest) <= most)
}

/// Returns the name of `known` with the fewest edits to `name`; `None` if `known` is empty.
fn nearest_name<'k>(name: &str, known: &[&'k str]) -> Option<&'k str> {
    known.iter().min_by_key(|known| edits(name, known)).copied()
}

/// Returns the number of letters to insert, delete or replace to turn one word into the other
/// (Levenshtein distance).
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, other) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(letter != *other);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::{edits, similar_name};

    #[test]
    fn only_misspellings_are_similar() {
        let known = ["spoon-cup", "stack", "peg-hole"];
        for (name, expected) in
            [("spon-cup", Some("spoon-cup")), ("stak", Some("stack")), ("no-such", None), ("", None)]
        {
            assert_eq!(similar_name(name, &known), expected, "{name}");
        }
    }

    #[test]
    fn edit_distance_counts_changed_letters() {
        for (a, b, expected) in
            [("", "", 0), ("abc", "abc", 0), ("", "abc", 3), ("tolerence", "tolerance", 1), ("kitten", "sitting", 3)]
        {
            assert_eq!(edits(a, b), expected);
            assert_eq!(edits(b, a), expected);
        }
    }
}
