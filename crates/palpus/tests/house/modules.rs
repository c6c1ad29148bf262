//! Reads the modules of a crate and their imports, and resolves paths to the files that define
//! their targets.

use std::collections::BTreeMap;

use super::source::{Token, tokens, without_tests};

/// A path in the source of a module.
#[derive(Clone, Debug)]
pub(crate) struct Named {
    pub(crate) segments: Vec<String>,
    pub(crate) line: usize,
    /// The name that a `use` binds to the path in the module; `None` for a path in code and for a
    /// glob.
    binding: Option<String>,
    /// True for a `pub use`, which does not count as an import.
    pub(crate) is_shown: bool,
}

/// A module with its own file.
#[derive(Debug)]
pub(crate) struct Module {
    /// Path of the file below the source folder.
    pub(crate) file: String,
    pub(crate) named: Vec<Named>,
    /// Names of the modules that the file declares.
    children: Vec<String>,
}

/// The modules of a crate, by their module path. The path of the root is empty.
pub(crate) struct Modules(pub(crate) BTreeMap<Vec<String>, Module>);

impl Modules {
    /// Reads all modules, starting at `lib.rs`. `text_of` returns the text of a file for its path
    /// below the source folder; `None` if the file does not exist. If `tests` is false, items with
    /// `#[cfg(test)]` and the files of such modules are left out.
    pub(crate) fn read(text_of: &dyn Fn(&str) -> Option<String>, tests: bool) -> Self {
        let mut modules = Self(BTreeMap::new());
        let text = text_of("lib.rs").expect("a crate has a lib.rs");
        modules.add(text_of, Vec::new(), ("lib.rs".to_string(), text), tests);
        modules
    }

    fn add(
        &mut self,
        text_of: &dyn Fn(&str) -> Option<String>,
        path: Vec<String>,
        (file, text): (String, String),
        tests: bool,
    ) {
        let all = tokens(&text);
        let read = if tests { all } else { without_tests(&all) };
        let children = declared(&read);
        for child in &children {
            let below: Vec<String> = path.iter().chain([child]).cloned().collect();
            let stem = below.join("/");
            let files = [format!("{stem}.rs"), format!("{stem}/mod.rs")];
            // An inline module belongs to the file that contains it.
            if let Some(found) = files.into_iter().find_map(|file| text_of(&file).map(|text| (file, text))) {
                self.add(text_of, below, found, tests);
            }
        }
        self.0.insert(path, Module { file, named: named(&read), children });
    }

    /// Returns the module whose file defines the target of the path `segments`, as written in
    /// module `from`. Returns `None` if the target is not in this crate.
    pub(crate) fn home(&self, from: &[String], segments: &[String]) -> Option<&Vec<String>> {
        self.home_within(from, segments, 0)
    }

    fn home_within(&self, from: &[String], segments: &[String], jumps: usize) -> Option<&Vec<String>> {
        let mut here = from.to_vec();
        for (k, segment) in segments.iter().enumerate() {
            match segment.as_str() {
                "crate" => here.clear(),
                "self" => {}
                "super" => {
                    here.pop()?;
                }
                name => {
                    let (_, module) = self.0.get_key_value(&here)?;
                    if module.children.iter().any(|child| child == name) {
                        here.push(name.to_string());
                        // The module is an inline module.
                        if !self.0.contains_key(&here) {
                            here.pop();
                            break;
                        }
                        continue;
                    }
                    let bound = module.named.iter().find(|named| named.binding.as_deref() == Some(name));
                    // A `use` must not be resolved by its own binding.
                    let itself = |named: &&Named| k == 0 && named.segments.as_slice() == segments;
                    match bound.filter(|named| !itself(named) && jumps < 16) {
                        Some(named) => {
                            let onward: Vec<String> =
                                named.segments.iter().chain(&segments[k + 1..]).cloned().collect();
                            return self.home_within(&here, &onward, jumps + 1);
                        }
                        None if k == 0 => return None,
                        None => break,
                    }
                }
            }
        }
        self.0.get_key_value(&here).map(|(path, _)| path)
    }
}

/// Returns the names of the modules that the tokens declare.
fn declared(tokens: &[Token]) -> Vec<String> {
    let is_declared = |pair: &&[Token]| pair[0].is("mod") && pair[1].is_word();
    tokens.windows(2).filter(is_declared).map(|pair| pair[1].text.clone()).collect()
}

/// Returns all paths in the tokens: one for each leaf of the tree of a `use`, and the paths in
/// code.
pub(crate) fn named(tokens: &[Token]) -> Vec<Named> {
    let mut all = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        if tokens[at].is("use") && tokens.get(at + 1).is_some_and(|next| next.is_word() || next.is("::")) {
            let before = at.checked_sub(1).map(|k| &tokens[k]);
            let is_shown = before.is_some_and(|t| t.is("pub") || t.is(")"));
            at = tree(tokens, at + 1, &[], is_shown, &mut all);
        } else if tokens[at].is_word() && tokens.get(at + 1).is_some_and(|next| next.is("::")) {
            let line = tokens[at].line;
            let mut segments = vec![tokens[at].text.clone()];
            while tokens.get(at + 1).is_some_and(|t| t.is("::")) && tokens.get(at + 2).is_some_and(Token::is_word) {
                segments.push(tokens[at + 2].text.clone());
                at += 2;
            }
            all.push(Named { segments, line, binding: None, is_shown: false });
            at += 1;
        } else {
            at += 1;
        }
    }
    all
}

/// Reads one tree of a `use`, whose paths start with `prefix`. Returns the position after the tree.
fn tree(tokens: &[Token], mut at: usize, prefix: &[String], is_shown: bool, all: &mut Vec<Named>) -> usize {
    let mut segments = prefix.to_vec();
    let line = tokens.get(at).map_or(0, |token| token.line);
    while let Some(token) = tokens.get(at) {
        match token.text.as_str() {
            "::" => at += 1,
            "{" => {
                at += 1;
                while tokens.get(at).is_some_and(|token| !token.is("}")) {
                    at = tree(tokens, at, &segments, is_shown, all);
                    at += usize::from(tokens.get(at).is_some_and(|token| token.is(",")));
                }
                return at + 1;
            }
            "*" => {
                all.push(Named { segments, line, binding: None, is_shown });
                return at + 1;
            }
            "as" => {
                let binding = tokens.get(at + 1).map(|token| token.text.clone());
                all.push(Named { segments, line, binding, is_shown });
                return at + 2;
            }
            _ if token.is_word() => {
                segments.push(token.text.clone());
                at += 1;
            }
            _ => break,
        }
    }
    // `{self}` binds the name of the module.
    if segments.last().is_some_and(|last| last == "self") && segments.len() > 1 {
        segments.pop();
    }
    let binding = segments.last().cloned();
    all.push(Named { segments, line, binding, is_shown });
    at
}
