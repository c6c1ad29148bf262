//! Build information for reports: the compiler, the target, and in a release build the commit.
//! Missing information is no error.

#![allow(clippy::print_stdout, reason = "this is how a build script talks to cargo")]

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
    tell("PALPUS_RUSTC", said(&rustc, &["--version"]));
    tell("PALPUS_TARGET", std::env::var("TARGET").ok());
    let profile = std::env::var("PROFILE").ok();
    // Debug builds leave the commit out, because each new commit would otherwise rebuild the
    // program.
    let commit = (profile.as_deref() == Some("release")).then(commit).flatten();
    tell("PALPUS_PROFILE", profile);
    tell("PALPUS_COMMIT", commit);
}

fn tell(name: &str, value: Option<String>) {
    println!("cargo::rustc-env={name}={}", value.unwrap_or_default());
}

/// Returns the commit that is checked out; `None` without git or outside a clone.
fn commit() -> Option<String> {
    let commit = said("git", &["rev-parse", "--short=12", "HEAD"])?;
    let branch = said("git", &["symbolic-ref", "-q", "HEAD"]);
    for name in ["HEAD"].into_iter().chain(branch.as_deref()) {
        let path = said("git", &["rev-parse", "--git-path", name])?;
        // For a file that does not exist, Cargo would run this script in every build.
        if Path::new(&path).exists() {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    let changed = !said("git", &["status", "--porcelain", "--untracked-files=no"]).unwrap_or_default().is_empty();
    Some(if changed { format!("{commit}, changed since") } else { commit })
}

/// Returns the first line that a program prints; `None` if the program fails.
fn said(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.lines().next().unwrap_or("").trim().to_owned())
}
