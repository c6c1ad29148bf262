//! `palpus report`: makes one self-contained HTML page of a recorded run, or of the whole
//! reproduction of the paper.
//!
//! * `html`, `style.css` — the only place that writes tags; all text from recordings is untrusted
//!   and escaped.
//! * `pictures` — moments as pictures with few colours, light and dark.
//! * `run` — the page of one recording.
//! * `reproduce` — runs and measures everything, and makes a page of the results.

mod clearance;
pub(crate) mod html;
mod pictures;
mod reproduce;
mod run;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail};

pub(crate) use clearance::clearance_page;
pub(crate) use pictures::{Frame, Shot, of_moment};

use self::run::Run;
use crate::args::{ReportArguments, file_policy};
use crate::{files, output};

pub(crate) fn report(arguments: &ReportArguments) -> anyhow::Result<ExitCode> {
    let policy = file_policy(arguments.allow_outside);
    if arguments.reproduce {
        let folder = arguments.path.as_deref().unwrap_or(Path::new(REPRODUCTION));
        reproduce::reproduce(arguments, folder)?;
        write(&arguments.out.clone().unwrap_or_else(|| folder.join("report.html")), &reproduce::page(folder)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let path = arguments.path.as_deref().unwrap_or(Path::new(RUNS));
    if reproduce::is_in(path) {
        write(&arguments.out.clone().unwrap_or_else(|| path.join("report.html")), &reproduce::page(path)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let recordings = if path.is_dir() { recordings_in(path)? } else { vec![path.to_owned()] };
    match (&recordings[..], &arguments.out) {
        ([], _) => bail!("{} contains no recording; `palpus run --record FILE` makes one", path.display()),
        ([recording], out) => {
            let out = out.clone().unwrap_or_else(|| recording.with_extension("html"));
            write(&out, &Run::of(recording, policy)?.page()?)?;
        }
        (_, Some(_)) => bail!("{} contains {} recordings; --out needs a single one", path.display(), recordings.len()),
        (several, None) => {
            for recording in several {
                write(&beside(recording, several), &Run::of(recording, policy)?.page()?)?;
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Default folder of recordings.
const RUNS: &str = "palpus-out";

/// Default folder of a reproduction.
const REPRODUCTION: &str = "palpus-out/report";

/// Returns the recordings in a folder, by name.
fn recordings_in(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("{} could not be read", folder.display()))?;
    let mut files: Vec<PathBuf> =
        entries.filter_map(|entry| Some(entry.ok()?.path())).filter(|p| is_recording(p)).collect();
    files.sort();
    Ok(files)
}

/// True if the file begins like a recording in one of the three formats. A folder may contain other
/// tables.
fn is_recording(path: &Path) -> bool {
    use std::io::Read;
    let mut begin = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(LONGEST_BEGIN).read_to_end(&mut begin));
    read.is_ok() && BEGINS.iter().any(|known| begin.starts_with(known))
}

/// First bytes of recordings: CSV with palpus's header, Parquet, MCAP.
const BEGINS: [&[u8]; 3] = [b"# format = ", b"PAR1", b"\x89MCAP0\r\n"];
/// Number of bytes that are read to recognise a recording.
const LONGEST_BEGIN: u64 = 16;

/// Returns the file of a recording's page, in the recording's folder. Recordings with the same name
/// and different formats have different pages.
fn beside(recording: &Path, all: &[PathBuf]) -> PathBuf {
    let page = recording.with_extension("html");
    if all.iter().filter(|other| other.with_extension("html") == page).count() < 2 {
        return page;
    }
    let mut name = recording.as_os_str().to_owned();
    name.push(".html");
    name.into()
}

fn write(path: &Path, page: &str) -> anyhow::Result<()> {
    files::make_folder_of(path)?;
    std::fs::write(path, page)
        .with_context(|| format!("{} could not be written; name another file", path.display()))?;
    output::line(format!("{} ({} kB): open it in any browser", path.display(), page.len().div_ceil(1000)));
    Ok(())
}
