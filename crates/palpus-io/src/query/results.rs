//! Writes the results of queries.

use std::fmt;
use std::io::{self, Write};

use glam::DVec3;
use palpus::body::Feature;
use palpus::depth::Containment;
use palpus::detect::Contact;
use serde::{Serialize, Serializer};

use super::depths::containment_number;
use crate::table::Line;

/// The columns of a file of results.
pub const RESULT_COLUMNS: [&str; 15] = [
    "frame",
    "separation",
    "normal_x",
    "normal_y",
    "normal_z",
    "point_a_x",
    "point_a_y",
    "point_a_z",
    "point_b_x",
    "point_b_y",
    "point_b_z",
    "contacts",
    "certified",
    "query_us",
    "contained",
];

/// The columns of a file of contacts.
pub const CONTACT_COLUMNS: [&str; 16] = [
    "frame",
    "contact",
    "separation",
    "normal_x",
    "normal_y",
    "normal_z",
    "point_a_x",
    "point_a_y",
    "point_a_z",
    "point_b_x",
    "point_b_y",
    "point_b_z",
    "piece_a",
    "piece_b",
    "feature_a",
    "feature_b",
];

/// The result for one pose, in b's frame and model units, where `point_a − point_b = separation ·
/// normal`. The serialized fields have the names of the table's columns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct QueryRow {
    /// Index of the pose, from 0.
    pub frame: u64,
    /// Smallest distance, or minus the depth of the deepest contact.
    pub separation: f64,
    /// Unit vector from b into a.
    pub normal: DVec3,
    /// Contact point on a.
    pub point_a: DVec3,
    /// Contact point on b.
    pub point_b: DVec3,
    /// Number of leaf contacts within the tolerance.
    pub contacts: u32,
    /// True if the depth is proven to be global; always true for a distance.
    pub certified: bool,
    /// Containment: says if one body lies inside the other body. In that case, `separation` refers
    /// to the nearest surfaces or pieces and is not the length of a translation that separates the
    /// bodies.
    #[serde(serialize_with = "as_number")]
    pub contained: Containment,
    /// Duration of the engine call without input and output, in µs.
    pub query_us: f64,
}

fn as_number<S: Serializer>(contained: &Containment, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_u8(containment_number(*contained))
}

/// Writes a file of results.
pub struct QueryWriter<W: Write> {
    out: W,
    line: Line,
}

impl<W: Write> QueryWriter<W> {
    /// Writes the header. `out` should be buffered.
    pub fn new(mut out: W) -> io::Result<Self> {
        writeln!(out, "{}", RESULT_COLUMNS.join(","))?;
        Ok(Self { out, line: Line::default() })
    }

    /// Writes the result of one pose.
    pub fn write(&mut self, row: &QueryRow) -> io::Result<()> {
        let line = &mut self.line;
        line.clear();
        line.cell(row.frame);
        line.numbers([row.separation]);
        line.numbers([row.normal, row.point_a, row.point_b].iter().flat_map(DVec3::to_array));
        line.cell(row.contacts);
        line.cell(row.certified);
        line.numbers([row.query_us]);
        line.cell(containment_number(row.contained));
        self.out.write_all(line.end())
    }

    /// Flushes and returns `out`.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}

/// Writes a file of contacts.
pub struct ContactWriter<W: Write> {
    out: W,
    line: Line,
}

impl<W: Write> ContactWriter<W> {
    /// Writes the header. `out` should be buffered.
    pub fn new(mut out: W) -> io::Result<Self> {
        writeln!(out, "{}", CONTACT_COLUMNS.join(","))?;
        Ok(Self { out, line: Line::default() })
    }

    /// Writes the contacts of one pose.
    pub fn write(&mut self, frame: u64, contacts: &[Contact]) -> io::Result<()> {
        for (index, contact) in contacts.iter().enumerate() {
            let line = &mut self.line;
            line.clear();
            line.cell(frame);
            line.cell(index);
            line.numbers([contact.separation]);
            line.numbers([contact.normal, contact.point_a, contact.point_b].iter().flat_map(DVec3::to_array));
            line.cell(contact.piece_a);
            line.cell(contact.piece_b);
            line.cell(Name(contact.features.a));
            line.cell(Name(contact.features.b));
            self.out.write_all(line.end())?;
        }
        Ok(())
    }

    /// Flushes and returns `out`.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}

/// A feature in the form of the file.
struct Name(Feature);

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Feature::Vertex(index) => write!(f, "v{index}"),
            Feature::Edge(index) => write!(f, "e{index}"),
            Feature::Face(index) => write!(f, "f{index}"),
        }
    }
}
