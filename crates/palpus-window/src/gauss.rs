//! Draws the Gauss map of a convex piece on the sphere of directions \[K02 §3.3\].
//!
//! For each direction, one vertex of the piece is farthest along this direction. The sphere of
//! directions is divided by these vertices:
//!
//! * a face is the *point* of its normal;
//! * an edge is the *arc* of a great circle between the normals of its two faces;
//! * a vertex is the *region* between the arcs of its edges.
//!
//! The piece is the hull of a patch of the mesh. Faces that only the hull has are not part of the
//! surface. The admissible directions, which are normals of the mesh, are coloured
//! ([`palpus::body::AdmissibleNormals`]). At a vertex, they are the directions along which no
//! neighbour on the mesh is higher. At an edge, they are the arc up to the neighbour's true normal,
//! which may end before the hull's arc. At faces, they are the normals of the mesh. All other
//! directions are grey: the piece does not push in these directions.
//!
//! 1. Each sample of a disc is a direction, and gets the colour of the vertex that is farthest
//!    along this direction.
//! 2. All arcs are drawn thin. Then the admissible arcs are drawn thick over them.
//! 3. Points of faces are drawn, and points of the neighbours' normals at the ends of admissible
//!    arcs.
//!
//! The sphere is drawn in parallel projection, its near half from the camera's side and its far
//! half from behind.

use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::Pose;
use palpus::body::{AdmissibleNormals, Body};

use crate::camera::{Camera, View};
use crate::letters;
use crate::paint::paint;
use crate::picture::{Picture, Rgb};
use crate::piece::{PieceNumbers, piece_solids};
use crate::scene::{BodyPart, Look, Scene, ShownBody, Unit};
use crate::sheet::{Sheet, WORD_SIZE};
use crate::solid::Solid;
use crate::style::{Style, Theme, encoded, linear};

/// Number of samples along each side of a pixel.
const FINENESS: usize = 2;
/// Arcs are drawn in straight parts of at most this angle, rad.
const ARC_PART: f64 = 0.05;
/// Half the width of an arc of the hull, relative to the sphere's radius.
const THIN_ARC: f64 = 0.0022;
/// Half the width of an admissible arc, relative to the sphere's radius.
const OWN_ARC: f64 = 0.0072;
/// Radius of the point of a face, relative to the sphere's radius.
const FACE_POINT: f64 = 0.021;
/// Radius of the point of a rim face, relative to the sphere's radius.
const RIM_POINT: f64 = 0.011;
/// Radius of the point of a borrowed normal, relative to the sphere's radius.
const BORROWED_POINT: f64 = 0.015;
/// Share of the radius of a hollow point that is filled with another colour.
const HOLLOW: f64 = 0.5;
/// Darkness of the sphere at its rim.
const SLANT_SHADE: f64 = 0.42;
/// Difference of lightness between neighbouring regions.
const REGION_STEPS: [f64; 4] = [0.0, 0.16, -0.13, 0.07];

/// Colours of admissible and other regions.
#[derive(Clone, Copy, Debug)]
struct Palette {
    own_region: Rgb,
    other_region: Rgb,
    own: Rgb,
    other: Rgb,
    borrowed: Rgb,
    surface_face: Rgb,
    other_face: Rgb,
}

impl Palette {
    fn of(theme: Theme) -> Self {
        match theme {
            Theme::Light => Self {
                own_region: [150, 205, 235],
                other_region: [214, 214, 216],
                own: [10, 72, 176],
                other: [120, 122, 128],
                borrowed: [226, 112, 0],
                surface_face: [92, 160, 220],
                other_face: [196, 194, 190],
            },
            Theme::Dark => Self {
                own_region: [46, 104, 142],
                other_region: [74, 76, 80],
                own: [112, 196, 255],
                other: [160, 162, 168],
                borrowed: [255, 164, 60],
                surface_face: [80, 150, 214],
                other_face: [120, 118, 114],
            },
        }
    }
}

/// Returns the colours of a piece's faces: the colour of the mesh's faces, and the colour of
/// faces that only the hull has.
#[cfg(feature = "gui")]
pub(crate) fn piece_colours(theme: Theme) -> [Rgb; 2] {
    let palette = Palette::of(theme);
    [palette.surface_face, palette.other_face]
}

