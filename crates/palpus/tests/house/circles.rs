//! Finds import cycles: sets of files that import each other, directly or through other files.

use std::collections::{BTreeMap, BTreeSet};

/// For each file, the files that it imports.
pub(crate) type Needs = BTreeMap<String, BTreeSet<String>>;

/// Returns the cycles: maximal sets of files in which each file reaches every other file through
/// imports.
pub(crate) fn circles(needs: &Needs) -> Vec<BTreeSet<String>> {
    let reached: BTreeMap<&String, BTreeSet<&String>> = needs.keys().map(|file| (file, reach(needs, file))).collect();
    let mut found: Vec<BTreeSet<String>> = Vec::new();
    for file in needs.keys().filter(|file| reached[file].contains(file)) {
        let circle: BTreeSet<String> = reached[file]
            .iter()
            .filter(|other| reached.get(*other).is_some_and(|back| back.contains(file)))
            .map(|other| (*other).clone())
            .collect();
        if !found.contains(&circle) {
            found.push(circle);
        }
    }
    found
}

/// Returns all files that `file` imports, directly or through other files.
fn reach<'n>(needs: &'n Needs, file: &String) -> BTreeSet<&'n String> {
    let mut reached = BTreeSet::new();
    let mut ahead: Vec<&String> = needs.get(file).into_iter().flatten().collect();
    while let Some(next) = ahead.pop() {
        if reached.insert(next) {
            ahead.extend(needs.get(next).into_iter().flatten());
        }
    }
    reached
}
