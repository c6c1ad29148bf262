//! Bodies: creation from files and arrays, and their properties.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use glam::DVec3;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods};
use palpus::algebra::Workers;
use palpus::body::MassSource;
use palpus::depth::Interior;
use palpus::{BodySettings, Health, PolygonSoup};
use palpus_io::cache::prepared;
use palpus_io::scene::metres;
use palpus_io::{BodyCache, Threads, read_mesh};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::rows;
use crate::refused::{failed, refused};
use crate::workers::{detached, threads};

/// A solid that is prepared for queries. A body never changes, and several threads can use it at
/// the same time.
#[pyclass(frozen, module = "palpus")]
pub(crate) struct Body {
    body: Arc<palpus::Body>,
    /// Computed at the first depth query.
    interior: OnceLock<Interior>,
}

type Points<'py> = Bound<'py, PyArray2<f64>>;
type Triangles<'py> = Bound<'py, PyArray2<u32>>;

/// Arguments for the preparation of a body.
struct Wanted {
    settings: BodySettings,
    threads: Threads,
    cache: bool,
}

impl Wanted {
    fn new(
        scale: Option<f64>,
        unit: Option<&str>,
        flatness: Option<f64>,
        cache: bool,
        workers: Option<usize>,
    ) -> PyResult<Self> {
        let scale = match (scale, unit) {
            (Some(_), Some(_)) => return Err(refused("scale and unit set the same thing; give one of them")),
            (Some(scale), None) => scale,
            (None, None) => 1.0,
            (None, Some(name)) => metres(name)
                .map_err(|known| refused(format!("unit {name:?} is not a unit of length; use one of {known}")))?,
        };
        let default = BodySettings::default();
        let settings = BodySettings { scale, flatness: flatness.unwrap_or(default.flatness), ..default };
        Ok(Self { settings, threads: threads(workers)?, cache })
    }

    fn prepare(&self, py: Python<'_>, name: &str, soup: &PolygonSoup) -> PyResult<Body> {
        let made = detached(py, |_, look| {
            let cache = BodyCache::of_user().filter(|_| self.cache);
            prepared(soup, &self.settings, cache.as_ref(), &self.threads, look)
        })?;
        let made = made.map_err(|error| {
            let cause = failed(&error);
            refused(format!("{name} cannot be prepared: {}", cause.value(py)))
        })?;
        Ok(Body { body: Arc::new(made), interior: OnceLock::new() })
    }
}

#[pymethods]
impl Body {
    /// Flatness for measurements: depths are exact to about this fraction of the model's size.
    #[classattr]
    const EXACT: f64 = BodySettings::EXACT;
    /// Flatness for haptic rendering: planes that were written with few digits become one face.
    #[classattr]
    const HAPTIC: f64 = BodySettings::HAPTIC;

