//! `palpus inspect`: prints health, mass properties and pieces of a model, as text or as JSON.

use std::process::ExitCode;
use std::sync::Arc;

use palpus::body::{Body, BodySettings, Health};
use serde::Serialize;

use crate::args::{InspectArguments, PictureArguments};
use crate::sweeps::Sweeps;
use crate::{bodies, files, output, picture};

/// Document of `--json`; lengths are in model units.
#[derive(Serialize)]
struct Report {
    model: String,
    content: String,
    vertices: usize,
    triangles: usize,
    size: f64,
    bounds_min: [f64; 3],
    bounds_max: [f64; 3],
    closed: bool,
    manifold: bool,
    components: usize,
    genus: Option<usize>,
    boundary_edges: usize,
    non_manifold_edges: usize,
    pinched_vertices: usize,
    self_intersecting: Option<bool>,
    self_intersecting_triangles: Option<usize>,
    inverted_components: usize,
    notices: Vec<String>,
    mass: Mass,
    pieces: Pieces,
    /// `None` unless the user requested sweeps of a closed model.
    sweeps: Option<Sweeps>,
    seconds: f64,
    cached: bool,
}

#[derive(Serialize)]
struct Mass {
    volume: f64,
    center_of_mass: [f64; 3],
    /// Inertia about the centre of mass, for density 1, row by row.
    inertia: [[f64; 3]; 3],
    principal_moments: [f64; 3],
    source: String,
}

#[derive(Serialize)]
struct Pieces {
    count: usize,
    per_triangle: f64,
    flat: usize,
    largest_triangles: usize,
    largest_vertices: usize,
    hierarchy_depth: usize,
}

pub(crate) fn inspect(arguments: &InspectArguments) -> anyhow::Result<ExitCode> {
    let prepared = bodies::prepare_file(&arguments.model, &BodySettings::default())?;
    let body = &Arc::new(prepared.body);
    let health = Health::full(body.mesh(), body.half_edges(), body.tree(), body.health().cleaning);
    let name = files::input_name(&arguments.model);
    let sweeps = (arguments.sweeps && body.mesh().is_closed()).then(|| Sweeps::of(body, arguments.samples));
    let report = Report {
        sweeps,
        cached: prepared.kept,
        ..report(name, prepared.hash.to_string(), prepared.seconds, body, &health)
    };
    if let Some(file) = &arguments.picture {
        picture::write_model(&arguments.model, body, None, file, &PictureArguments::default())?;
    }
    if arguments.json {
        output::json(&report)?;
    } else {
        tell(&report);
        match &report.sweeps {
            Some(sweeps) => sweeps.tell(),
            None if arguments.sweeps => output::line("         sweeps  none: an open surface has no inside".to_owned()),
            None => (),
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn report(model: String, content: String, seconds: f64, body: &Body, health: &Health) -> Report {
    let mesh = body.mesh();
    let bounds = mesh.bounds();
    let crossings = health.self_intersections.as_ref();
    Report {
        model,
        content,
        vertices: mesh.vertices().len(),
        triangles: mesh.triangles().len(),
        size: body.size(),
        bounds_min: bounds.min.to_array(),
        bounds_max: bounds.max.to_array(),
        closed: health.closed,
        manifold: health.is_manifold(),
        components: health.components.len(),
        genus: health.genus(),
        boundary_edges: health.boundary_edges,
        non_manifold_edges: health.non_manifold_edges,
        pinched_vertices: health.pinched_vertices,
        self_intersecting: crossings.map(|crossings| crossings.any()),
        self_intersecting_triangles: crossings.map(|crossings| crossings.triangles),
        inverted_components: health.cleaning.inverted_components,
        notices: health.notices().iter().map(ToString::to_string).collect(),
        mass: mass(body),
        pieces: pieces(body),
        sweeps: None,
        seconds,
        cached: false,
    }
}

fn mass(body: &Body) -> Mass {
    let mass = body.mass();
    let rows = mass.inertia.transpose();
    Mass {
        volume: mass.volume,
        center_of_mass: mass.center_of_mass.to_array(),
        inertia: rows.to_cols_array_2d(),
        principal_moments: mass.principal().moments.to_array(),
        source: mass.source.to_string(),
    }
}

fn pieces(body: &Body) -> Pieces {
    let polytopes = body.polytopes();
    Pieces {
        count: polytopes.len(),
        per_triangle: polytopes.len() as f64 / body.mesh().triangles().len() as f64,
        flat: polytopes.iter().filter(|piece| piece.is_flat()).count(),
        largest_triangles: body.pieces().iter().map(|piece| piece.triangles().len()).max().unwrap_or(0),
        largest_vertices: polytopes.iter().map(|piece| piece.vertices().len()).max().unwrap_or(0),
        hierarchy_depth: body.hierarchy().depth(),
    }
}

fn tell(report: &Report) {
    let kind = match (report.closed, report.manifold) {
        (true, true) => "a closed manifold surface: a solid",
        (true, false) => "a closed surface, but not manifold everywhere",
        (false, _) => "an open surface",
    };
    let genus = report.genus.map_or(String::new(), |genus| format!(", genus {genus}"));
    let components =
        if report.components == 1 { "1 component".into() } else { format!("{} components", report.components) };
    let crossing = match report.self_intersecting {
        Some(true) => format!("it intersects itself ({} triangles)", report.self_intersecting_triangles.unwrap_or(0)),
        Some(false) => "it does not cross itself".to_owned(),
        None => "not checked for self-intersections".to_owned(),
    };
    let [x, y, z] = std::array::from_fn(|k| report.bounds_max[k] - report.bounds_min[k]);
    let (mass, pieces) = (&report.mass, &report.pieces);
    let [cx, cy, cz] = mass.center_of_mass;
    let [ix, iy, iz] = mass.principal_moments;
    let rows = [
        ("model", report.model.clone()),
        ("surface", format!("{} vertices, {} triangles; {kind}", report.vertices, report.triangles)),
        ("health", format!("{components}{genus}; {crossing}")),
        ("size", format!("{x:.6} × {y:.6} × {z:.6} model units, diagonal {:.6}", report.size)),
        ("volume", format!("{:.6e} ({})", mass.volume, mass.source)),
        ("centre of mass", format!("{cx:.6} {cy:.6} {cz:.6}")),
        ("inertia", format!("principal moments {ix:.4e} {iy:.4e} {iz:.4e} at density 1")),
        (
            "pieces",
            format!(
                "{} convex ({:.3} a triangle), {} of them flat; the largest has {} triangles and {} corners",
                pieces.count, pieces.per_triangle, pieces.flat, pieces.largest_triangles, pieces.largest_vertices
            ),
        ),
        ("prepared in", format!("{:.2} s{}", report.seconds, if report.cached { " (from the cache)" } else { "" })),
    ];
    for (name, text) in rows {
        output::line(format!("{name:>15}  {text}"));
    }
    for notice in &report.notices {
        output::line(format!("{:>15}  {notice}", "notice"));
    }
}
