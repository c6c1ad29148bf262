//! Scene files that name meshes outside their own folder. The program asks the user before it reads
//! such a scene file.

use std::io::{BufRead, IsTerminal, Write};
use std::path::Path;

use anyhow::{Context, bail};
use palpus_io::scene::{FilePolicy, SceneError, SceneFile, read_scene};

/// Reads a scene file. If it names files outside its folder and `policy` does not allow this, the
/// user is asked. Without a terminal, the function fails.
pub(super) fn read_asking(path: &Path, policy: FilePolicy) -> anyhow::Result<SceneFile> {
    let terminal = std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
    let answer = |inside: &SceneError| {
        terminal.then(|| {
            crate::output::note(format!("note: {inside}"));
            ask(&mut std::io::stdin().lock(), &mut std::io::stderr())
        })
    };
    read(path, policy, &answer)
}

/// Does the work of [`read_asking`]; `answer` asks the question, and returns `None` without a
/// terminal.
fn read(path: &Path, policy: FilePolicy, answer: &dyn Fn(&SceneError) -> Option<bool>) -> anyhow::Result<SceneFile> {
    let inside = match (read_scene(path, policy), policy) {
        (Err(error), FilePolicy::Inside) => error,
        (read, _) => return Ok(read?),
    };
    // Asks only if the place of a file is the only error.
    let Ok(scene) = read_scene(path, FilePolicy::Anywhere) else { return Err(inside.into()) };
    match answer(&inside) {
        Some(true) => Ok(scene),
        Some(false) => bail!("{} names files outside its folder, and you did not allow that", path.display()),
        None => Err(inside).context("the scene names files outside its folder; use --allow-outside if you trust it"),
    }
}

/// Asks the question; every answer except yes means no.
fn ask(input: &mut dyn BufRead, output: &mut dyn Write) -> bool {
    let mut line = String::new();
    let asked = output.write_all(b"Read files outside the scene's folder? [y/N] ").and_then(|()| output.flush());
    asked.is_ok() && input.read_line(&mut line).is_ok() && matches!(line.trim(), "y" | "Y" | "yes" | "Yes")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a scene in a folder of its own, with meshes outside of this folder.
    fn scene() -> std::path::PathBuf {
        let folder = std::env::temp_dir().join(format!("palpus-outside-{}", std::process::id()));
        let inner = folder.join("scene");
        std::fs::create_dir_all(&inner).expect("the folder can be created");
        std::fs::write(folder.join("a.obj"), "v 0 0 0\n").expect("the mesh can be written");
        let file = inner.join("scene.toml");
        let text = "unit = \"mm\"\n[probe]\nmesh = \"../a.obj\"\n[environment]\nmesh = \"../a.obj\"\n";
        std::fs::write(&file, text).expect("the scene can be written");
        file
    }

    #[test]
    fn files_outside_need_permission() {
        let file = scene();
        assert!(read(&file, FilePolicy::Inside, &|_| Some(true)).is_ok());
        assert!(read(&file, FilePolicy::Anywhere, &|_| panic!("no question may be asked")).is_ok());
        let refused = read(&file, FilePolicy::Inside, &|_| Some(false)).unwrap_err().to_string();
        assert!(refused.contains("did not allow"), "{refused}");
        let unasked = read(&file, FilePolicy::Inside, &|_| None).unwrap_err().to_string();
        assert!(unasked.contains("--allow-outside"), "{unasked}");
    }

    #[test]
    fn only_yes_gives_permission() {
        for (typed, is_yes) in [("y\n", true), ("yes\n", true), ("\n", false), ("n\n", false), ("", false)] {
            assert_eq!(ask(&mut typed.as_bytes(), &mut Vec::new()), is_yes, "{typed:?}");
        }
    }
}
