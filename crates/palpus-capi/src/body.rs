//! Bodies: created once from triangles, points or a file, and shared by queries and worlds.

use std::ffi::c_char;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use palpus::depth::Interior;
use palpus::glam::DVec3;
use palpus::{Body, BodyError, BodySettings, PolygonSoup};
use palpus_io::{Threads, read_mesh};

use crate::handle::{Kind, Table};
use crate::pointer::{In, InArray, Out, Text};
use crate::result::{Fault, entry, palpus_result};

/// Flatness for measurements: depths are exact to about this fraction of the model's size.
pub const PALPUS_FLATNESS_EXACT: f64 = 3e-8;
/// Flatness for haptic rendering: a plane whose coordinates a file wrote with six digits becomes
/// one face.
pub const PALPUS_FLATNESS_HAPTIC: f64 = 3e-5;

/// A body. Any number of threads, queries and worlds may use a body at the same time. A body that a
/// query or a world uses stays in memory after its handle is destroyed.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct palpus_body {
    /// 0 if there is no body.
    pub id: u64,
}

/// How a body is created from a mesh.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_body_settings {
    /// Metres per unit of the model.
    pub scale: f64,
    /// How far a piece may deviate from the surface, as a fraction of the model's size, from 0 to
    /// 0.001.
    pub flatness: f64,
    /// 1: pieces reach into the solid, so that deep penetration is detected. 0: each piece is only
    /// as thick as its part of the surface.
    pub thick: u32,
}

/// Properties of a body. Lengths are in m, after scaling.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct palpus_body_facts {
    /// Number of triangles after cleaning.
    pub triangle_count: u64,
    /// Number of convex pieces.
    pub piece_count: u64,
    /// 1 if the surface has no boundary.
    pub is_closed: u32,
    /// 1 if each edge has one or two triangles with matching orientation, and parts of the surface
    /// do not touch at a single vertex.
    pub is_manifold: u32,
    /// Volume, m^3.
    pub volume: f64,
    /// Centre of mass, m, in the model's frame.
    pub center_of_mass: [f64; 3],
    /// Inertia about the centre of mass at density 1, m^5, row by row.
    pub inertia: [f64; 9],
    /// Lowest corner of the bounding box along the axes, m.
    pub bounds_min: [f64; 3],
    /// Highest corner of the bounding box, m.
    pub bounds_max: [f64; 3],
}

/// The value behind a body's handle.
pub(crate) struct Shared {
    pub(crate) body: Arc<Body>,
    /// The interior is computed when a depth is first requested.
    interior: OnceLock<Interior>,
}

impl Shared {
    pub(crate) fn interior(&self) -> &Interior {
        self.interior.get_or_init(|| Interior::new(&self.body, &Threads::all(), &mut |_| ()))
    }
}

static BODIES: Table<Arc<Shared>> = Table::new(Kind::Body);

/// Returns the body of a handle.
pub(crate) fn body_of(handle: palpus_body) -> Result<Arc<Shared>, Fault> {
    BODIES.read(handle.id, |body| Ok(body.clone()))
}

impl palpus_body_settings {
    fn checked(&self) -> Result<BodySettings, Fault> {
        let Self { scale, flatness, thick } = *self;
        Ok(BodySettings { scale, flatness, thick: flag("thick", thick)? })
    }
}

impl From<BodySettings> for palpus_body_settings {
    fn from(settings: BodySettings) -> Self {
        let BodySettings { scale, flatness, thick } = settings;
        Self { scale, flatness, thick: thick.into() }
    }
}

/// Converts a number, 0 or 1, to a boolean.
pub(crate) fn flag(name: &str, value: u32) -> Result<bool, Fault> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Fault::value(format!("{name} is {value}, but must be 0 or 1"))),
    }
}

fn keep(body: Result<Body, BodyError>, out: &Out<palpus_body>) -> Result<(), Fault> {
    let body = body.map_err(|error| match error {
        BodyError::Scale(_) | BodyError::Flatness(_) => Fault::value(error.to_string()),
        _ => Fault::new(palpus_result::PalpusErrorMesh, error.to_string()),
    })?;
    let id = BODIES.insert(Arc::new(Shared { body: Arc::new(body), interior: OnceLock::new() }))?;
    out.put(palpus_body { id })
}

fn of_soup(soup: &PolygonSoup, settings: &BodySettings, out: &Out<palpus_body>) -> Result<(), Fault> {
    keep(Body::from_soup_with(soup, settings, &Threads::all(), &mut |_| ()), out)
}

