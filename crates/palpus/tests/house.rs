//! Tests the rules of ARCHITECTURE.md about imports.
//!
//! 1. A top-level module of the engine imports only top-level modules that come before it in the
//!    alphabet.
//! 2. Imports between the members of a folder form no cycles. A file and the folder of its name
//!    count as one member. Tests are ignored.
//! 3. A crate imports another crate only if the drawing in ARCHITECTURE.md has an arrow between the
//!    two.
//!
//! Every path in a file counts as an import, in `use` and in code. A `pub use` does not count as an
//! import. A path through a `pub use` counts as an import of the file that defines the item.

mod house {
    pub(crate) mod circles;
    pub(crate) mod crates;
    pub(crate) mod modules;
    pub(crate) mod source;
}

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use house::circles::{Needs, circles};
use house::crates::arrows;
use house::modules::Modules;

/// The top-level modules of the engine, in their required order.
const ROOMS: [&str; 7] = ["algebra", "body", "collision", "depth", "detect", "force", "render"];

/// The known cycles, as folder and members. Do not add a cycle to this list.
const ALLOWED_CIRCLES: [&str; 0] = [];

/// The targets of a crate's arrows: first the crates that its product code imports, then the
/// additional crates that its tests and benches import.
type Drawn = [&'static [&'static str]; 2];
const ARROWS: [(&str, Drawn); 11] = [
    ("palpus", [&[], &["palpus-alloc"]]),
    ("palpus-alloc", [&[], &[]]),
    ("palpus-baselines", [&["palpus"], &["palpus-scenes"]]),
    ("palpus-capi", [&["palpus", "palpus-io"], &["palpus-alloc"]]),
    (
        "palpus-cli",
        [
            &[
                "palpus",
                "palpus-alloc",
                "palpus-baselines",
                "palpus-device",
                "palpus-drivers",
                "palpus-io",
                "palpus-scenes",
                "palpus-window",
            ],
            &[],
        ],
    ),
    ("palpus-device", [&["palpus", "palpus-alloc"], &["palpus-scenes"]]),
    ("palpus-drivers", [&["palpus", "palpus-device"], &["palpus-alloc"]]),
    ("palpus-io", [&["palpus"], &[]]),
    ("palpus-python", [&["palpus", "palpus-alloc", "palpus-cli", "palpus-device", "palpus-io"], &[]]),
    ("palpus-scenes", [&["palpus"], &["palpus-alloc", "palpus-io"]]),
    ("palpus-window", [&["palpus", "palpus-device", "palpus-io"], &[]]),
];

/// Returns a message for each import of crate `name` without an arrow. Tests may import all
/// crates that the product code imports.
fn not_drawn(name: &str, needed: &[Vec<String>; 2], drawn: &Drawn) -> Vec<String> {
    let [product, tests] = drawn;
    let is_missing = |known: &[&str], to: &str| !known.contains(&to);
    let bare = needed[0].iter().filter(|to| is_missing(product, to)).map(|to| format!("{name} imports {to}"));
    let tested = needed[1].iter().filter(|to| is_missing(product, to) && is_missing(tests, to));
    bare.chain(tested.map(|to| format!("the tests of {name} import {to}"))).collect()
}

/// Reads the modules of the engine, with or without tests.
fn engine(tests: bool) -> Modules {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    Modules::read(&|file| fs::read_to_string(source.join(file)).ok(), tests)
}

/// Returns a message for each import of a top-level module that is not before the importing module
/// in the order.
fn against_the_order(modules: &Modules, rooms: &[&str]) -> Vec<String> {
    let mut broken = Vec::new();
    for (path, module) in &modules.0 {
        let Some(room) = path.first() else { continue };
        for named in &module.named {
            let Some(target) = modules.home(path, &named.segments).and_then(|home| home.first()) else { continue };
            if rooms.contains(&target.as_str()) && target > room {
                broken.push(format!("{}:{} imports {target}", module.file, named.line));
            }
        }
    }
    broken
}

/// Returns for each member of a folder the members that it imports. A file and the folder of its
/// name are one member.
fn needs(modules: &Modules, folder: &[String]) -> Needs {
    let mut needs = Needs::new();
    let member = |path: &[String]| path.starts_with(folder).then(|| path.get(folder.len()).cloned()).flatten();
    for (path, module) in &modules.0 {
        let Some(from) = member(path) else { continue };
        let needed = needs.entry(from.clone()).or_default();
        for named in module.named.iter().filter(|named| !named.is_shown) {
            let to = modules.home(path, &named.segments).and_then(|home| member(home));
            needed.extend(to.filter(|to| *to != from));
        }
    }
    needs
}

/// Returns all cycles in the folders of the engine, each as a folder and its sorted members.
fn circles_of_rooms(modules: &Modules) -> BTreeSet<String> {
    let folders = modules.0.keys().filter(|path| !path.is_empty());
    folders
        .flat_map(|folder| {
            let circle =
                |circle: BTreeSet<String>| format!("{}: {}", folder.join("/"), Vec::from_iter(circle).join(" "));
            circles(&needs(modules, folder)).into_iter().map(circle).collect::<Vec<_>>()
        })
        .collect()
}

