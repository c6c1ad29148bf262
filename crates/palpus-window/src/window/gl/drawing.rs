//! The content of one frame as numbers for the graphics library.

use std::collections::HashMap;

use glam::{DMat4, DVec3, DVec4};

use crate::camera::Camera;
use crate::marks::{Patch, Triangles};
use crate::picture::Rgb;
use crate::solid::Solid;
use crate::style::{linear, piece_colour};
use crate::xray::XRay;

/// Number of values of a corner: its position, normal, colour and sides.
pub(super) const CORNER: usize = 12;

/// Drawing of one body in a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DrawnBody {
    /// Index of the solid.
    pub(crate) solid: usize,
    /// Transformation from the body's frame to the view's frame.
    pub(crate) model_view: DMat4,
    /// Colour of the body, if its pieces have no colours.
    pub(crate) colour: Rgb,
    pub(crate) pieces: bool,
    pub(crate) wireframe: bool,
    /// Opacity seen along the normal and at a grazing angle, if the body is translucent.
    pub(crate) glass: Option<(f64, f64)>,
    /// True if the body is translucent only where it hides a probe.
    pub(crate) xray: bool,
}

impl DrawnBody {
    /// True if the whole body is translucent.
    pub(super) fn is_glass(&self) -> bool {
        self.glass.is_some() && !self.xray
    }
}

/// Which part of a body is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BodyPart {
    /// All of it, translucent if the body is.
    All = 0,
    /// The opaque pixels of a body that is transparent around a probe.
    Solid = 1,
    /// The translucent pixels of a body that is transparent around a probe.
    Glass = 2,
    /// A patch, whose corners have their opacity.
    Patch = 3,
    /// All of it, opaque.
    Opaque = 4,
}

/// One frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Drawing {
    pub(crate) projection: DMat4,
    pub(crate) bodies: Vec<DrawnBody>,
    /// Probes around which bodies are transparent, in pixels from the lower left corner.
    pub(crate) xrays: Vec<XRay>,
    /// Corners of the marks, view's frame.
    pub(crate) marks: Vec<f32>,
    /// Corners of the patches, view's frame.
    pub(crate) patches: Vec<f32>,
}

impl Drawing {
    /// Adds a mark whose triangles are in the world frame.
    pub(crate) fn mark(&mut self, view: &DMat4, triangles: &Triangles, colour: Rgb) {
        let colour = linear(colour);
        for corner in triangles.iter().flatten() {
            let (point, normal) = (view.transform_point3(corner.point), view.transform_vector3(corner.normal));
            push_corner(&mut self.marks, point, normal, colour, DVec3::ONE);
        }
    }

    /// Adds a patch of `radius` metres, slightly before the surface on which it lies.
    pub(crate) fn patch(&mut self, view: &DMat4, patch: &Patch, radius: f64) {
        let colour = linear(patch.colour);
        let normal = view.transform_vector3(patch.normal);
        for (point, cover) in patch.triangles(radius).into_iter().flatten() {
            let point = view.transform_point3(point);
            let nearer = point - point.normalize_or(DVec3::NEG_Z) * (PATCH_BEFORE * radius);
            push_corner(&mut self.patches, nearer, normal, colour, DVec3::splat(cover));
        }
    }
}

/// Distance from a patch to its surface, in radii: patches are flat, but surfaces may be curved.
const PATCH_BEFORE: f64 = 0.5;

/// Returns the transformation from the view's frame to a picture `aspect` times as wide as it is
/// high.
pub(crate) fn projection(camera: &Camera, aspect: f64) -> DMat4 {
    let (nearest, farthest) = (camera.nearest(), camera.distance * FARTHEST);
    let (tall, deep) = (camera.half_opening(), nearest - farthest);
    DMat4::from_cols(
        DVec4::new(1.0 / (tall * aspect), 0.0, 0.0, 0.0),
        DVec4::new(0.0, 1.0 / tall, 0.0, 0.0),
        DVec4::new(0.0, 0.0, (farthest + nearest) / deep, -1.0),
        DVec4::new(0.0, 0.0, 2.0 * farthest * nearest / deep, 0.0),
    )
}

/// Far limit of the view, relative to the distance of the target.
const FARTHEST: f64 = 40.0;

/// Returns the transformation from the world to the view's frame.
pub(crate) fn view(camera: &Camera) -> DMat4 {
    let [right, up, back] = camera.axes();
    let axes = glam::DMat3::from_cols(right, up, back).transpose();
    DMat4::from_mat3(axes) * DMat4::from_translation(-camera.eye())
}

fn push_corner(corners: &mut Vec<f32>, point: DVec3, normal: DVec3, colour: DVec3, sides: DVec3) {
    for part in [point, normal, colour, sides] {
        corners.extend(part.as_vec3().to_array());
    }
}

/// Returns the corners of a solid, each once, and the three corner indices of each triangle.
pub(super) fn shared_corners(solid: &Solid, piece_lightness: f64) -> (Vec<f32>, Vec<u32>) {
    let mut numbers = HashMap::new();
    let (mut corners, mut indices) = (Vec::new(), Vec::with_capacity(solid.triangles.len() * 3));
    for ((triangle, normals), piece) in solid.triangles.iter().zip(&solid.normals).zip(&solid.pieces) {
        for k in 0..3 {
            let normal = normals[k].as_vec3().to_array().map(f32::to_bits);
            let next = numbers.len() as u32;
            let number = *numbers.entry((triangle[k], *piece, normal)).or_insert(next);
            if number == next {
                let colour = piece_colour(*piece, piece_lightness);
                push_corner(&mut corners, solid.vertices[triangle[k] as usize], normals[k], colour, DVec3::ONE);
            }
            indices.push(number);
        }
    }
    (corners, indices)
}

/// Returns the corners of a solid, triangle by triangle, each with the number of its opposite side.
pub(super) fn apart_corners(solid: &Solid, piece_lightness: f64) -> Vec<f32> {
    let mut corners = Vec::with_capacity(solid.triangles.len() * 3 * CORNER);
    for ((triangle, normals), piece) in solid.triangles.iter().zip(&solid.normals).zip(&solid.pieces) {
        let colour = piece_colour(*piece, piece_lightness);
        for (k, side) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
            push_corner(&mut corners, solid.vertices[triangle[k] as usize], normals[k], colour, side);
        }
    }
    corners
}