/// A piece of a body to be drawn.
#[derive(Clone, Copy, Debug)]
pub struct PieceOf<'a> {
    /// The body.
    pub body: &'a Body,
    /// Index of the piece.
    pub piece: u32,
    /// Name of the body.
    pub name: &'a str,
    /// Unit of length.
    pub unit: Unit,
}

/// Draws the piece, its place in the body, and both halves of its Gauss map, seen along the
/// direction of `from`. `piece` must be a piece of the body.
pub fn paint_gauss(shown: &PieceOf<'_>, from: &Camera, style: &Style, width: usize, height: usize) -> Picture {
    let &PieceOf { body, piece, name, unit } = shown;
    let numbers = PieceNumbers::of(body, piece);
    let title = format!("{name} · piece {piece} (there are {}, from 0)", body.polytopes().len());
    let mut sheet = Sheet::new(width, height, style, &title, &caption(&numbers, unit));
    let palette = Palette::of(style.theme);
    let area = sheet.area();
    let gap = 10.0 * sheet.scale;
    let (left, right) = (area.part([0.0, LEFT], [0.0, 1.0], 0.0), area.part([LEFT, 1.0], [0.0, 1.0], gap));
    let [own, hull] = piece_solids(body, piece).map(Arc::new);
    let placed = |solid: &Arc<Solid>, colour, look| ShownBody {
        part: BodyPart::Environment,
        solid: Arc::clone(solid),
        pose: Pose::IDENTITY,
        colour,
        look,
    };
    let of_piece =
        [placed(&own, palette.surface_face, Look::default()), placed(&hull, palette.other_face, Look::default())];
    let environment = BodyPart::Environment.colour(style.theme);
    let whole = placed(&Arc::new(Solid::of_body(body)), environment, Look { translucent: true, ..Look::default() });
    let in_place = [of_piece.to_vec(), vec![whole]].concat();
    let bare = Style { words: false, ..*style };
    for (bodies, down) in [(of_piece.to_vec(), [0.0, 0.5]), (in_place, [0.5, 1.0])] {
        let [x, y, wide, tall] = left.part([0.0, 1.0], down, gap).pixels();
        let scene = Scene { bodies, ..Scene::default() };
        let mut camera = *from;
        camera.frame(scene.corners(), wide as f64 / tall as f64);
        sheet.picture.put(&paint(&scene, &camera, &bare, wide, tall), x, y);
    }
    let axes = from.axes();
    let below = 1.9 * WORD_SIZE * sheet.scale;
    for (far, across, words) in
        [(false, [0.0, 0.5], "towards the viewer"), (true, [0.5, 1.0], "away, seen from behind")]
    {
        let half = right.part(across, [0.0, 1.0], 0.0);
        let radius = 0.5 * half.width.min(half.height - if style.words { below } else { 0.0 }) - 0.5 * gap;
        let (x, y) =
            (half.x + 0.5 * half.width, half.y + 0.5 * half.height - if style.words { 0.5 * below } else { 0.0 });
        draw_half(
            &mut sheet.picture,
            body,
            piece,
            &seen_from(axes, far),
            &Disc { x, y, radius: radius.max(1.0) },
            style.theme,
        );
        let faint = sheet.colours.faint;
        sheet.write_about(words, x, y + radius + below, WORD_SIZE, faint);
    }
    let rows = [
        (palette.own_region, false, "admissible directions"),
        (palette.other_region, false, "other directions"),
        (palette.own, false, "face of the mesh"),
        (palette.own, true, "in part"),
        (palette.other, true, "virtual face"),
        (palette.borrowed, false, "a neighbour's normal, end of an arc"),
    ];
    sheet.legend(&rows);
    sheet.picture
}

/// Draws only the near half of the Gauss map of a piece as seen by `camera`, `size` by `size`
/// pixels.
pub fn paint_gauss_half(body: &Body, piece: u32, camera: &Camera, theme: Theme, size: usize) -> Picture {
    let mut picture = Picture::new(size, size, theme.colours().below);
    let middle = 0.5 * size as f64;
    let disc = Disc { x: middle, y: middle, radius: (middle * WITHIN_SQUARE).max(1.0) };
    draw_half(&mut picture, body, piece, &camera.axes(), &disc, theme);
    picture
}

