//! docs/scene-file.md lists exactly the keys that the parser accepts.

use std::path::Path;

use palpus_io::FilePolicy;
use palpus_io::scene::parse_scene;

const PAGE: &str = include_str!("../../../docs/scene-file.md");

/// The headings of the page and, for each heading, a scene with an unknown key in that table.
const TABLES: [(&str, &str); 12] = [
    ("## Top of the file", "x = 1\n"),
    ("## `[probe]`", "[probe]\nmesh = \"a\"\nx = 1\n"),
    ("## `[environment]`", "[probe]\nmesh = \"a\"\n[environment]\nx = 1\n"),
    ("## `[contact]`", "[contact]\nx = 1\n"),
    ("### `friction`", "[contact]\nfriction = { x = 1 }\n"),
    ("### `material`", "[contact]\nmaterial = { x = 1 }\n"),
    ("## `[coupling]`", "[coupling]\nx = 1\n"),
    ("## `[device]`", "[device]\nx = 1\n"),
    ("## `[hand]`", "[hand]\nx = 1\n"),
    ("## `[[object]]`", "[[object]]\nmesh = \"a\"\nx = 1\n"),
    ("### `[[tool]]`", "[[tool]]\nmesh = \"a\"\nx = 1\n"),
    ("### `[second]`", "[probe]\nmesh = \"a\"\n[second]\nmesh = \"a\"\nx = 1\n"),
];

fn parse(text: &str) -> Result<(), String> {
    parse_scene(text, Path::new("scene.toml"), FilePolicy::Inside).map(|_| ()).map_err(|error| error.to_string())
}

/// Returns the keys that the parser's error lists for a table.
fn accepted(scene: &str) -> Vec<String> {
    let bodies = [("[probe]", "probe"), ("[environment]", "environment")];
    let missing = |(table, _): &&(&str, &str)| !scene.contains(*table) && !scene.contains("[[tool]]");
    let others: String = bodies.iter().filter(missing).map(|(table, _)| format!("{table}\nmesh = \"a\"\n")).collect();
    let rest = if scene.contains("[[tool]]") { "[environment]\nmesh = \"a\"\n".to_owned() } else { others };
    let (top, tables) = if scene.starts_with('x') { (scene, "") } else { ("", scene) };
    let error = parse(&format!("unit = \"mm\"\n{top}{rest}{tables}")).unwrap_err();
    let (_, list) = error.split_once("(valid keys: ").unwrap_or_else(|| panic!("{error}"));
    sorted(list.trim_end_matches(')').split(", "))
}

fn sorted<'a>(keys: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut keys: Vec<String> = keys.map(str::to_owned).collect();
    keys.sort();
    keys
}

/// Returns the first column of the table under a heading of the page.
fn documented(heading: &str) -> Vec<String> {
    let after = PAGE.lines().skip_while(|line| *line != heading).skip(1);
    let rows = after.skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|')).skip(2);
    sorted(rows.filter_map(|row| row.split('`').nth(1)))
}

#[test]
fn page_lists_the_accepted_keys() {
    for (heading, scene) in TABLES {
        assert_eq!(documented(heading), accepted(scene), "{heading}");
    }
}

#[test]
fn examples_of_the_page_are_valid_scenes() {
    let examples: Vec<&str> = PAGE.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(examples.len() >= 3);
    for example in examples {
        let bodies = if example.contains("environment") { "" } else { "unit = \"mm\"\n[environment]\nmesh = \"a\"\n" };
        parse(&format!("{bodies}{example}")).unwrap();
    }
}
