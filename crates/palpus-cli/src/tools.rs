//! The tools of a scene: their names, the arguments for each, and the references between their
//! recordings.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use anyhow::bail;
use palpus_io::Recording;
use toml::{Table, Value};

use crate::args::RunArguments;
use crate::files;

const NAMES: [&str; 8] = ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth"];

/// Returns the name of tool number `which` (from 0 on) and of its hand. Files, pages and documents
/// use the same name.
pub(crate) fn name(which: usize) -> Cow<'static, str> {
    NAMES.get(which).map_or_else(|| format!("{}th", which + 1).into(), |name| (*name).into())
}

/// Arguments for one tool.
pub(crate) struct ToolArguments<'a> {
    pub(crate) device: &'a str,
    pub(crate) hand: Option<&'a str>,
    /// Faults to inject.
    pub(crate) faults: &'a [String],
}

impl<'a> ToolArguments<'a> {
    /// Returns the arguments for each tool of a scene.
    pub(crate) fn of(arguments: &'a RunArguments, tools: usize) -> anyhow::Result<Vec<Self>> {
        let RunArguments { scene, device, second_device, hand, second_hand, fault, .. } = arguments;
        if tools < 2 {
            for (given, name) in [(second_device, "--second-device"), (second_hand, "--second-hand")] {
                if given.is_some() {
                    bail!("{name} needs a scene with a second tool, such as two-hands; {scene} has one tool");
                }
            }
        }
        let devices = each("--device", scene, device, second_device.as_ref(), tools)?;
        let hands = each("--hand", scene, hand, second_hand.as_ref(), tools)?;
        for (k, device) in devices.iter().enumerate() {
            if device.is_some_and(|device| device != "sim" && devices[..k].contains(&Some(device))) {
                let device = device.unwrap_or_default();
                bail!(
                    "two tools cannot use the device `{device}`; name another one with --second-device or a further --device"
                );
            }
        }
        let tool = |(k, (device, hand)): (usize, (&Option<&'a str>, Option<&'a str>))| Self {
            device: device.unwrap_or("sim"),
            hand,
            faults: if k == 0 { fault } else { &[] },
        };
        Ok(devices.iter().zip(hands).enumerate().map(tool).collect())
    }
}

/// Returns the user's value for each tool: from the repeated option, in the order of the tools, or
/// from the option of the second tool.
fn each<'a>(
    option: &str,
    scene: &str,
    typed: &'a [String],
    of_second: Option<&'a String>,
    tools: usize,
) -> anyhow::Result<Vec<Option<&'a str>>> {
    if typed.len() > tools {
        bail!("{option} is given {} times, but {scene} has only {tools} tools; leave some out", typed.len());
    }
    if typed.len() > 1 && of_second.is_some() {
        bail!("the second {option} and --second{} set the same value; leave out one", &option[1..]);
    }
    let second = |which: usize| of_second.filter(|_| which == 1);
    Ok((0..tools).map(|which| typed.get(which).or(second(which)).map(String::as_str)).collect())
}

/// Returns the recording files of this many tools; `file` is the recording of the first tool.
pub(crate) fn recordings(file: PathBuf, tools: usize) -> Vec<PathBuf> {
    let others: Vec<PathBuf> = (1..tools).map(|which| files::beside(&file, name(which))).collect();
    std::iter::once(file).chain(others).collect()
}

/// Header key under which a recording names the recordings of the other tools.
const SECTION: &str = "tools";
/// The header key that older versions used for recordings of two tools.
const SECTION_OF_TWO: &str = "other_tool";

/// Returns the header entry of tool `which`: the file names of the recordings of all tools, without
/// folders, because they are in the same folder.
pub(crate) fn name_recordings(which: usize, all: &[PathBuf], into: &mut Table) {
    let file = |path: &PathBuf| Value::from(file_name(path));
    let table = Table::from_iter([
        ("this".to_owned(), Value::from(which as i64 + 1)),
        ("recordings".to_owned(), Value::Array(all.iter().map(file).collect())),
    ]);
    into.insert(SECTION.into(), Value::Table(table));
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns the tool number of `recording`, and the file names of the recordings of all tools (the
/// name of `recording` itself is empty); `None` if there is only one tool.
pub(crate) fn named_by(recording: &Recording) -> Option<(usize, Vec<&str>)> {
    let more = &recording.header.scene.more;
    if let Some(two) = more.get(SECTION_OF_TWO).and_then(Value::as_table) {
        let this = two.get("this_is")?.as_str()?;
        let which = NAMES[..2].iter().position(|name| *name == this)?;
        let other = two.get("recording")?.as_str()?;
        return Some((which, if which == 0 { vec!["", other] } else { vec![other, ""] }));
    }
    let table = more.get(SECTION)?.as_table()?;
    let which = usize::try_from(table.get("this")?.as_integer()?).ok()?.checked_sub(1)?;
    let mut names: Vec<&str> = table.get("recordings")?.as_array()?.iter().filter_map(Value::as_str).collect();
    *names.get_mut(which)? = "";
    Some((which, names))
}

#[cfg(test)]
mod tests {
    use palpus_io::scene::FilePolicy;

    use super::*;

    /// Returns a recording without rows, with this entry about other tools in its header.
    fn with(more: Table) -> Recording {
        crate::bodies::use_cache(false);
        let stage = crate::stage::prepare("pen-sphere", FilePolicy::Inside).expect("the scene is built in");
        let mut header = stage.header(stage.settings, "sim", 1000.0);
        header.scene.more = more;
        Recording { header, rows: Vec::new(), changes: Vec::new(), notice: None }
    }

    #[test]
    fn recordings_name_each_other_in_both_formats() {
        let mut table = Table::new();
        let files = recordings(PathBuf::from("out/run.csv"), 3);
        name_recordings(1, &files, &mut table);
        assert_eq!(named_by(&with(table)), Some((1, vec!["run.csv", "", "run-third.csv"])));
        let recording_of = |text: &str| with(toml::from_str(text).expect("the TOML is valid"));
        let before = recording_of("other_tool = { this_is = \"second\", recording = \"run.csv\" }");
        assert_eq!(named_by(&before), Some((1, vec!["run.csv", ""])));
        for damaged in ["this = 0, recordings = []", "this = 4, recordings = [\"a\"]", "this = -1", "recordings = 3"] {
            assert_eq!(named_by(&recording_of(&format!("tools = {{ {damaged} }}"))), None, "{damaged}");
        }
    }
}
