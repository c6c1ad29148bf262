//! Tests that the tests named in `docs/safety.md` exist.

use std::fs;
use std::path::Path;

/// Returns the texts between backquotes.
fn quoted(line: &str) -> impl Iterator<Item = &str> {
    line.split('`').skip(1).step_by(2)
}

#[test]
fn every_test_named_on_the_page_exists() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = fs::read_to_string(crates.join("../docs/safety.md")).expect("docs/safety.md can be read");
    let (mut found, mut missing) = (0, Vec::new());
    for line in page.lines().filter(|line| line.starts_with("| **")) {
        let held = line.rsplit('|').nth(1).expect("the row has a last column");
        let mut file = ("", String::new());
        for text in quoted(held) {
            if text.ends_with(".rs") {
                file = (text, fs::read_to_string(crates.join(text)).unwrap_or_default());
            } else if file.1.contains(&format!("fn {text}()")) {
                found += 1;
            } else {
                missing.push(format!("{}: {text}", file.0));
            }
        }
        assert!(!file.0.is_empty(), "this row names no test: {line}");
    }
    assert!(missing.is_empty(), "docs/safety.md names tests that do not exist:\n{}", missing.join("\n"));
    assert!(found > 50, "only {found} tests were found; check the format of the table");
}
