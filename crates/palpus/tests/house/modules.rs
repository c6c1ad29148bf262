//! The modules of a crate, what each imports, and in which file a path ends.

use std::collections::BTreeMap;

use super::source::{Token, tokens, without_tests};

/// A path in the source, in the module where it is written.
#[derive(Clone, Debug)]
pub(crate) struct Named {
    pub(crate) segments: Vec<String>,
    pub(crate) line: usize,
    /// Name of the path in its module, if a `use` gives one.
    binding: Option<String>,
    /// A `pub use`: it shows where something is, and needs nothing of it.
    pub(crate) is_shown: bool,
}

/// A module that has a file of its own.
#[derive(Debug)]
pub(crate) struct Module {
    /// Below the source folder.
    pub(crate) file: String,
    pub(crate) named: Vec<Named>,
    /// Names of the modules declared in it.
    children: Vec<String>,
}

/// The modules of a crate by their paths below its root, the root's being empty.
pub(crate) struct Modules(pub(crate) BTreeMap<Vec<String>, Module>);

impl Modules {
    /// Reads all modules below `lib.rs`; `text_of` gives the text of a file by its path below the
    /// source folder, if there is such a file. Without `tests`, what stands behind `#[cfg(test)]`
    /// is left out, with its files.
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
            // Modules that are written in place belong to the file around them.
            if let Some(found) = files.into_iter().find_map(|file| text_of(&file).map(|text| (file, text))) {
                self.add(text_of, below, found, tests);
            }
        }
        self.0.insert(path, Module { file, named: named(&read), children });
    }

    /// The module in whose file the path ends that is written in module `from`; `None` if it leaves
    /// the crate.
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
                        // A module written in place.
                        if !self.0.contains_key(&here) {
                            here.pop();
                            break;
                        }
                        continue;
                    }
                    let bound = module.named.iter().find(|named| named.binding.as_deref() == Some(name));
                    // The path that is being resolved names itself where it is written.
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

/// The modules that the tokens declare.
fn declared(tokens: &[Token]) -> Vec<String> {
    let is_declared = |pair: &&[Token]| pair[0].is("mod") && pair[1].is_word();
    tokens.windows(2).filter(is_declared).map(|pair| pair[1].text.clone()).collect()
}

/// All paths in the tokens: those of `use`, one for each leaf of its tree, and those in the code.
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

/// Reads one tree of a `use` behind `prefix`; answers where it ends.
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
    // `{self}` binds the module's own name.
    if segments.last().is_some_and(|last| last == "self") && segments.len() > 1 {
        segments.pop();
    }
    let binding = segments.last().cloned();
    all.push(Named { segments, line, binding, is_shown });
    at
}