fn points(vertices: &InArray<[f64; 3]>) -> Result<Vec<DVec3>, Fault> {
    vertices.check()?;
    Ok(vertices.iter().map(DVec3::from_array).collect())
}

/// Fills in the defaults: scale 1, PALPUS_FLATNESS_EXACT, thick.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_body_settings_default(settings: *mut palpus_body_settings) -> palpus_result {
    // SAFETY: the caller follows the header.
    let settings = unsafe { Out::new(settings, "settings") };
    entry(|| settings.put(BodySettings::default().into()))
}

/// Creates a body from triangles. `vertices` has x, y, z of `vertex_count` vertices in the model's
/// unit. `triangles` has the three vertex indices of `triangle_count` triangles, counter-clockwise
/// as seen from outside. `settings` may be NULL for the defaults. Both arrays are copied. Takes
/// seconds for 100 000 triangles, on all cores.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_body_from_triangles(
    vertices: *const f64,
    vertex_count: usize,
    triangles: *const u32,
    triangle_count: usize,
    settings: *const palpus_body_settings,
    body: *mut palpus_body,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (vertices, triangles) = unsafe {
        (
            InArray::new(vertices.cast(), vertex_count, "vertices"),
            InArray::new(triangles.cast(), triangle_count, "triangles"),
        )
    };
    // SAFETY: the caller follows the header.
    let (settings, body) = unsafe { (In::new(settings, "settings"), Out::new(body, "body")) };
    entry(|| {
        body.check()?;
        let settings = settings.get_if_any()?.map_or(Ok(BodySettings::default()), |settings| settings.checked())?;
        triangles.check()?;
        if vertex_count > u32::MAX as usize || triangle_count > u32::MAX as usize / 3 {
            let text = format!(
                "{vertex_count} vertices and {triangle_count} triangles are too many; each index must fit in 32 bits"
            );
            return Err(Fault::value(text));
        }
        let triangles: Vec<[u32; 3]> = triangles.iter().collect();
        of_soup(&PolygonSoup::from_triangles(points(&vertices)?, &triangles), &settings, &body)
    })
}

/// Creates a body from the convex hull of points: x, y, z of `point_count` points, m.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_body_from_convex(
    points: *const f64,
    point_count: usize,
    body: *mut palpus_body,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (corners, body) = unsafe { (InArray::new(points.cast(), point_count, "points"), Out::new(body, "body")) };
    entry(|| {
        body.check()?;
        keep(Body::from_convex(&self::points(&corners)?), &body)
    })
}

/// Creates a body from a mesh file (OBJ, STL, PLY, OFF, glTF or GLB, optionally compressed with
/// gzip). `path` is UTF-8. `settings` may be NULL for the defaults. For a model in mm, set the
/// scale to 0.001.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_body_from_file(
    path: *const c_char,
    settings: *const palpus_body_settings,
    body: *mut palpus_body,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (path, settings, body) =
        unsafe { (Text::new(path, "path"), In::new(settings, "settings"), Out::new(body, "body")) };
    entry(|| {
        body.check()?;
        let settings = settings.get_if_any()?.map_or(Ok(BodySettings::default()), |settings| settings.checked())?;
        let soup = read_mesh(Path::new(&path.get()?))
            .map_err(|error| Fault::new(palpus_result::PalpusErrorFile, error.to_string()))?;
        of_soup(&soup, &settings, &body)
    })
}

/// Writes the properties of a body.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_body_get_facts(body: palpus_body, facts: *mut palpus_body_facts) -> palpus_result {
    // SAFETY: the caller follows the header.
    let facts = unsafe { Out::new(facts, "facts") };
    entry(|| {
        let shared = body_of(body)?;
        let (body, mass, bounds) = (&shared.body, shared.body.mass(), shared.body.mesh().bounds());
        facts.put(palpus_body_facts {
            triangle_count: body.mesh().triangles().len() as u64,
            piece_count: body.pieces().len() as u64,
            is_closed: body.health().closed.into(),
            is_manifold: body.health().is_manifold().into(),
            volume: mass.volume,
            center_of_mass: mass.center_of_mass.to_array(),
            // The matrix is symmetric, so its columns equal its rows.
            inertia: mass.inertia.to_cols_array(),
            bounds_min: bounds.min.to_array(),
            bounds_max: bounds.max.to_array(),
        })
    })
}

/// Destroys the handle of a body. Queries and worlds that use the body keep it alive.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_body_destroy(body: palpus_body) -> palpus_result {
    entry(|| BODIES.remove(body.id))
}