#[test]
fn rooms_import_only_earlier_rooms() {
    let modules = engine(true);
    let rooms: BTreeSet<&str> = modules.0.keys().filter_map(|path| path.first()).map(String::as_str).collect();
    assert_eq!(Vec::from_iter(rooms), ROOMS);
    let broken = against_the_order(&modules, &ROOMS);
    assert!(broken.is_empty(), "imports that break the order of the rooms:\n{}", broken.join("\n"));
}

#[test]
fn imports_within_a_folder_form_no_cycles() {
    let found = circles_of_rooms(&engine(false));
    let allowed: BTreeSet<String> = ALLOWED_CIRCLES.iter().map(|circle| circle.to_string()).collect();
    let new: Vec<&String> = found.difference(&allowed).collect();
    assert!(new.is_empty(), "import cycles: {new:#?}; move the code that both files need into another file");
    let gone: Vec<&String> = allowed.difference(&found).collect();
    assert!(gone.is_empty(), "these cycles no longer exist, so remove them from ALLOWED_CIRCLES: {gone:#?}");
}

#[test]
fn crates_import_only_along_the_drawn_arrows() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let found = arrows(&crates);
    let mut wrong = Vec::new();
    for (name, needed) in &found {
        let Some((_, drawn)) = ARROWS.iter().find(|(drawn, _)| drawn == name) else {
            wrong.push(format!("{name} is not in the drawing"));
            continue;
        };
        wrong.extend(not_drawn(name, needed, drawn));
    }
    assert!(wrong.is_empty(), "imports without an arrow in the drawing in ARCHITECTURE.md:\n{}", wrong.join("\n"));
    assert_eq!(found.len(), ARROWS.len(), "the drawing has a crate that does not exist");
}

/// Returns the modules of an example crate with the top-level modules `body` and `depth`. The
/// arguments are the texts of `body/first.rs`, `body/second.rs` and `body/second/inner.rs`.
fn example(first: &str, second: &str, inner: &str) -> Modules {
    let text_of = |file: &str| {
        let text = match file {
            "lib.rs" => "pub mod body; pub mod depth;",
            "body/mod.rs" => "mod first; mod second; pub use first::First; pub use second::*;",
            "depth/mod.rs" => "pub struct Depth;",
            "body/first.rs" => first,
            "body/second.rs" => second,
            "body/second/inner.rs" => inner,
            _ => return None,
        };
        Some(text.to_string())
    };
    Modules::read(&text_of, false)
}

#[test]
fn every_form_of_import_is_found() {
    let broken = |first: &str| against_the_order(&example(first, "mod inner;", ""), &ROOMS);
    for import in [
        "use crate::depth::Depth;",
        "use crate::{\n    body::second,\n    depth::{self, Depth as Deep},\n};",
        "pub(crate) use crate::depth::*;",
        "use super::super::depth::Depth;",
        "fn deep() -> crate::depth::Depth { todo!() }",
        "/* a \" in a comment */ const QUOTE: char = '\"'; use crate::depth::Depth;",
    ] {
        assert!(!broken(import).is_empty(), "{import}");
    }
    for sound in [
        "use super::second;",
        "// use crate::depth::Depth;",
        "const TEXT: &str = \"crate::depth::Depth\"; fn life<'a>(x: &'a str) -> &'a str { x }",
        "#[cfg(test)]\nmod tests { use crate::depth::Depth; }",
    ] {
        assert_eq!(broken(sound), Vec::<String>::new(), "{sound}");
    }
    assert_eq!(broken("\nuse crate::depth;"), ["body/first.rs:2 imports depth"]);
}

#[test]
fn cycles_through_re_exports_are_found() {
    let found =
        |first: &str, second: &str, inner: &str| Vec::from_iter(circles_of_rooms(&example(first, second, inner)));
    let to_first = "mod inner; use super::First; pub struct Second(First);";
    assert_eq!(found("use super::second::Second; pub struct First;", to_first, ""), ["body: first second"]);
    assert_eq!(found("use crate::body::{self, second}; pub struct First;", to_first, ""), ["body: first second"]);
    let by_inner = ("use super::second::Second; pub struct First;", "mod inner; pub struct Second;");
    assert_eq!(found(by_inner.0, by_inner.1, "fn f(_: crate::body::First) {}"), ["body: first second"]);
    // These are not cycles: an import in one direction, an import in tests, and imports between a
    // file and the folder of its name.
    assert_eq!(found("pub struct First;", to_first, ""), Vec::<String>::new());
    let in_tests = "pub struct First; #[cfg(test)] mod tests { use super::super::second::Second; }";
    assert_eq!(found(in_tests, to_first, ""), Vec::<String>::new());
    let own_folder = "mod inner; pub use inner::Part; pub struct Second(inner::Part);";
    assert_eq!(found("pub struct First;", own_folder, "use super::Second; pub struct Part;"), Vec::<String>::new());
}

#[test]
fn missing_arrows_are_found() {
    let manifest = "[package]\nname = \"palpus-io\"\n[dependencies]\npalpus.workspace = true\nglam = \"1\"\n\
        [dependencies.palpus-cli]\npath = \"..\"\n[dev-dependencies]\npalpus-window = { workspace = true }\n";
    let (name, needed) = house::crates::read(manifest);
    assert_eq!(name, "palpus-io");
    let drawn = [&["palpus"][..], &[]];
    let wrong = not_drawn(&name, &needed, &drawn);
    assert_eq!(wrong, ["palpus-io imports palpus-cli", "the tests of palpus-io import palpus-window"]);
}
