//! Paints one moment for a page, once in light and once in dark colours. The picture shows
//! everything or only the surroundings of the contacts. The files have few colours.

use std::f64::consts::FRAC_PI_2;

use anyhow::Context;
use glam::DVec3;
use palpus_window::{Camera, Look, Moment, Scene, Style, Theme, View, paint};

use crate::numbers::{number_of, said};
use crate::seen::{LEAST_FORCE_SCALE, Seen, force_scale};
use crate::stage::Stage;

/// One picture in light and in dark colours, as PNG files.
pub(crate) struct Shots {
    pub(crate) light: Vec<u8>,
    pub(crate) dark: Vec<u8>,
}

/// Part of the scene in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Frame {
    /// Both bodies.
    Whole,
    /// The surroundings of the contacts.
    Contacts,
}

/// View of a moment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shot {
    pub(crate) frame: Frame,
    pub(crate) view: View,
    /// Torque that is drawn with the longest arrow, N·m.
    pub(crate) torque_max: f64,
    /// Style of the paper's Figure 4: only the forces of the clusters, in the colours of the
    /// contacts.
    pub(crate) as_in_the_paper: bool,
}

/// Size of the pictures, pixels.
const WIDTH: usize = 960;
const HEIGHT: usize = 600;
/// Smallest half width of the picture about the contacts, as a share of the probe's size.
const LEAST_REACH: f64 = 0.16;
/// Margin beyond the farthest contact, as a factor of its distance.
const MARGIN: f64 = 1.4;

/// Paints `moment` of the stage.
pub(crate) fn of_moment(stage: &Stage, moment: &Moment, shot: &Shot) -> anyhow::Result<Shots> {
    let seen = Seen::of(stage);
    let paint_in = |theme: Theme| -> anyhow::Result<Vec<u8>> {
        // The force on the hand has an arrow too, except in the paper's style.
        let of_hand = if shot.as_in_the_paper { 0.0 } else { moment.wrench.force.length() };
        let look = Look { xray: true, ..Look::default() };
        let scene = Scene {
            force_scale: force_scale(moment, of_hand),
            torque_scale: shot.torque_max,
            ..seen.scene_at(moment.clone(), theme, look)
        };
        let aspect = WIDTH as f64 / HEIGHT as f64;
        let mut camera = Camera::framing(scene.corners(), shot.view, aspect);
        if let Some(corners) = about_contacts(stage, moment).filter(|_| shot.frame == Frame::Contacts) {
            look_across(&mut camera, stage, moment);
            camera.frame(corners.into_iter(), aspect);
        }
        // The labels are in the text beside the picture, where they are legible at any size.
        let all = Style { theme, words: false, ..Style::default() };
        let paper = Style { clusters_as_contacts: true, wrench: false, anchors: false, ..all };
        let style = if shot.as_in_the_paper { paper } else { all };
        paint(&scene, &camera, &style, WIDTH, HEIGHT).small_png().context("a picture could not be packed")
    };
    Ok(Shots { light: paint_in(Theme::Light)?, dark: paint_in(Theme::Dark)? })
}

/// Turns the camera so that sideways forces lie across the picture, and vertical forces stand
/// upright in it.
fn look_across(camera: &mut Camera, stage: &Stage, moment: &Moment) {
    let forces = moment.clusters.iter().map(|cluster| stage.environment_pose.vector(cluster.force));
    let sideways = forces.sum::<DVec3>().with_z(0.0);
    camera.pitch = PITCH;
    if sideways.length() < LEAST_FORCE_SCALE * SIDEWAYS {
        return;
    }
    let across = [FRAC_PI_2, -FRAC_PI_2].map(|turn| sideways.y.atan2(sideways.x) + turn);
    // Two directions are possible; the camera takes the direction with the smaller turn.
    let from = camera.yaw;
    let turn = |yaw: f64| (yaw - from).sin().atan2((yaw - from).cos()).abs();
    camera.yaw = if turn(across[0]) <= turn(across[1]) { across[0] } else { across[1] };
}

/// Elevation of the camera in close-up pictures, rad.
const PITCH: f64 = 0.3;
/// Smallest sideways force that turns the view, as a share of the smallest force with an arrow.
const SIDEWAYS: f64 = 0.2;

/// Returns the corners of a box around all contacts, world.
fn about_contacts(stage: &Stage, moment: &Moment) -> Option<Vec<DVec3>> {
    let points: Vec<DVec3> =
        moment.contacts.iter().map(|contact| stage.environment_pose.point(contact.point)).collect();
    let low = points.iter().copied().reduce(DVec3::min)?;
    let high = points.iter().copied().reduce(DVec3::max)?;
    let half = (MARGIN * 0.5 * (high - low).length()).max(LEAST_REACH * stage.probe.size());
    let middle = 0.5 * (low + high);
    let sign = |bit: usize| if bit == 0 { -half } else { half };
    Some((0..8).map(|k| middle + DVec3::new(sign(k & 1), sign(k & 2), sign(k & 4))).collect())
}

/// Returns a description of the picture.
pub(super) fn caption(moment: &Moment) -> String {
    format!(
        "{} s: {} in {}, {} N and {} mN·m at the grip",
        said(moment.time, 4),
        number_of(moment.contact_count as u64, "contact"),
        number_of(moment.clusters.len() as u64, "cluster"),
        said(moment.wrench.force.length(), 3),
        said(moment.wrench.torque.length() * 1e3, 3)
    )
}
