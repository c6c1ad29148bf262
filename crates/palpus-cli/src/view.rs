//! `palpus view`: shows a model, its pieces, the Gauss map of a piece, or the felt depth on a
//! plane, as a picture or in a window.

use std::process::ExitCode;
use std::sync::Arc;

use anyhow::bail;
use palpus::body::{Body, BodySettings};
use palpus_io::Threads;
use palpus_window::{Axis, Section, SectionPlane, richest_piece};
#[cfg(feature = "window")]
use palpus_window::{Theme, Unit, Viewed};

use crate::args::{AxisName, ViewArguments};
use crate::{bodies, picture, view_window};

pub(crate) fn view(arguments: &ViewArguments) -> anyhow::Result<ExitCode> {
    let Some(file) = &arguments.screenshot else { return in_window(arguments) };
    let body = Arc::new(bodies::prepare_file(&arguments.model, &BodySettings::default())?.body);
    let (model, asked) = (&arguments.model, &arguments.picture);
    if let Some(piece) = arguments.gauss {
        picture::write_gauss(model, &body, chosen_piece(&body, piece)?, file, asked)?;
    } else if arguments.depth {
        let plane = chosen_plane(&body, arguments)?;
        let section = Section::of(&body, plane, arguments.fineness as usize, &Threads::all(), &mut |_| ())?;
        picture::write_section(model, &body, &section, file, asked)?;
    } else {
        picture::write_model(model, &body, arguments.exploded, file, asked)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Alternatives without a window.
const INSTEAD: &str = "--screenshot FILE makes a picture without one";

#[cfg(feature = "window")]
fn in_window(arguments: &ViewArguments) -> anyhow::Result<ExitCode> {
    view_window::expect_one(INSTEAD)?;
    let body = bodies::prepare_file(&arguments.model, &BodySettings::default())?.body;
    let piece = arguments.gauss.map(|piece| chosen_piece(&body, piece)).transpose()?;
    let plane = if arguments.depth { Some(chosen_plane(&body, arguments)?) } else { None };
    let viewed = Viewed {
        body: Arc::new(body),
        name: picture::model_name(&arguments.model),
        unit: Unit::Model,
        spread: arguments.exploded.unwrap_or(0.0),
        piece,
        plane,
        theme: Theme::Dark,
    };
    view_window::show_model(viewed, INSTEAD)?;
    Ok(ExitCode::SUCCESS)
}

#[cfg(not(feature = "window"))]
fn in_window(_: &ViewArguments) -> anyhow::Result<ExitCode> {
    view_window::expect_one(INSTEAD)?;
    Ok(ExitCode::SUCCESS)
}

/// Returns the requested piece, or the piece with most faces.
fn chosen_piece(body: &Body, asked: Option<u32>) -> anyhow::Result<u32> {
    let count = body.polytopes().len();
    match (asked, richest_piece(body)) {
        (Some(piece), _) if (piece as usize) < count => Ok(piece),
        (Some(piece), Some(_)) => bail!("--gauss {piece}: there is no such piece; the pieces are 0 to {}", count - 1),
        (None, Some(richest)) => Ok(richest),
        (_, None) => bail!("this model has no pieces"),
    }
}

/// Returns the requested plane, or a plane through the middle.
fn chosen_plane(body: &Body, arguments: &ViewArguments) -> anyhow::Result<SectionPlane> {
    let axis = arguments.axis.into();
    let [low, middle, high] = [0.0, 0.5, 1.0].map(|part| SectionPlane::through(body, axis, part));
    match arguments.offset {
        None => Ok(middle),
        Some(offset) if (low.offset..=high.offset).contains(&offset) => Ok(SectionPlane { axis, offset }),
        Some(offset) => {
            let (low, high) = (low.offset, high.offset);
            bail!("--offset {offset}: the model reaches from {low} to {high} along {}", axis.name())
        }
    }
}

impl From<AxisName> for Axis {
    fn from(name: AxisName) -> Self {
        match name {
            AxisName::X => Self::X,
            AxisName::Y => Self::Y,
            AxisName::Z => Self::Z,
        }
    }
}
