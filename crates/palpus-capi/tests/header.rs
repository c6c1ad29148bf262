//! `include/palpus.h` is what cbindgen makes of this crate, and C and C++ compilers take it.
//!
//! After a change: `PALPUS_WRITE_HEADER=1 cargo test -p palpus-capi --test header`.
#![allow(clippy::print_stderr, reason = "a test that is skipped says so")]

use std::path::{Path, PathBuf};
use std::process::Command;

/// The files with items of the header, in the header's order.
const FILES: [&str; 9] =
    ["version", "result", "value", "body", "query", "depth", "settings", "world", "world_functions"];

const TOP: &str = "\
/*
 * palpus as a C library: contacts and penetration depth of triangle meshes, and 6-DOF haptic rendering.
 * docs/c.md is its page. C99 or later, C++11 or later (palpus.hpp: C++17).
 *
 * Written by `PALPUS_WRITE_HEADER=1 cargo test -p palpus-capi --test header`; do not edit.
 *
 * Units are SI: m, rad, s, N, N m, kg. Frames are right-handed. A pose of a in b's frame takes points
 * of a to points of b. Handles are numbers, and a wrong one is an error. A pointer must be NULL or point
 * to as many values as the function says.
 */";

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

fn generated() -> String {
    let enumeration = cbindgen::EnumConfig {
        rename_variants: cbindgen::RenameRule::ScreamingSnakeCase,
        ..cbindgen::EnumConfig::default()
    };
    let config = cbindgen::Config {
        language: cbindgen::Language::C,
        header: Some(TOP.to_owned()),
        include_guard: Some("PALPUS_H".to_owned()),
        cpp_compat: true,
        no_includes: true,
        sys_includes: ["stddef.h", "stdint.h"].map(str::to_owned).to_vec(),
        usize_is_size_t: true,
        style: cbindgen::Style::Type,
        documentation_style: cbindgen::DocumentationStyle::Doxy,
        line_length: 100,
        tab_width: 4,
        enumeration,
        ..cbindgen::Config::default()
    };
    let files = FILES.map(|file| folder().join("src").join(file).with_extension("rs"));
    let builder = files.iter().fold(cbindgen::Builder::new(), |builder, file| builder.with_src(file));
    let mut text = Vec::new();
    builder.with_config(config).generate().expect("the sources are understood").write(&mut text);
    String::from_utf8(text).expect("the header is UTF-8")
}

#[test]
fn header_is_that_of_the_sources() {
    let (header, path) = (generated(), folder().join("../../include/palpus.h"));
    if std::env::var_os("PALPUS_WRITE_HEADER").is_some() {
        std::fs::write(&path, &header).expect("the header can be written");
    }
    let kept = std::fs::read_to_string(&path).expect("include/palpus.h");
    assert!(kept == header, "include/palpus.h is not that of the sources; see the top of this test");
}

#[test]
fn compilers_take_the_headers() {
    let cases =
        [("cc", "c", "c99", "palpus.h"), ("c++", "c++", "c++11", "palpus.h"), ("c++", "c++", "c++17", "palpus.hpp")];
    for (compiler, language, standard, header) in cases {
        let mut command = Command::new(compiler);
        command.args([&format!("-std={standard}"), "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only"]);
        command.args(["-x", language]).arg(folder().join("../../include").join(header));
        let Ok(output) = command.output() else {
            eprintln!("skipped: there is no {compiler} here");
            continue;
        };
        let said = String::from_utf8_lossy(&output.stderr);
        // Compilers warn about `#pragma once` here because the header is compiled as a main file.
        let said: String = said.lines().filter(|line| !line.contains("pragma once")).collect();
        assert!(output.status.success(), "{header}, {standard}: {said}");
    }
}
