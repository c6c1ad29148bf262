//! `palpus depth`: computes bounds of the penetration depth of two models of any shape, for many
//! poses.
//!
//! Frames are divided into runs of fixed length, and one thread computes a run from its beginning.
//! The results therefore do not depend on the number of threads, and most frames start from the
//! previous frame's result.

use std::ops::Range;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{anyhow, bail};
use palpus::algebra::{Pose, Workers, both, quantile_of_sorted};
use palpus::body::{Body, BodySettings, Health, Notice};
use palpus::depth::{Containment, DepthBracket, GlobalDepth, GlobalMemory, GlobalSettings, Interior};
use palpus_io::scene::metres;
use palpus_io::{DepthWriter, Threads};
use serde::Serialize;

use crate::args::{DepthArguments, PairArguments};
use crate::{bodies, files, output, query};

/// The document of `--json`; lengths are in model units.
#[derive(Serialize)]
struct Summary {
    frames: usize,
    overlapping: usize,
    contained: usize,
    /// Number of overlapping frames whose bounds differ by at most the requested gap.
    certified: usize,
    gap: f64,
    deepest: Option<Deepest>,
    cells: [usize; 2],
    preparation_s: f64,
    median_us: Option<f64>,
    largest_us: Option<f64>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct Deepest {
    frame: usize,
    lower: f64,
    upper: f64,
}

/// Two models and the poses of the first model.
pub(crate) struct Pair {
    pub(crate) a: Body,
    pub(crate) b: Body,
    /// Poses of a in b's frame.
    pub(crate) poses: Vec<Pose>,
}

/// The results of all poses.
pub(crate) struct Answers {
    /// Each result with its time, µs.
    pub(crate) answers: Vec<(DepthBracket, f64)>,
    /// Notes about defects of the models that limit the meaning of the depths.
    pub(crate) notes: Vec<String>,
    gap: f64,
    cells: [usize; 2],
    preparation_s: f64,
}

impl Pair {
    pub(crate) fn read(arguments: &PairArguments) -> anyhow::Result<Self> {
        let poses = files::read_poses(&arguments.poses)?;
        let settings = BodySettings::default();
        let a = bodies::prepare_file(&arguments.a, &settings)?.body;
        let b = bodies::prepare_file(&arguments.b, &settings)?.body;
        Ok(Self { a, b, poses })
    }
}

pub(crate) fn depth(arguments: &DepthArguments) -> anyhow::Result<ExitCode> {
    let asked = &arguments.depth;
    let Some(path) = &asked.out else { bail!("--out is missing; name the file for the results") };
    let pair = Pair::read(asked)?;
    let mut out = DepthWriter::new(query::create(path)?)?;
    let Answers { answers, notes, gap, cells, preparation_s } = answer_all(&pair, asked)?;
    for (frame, (answer, us)) in answers.iter().enumerate() {
        out.write(frame as u64, answer, *us)?;
    }
    out.finish()?;
    tell(asked.json, &Summary { preparation_s, cells, ..Summary::of(&answers, gap, notes) })?;
    Ok(ExitCode::SUCCESS)
}

/// Computes the bounds at all poses, on all threads.
pub(crate) fn answer_all(pair: &Pair, arguments: &PairArguments) -> anyhow::Result<Answers> {
    let Pair { a, b, poses } = pair;
    let gap = gap_of(&arguments.gap, &arguments.unit, a.size().min(b.size()))?;
    let goal = GlobalSettings { gap, budget: arguments.budget, outside: arguments.outside };
    let notes = [(&arguments.a, a), (&arguments.b, b)]
        .into_iter()
        .filter_map(|(path, body)| note_of(&files::input_name(path), body))
        .collect();
    let threads = Threads::all();
    let begin = Instant::now();
    let interior = |body: &Body| Interior::new(body, &threads, &mut |_| ());
    let (interior_a, interior_b) = both(&threads, || interior(a), || interior(b));
    let preparation_s = begin.elapsed().as_secs_f64();
    let query = GlobalDepth::new(a, &interior_a, b, &interior_b);
    let answers = answer(&query, poses, &goal, &threads);
    let cells = [interior_a.cell_count(), interior_b.cell_count()];
    Ok(Answers { answers, notes, gap, cells, preparation_s })
}

/// Returns the results of all poses, each with its time, µs.
fn answer(
    query: &GlobalDepth<'_>,
    poses: &[Pose],
    goal: &GlobalSettings,
    threads: &dyn Workers,
) -> Vec<(DepthBracket, f64)> {
    let of_run = |numbers: Range<usize>, memory: &mut GlobalMemory| {
        let answers = poses[numbers].iter().map(|pose_ba| {
            let begin = Instant::now();
            let answer = query.run(pose_ba, goal, memory);
            (answer, begin.elapsed().as_secs_f64() * 1e6)
        });
        answers.collect::<Vec<_>>()
    };
    let watched = output::watched();
    let mut said = Instant::now();
    let mut progress = |done: f64| {
        if watched && said.elapsed().as_millis() > 200 {
            said = Instant::now();
            output::live(&format!("depth of pose {} of {}", (done * poses.len() as f64) as usize, poses.len()));
        }
    };
    GlobalDepth::run_all(poses.len(), threads, &mut progress, of_run).into_iter().flatten().collect()
}

impl Summary {
    fn of(answers: &[(DepthBracket, f64)], gap: f64, notes: Vec<String>) -> Self {
        let deep = || answers.iter().enumerate().filter(|(_, (answer, _))| answer.upper > 0.0);
        let mut times: Vec<f64> = deep().map(|(_, &(_, us))| us).collect();
        times.sort_by(f64::total_cmp);
        let deepest = deep().max_by(|(_, (p, _)), (_, (q, _))| p.upper.total_cmp(&q.upper));
        Self {
            frames: answers.len(),
            overlapping: times.len(),
            contained: deep().filter(|(_, (answer, _))| answer.containment != Containment::Neither).count(),
            certified: deep().filter(|(_, (answer, _))| answer.certified).count(),
            gap,
            deepest: deepest.map(|(frame, (answer, _))| Deepest { frame, lower: answer.lower, upper: answer.upper }),
            cells: [0; 2],
            preparation_s: 0.0,
            median_us: quantile_of_sorted(&times, 0.5),
            largest_us: times.last().copied(),
            notes,
        }
    }
}

fn tell(json: bool, summary: &Summary) -> anyhow::Result<()> {
    if json {
        return output::json(summary);
    }
    for note in &summary.notes {
        output::note(format!("note: {note}"));
    }
    output::line(format!(
        "{} poses: {} overlap ({} of them contained), bounds within {:.3e} at {}",
        summary.frames, summary.overlapping, summary.contained, summary.gap, summary.certified
    ));
    if let Some(deepest) = &summary.deepest {
        output::line(format!("deepest: frame {}, {:.6e} to {:.6e}", deepest.frame, deepest.lower, deepest.upper));
    }
    if let (Some(median), Some(largest)) = (summary.median_us, summary.largest_us) {
        let [a, b] = summary.cells;
        output::line(format!(
            "cells: {a} and {b}, built in {:.2} s; a pose took {:.2} ms (median), at most {:.2} ms",
            summary.preparation_s,
            median * 1e-3,
            largest * 1e-3
        ));
    }
    Ok(())
}

/// Returns a note if a defect of the model limits the meaning of its depth.
fn note_of(name: &str, body: &Body) -> Option<String> {
    let health = Health::full(body.mesh(), body.half_edges(), body.tree(), body.health().cleaning);
    let notice = health.notices().into_iter().find(Notice::is_warning)?;
    let meaning = if health.closed {
        "a point is inside if the surface winds around it at least once"
    } else {
        "it does not enclose a solid, so only its surface counts"
    };
    Some(format!("{name} has {}; {meaning}", counted(&notice)))
}

/// Returns the notice without its last part, which applies to haptics only.
fn counted(notice: &Notice) -> String {
    let text = notice.to_string();
    text.split(':').next().unwrap_or_default().to_owned()
}

/// Reads a gap: a share of `size` in percent, or a length with or without a unit.
fn gap_of(text: &str, unit: &str, size: f64) -> anyhow::Result<f64> {
    let per_unit = metres(unit).map_err(|known| anyhow!("--unit {unit} is not a unit of length; known are {known}"))?;
    let digits = text.find(|c: char| c == '%' || (c.is_ascii_alphabetic() && c != 'e')).unwrap_or(text.len());
    let (number, suffix) = text.split_at(digits);
    let factor = match suffix {
        "%" => Some(0.01 * size),
        "" => Some(1.0),
        name => metres(name).ok().map(|metres| metres / per_unit),
    };
    match (number.trim().parse::<f64>(), factor) {
        (Ok(value), Some(factor)) if value.is_finite() && value > 0.0 => Ok(value * factor),
        _ => bail!("--gap {text} is neither a share such as 1% nor a positive length such as 0.01mm or 0.01"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gap_is_a_share_or_a_length() {
        for (text, unit, gap) in
            [("1%", "mm", 0.5), ("0.01mm", "mm", 0.01), ("0.01mm", "m", 1e-5), ("2", "mm", 2.0), ("1e-3", "in", 1e-3)]
        {
            assert!((gap_of(text, unit, 50.0).expect(text) - gap).abs() < 1e-15, "{text}");
        }
        for text in ["", "-1%", "1 parsec", "nan", "0"] {
            assert!(gap_of(text, "mm", 50.0).is_err(), "{text}");
        }
    }
}
