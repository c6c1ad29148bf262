//! `palpus prepare`: makes convex pieces and hierarchies of models.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, bail};
use palpus::body::{Body, BodySettings, PolygonSoup, Polytope};
use palpus_io::write_obj_groups;
use serde::Serialize;

use crate::args::PrepareArguments;
use crate::{bodies, files, output};

/// Entry of `--json` for one model.
#[derive(Serialize)]
struct Report {
    model: String,
    triangles: usize,
    pieces: usize,
    pieces_per_triangle: f64,
    nodes: usize,
    seconds: f64,
    /// True if the body came from the cache.
    cached: bool,
}

pub(crate) fn prepare(arguments: &PrepareArguments) -> anyhow::Result<ExitCode> {
    if arguments.pieces.is_some() && arguments.models.len() > 1 {
        bail!("--pieces writes one file, but {} models are given; prepare them one by one", arguments.models.len());
    }
    let mut reports = Vec::new();
    for model in &arguments.models {
        let prepared = bodies::prepare_file(model, &BodySettings::default())?;
        let body = &prepared.body;
        if let Some(path) = &arguments.pieces {
            write_pieces(body, path).with_context(|| format!("{} could not be written", path.display()))?;
        }
        let triangles = body.mesh().triangles().len();
        let pieces = body.pieces().len();
        reports.push(Report {
            model: files::input_name(model),
            triangles,
            pieces,
            pieces_per_triangle: pieces as f64 / triangles as f64,
            nodes: body.hierarchy().nodes().len(),
            seconds: prepared.seconds,
            cached: prepared.kept,
        });
        if reports.len() == arguments.models.len() {
            // Skips the destructors: the program ends now, and freeing a million lists one by one
            // takes long.
            std::mem::forget(prepared);
        }
    }
    if arguments.json {
        output::json(&reports)?;
    } else {
        for report in &reports {
            output::line(format!(
                "{}: {} triangles in {} convex pieces ({:.3} a triangle), {} hierarchy nodes, {:.2} s{}",
                report.model,
                report.triangles,
                report.pieces,
                report.pieces_per_triangle,
                report.nodes,
                report.seconds,
                if report.cached { " from the cache" } else { "" }
            ));
        }
        if let Some(path) = &arguments.pieces {
            output::line(format!("every piece is a group of {}", path.display()));
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn write_pieces(body: &Body, path: &Path) -> anyhow::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    let groups = body.polytopes().iter().enumerate().map(|(k, piece)| (format!("piece_{k:05}"), soup_of(piece)));
    write_obj_groups(&mut out, groups)?;
    out.flush()?;
    Ok(())
}

/// Returns the faces of a piece, without the rims of a flat piece, which have no width.
fn soup_of(piece: &Polytope) -> PolygonSoup {
    let mut soup = PolygonSoup { vertices: piece.vertices().to_vec(), ..PolygonSoup::new() };
    for face in (0..piece.face_count() as u32).filter(|&face| !piece.is_rim(face)) {
        soup.push_face(&piece.face_vertices(face).to_vec());
    }
    soup
}
