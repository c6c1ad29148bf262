//! The page of `palpus clearance`: clearance along the poses, and pictures of the tightest poses.

use std::sync::Arc;

use anyhow::Context;
use palpus::algebra::Pose;
use palpus_window::{BodyPart, Camera, Look, Scene, ShownBody, Solid, Style, Theme, Unit, View, paint};

use super::html::{Html, Table};
use crate::clearance::{Place, Shown};
use crate::plots::{BLUE, Figure, Mark, Panel, Series, bands, svg};

/// Size of the pictures, pixels.
const WIDTH: usize = 960;
const HEIGHT: usize = 600;

/// Returns the whole page.
pub(crate) fn clearance_page(shown: &Shown<'_>) -> anyhow::Result<String> {
    let [a, b] = &shown.names;
    let title = format!("Clearance of {a} and {b}");
    let mut page = Html::new();
    page.element("h1", "", |h| {
        h.text(&title);
    });
    for note in shown.notes {
        page.element("p", "", |p| {
            p.text(note);
        });
    }
    page.section("along", "Clearance along the placements", |section| {
        section.plot(
            &svg(&figure(shown)),
            "Distance where the bodies are apart; minus the depth (upper bound) where they overlap (shaded). Letters mark the tightest places.",
        );
    });
    let solids = shown.bodies.map(|body| Arc::new(Solid::of_body(body)));
    let mut pictures = Vec::new();
    for place in shown.tightest {
        let paint_in = |theme| picture(&solids, &shown.poses[place.frame], theme);
        pictures.push((paint_in(Theme::Light)?, paint_in(Theme::Dark)?));
    }
    page.section("tightest", "The tightest places", |section| {
        section.table(&table(shown.tightest));
        for ((k, place), (light, dark)) in shown.tightest.iter().enumerate().zip(&pictures) {
            let words =
                format!("{}: frame {}, clearance {:.4e}, {}", letter(k), place.frame, place.clearance, place.state);
            section.picture_pair(light, dark, &words);
        }
    });
    Ok(page.page(&title))
}

fn figure(shown: &Shown<'_>) -> Figure {
    let points = || shown.clearances.iter().enumerate().map(|(frame, &clearance)| (frame as f64, clearance));
    let marks = shown.tightest.iter().enumerate();
    Figure {
        bands: bands(points().map(|(x, clearance)| (x, clearance < 0.0))),
        marks: marks.map(|(k, place)| Mark { x: place.frame as f64, label: letter(k) }).collect(),
        ..Figure::new(
            "",
            "frame",
            vec![Panel::lines("Clearance", "model units", vec![Series::new("clearance", BLUE, points().collect())])],
        )
    }
}

fn table(tightest: &[Place]) -> Table {
    let head = ["place", "state", "frame", "clearance", "depth at least", "way out x", "y", "z"];
    let row = |(k, place): (usize, &Place)| {
        let number = |x: f64| if place.clearance < 0.0 { format!("{x:.4e}") } else { String::new() };
        let [x, y, z] = place.way_out.map(number);
        vec![
            letter(k),
            place.state.to_owned(),
            place.frame.to_string(),
            format!("{:.4e}", place.clearance),
            number(place.depth_lower),
            x,
            y,
            z,
        ]
    };
    Table {
        title: "Lengths are in model units. Moving A along the way out (in B's frame) separates the bodies.".to_owned(),
        head: head.map(str::to_owned).to_vec(),
        rows: tightest.iter().enumerate().map(row).collect(),
        naming: 2,
    }
}

/// Returns the label of place `k`: A, B, …, and numbers after Z.
fn letter(k: usize) -> String {
    u8::try_from(k).ok().filter(|&k| k < 26).map_or_else(|| (k + 1).to_string(), |k| char::from(b'A' + k).to_string())
}

fn picture(solids: &[Arc<Solid>; 2], pose_ba: &Pose, theme: Theme) -> anyhow::Result<Vec<u8>> {
    let shown = |part: BodyPart, which: usize, pose: Pose, translucent: bool| ShownBody {
        part,
        solid: Arc::clone(&solids[which]),
        pose,
        colour: part.colour(theme),
        look: Look { translucent, ..Look::default() },
    };
    let bodies =
        vec![shown(BodyPart::Probe, 0, *pose_ba, false), shown(BodyPart::Environment, 1, Pose::IDENTITY, true)];
    let scene = Scene { bodies, unit: Unit::Model, ..Scene::default() };
    let camera = Camera::framing(scene.corners(), View::Oblique, WIDTH as f64 / HEIGHT as f64);
    let style = Style { theme, words: false, ..Style::default() };
    paint(&scene, &camera, &style, WIDTH, HEIGHT).small_png().context("a picture could not be packed")
}
