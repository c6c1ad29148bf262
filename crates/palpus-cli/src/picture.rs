//! Pictures of runs and models without a display: from the arguments to a scene and a PNG file.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, bail};
use glam::DVec3;
use palpus::algebra::Pose;
use palpus::body::Body;
use palpus_window::{
    BodyPart, Camera, Look, Moment, Picture, PieceOf, Scene, Section, SectionOf, ShownBody, Solid, Style, Theme, Unit,
    View, before_surface_faces, paint, paint_gauss, paint_section,
};

use crate::args::{Direction, PictureArguments};
use crate::seen::{Seen, force_scale};
use crate::stage::Stage;
use crate::{files, output};

/// Draws a model. `spread`: the pieces are moved apart by this share of their distance from the
/// middle.
pub(crate) fn write_model(
    model: &Path,
    body: &Body,
    spread: Option<f64>,
    file: &Path,
    asked: &PictureArguments,
) -> anyhow::Result<()> {
    let style = style(asked);
    let solid = match spread {
        Some(spread) => Solid::exploded(body, spread),
        None => Solid::of_body(body),
    };
    let colour = BodyPart::Probe.colour(style.theme);
    let look = Look { pieces: !asked.plain, wireframe: asked.wireframe, ..Look::default() };
    let scene = Scene {
        bodies: vec![ShownBody { part: BodyPart::Probe, solid: Arc::new(solid), pose: Pose::IDENTITY, colour, look }],
        title: model_name(model),
        caption: format!("{} triangles in {} convex pieces", body.mesh().triangles().len(), body.pieces().len()),
        unit: Unit::Model,
        ..Scene::default()
    };
    write(&scene, asked, &style, file)
}

/// Returns the name of a model file in pictures.
pub(crate) fn model_name(model: &Path) -> String {
    model.file_name().unwrap_or(model.as_os_str()).to_string_lossy().into_owned()
}

/// Draws a piece of a model and its Gauss map.
pub(crate) fn write_gauss(
    model: &Path,
    body: &Body,
    piece: u32,
    file: &Path,
    asked: &PictureArguments,
) -> anyhow::Result<()> {
    let [width, height] = asked.size.0;
    // Without a given side, shows the side of the piece that can be touched.
    let from = match asked.from {
        Direction::Oblique => before_surface_faces(body, piece),
        side => Camera::framing([DVec3::ZERO].into_iter(), side.into(), 1.0),
    };
    let shown = PieceOf { body, piece, name: &model_name(model), unit: Unit::Model };
    keep(&paint_gauss(&shown, &from, &style(asked), width, height), file)
}

/// Draws the felt depth of a model on a plane.
pub(crate) fn write_section(
    model: &Path,
    body: &Body,
    section: &Section,
    file: &Path,
    asked: &PictureArguments,
) -> anyhow::Result<()> {
    let [width, height] = asked.size.0;
    let shown = SectionOf { section, body, name: &model_name(model), unit: Unit::Model };
    keep(&paint_section(&shown, &style(asked), width, height), file)
}

/// Draws a run: the bodies in the world, and contacts and forces at `moment`.
pub(crate) fn write_run(
    name: &str,
    stage: &Stage,
    torque_max: f64,
    moment: Moment,
    file: &Path,
    asked: &PictureArguments,
) -> anyhow::Result<()> {
    let style = style(asked);
    let look = Look { pieces: asked.pieces, wireframe: asked.wireframe, xray: !asked.plain, ..Look::default() };
    let scene = Scene {
        force_scale: force_scale(&moment, moment.wrench.force.length()),
        torque_scale: torque_max,
        title: name.to_owned(),
        caption: caption(&moment),
        ..Seen::of(stage).scene_at(moment, style.theme, look)
    };
    write(&scene, asked, &style, file)
}

fn caption(moment: &Moment) -> String {
    let counted = |n: usize, one: &str| if n == 1 { format!("1 {one}") } else { format!("{n} {one}s") };
    format!(
        "{:.3} s · {} in {} · {:.2} N · {:.1} mN·m",
        moment.time,
        counted(moment.contact_count, "contact"),
        counted(moment.clusters.len(), "cluster"),
        moment.wrench.force.length(),
        moment.wrench.torque.length() * 1e3
    )
}

fn style(asked: &PictureArguments) -> Style {
    Style { theme: if asked.dark { Theme::Dark } else { Theme::Light }, words: !asked.no_words, ..Style::default() }
}

fn write(scene: &Scene, asked: &PictureArguments, style: &Style, file: &Path) -> anyhow::Result<()> {
    if !(asked.zoom > 0.0 && asked.zoom.is_finite()) {
        bail!("--zoom {} is not a valid factor; 2 shows everything twice as large", asked.zoom);
    }
    let [width, height] = asked.size.0;
    let mut camera = Camera::framing(scene.corners(), asked.from.into(), width as f64 / height as f64);
    camera.zoom(asked.zoom);
    keep(&paint(scene, &camera, style, width, height), file)
}

/// Writes a picture, creates its folder if necessary, and prints its path.
fn keep(picture: &Picture, file: &Path) -> anyhow::Result<()> {
    files::make_folder_of(file)?;
    picture.write_png(file).with_context(|| format!("{} could not be written; name another file", file.display()))?;
    output::note(format!("picture: {}", file.display()));
    Ok(())
}

impl From<Direction> for View {
    fn from(direction: Direction) -> Self {
        match direction {
            Direction::Oblique => Self::Oblique,
            Direction::Front => Self::Front,
            Direction::Back => Self::Back,
            Direction::Left => Self::Left,
            Direction::Right => Self::Right,
            Direction::Top => Self::Top,
            Direction::Bottom => Self::Bottom,
        }
    }
}
