//! Draws a scene as a picture.
//!
//! 1. Every pixel has four samples.
//! 2. The *ground*: its grid, and the shadow of the bodies.
//! 3. *Bodies* in one layer, with outlines where they end.
//! 4. *Translucent bodies*, the parts of bodies that hide a probe, and the probe at the device's
//!    pose if the proxy has another pose. The nearest inner sides of these bodies are drawn first,
//!    then their nearest outer sides. Surfaces that are seen at a grazing angle are more opaque, as
//!    with glass.
//! 5. *Marks* in a separate layer. Marks that a body hides stay visible in a paler colour.
//! 6. Samples are averaged to pixels, and text is drawn on top.
//!
//! The light comes from a sky and from two lamps that move with the camera, so a surface that faces
//! the viewer is never dark.

mod words;

use glam::{DVec2, DVec3};
use palpus::algebra::Pose;

use crate::camera::Camera;
use crate::ground::Ground;
use crate::letters::{self, Setting};
use crate::marks::{Dot, Marks, NOMINAL_HEIGHT, Patch, Triangles};
use crate::picture::{Picture, Rgb};
use crate::raster::{Corner, Facing, Fragment, Layer, Lens, Light};
use crate::scene::{Look, Scene, ShownBody};
use crate::style::{Colours, Style, encoded, linear, piece_colour};
use crate::xray::XRay;
pub(crate) use words::round_length;
use words::{WORD_SIZE, words};

/// Number of samples along each side of a pixel.
const FINENESS: usize = 2;
/// Width of the lines of a wireframe, pixels.
const WIRE_WIDTH: f64 = 0.7;
/// Distance from a patch to its point, towards the viewer, in radii: a patch is flat, but the
/// surface may be curved.
const PATCH_BEFORE: f64 = 0.5;
/// Width of the lines of the grid, pixels.
const GRID_WIDTH: f64 = 1.1;
/// Strength of the lines of the grid.
const GRID_LINE: f64 = 0.17;
/// Strength of the lines through the middle of the grid.
const AXIS_LINE: f64 = 0.34;
/// Visibility of a mark behind a body.
pub(crate) const HIDDEN: f32 = 0.38;
/// A mark counts as in front of a surface if its depth times this value is less than the depth of
/// the surface. Contacts lie between two surfaces, so they would otherwise be hidden.
const BEFORE: f32 = 0.997;
/// Opacity of the outlines of bodies.
const OUTLINE_STRENGTH: f64 = 0.6;
/// Opacity of the edges of the mesh.
const WIRE_STRENGTH: f64 = 0.55;
/// Opacity of a translucent body seen along its normal, and at a grazing angle.
pub(crate) const COVER_SQUARE: f64 = 0.27;
pub(crate) const COVER_ALONG: f64 = 0.72;
/// Opacity of the probe at the device's pose.
pub(crate) const GHOST_COVER: f64 = 0.35;