/// Share of a square that the sphere fills when it is drawn alone.
const WITHIN_SQUARE: f64 = 0.96;
/// Share of the page for the piece itself.
const LEFT: f64 = 0.27;

/// Returns the text about the piece below the picture.
fn caption(numbers: &PieceNumbers, unit: Unit) -> [String; 2] {
    let PieceNumbers { faces, original_faces, virtual_faces, rims, vertices, edges, arcs, volume, owned, .. } = numbers;
    let rims = if *rims > 0 { format!(", {rims} of no width") } else { String::new() };
    let unit = if unit == Unit::Model { "units³" } else { "m³" };
    let shape =
        format!("{vertices} vertices · {edges} edges, {arcs} with arcs of the mesh · volume {volume:.3e} {unit}");
    [
        format!("{faces} faces: {original_faces} of the mesh, {virtual_faces} virtual{rims} · {shape}"),
        format!("{:.1} % of all directions are admissible: the mesh has them there", 100.0 * owned),
    ]
}

/// Returns a camera in front of the mesh part of the piece's surface, or the oblique view if that
/// part has no mean direction.
pub fn before_surface_faces(body: &Body, piece: u32) -> Camera {
    let mut camera = Camera::framing([DVec3::ZERO].into_iter(), View::Oblique, 1.0);
    let mesh = body.mesh();
    let outward: DVec3 = body.pieces()[piece as usize]
        .triangles()
        .iter()
        .map(|&t| mesh.triangle_normal(t) * mesh.triangle_area(t))
        .sum();
    if let Some(direction) = outward.try_normalize() {
        camera.yaw = direction.y.atan2(direction.x);
        camera.pitch = direction.z.clamp(-1.0, 1.0).asin();
    }
    camera
}

/// Position of a half of the sphere, pixels.
#[derive(Clone, Copy, Debug)]
struct Disc {
    x: f64,
    y: f64,
    radius: f64,
}

impl Disc {
    /// Returns the position of a direction if it is on the visible half; `axes` are right, up and
    /// towards the viewer.
    fn place(&self, axes: &[DVec3; 3], direction: DVec3) -> Option<(f64, f64)> {
        let [right, up, back] = axes;
        (back.dot(direction) >= 0.0)
            .then(|| (self.x + self.radius * right.dot(direction), self.y - self.radius * up.dot(direction)))
    }
}

/// Returns the axes of the viewer, or of a viewer on the other side.
fn seen_from([right, up, back]: [DVec3; 3], far: bool) -> [DVec3; 3] {
    if far { [-right, up, -back] } else { [right, up, back] }
}

fn draw_half(picture: &mut Picture, body: &Body, piece: u32, axes: &[DVec3; 3], disc: &Disc, theme: Theme) {
    let (own, palette) = (body.admissible_normals(piece), Palette::of(theme));
    draw_regions(picture, &own, axes, disc, &palette);
    draw_arcs(picture, &own, axes, disc, &palette);
    draw_points(picture, &own, axes, disc, &palette);
}

/// Draws the regions (step 1).
fn draw_regions(picture: &mut Picture, own: &AdmissibleNormals<'_>, axes: &[DVec3; 3], disc: &Disc, palette: &Palette) {
    let rows = span(disc.y, disc.radius, picture.height());
    let columns = span(disc.x, disc.radius, picture.width());
    let mut vertex = 0;
    for y in rows {
        for x in columns.clone() {
            let (mut light, mut hit) = (DVec3::ZERO, 0.0);
            for k in 0..FINENESS * FINENESS {
                let sub = |k: usize| (k as f64 + 0.5) / FINENESS as f64;
                let u = (x as f64 + sub(k % FINENESS) - disc.x) / disc.radius;
                let v = (disc.y - y as f64 - sub(k / FINENESS)) / disc.radius;
                let squared = u * u + v * v;
                if squared > 1.0 {
                    continue;
                }
                let w = (1.0 - squared).sqrt();
                let direction = axes[0] * u + axes[1] * v + axes[2] * w;
                vertex = own.polytope().support_from(vertex, direction);
                light += region_light(own, vertex, direction, palette) * (1.0 - SLANT_SHADE * (1.0 - w) * (1.0 - w));
                hit += 1.0;
            }
            if hit > 0.0 {
                let under = linear(picture.pixel(x, y));
                let all = (FINENESS * FINENESS) as f64;
                picture.set_pixel(x, y, encoded((light + under * (all - hit)) / all));
            }
        }
    }
}

