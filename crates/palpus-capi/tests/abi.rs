//! `include/palpus.abi` lists the functions of the library, and the size and offset of every
//! field of the header's structures, as a C compiler lays them out for 64 bits. A program that was
//! compiled with an older header keeps working as long as no line of the list changes. Added
//! lines are new functions.
//!
//! After a change: `PALPUS_WRITE_ABI=1 cargo test -p palpus-capi --test abi`. If a line was changed
//! or removed, also increase `PALPUS_ABI_VERSION` and the library's version in Cargo.toml.
#![allow(clippy::print_stderr, reason = "a skipped test prints why")]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

fn include() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../include")
}

/// Returns the header without comments.
fn header() -> String {
    let text = std::fs::read_to_string(include().join("palpus.h")).expect("include/palpus.h");
    let mut code = String::new();
    let mut rest = text.as_str();
    while let Some((before, after)) = rest.split_once("/*") {
        code.push_str(before);
        rest = after.split_once("*/").expect("every comment must end").1;
    }
    code + rest
}

/// Returns the declarations of functions, each on one line, in alphabetical order.
fn functions(header: &str) -> Vec<String> {
    let words = header.lines().filter(|line| !line.starts_with('#')).collect::<Vec<_>>().join(" ");
    let declared = words.split(';').filter(|part| part.contains("palpus_") && part.contains('('));
    let one_line = |part: &str| part.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut found: Vec<String> = declared.map(one_line).map(|line| line.replace("extern \"C\" { ", "")).collect();
    found.sort_by_key(|line| line.split_once('(').map(|(front, _)| front.rsplit(' ').next().map(str::to_owned)));
    found
}

/// Returns the structures and the names of their fields.
fn structures(header: &str) -> Vec<(String, Vec<String>)> {
    let mut found = Vec::new();
    for part in header.split("typedef struct {").skip(1) {
        let (fields, after) = part.split_once('}').expect("every structure must end");
        let name = after.split_once(';').expect("every structure must have a name").0.trim().to_owned();
        let field = |field: &str| {
            let name = field.trim().rsplit([' ', '*']).next().unwrap_or_default();
            name.split('[').next().unwrap_or_default().to_owned()
        };
        found.push((name, fields.split(';').map(field).filter(|name| !name.is_empty()).collect()));
    }
    found
}

/// Returns a C program that prints the layout.
fn program(header: &str) -> String {
    let mut text = "#include <stdio.h>\n#include \"palpus.h\"\nint main(void) {\n".to_owned();
    text += "printf(\"abi %d\\n\", PALPUS_ABI_VERSION);\n";
    for (name, fields) in structures(header) {
        writeln!(text, "printf(\"{name} %zu bytes\\n\", sizeof({name}));").expect("writing to a string succeeds");
        for field in fields {
            let size = format!("sizeof((({name} *)0)->{field})");
            writeln!(text, "printf(\"  {field} at %zu, %zu bytes\\n\", offsetof({name}, {field}), {size});")
                .expect("writing to a string succeeds");
        }
    }
    text + "return 0; }\n"
}

#[test]
fn abi_matches_the_list() {
    if cfg!(not(target_pointer_width = "64")) {
        return;
    }
    let header = header();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let (source, built) = (folder.join("layout.c"), folder.join("layout"));
    std::fs::write(&source, program(&header)).expect("the source can be written");
    let compiled = Command::new("cc").arg("-I").arg(include()).arg("-o").arg(&built).arg(&source).output();
    let Ok(compiled) = compiled else {
        eprintln!("skipped: cc was not found");
        return;
    };
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let layout = Command::new(&built).output().expect("the program runs").stdout;
    let list = functions(&header).join("\n") + "\n" + &String::from_utf8(layout).expect("the output is ASCII");
    assert!(list.lines().count() > 100, "the header must be parsed completely");

    let path = include().join("palpus.abi");
    if std::env::var_os("PALPUS_WRITE_ABI").is_some() {
        std::fs::write(&path, &list).expect("the list can be written");
    }
    let kept = std::fs::read_to_string(&path).expect("include/palpus.abi");
    let changed = || kept.lines().find(|line| !list.lines().any(|new| new == *line)).unwrap_or("only new lines");
    assert!(kept == list, "include/palpus.abi does not match the header ({}); see the top of this test", changed());
}
