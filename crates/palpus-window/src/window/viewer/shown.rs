//! The scene of a model: its bodies (with a picked piece, moved apart and cut), and the plane's
//! marks.

use std::sync::Arc;

use eframe::egui;
use palpus::algebra::Pose;
use palpus::body::Body;

use super::Viewer;
use crate::gauss::piece_colours;
use crate::marks::{Triangles, rod};
use crate::picture::Rgb;
use crate::piece::piece_solids;
use crate::scene::{BodyPart, Look, ShownBody};
use crate::solid::Solid;
use crate::style::Theme;

/// Largest number of drawn lines of the cut; more would be too slow.
const MOST_CUT: usize = 1500;
/// Thickness of the plane's frame and of the cut, relative to the body's size.
const FRAME_THICKNESS: f64 = 1.2e-3;
const CUT_THICKNESS: f64 = 1.0e-3;

impl Viewer {
    /// Draws the scene in the middle (step 3).
    pub(super) fn middle(&mut self, ui: &mut egui::Ui) {
        let area = self.view.place(ui, &self.scene);
        self.view.navigate(ui, &area);
        if area.response.clicked()
            && let Some(at) = area.response.interact_pointer_pos()
        {
            let ray = self.view.ray(&area, at);
            let met = self.scene.bodies.iter().filter_map(|body| {
                let (origin, direction) =
                    (body.pose.inverse().point(ray.origin), body.pose.inverse().vector(ray.direction));
                body.solid.first_met(origin, direction)
            });
            let nearest = met.min_by(|a, b| a.0.total_cmp(&b.0));
            self.pick(nearest.map(|(_, piece)| piece));
        }
        for (k, body) in self.scene.bodies.iter_mut().enumerate() {
            let picked = k > 0;
            body.look = Look {
                pieces: self.look.pieces && !picked,
                // The picked piece and the cut stay visible.
                translucent: !picked
                    && (self.look.translucent || (self.piece.is_some() && self.spread == 0.0) || self.cut),
                ..self.look
            };
        }
        let marks = if self.cut { self.plane_marks() } else { Vec::new() };
        self.view.draw(ui, &area, &self.scene, &self.style, &marks);
    }

    /// Draws the plane's frame, and the lines in which the plane cuts the mesh.
    fn plane_marks(&self) -> Vec<(Triangles, Rgb)> {
        let colours = self.style.theme.colours();
        let corners = self.plane.corners(&self.body);
        let size = self.body.size();
        let frame: Triangles =
            (0..4).flat_map(|k| rod(corners[k], corners[(k + 1) % 4], FRAME_THICKNESS * size)).collect();
        let mut marks = vec![(frame, colours.faint)];
        if self.spread == 0.0 {
            let mesh = self.body.mesh();
            let triangles = (0..mesh.triangles().len() as u32).map(|t| mesh.triangle_points(t).to_vec());
            let cut = self.plane.cut(triangles);
            if cut.len() <= MOST_CUT {
                let at = |[u, v]: [f64; 2]| self.plane.point(u, v);
                let cut = cut.into_iter().flat_map(|[a, b]| rod(at(a), at(b), CUT_THICKNESS * size)).collect();
                marks.push((cut, colours.force));
            }
        }
        marks
    }
}

/// Returns the bodies of [`Viewer::scene`].
pub(super) fn bodies(body: &Body, spread: f64, piece: Option<u32>, look: Look, theme: Theme) -> Vec<ShownBody> {
    let environment = BodyPart::Environment.colour(theme);
    let all = if spread > 0.0 { Solid::exploded(body, spread) } else { Solid::of_body(body) };
    let shown = |solid: Solid, pose, colour, look| ShownBody {
        part: BodyPart::Environment,
        solid: Arc::new(solid),
        pose,
        colour,
        look,
    };
    let Some(piece) = piece else { return vec![shown(all, Pose::IDENTITY, environment, look)] };
    let pose = Pose { translation: Solid::shift(body, piece, spread), ..Pose::IDENTITY };
    let [own, hull] = piece_solids(body, piece);
    let [own_colour, hull_colour] = piece_colours(theme);
    let plain = Look::default();
    vec![
        shown(all.without(piece), Pose::IDENTITY, environment, look),
        shown(own, pose, own_colour, plain),
        shown(hull, pose, hull_colour, plain),
    ]
}