/// Draws `scene` as seen by `camera`, `width` by `height` pixels.
pub fn paint(scene: &Scene, camera: &Camera, style: &Style, width: usize, height: usize) -> Picture {
    let colours = style.theme.colours();
    let scale = height as f64 / NOMINAL_HEIGHT;
    let lens = Lens::new(camera, width * FINENESS, height * FINENESS);
    let samples = scale * FINENESS as f64;
    let size = [width, height].map(|pixels| (pixels * FINENESS) as f64);
    let sees_through = scene.bodies.iter().any(|body| body.look.xray);
    let xrays = if sees_through { scene.xrays(camera, size, samples) } else { Vec::new() };
    let brush = Brush { lens, colours, samples, xrays };

    let mut opaque = Layer::new(width * FINENESS, height * FINENESS);
    for (k, body) in scene.bodies.iter().enumerate().filter(|(_, body)| !body.look.translucent) {
        let cover = if body.look.xray { Cover::AroundProbes(Part::Solid) } else { Cover::Whole };
        brush.body(&mut opaque, body, &body.pose, k as u16 + 1, Facing::Any, cover);
    }
    let is_cut = |at: DVec2| brush.xrays.iter().any(|xray| xray.is_edge(at));
    opaque.outline(linear(colours.outline), OUTLINE_STRENGTH, is_cut);
    let mut light = background(&colours, opaque.width, opaque.height);
    if let Some(ground) = Ground::below(scene).filter(|ground| ground.is_seen_from(camera.eye())) {
        brush.ground(&mut light, opaque.width, scene, &ground);
    }
    cover(&mut light, &opaque, |_| 1.0);

    let mut layer = Layer::new(opaque.width, opaque.height);
    for facing in [Facing::Back, Facing::Front] {
        layer.restart_before(&opaque);
        brush.translucent(&mut layer, scene, facing);
        if facing == Facing::Front {
            layer.outline(linear(colours.outline), OUTLINE_STRENGTH, is_cut);
        }
        cover(&mut light, &layer, |_| 1.0);
    }
    if scene.moment.is_some() {
        let marks = brush.marks_of(scene, style);
        brush.patches(&mut light, &opaque, &marks.patches);
        let mut layer = Layer::new(opaque.width, opaque.height);
        brush.marks(&mut layer, &marks);
        layer.outline(linear(colours.outline), OUTLINE_STRENGTH, |_| false);
        cover(&mut light, &layer, |k| if layer.nearness[k] >= opaque.nearness[k] * BEFORE { 1.0 } else { HIDDEN });
    }
    let mut picture = pixels(&light, width, height);
    if style.words {
        let values = if scene.moment.is_some() { brush.marks_of(scene, style).labels } else { Vec::new() };
        for value in values {
            if let Some(at) = camera.project(value.point, width as f64, height as f64) {
                let (x, y) = (at.x + 0.7 * WORD_SIZE * scale, at.y + 0.4 * WORD_SIZE * scale);
                let size = WORD_SIZE * scale;
                letters::write(
                    &mut picture,
                    &value.words,
                    &Setting { x, y, size, colour: value.colour, halo: colours.above },
                );
            }
        }
        words(&mut picture, scene, camera, style, scale);
    }
    picture
}

/// Inputs of all drawing steps.
struct Brush {
    lens: Lens,
    colours: Colours,
    /// Samples in a nominal pixel.
    samples: f64,
    /// Probes around which bodies are transparent, in samples.
    xrays: Vec<XRay>,
}

/// Opacity of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cover {
    Whole,
    /// Opacity seen along the normal, and at a grazing angle.
    Glass(f64, f64),
    /// Transparent where it hides a probe.
    AroundProbes(Part),
}

/// The translucent part of a body around probes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Solid,
    Glass,
}

impl Brush {
    /// Draws the grid and the shadow.
    fn ground(&self, light: &mut [[f32; 3]], width: usize, scene: &Scene, ground: &Ground) {
        let shadow = ground.shadow(scene.bodies.iter().map(|body| (&*body.solid, body.pose)));
        let (shade, ink) = (linear(self.colours.shadow), linear(self.colours.ink));
        let half = 0.5 * GRID_WIDTH * self.samples;
        for (k, light) in light.iter_mut().enumerate() {
            let at = DVec2::new((k % width) as f64 + 0.5, (k / width) as f64 + 0.5);
            let Some(point) = self.lens.on_plane(at, ground.middle, DVec3::Z) else { continue };
            let mut mix = |colour: DVec3, part: f64| {
                for (under, over) in light.iter_mut().zip(colour.to_array()) {
                    *under += (over as f32 - *under) * part as f32;
                }
            };
            mix(shade, self.colours.shade * shadow.at(point));
            let strength = ground.strength(point);
            if strength > 0.0 {
                // Distance in samples to the nearest line of each kind, from the positions of
                // neighbouring samples.
                let next =
                    |step: DVec2| self.lens.on_plane(at + step, ground.middle, DVec3::Z).unwrap_or(point) - point;
                let (right, below) = (next(DVec2::X), next(DVec2::Y));
                let line = |axis: usize| {
                    let cells = (point[axis] - ground.middle[axis]) / ground.cell;
                    let away = (cells - cells.round()).abs() * ground.cell;
                    let sample = right[axis].hypot(below[axis]).max(f64::MIN_POSITIVE);
                    let most = if cells.round() == 0.0 { AXIS_LINE } else { GRID_LINE };
                    most * (half + 0.5 - away / sample).clamp(0.0, 1.0)
                };
                mix(ink, strength * line(0).max(line(1)));
            }
        }
    }