    /// Reads a mesh (obj, stl, ply, off, gltf, glb) and prepares it.
    ///
    /// Lengths stay in model units, unless `unit` ("mm", "m", …) or `scale` (metres per model unit)
    /// is given; then they are metres. `flatness` is Body.EXACT (the default) or Body.HAPTIC. The
    /// prepared body is stored in the user's cache folder, which the program also uses, unless
    /// `cache` is False.
    #[staticmethod]
    #[pyo3(signature = (path, *, scale=None, unit=None, flatness=None, cache=true, workers=None))]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        scale: Option<f64>,
        unit: Option<&str>,
        flatness: Option<f64>,
        cache: bool,
        workers: Option<usize>,
    ) -> PyResult<Self> {
        let wanted = Wanted::new(scale, unit, flatness, cache, workers)?;
        let soup = py.detach(|| read_mesh(&path)).map_err(|error| failed(&error))?;
        wanted.prepare(py, &path.display().to_string(), &soup)
    }

    /// Creates a body from vertices (N, 3) and faces (M, K). A face is K vertex indices,
    /// counter-clockwise as seen from outside.
    ///
    /// The other arguments are the same as for `load`.
    #[staticmethod]
    #[pyo3(signature = (vertices, faces, *, scale=None, unit=None, flatness=None, cache=false, workers=None))]
    #[expect(clippy::too_many_arguments, reason = "in Python all except two of them are passed by name")]
    fn from_arrays(
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        faces: &Bound<'_, PyAny>,
        scale: Option<f64>,
        unit: Option<&str>,
        flatness: Option<f64>,
        cache: bool,
        workers: Option<usize>,
    ) -> PyResult<Self> {
        let wanted = Wanted::new(scale, unit, flatness, cache, workers)?;
        let vertices = rows::<3>("vertices", "x, y, z", vertices)?;
        let mut soup =
            PolygonSoup { vertices: vertices.into_iter().map(DVec3::from_array).collect(), ..PolygonSoup::new() };
        push_faces(&mut soup, faces)?;
        wanted.prepare(py, "the mesh", &soup)
    }

    /// Creates a body from any object that has `vertices` and `faces`, such as a trimesh mesh.
    ///
    /// The other arguments are the same as for `load`.
    #[staticmethod]
    #[pyo3(signature = (mesh, *, scale=None, unit=None, flatness=None, cache=false, workers=None))]
    fn from_mesh(
        mesh: &Bound<'_, PyAny>,
        scale: Option<f64>,
        unit: Option<&str>,
        flatness: Option<f64>,
        cache: bool,
        workers: Option<usize>,
    ) -> PyResult<Self> {
        let part = |name: &str| {
            mesh.getattr(name).map_err(|_| {
                refused(format!("a mesh must have vertices and faces, but this {} has no {name}", mesh.get_type()))
            })
        };
        let (vertices, faces) = (part("vertices")?, part("faces")?);
        Self::from_arrays(mesh.py(), &vertices, &faces, scale, unit, flatness, cache, workers)
    }

    /// Vertices (N, 3) of the mesh after cleaning.
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Points<'py>> {
        table(py, self.body.mesh().vertices().iter().map(DVec3::to_array).collect())
    }

    /// Triangles (M, 3) as vertex indices.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Triangles<'py>> {
        table(py, self.body.mesh().triangles().to_vec())
    }

    /// Number of convex pieces.
    #[getter]
    fn piece_count(&self) -> usize {
        self.body.pieces().len()
    }

    /// Returns the vertices (N, 3) and triangles (M, 3) of a convex piece.
    fn piece<'py>(&self, py: Python<'py>, number: usize) -> PyResult<(Points<'py>, Triangles<'py>)> {
        let count = self.piece_count();
        let Some(piece) = self.body.polytopes().get(number) else {
            return Err(refused(format!("there is no piece {number}; the body has {count} pieces, counted from 0")));
        };
        let fan = |f: u32| piece.face_vertices(f).fan().collect::<Vec<[u32; 3]>>();
        let triangles = (0..piece.face_count() as u32).filter(|&f| !piece.is_rim(f)).flat_map(fan).collect();
        Ok((table(py, piece.vertices().iter().map(DVec3::to_array).collect())?, table(py, triangles)?))
    }

    /// Volume, in cubed length units of the body.
    #[getter]
    fn volume(&self) -> f64 {
        self.body.mass().volume
    }

    /// Centre of mass (3,) in the model's frame.
    #[getter]
    fn center_of_mass<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.body.mass().center_of_mass.to_array().to_vec().into_pyarray(py)
    }

    /// Inertia (3, 3) about the centre of mass at density 1, along the model's axes.
    #[getter]
    fn inertia<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.body.mass().inertia.to_cols_array_2d().to_vec())
    }

    /// How volume and inertia were computed: "mesh", "hull" if the mesh is open, or "sheet" if it
    /// is flat.
    #[getter]
    fn mass_source(&self) -> &'static str {
        match self.body.mass().source {
            MassSource::Mesh => "mesh",
            MassSource::Hull => "hull",
            MassSource::Sheet => "sheet",
        }
    }

    /// Diagonal of the bounding box.
    #[getter]
    fn size(&self) -> f64 {
        self.body.size()
    }

    /// Returns the state of the mesh, including self-intersections: counts, and `notices` as text.
    fn health<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let body = &self.body;
        let health = py.detach(|| Health::full(body.mesh(), body.half_edges(), body.tree(), body.health().cleaning));
        let known = PyDict::new(py);
        known.set_item("closed", health.closed)?;
        known.set_item("manifold", health.is_manifold())?;
        known.set_item("genus", health.genus())?;
        known.set_item("components", health.components.len())?;
        known.set_item("boundary_edges", health.boundary_edges)?;
        known.set_item("non_manifold_edges", health.non_manifold_edges)?;
        known.set_item("self_intersecting_triangles", health.self_intersections.map_or(0, |own| own.triangles))?;
        known.set_item("notices", health.notices().iter().map(ToString::to_string).collect::<Vec<_>>())?;
        Ok(known)
    }

    fn __repr__(&self) -> String {
        let (triangles, pieces) = (self.body.mesh().triangles().len(), self.piece_count());
        format!("<palpus.Body: {triangles} triangles in {pieces} convex pieces, size {:.6}>", self.size())
    }
}

impl Body {
    pub(crate) fn shared(&self) -> &Arc<palpus::Body> {
        &self.body
    }

    /// Returns the convex cells of the body's inside. The first call computes the cells.
    pub(crate) fn interior(&self, workers: &dyn Workers) -> &Interior {
        self.interior.get_or_init(|| Interior::new(&self.body, workers, &mut |_| ()))
    }
}

/// Appends the faces of an array to the soup.
fn push_faces(soup: &mut PolygonSoup, given: &Bound<'_, PyAny>) -> PyResult<()> {
    let numpy = given.py().import("numpy")?;
    let wrong = |what: String| refused(format!("faces {what}, but must be (M, 3) or (M, K) vertex indices from 0"));
    let array = numpy.call_method1("asarray", (given,)).map_err(|_| wrong("are not an array".to_owned()))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if kind != "i" && kind != "u" {
        return Err(wrong(format!("are of type {}", array.getattr("dtype")?)));
    }
    let array = array.call_method1("astype", ("int64",))?.cast_into::<PyArrayDyn<i64>>()?.try_readonly()?;
    let view = array.as_array();
    let corners = match *view.shape() {
        [_, corners] if corners >= 3 => corners,
        ref shape => return Err(wrong(format!("have the shape {shape:?}"))),
    };
    let mut face = Vec::with_capacity(corners);
    for (k, &index) in view.iter().enumerate() {
        let number = u32::try_from(index).map_err(|_| wrong(format!("name vertex {index} in face {}", k / corners)))?;
        face.push(number);
        if face.len() == corners {
            soup.push_face(&face);
            face.clear();
        }
    }
    Ok(())
}

/// Returns rows as a two-dimensional array, without a copy.
fn table<'py, T: numpy::Element, const N: usize>(
    py: Python<'py>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let count = rows.len();
    rows.into_flattened().into_pyarray(py).reshape([count, N])
}
