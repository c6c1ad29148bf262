//! Rows for Python. numpy uses the rows as structured arrays in the engine's memory.
//!
//! Every byte of a row is initialised, because numpy compares and writes rows as bytes. The field
//! `fill` covers the padding.
#![expect(
    unsafe_code,
    reason = "numpy trusts the layout of a row, which the macro `layout` derives from the row's type"
)]

use std::mem::{offset_of, size_of};

use glam::DVec3;
use numpy::{Element, PyArrayDescr};
use palpus::Contact;
use palpus::body::Feature;
use palpus::depth::{Containment, DepthBracket};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{IntoPyDict, PyDict};

/// A contact at a pose. Lengths are in model units; vectors are in b's frame.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct ContactRow {
    pose: u64,
    separation: f64,
    normal: [f64; 3],
    point_a: [f64; 3],
    point_b: [f64; 3],
    piece_a: u32,
    piece_b: u32,
    feature_a: u32,
    feature_b: u32,
    kind_a: u8,
    kind_b: u8,
    fill: [u8; 6],
}

/// The nearest points at a pose. Lengths are in model units; vectors are in b's frame.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct DistanceRow {
    pub(crate) separation: f64,
    normal: [f64; 3],
    point_a: [f64; 3],
    point_b: [f64; 3],
    contacts: u32,
    certified: bool,
    contained: u8,
    fill: [u8; 2],
}

/// The depth at a pose. Lengths are in model units; vectors are in b's frame.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct DepthRow {
    lower: f64,
    upper: f64,
    translation: [f64; 3],
    distance: f64,
    evaluations: u64,
    certified: bool,
    contained: u8,
    fill: [u8; 6],
}

/// Describes the memory layout of a row to numpy: each field with numpy's name of its type.
macro_rules! layout {
    ($row:ty { $($field:ident: $format:literal),* }) => {
        impl $row {
            fn layout(py: Python<'_>) -> PyResult<Bound<'_, PyArrayDescr>> {
                let layout: Bound<'_, PyDict> = [
                    ("names", [$(stringify!($field)),*].into_pyobject(py)?.into_any()),
                    ("formats", [$($format),*].into_pyobject(py)?.into_any()),
                    ("offsets", [$(offset_of!($row, $field)),*].into_pyobject(py)?.into_any()),
                    ("itemsize", size_of::<$row>().into_pyobject(py)?.into_any()),
                ]
                .into_py_dict(py)?;
                PyArrayDescr::new(py, layout)
            }
        }

        // SAFETY: all fields are plain numbers, listed with their types and offsets. All fields lie
        // within the row.
        unsafe impl Element for $row {
            const IS_COPY: bool = true;

            fn get_dtype(py: Python<'_>) -> Bound<'_, PyArrayDescr> {
                static KNOWN: PyOnceLock<Py<PyArrayDescr>> = PyOnceLock::new();
                let make = || Self::layout(py).expect("numpy accepts the layout, as it did in `add_types`").unbind();
                KNOWN.get_or_init(py, make).clone_ref(py).into_bound(py)
            }

            fn clone_ref(&self, _py: Python<'_>) -> Self {
                *self
            }
        }
    };
}

layout!(ContactRow {
    pose: "u8",
    separation: "f8",
    normal: "3f8",
    point_a: "3f8",
    point_b: "3f8",
    piece_a: "u4",
    piece_b: "u4",
    feature_a: "u4",
    feature_b: "u4",
    kind_a: "S1",
    kind_b: "S1"
});
layout!(DistanceRow {
    separation: "f8",
    normal: "3f8",
    point_a: "3f8",
    point_b: "3f8",
    contacts: "u4",
    certified: "?",
    contained: "u1"
});
layout!(DepthRow {
    lower: "f8",
    upper: "f8",
    translation: "3f8",
    distance: "f8",
    evaluations: "u8",
    certified: "?",
    contained: "u1"
});

/// Adds the types of the rows to the package.
pub(crate) fn add_types(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("CONTACT", ContactRow::layout(py)?)?;
    module.add("DISTANCE", DistanceRow::layout(py)?)?;
    module.add("DEPTH", DepthRow::layout(py)?)
}

impl ContactRow {
    pub(crate) fn new(pose: usize, contact: &Contact) -> Self {
        let named = |feature| match feature {
            Feature::Vertex(index) => (b'v', index),
            Feature::Edge(index) => (b'e', index),
            Feature::Face(index) => (b'f', index),
        };
        let ((kind_a, feature_a), (kind_b, feature_b)) = (named(contact.features.a), named(contact.features.b));
        Self {
            pose: pose as u64,
            separation: contact.separation,
            normal: contact.normal.to_array(),
            point_a: contact.point_a.to_array(),
            point_b: contact.point_b.to_array(),
            piece_a: contact.piece_a,
            piece_b: contact.piece_b,
            feature_a,
            feature_b,
            kind_a,
            kind_b,
            fill: [0; 6],
        }
    }
}

impl DistanceRow {
    pub(crate) fn new(nearest: &Contact, contacts: usize, certified: bool, contained: Containment) -> Self {
        let [normal, point_a, point_b] =
            [nearest.normal, nearest.point_a, nearest.point_b].map(|v: DVec3| v.to_array());
        let (separation, contacts) = (nearest.separation, contacts as u32);
        Self { separation, normal, point_a, point_b, contacts, certified, contained: number(contained), fill: [0; 2] }
    }
}

impl DepthRow {
    pub(crate) fn new(answer: &DepthBracket) -> Self {
        let distance = answer.distance.map_or(f64::NAN, |far| if answer.upper > 0.0 { -far } else { far });
        Self {
            lower: answer.lower,
            upper: answer.upper,
            translation: answer.translation.to_array(),
            distance,
            evaluations: answer.evaluations,
            certified: answer.certified,
            contained: number(answer.containment),
            fill: [0; 6],
        }
    }
}

/// Returns 0 if neither body lies in the other, 1 if a lies in b, 2 if b lies in a. The program's
/// files use the same numbers.
fn number(containment: Containment) -> u8 {
    match containment {
        Containment::Neither => 0,
        Containment::AInB => 1,
        Containment::BInA => 2,
    }
}
