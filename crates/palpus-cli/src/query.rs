//! `palpus query`: computes contacts of two models for a list of poses, on all cores.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::ops::Range;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Context;
use palpus::algebra::Pose;
use palpus::algebra::tolerance::TOLERANCE_SHARE;
use palpus::body::{Body, BodySettings};
use palpus::depth::ContainmentQuery;
use palpus::detect::{Contact, ContactBatch, ContactQuery, Proof, QuerySettings};
use palpus_io::{ContactWriter, QueryRow, QueryWriter, Threads};
use serde::Serialize;

use crate::args::QueryArguments;
use crate::{bodies, files, output};

/// Largest number of leaf contacts at one pose.
const CAPACITY: usize = 1 << 16;
/// Number of poses whose results are kept in memory before they are written.
const BLOCK: usize = 32 * ContactBatch::RUN;

pub(crate) fn query(arguments: &QueryArguments) -> anyhow::Result<ExitCode> {
    let poses = files::read_poses(&arguments.poses)?;
    let settings = BodySettings::default();
    let a = bodies::prepare_file(&arguments.a, &settings)?.body;
    let b = bodies::prepare_file(&arguments.b, &settings)?.body;
    let tolerance = tolerance_of(arguments.tolerance, &a, &b)?;
    // The table goes to standard output, unless a file or a document is requested.
    let mut rows = match &arguments.out {
        Some(path) => Some(QueryWriter::new(create(path)?)?),
        None if arguments.json => None,
        None => Some(QueryWriter::new(standard_output())?),
    };
    let mut results = Vec::new();
    let mut contact_rows = match &arguments.contacts {
        Some(path) => Some(ContactWriter::new(create(path)?)?),
        None => None,
    };
    let proof = if arguments.local { Proof::None } else { Proof::Prove };
    let settings = QuerySettings { tolerance, capacity: CAPACITY, proof, ..QuerySettings::default() };
    let (a, b) = (Arc::new(a), Arc::new(b));
    let containment = ContainmentQuery::new(&a, &b);
    let batch = ContactBatch::new(a.clone(), b.clone(), settings);
    let keep = contact_rows.is_some();
    let of_run = |query: &mut ContactQuery, frames: Range<usize>| -> Vec<Answer> {
        frames.map(|frame| answer(query, &containment, frame, &poses[frame], keep)).collect()
    };
    let mut dropped = 0;
    for begin in (0..poses.len()).step_by(BLOCK) {
        let frames = begin..poses.len().min(begin + BLOCK);
        let answers = batch.run(frames.clone(), &Threads::all(), &mut |_| (), of_run);
        for (frame, answer) in frames.zip(answers.into_iter().flatten()) {
            let row = answer.row.with_context(|| format!("frame {frame} has no result: a model has no pieces"))?;
            if let Some(rows) = &mut rows {
                rows.write(&row)?;
            }
            if arguments.json {
                results.push(row);
            }
            if let Some(file) = &mut contact_rows {
                file.write(frame as u64, &answer.contacts)?;
            }
            dropped += answer.dropped;
        }
    }
    if let Some(rows) = rows {
        rows.finish()?;
    }
    if let Some(file) = contact_rows {
        file.finish()?;
    }
    if dropped > 0 {
        output::note(format!(
            "note: {dropped} contacts over {CAPACITY} in a frame were left out; a smaller --tolerance has fewer"
        ));
    }
    if arguments.json {
        output::json(&Document { tolerance, results })?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The document of `--json`, in model units and B's frame.
#[derive(Serialize)]
struct Document {
    tolerance: f64,
    results: Vec<QueryRow>,
}

/// Returns the requested tolerance, or the default for these two models.
pub(crate) fn tolerance_of(typed: Option<f64>, a: &Body, b: &Body) -> anyhow::Result<f64> {
    match typed {
        Some(t) if t.is_finite() && t >= 0.0 => Ok(t),
        Some(t) => anyhow::bail!("--tolerance is {t}, but must be a length in model units, 0 or more"),
        None => Ok(TOLERANCE_SHARE * a.size().min(b.size())),
    }
}

/// Opens a buffered file to write to, or standard output for `-`; the error names the file.
pub(crate) fn create(path: &Path) -> anyhow::Result<BufWriter<Box<dyn Write>>> {
    if files::is_standard(path) {
        return Ok(standard_output());
    }
    let file =
        File::create(path).with_context(|| format!("{} could not be created; check the folder", path.display()))?;
    Ok(BufWriter::new(Box::new(file)))
}

fn standard_output() -> BufWriter<Box<dyn Write>> {
    BufWriter::new(Box::new(output::Answer::new()))
}

/// Results at one pose.
struct Answer {
    /// `None` if a model has no pieces.
    row: Option<QueryRow>,
    /// Empty unless contacts are requested.
    contacts: Vec<Contact>,
    /// Number of contacts beyond the capacity.
    dropped: u64,
}

fn answer(
    query: &mut ContactQuery,
    containment: &ContainmentQuery<'_>,
    frame: usize,
    pose_ba: &Pose,
    keep: bool,
) -> Answer {
    let begin = Instant::now();
    let nearest = query.nearest(pose_ba);
    let query_us = begin.elapsed().as_secs_f64() * 1e6;
    let (counters, contacts) = (query.counters(), query.found());
    let row = nearest.map(|nearest| QueryRow {
        frame: frame as u64,
        separation: nearest.separation,
        normal: nearest.normal,
        point_a: nearest.point_a,
        point_b: nearest.point_b,
        contacts: contacts.len() as u32,
        // The planes through the closest points prove a distance. Depths are either proven or
        // counted as unproven.
        certified: counters.unproven == 0,
        query_us,
        contained: containment.run(pose_ba),
    });
    let contacts = if keep { contacts.to_vec() } else { Vec::new() };
    Answer { row, contacts, dropped: u64::from(counters.traversal.dropped) }
}
