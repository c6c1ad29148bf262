//! Table 1 of the paper: convex pieces of the models, compared with the paper's numbers.

use std::path::{Path, PathBuf};

use comfy_table::presets::UTF8_BORDERS_ONLY;
use comfy_table::{CellAlignment, Table};
use palpus::body::BodySettings;
use palpus_scenes::shape;
use serde::Serialize;

use crate::bodies::{self, Prepared};

/// One model, compared with the paper's model.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    model: &'static str,
    source: String,
    triangles: usize,
    pieces: usize,
    pieces_per_triangle: f64,
    paper_triangles: usize,
    paper_pieces: usize,
    paper_pieces_per_triangle: f64,
    seconds: f64,
}

/// Values of the paper's Table 1.
const PAPER: [(&str, usize, usize); 5] = [
    ("torus", 2000, 67),
    ("cup", 500, 190),
    ("spoon", 336, 78),
    ("armadillo", 31240, 9098),
    ("intestine", 24846, 9913),
];

/// Scanned and modelled meshes with the paper's triangle counts, by file name.
const FILES: [(&str, &str); 5] = [
    ("cup", "teacup_500.obj"),
    ("spoon", "teaspoon_336.obj"),
    ("armadillo", "armadillo_31240.obj"),
    ("intestine", "intestine_colon_male_24846.obj"),
    ("intestine", "intestine_small_female_24846.obj"),
];

/// Prepares every model that exists.
pub(super) fn measure(models: Option<&Path>) -> anyhow::Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (model, soup) in
        [("torus", shape::torus()), ("cup", shape::cup()), ("spoon", shape::spoon()), ("intestine", shape::intestine())]
    {
        let prepared = bodies::prepare_soup(model, &soup, &BodySettings::default())?;
        rows.push(row(model, "built-in scene".to_owned(), &prepared));
    }
    if let Some(folder) = models {
        for (model, file) in FILES {
            let Some(path) = find(folder, file) else { continue };
            rows.push(row(model, file.to_owned(), &bodies::prepare_file(&path, &BodySettings::default())?));
        }
    }
    rows.sort_by_key(|row| PAPER.iter().position(|paper| paper.0 == row.model));
    Ok(rows)
}

fn row(model: &'static str, source: String, prepared: &Prepared) -> Row {
    let (paper_triangles, paper_pieces) =
        PAPER.iter().find(|paper| paper.0 == model).map_or((0, 0), |paper| (paper.1, paper.2));
    let (triangles, pieces) = (prepared.body.mesh().triangles().len(), prepared.body.pieces().len());
    Row {
        model,
        source,
        triangles,
        pieces,
        pieces_per_triangle: pieces as f64 / triangles as f64,
        paper_triangles,
        paper_pieces,
        paper_pieces_per_triangle: paper_pieces as f64 / paper_triangles as f64,
        seconds: prepared.seconds,
    }
}

/// Returns the file in the folder or in one of its subfolders.
pub(crate) fn find(folder: &Path, file: &str) -> Option<PathBuf> {
    let direct = folder.join(file);
    if direct.is_file() {
        return Some(direct);
    }
    let mut folders: Vec<PathBuf> =
        std::fs::read_dir(folder).ok()?.filter_map(|entry| Some(entry.ok()?.path())).filter(|p| p.is_dir()).collect();
    folders.sort();
    folders.into_iter().map(|inner| inner.join(file)).find(|path| path.is_file())
}

/// Returns the table as text.
pub(super) fn text(rows: &[Row]) -> String {
    let mut table = Table::new();
    table.load_preset(UTF8_BORDERS_ONLY);
    table.set_header([
        "model",
        "mesh",
        "triangles",
        "pieces",
        "per triangle",
        "paper: triangles",
        "pieces",
        "per triangle",
    ]);
    for row in rows {
        table.add_row([
            row.model.to_owned(),
            row.source.clone(),
            row.triangles.to_string(),
            row.pieces.to_string(),
            format!("{:.3}", row.pieces_per_triangle),
            row.paper_triangles.to_string(),
            row.paper_pieces.to_string(),
            format!("{:.3}", row.paper_pieces_per_triangle),
        ]);
    }
    for column in 2..8 {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.to_string()
}