    /// Draws a body, or one of its sides.
    fn body(&self, layer: &mut Layer, body: &ShownBody, pose: &Pose, name: u16, facing: Facing, cover: Cover) {
        let solid = &body.solid;
        let points: Vec<DVec3> = solid.vertices.iter().map(|v| pose.point(*v)).collect();
        let wire = WIRE_WIDTH * self.samples;
        let (own, outline) = (linear(body.colour), linear(self.colours.outline));
        for ((triangle, normals), &piece) in solid.triangles.iter().zip(&solid.normals).zip(&solid.pieces) {
            let colour = if body.look.pieces { piece_colour(piece, self.colours.piece_lightness) } else { own };
            let corner = |k: usize| Corner { point: points[triangle[k] as usize], normal: pose.vector(normals[k]) };
            layer.triangle(&self.lens, name, [corner(0), corner(1), corner(2)], facing, |fragment| {
                let mut covered = self.covered(cover, fragment)?;
                let mut light = lit(colour, fragment);
                if body.look.wireframe && fragment.side < wire {
                    light = light.lerp(outline, WIRE_STRENGTH);
                    covered = covered.max(WIRE_STRENGTH);
                }
                Some(as_light(light, covered))
            });
        }
    }

    /// Returns the opacity of a fragment; `None` if it is not drawn in this step.
    fn covered(&self, cover: Cover, fragment: &Fragment) -> Option<f64> {
        match cover {
            Cover::Whole => Some(1.0),
            Cover::Glass(square, along) => Some(glass(fragment, square, along)),
            Cover::AroundProbes(part) => {
                let solidities = self.xrays.iter().map(|xray| xray.solidity(fragment.at, fragment.depth));
                let solidity = solidities.fold(1.0, f64::min);
                let glassy = glass(fragment, COVER_SQUARE, COVER_ALONG);
                match part {
                    Part::Solid => (solidity >= 1.0).then_some(1.0),
                    Part::Glass => (solidity < 1.0).then_some(glassy + (1.0 - glassy) * solidity),
                }
            }
        }
    }

    /// Draws one side of all translucent bodies, and of the probe at the device's pose.
    fn translucent(&self, layer: &mut Layer, scene: &Scene, facing: Facing) {
        for (k, body) in scene.bodies.iter().enumerate() {
            let cover = match body.look {
                Look { translucent: true, .. } => Cover::Glass(COVER_SQUARE, COVER_ALONG),
                Look { xray: true, .. } => Cover::AroundProbes(Part::Glass),
                _ => continue,
            };
            self.body(layer, body, &body.pose, k as u16 + 1, facing, cover);
        }
        let (Some(moment), Some(probe), Facing::Front) = (&scene.moment, scene.bodies.first(), facing) else { return };
        if scene.is_device_apart(moment, probe) {
            let pose = scene.moment_pose * moment.device;
            let name = scene.bodies.len() as u16 + 1;
            self.body(layer, probe, &pose, name, facing, Cover::Glass(0.5 * GHOST_COVER, GHOST_COVER));
        }
    }

    fn marks_of(&self, scene: &Scene, style: &Style) -> Marks {
        Marks::of(scene, style, &|point, pixels| self.lens.metres(point, pixels * self.samples), &|_, _| 1.0)
    }

    /// Draws the pressure between bodies over the picture.
    fn patches(&self, light: &mut [[f32; 3]], opaque: &Layer, patches: &[Patch]) {
        for patch in patches {
            let (radius, colour) = (patch.radius * self.samples, linear(patch.colour).as_vec3().to_array());
            let metres = self.lens.metres(patch.point, radius);
            opaque.about(&self.lens, patch.point, radius, |k, at| {
                let Some(point) = self.lens.on_plane(at, patch.point, patch.normal) else { return };
                let depth = -self.lens.point_in_view(point).z - PATCH_BEFORE * metres;
                if 1.0 / depth < f64::from(opaque.nearness[k]) {
                    return;
                }
                let cover = patch.cover_at((point - patch.point).length() / metres) as f32;
                for (under, over) in light[k].iter_mut().zip(colour) {
                    *under += (over - *under) * cover;
                }
            });
        }
    }

    /// Draws dots and arrows.
    fn marks(&self, layer: &mut Layer, marks: &Marks) {
        for dot in &marks.dots {
            self.dot(layer, dot);
        }
        for (triangles, colour) in &marks.solids {
            self.solid_mark(layer, triangles, *colour);
        }
    }

