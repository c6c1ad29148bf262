//! `palpus clearance`: computes the distance or the penetration depth of two models along a path or
//! for a set of poses, and finds the tightest places.

use std::path::Path;
use std::process::ExitCode;

use anyhow::Context;
use palpus::algebra::Pose;
use palpus::body::Body;
use palpus::depth::{Containment, DepthBracket};
use palpus_io::DepthWriter;
use serde::Serialize;

use crate::args::ClearanceArguments;
use crate::depth::{Answers, Pair, answer_all};
use crate::{files, output, query, report};

/// The document of `--json`; lengths are in model units.
#[derive(Serialize)]
struct Summary<'a> {
    frames: usize,
    free: usize,
    overlapping: usize,
    contained: usize,
    tightest: &'a [Place],
    notes: &'a [String],
}

/// A pose with less clearance than its neighbours in the file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Place {
    pub(crate) frame: usize,
    /// The distance if the bodies do not overlap; else minus the upper bound of the depth.
    pub(crate) clearance: f64,
    /// Lower bound of the depth: no shorter translation separates the bodies.
    pub(crate) depth_lower: f64,
    /// Translation of A, in B's frame, that separates the bodies.
    pub(crate) way_out: [f64; 3],
    /// Description for people.
    pub(crate) state: &'static str,
}

/// Content of the page.
pub(crate) struct Shown<'a> {
    pub(crate) names: [String; 2],
    pub(crate) bodies: [&'a Body; 2],
    pub(crate) poses: &'a [Pose],
    /// Clearance at each pose.
    pub(crate) clearances: &'a [f64],
    pub(crate) tightest: &'a [Place],
    pub(crate) notes: &'a [String],
}

pub(crate) fn clearance(arguments: &ClearanceArguments) -> anyhow::Result<ExitCode> {
    let asked = &arguments.depth;
    let pair = Pair::read(asked)?;
    let mut out = asked.out.as_deref().map(|path| DepthWriter::new(query::create(path)?).map_err(anyhow::Error::from));
    let mut out = out.take().transpose()?;
    let Answers { answers, notes, .. } = answer_all(&pair, asked)?;
    if let Some(out) = &mut out {
        for (frame, (answer, us)) in answers.iter().enumerate() {
            out.write(frame as u64, answer, *us)?;
        }
    }
    if let Some(out) = out {
        out.finish()?;
    }
    let answers: Vec<DepthBracket> = answers.into_iter().map(|(answer, _)| answer).collect();
    let clearances: Vec<f64> = answers.iter().map(clearance_of).collect();
    let tightest: Vec<Place> = tightest(&clearances, arguments.tightest)
        .into_iter()
        .map(|frame| Place {
            frame,
            clearance: clearances[frame],
            depth_lower: answers[frame].lower,
            way_out: answers[frame].translation.to_array(),
            state: state(&answers[frame]),
        })
        .collect();
    if let Some(page) = &arguments.html {
        let name = |path: &Path| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let shown = Shown {
            names: [name(&asked.a), name(&asked.b)],
            bodies: [&pair.a, &pair.b],
            poses: &pair.poses,
            clearances: &clearances,
            tightest: &tightest,
            notes: &notes,
        };
        let html = report::clearance_page(&shown)?;
        files::make_folder_of(page)?;
        std::fs::write(page, html)
            .with_context(|| format!("{} could not be written; name another file", page.display()))?;
    }
    let contained = answers.iter().filter(|answer| answer.containment != Containment::Neither).count();
    let free = answers.iter().filter(|answer| answer.upper == 0.0).count();
    let overlapping = answers.len() - free;
    let summary = Summary { frames: answers.len(), free, overlapping, contained, tightest: &tightest, notes: &notes };
    if asked.json {
        output::json(&summary)?;
    } else {
        tell(&summary);
    }
    Ok(ExitCode::SUCCESS)
}

fn tell(summary: &Summary<'_>) {
    for note in summary.notes {
        output::note(format!("note: {note}"));
    }
    output::line(format!(
        "{} placements: {} apart, {} overlap ({} of them contained)",
        summary.frames, summary.free, summary.overlapping, summary.contained
    ));
    output::line(format!("{:>8}  {:>13}  {:<12}  way out", "frame", "clearance", "state"));
    for place in summary.tightest {
        let [x, y, z] = place.way_out;
        let way = if place.clearance < 0.0 { format!("({x:.4e}, {y:.4e}, {z:.4e})") } else { String::new() };
        output::line(format!("{:>8}  {:>13.6e}  {:<12}  {way}", place.frame, place.clearance, place.state));
    }
}

/// Returns the distance if the bodies do not overlap; else minus the upper bound of the depth.
fn clearance_of(answer: &DepthBracket) -> f64 {
    if answer.upper > 0.0 { -answer.upper } else { answer.distance.unwrap_or(0.0) }
}

fn state(answer: &DepthBracket) -> &'static str {
    match (answer.containment, answer.upper > 0.0) {
        (Containment::AInB, _) => "A inside B",
        (Containment::BInA, _) => "B inside A",
        (Containment::Neither, true) => "overlap",
        (Containment::Neither, false) => "free",
    }
}

/// Returns up to `most` frames that are at least as tight as their neighbours, the tightest first.
/// If neighbours are equal, the first counts.
fn tightest(clearances: &[f64], most: usize) -> Vec<usize> {
    let least_here = |&k: &usize| {
        let before = k.checked_sub(1).is_none_or(|before| clearances[k] < clearances[before]);
        before && clearances.get(k + 1).is_none_or(|after| clearances[k] <= *after)
    };
    let mut frames: Vec<usize> = (0..clearances.len()).filter(least_here).collect();
    frames.sort_by(|&p, &q| clearances[p].total_cmp(&clearances[q]).then(p.cmp(&q)));
    frames.truncate(most);
    frames
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tightest_places_are_local_minima() {
        let clearances = [3.0, 1.0, 2.0, -1.0, -1.0, 4.0, 0.5];
        assert_eq!(tightest(&clearances, 5), [3, 6, 1]);
        assert_eq!(tightest(&clearances, 1), [3]);
        assert_eq!(tightest(&[2.0], 5), [0]);
        assert!(tightest(&[], 5).is_empty());
    }
}