fn region_light(own: &AdmissibleNormals<'_>, vertex: u32, direction: DVec3, palette: &Palette) -> DVec3 {
    let owned = own.vertex_admits(vertex, direction);
    let colour = linear(if owned { palette.own_region } else { palette.other_region });
    // Regions that are not admissible differ only by their arcs.
    let step = if owned { REGION_STEPS[vertex as usize % REGION_STEPS.len()] } else { 0.0 };
    colour * (1.0 + step)
}

fn span(middle: f64, radius: f64, end: usize) -> std::ops::Range<usize> {
    let low = (middle - radius).floor().max(0.0) as usize;
    low.min(end)..((middle + radius).ceil().max(0.0) as usize).min(end)
}

/// Draws the arcs (step 2).
fn draw_arcs(picture: &mut Picture, own: &AdmissibleNormals<'_>, axes: &[DVec3; 3], disc: &Disc, palette: &Palette) {
    let polytope = own.polytope();
    let hull = polytope.edges().map(|edge| [edge.left, edge.right].map(|f| polytope.plane(f).normal));
    let thin = (THIN_ARC * disc.radius).max(0.35);
    for ends in hull {
        draw_arc(picture, ends, axes, disc, thin, palette.other);
    }
    let thick = (OWN_ARC * disc.radius).max(0.8);
    for arc in own.arcs() {
        draw_arc(picture, own.ends(arc), axes, disc, thick, palette.own);
    }
}

/// Draws the shorter arc between two directions, where it is on the visible half.
fn draw_arc(picture: &mut Picture, ends: [DVec3; 2], axes: &[DVec3; 3], disc: &Disc, radius: f64, colour: Rgb) {
    let angle = ends[0].angle_between(ends[1]);
    let parts = (angle / ARC_PART).ceil().max(1.0);
    let at = |k: f64| {
        let (part, sin) = (k / parts, angle.sin());
        // For a very short arc, uses the chord. A half circle has no shorter arc, but pieces have
        // no half circles.
        let direction = if sin.abs() < SHORT_ARC {
            ends[0].lerp(ends[1], part)
        } else {
            (ends[0] * ((1.0 - part) * angle).sin() + ends[1] * (part * angle).sin()) / sin
        };
        disc.place(axes, direction.normalize_or(ends[0]))
    };
    let mut run = Vec::new();
    for k in 0..=parts as usize {
        match at(k as f64) {
            Some(place) => run.push(place),
            None => draw_run(picture, &mut run, radius, colour),
        }
    }
    draw_run(picture, &mut run, radius, colour);
}

/// Below this sine, an arc is drawn straight.
const SHORT_ARC: f64 = 1e-6;

fn draw_run(picture: &mut Picture, run: &mut Vec<(f64, f64)>, radius: f64, colour: Rgb) {
    letters::line(picture, run, radius, colour);
    run.clear();
}

/// Draws the points (step 3).
fn draw_points(picture: &mut Picture, own: &AdmissibleNormals<'_>, axes: &[DVec3; 3], disc: &Disc, palette: &Palette) {
    let mut point = |direction: DVec3, size: f64, colour: Rgb, within: Rgb| {
        if let Some((x, y)) = disc.place(axes, direction) {
            let radius = (size * disc.radius).max(1.4);
            letters::disc(picture, x, y, radius, colour);
            letters::disc(picture, x, y, HOLLOW * radius, within);
        }
    };
    let polytope = own.polytope();
    let mut faces: Vec<u32> = (0..polytope.face_count() as u32).collect();
    // Admissible faces are drawn on top.
    faces.sort_by_key(|f| own.surface_face(*f).is_some());
    for f in faces {
        let normal = polytope.plane(f).normal;
        match own.surface_face(f) {
            Some(face) => {
                point(normal, FACE_POINT, palette.own, if face.whole { palette.own } else { palette.own_region })
            }
            None if polytope.is_rim(f) => point(normal, RIM_POINT, palette.other, palette.other_region),
            None => point(normal, FACE_POINT, palette.other, palette.other_region),
        }
    }
    for borrowed in own.borrowed() {
        point(borrowed.plane.normal, BORROWED_POINT, palette.borrowed, palette.borrowed);
    }
}