    /// Draws a dot as a small ball in a ring, slightly before its position.
    fn dot(&self, layer: &mut Layer, dot: &Dot) {
        let (inner, outline) = (linear(dot.colour), linear(self.colours.outline));
        let (point, radius) = (dot.point, dot.radius * self.samples);
        let nearer = self.lens.metres(point, 0.5 * radius);
        layer.dot(&self.lens, MARK, point, radius, nearer, |part| {
            as_light(if part > 0.82 { outline } else { inner * (1.0 - 0.35 * part * part) }, 1.0)
        });
    }

    fn solid_mark(&self, layer: &mut Layer, triangles: &Triangles, colour: Rgb) {
        let colour = linear(colour);
        for corners in triangles {
            layer.triangle(&self.lens, MARK, *corners, Facing::Front, |fragment| {
                Some(as_light(lit(colour, fragment), 1.0))
            });
        }
    }
}

/// All marks have the same number in the layer.
const MARK: u16 = 1;

fn as_light(light: DVec3, covered: f64) -> Light {
    [light.x as f32, light.y as f32, light.z as f32, covered as f32]
}

/// Computes the light: a warm lamp from the left, a cool lamp from the right, a sky, a highlight,
/// and a rim at grazing angles.
fn lit(colour: DVec3, fragment: &Fragment) -> DVec3 {
    let n = fragment.normal;
    let key = DVec3::new(-0.45, 0.62, 0.64);
    let fill = DVec3::new(0.80, 0.05, 0.60);
    let slant = 1.0 - n.dot(fragment.to_eye).clamp(0.0, 1.0);
    let sky = DVec3::new(0.27, 0.285, 0.31) + DVec3::new(0.15, 0.16, 0.18) * n.y;
    let lamps =
        DVec3::new(0.70, 0.68, 0.64) * n.dot(key).max(0.0) + DVec3::new(0.22, 0.24, 0.27) * n.dot(fill).max(0.0);
    let half = (key + fragment.to_eye).normalize_or(DVec3::Z);
    let gloss = n.dot(half).max(0.0).powi(48);
    colour * (sky + lamps) + DVec3::splat(0.15 * gloss) + DVec3::new(0.06, 0.065, 0.07) * slant.powi(3)
}

/// Returns the opacity of a translucent surface.
fn glass(fragment: &Fragment, square: f64, along: f64) -> f64 {
    let slant = 1.0 - fragment.normal.dot(fragment.to_eye).clamp(0.0, 1.0);
    square + (along - square) * slant * slant
}

/// Returns a vertical gradient.
fn background(colours: &Colours, width: usize, height: usize) -> Vec<[f32; 3]> {
    let (above, below) = (linear(colours.above), linear(colours.below));
    let mut light = Vec::with_capacity(width * height);
    for row in 0..height {
        let part = (row as f64 + 0.5) / height as f64;
        light.extend(std::iter::repeat_n(above.lerp(below, part).as_vec3().to_array(), width));
    }
    light
}

/// Draws a layer over the light; `part` gives the share of a sample that counts.
fn cover(light: &mut [[f32; 3]], layer: &Layer, part: impl Fn(usize) -> f32) {
    for (k, under) in light.iter_mut().enumerate() {
        if layer.name[k] == 0 {
            continue;
        }
        let [r, g, b, covered] = layer.light[k];
        let covered = covered * part(k);
        for (under, over) in under.iter_mut().zip([r, g, b]) {
            *under += (over - *under) * covered;
        }
    }
}

/// Returns the mean of the samples of each pixel.
fn pixels(light: &[[f32; 3]], width: usize, height: usize) -> Picture {
    let mut picture = Picture::new(width, height, [0; 3]);
    for y in 0..height {
        for x in 0..width {
            let mut sum = DVec3::ZERO;
            for row in y * FINENESS..(y + 1) * FINENESS {
                for column in x * FINENESS..(x + 1) * FINENESS {
                    let [r, g, b] = light[row * width * FINENESS + column];
                    // Light brighter than white is cut to white before averaging, so that edges of
                    // highlights stay smooth.
                    sum += DVec3::new(f64::from(r), f64::from(g), f64::from(b)).min(DVec3::ONE);
                }
            }
            picture.set_pixel(x, y, encoded(sum / (FINENESS * FINENESS) as f64));
        }
    }
    picture
}
