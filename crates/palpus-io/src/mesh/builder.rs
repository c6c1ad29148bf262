//! Collects vertices and faces into a [`PolygonSoup`], and checks that every coordinate is finite
//! and every index is in range.

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::fault::{Fault, MeshProblem, Place};
use super::lines::{number, shown};

/// The largest absolute coordinate that is accepted, in model units.
///
/// Moments of inertia are sums of fifth powers of coordinates, which overflow beyond about 1e60. No
/// real coordinate exceeds 1e30, but a damaged exponent usually does.
pub const MAX_COORDINATE: f64 = 1e30;

pub(super) struct SoupBuilder {
    soup: PolygonSoup,
    /// Number that the file format gives to the first vertex; used in error messages.
    first: u64,
    /// Indices that exceeded the number of vertices at the time they were read, with their places.
    /// Each index is larger than all earlier indices. The first index that is still out of range at
    /// the end of the file is the file's first invalid index.
    forward: Vec<(u64, Place)>,
}

impl SoupBuilder {
    /// `first` is the number that the format gives to the first vertex (1 in OBJ, 0 otherwise).
    pub(super) fn new(first: u64) -> Self {
        Self { soup: PolygonSoup::new(), first, forward: Vec::new() }
    }

    pub(super) fn vertex_count(&self) -> u64 {
        self.soup.vertices.len() as u64
    }

    pub(super) fn corner_count(&self) -> u64 {
        self.soup.face_vertices.len() as u64
    }

    /// Reserves memory. The caller has checked the counts against the file size.
    pub(super) fn reserve_vertices(&mut self, vertices: u64) {
        self.soup.vertices.reserve(vertices as usize);
    }

    /// Appends a vertex; `text(axis)` returns a coordinate as written in the file, for error
    /// messages.
    pub(super) fn vertex(&mut self, xyz: [f64; 3], place: Place, text: impl Fn(usize) -> String) -> Result<(), Fault> {
        for (axis, x) in xyz.into_iter().enumerate() {
            if !x.is_finite() {
                return Err(Fault::new(place, MeshProblem::NotFinite { text: text(axis) }));
            }
            if x.abs() > MAX_COORDINATE {
                return Err(Fault::new(place, MeshProblem::TooFar { text: text(axis) }));
            }
        }
        if self.soup.vertices.len() >= u32::MAX as usize {
            let what = "the file has more vertices than 32-bit indices can address";
            return Err(Fault::new(place, MeshProblem::TooLarge(what.to_owned())));
        }
        self.soup.vertices.push(DVec3::from_array(xyz));
        Ok(())
    }

    /// Appends a vertex whose coordinates are the first three words of a line.
    pub(super) fn vertex_of_words<'a>(
        &mut self,
        mut words: impl Iterator<Item = &'a [u8]>,
        place: Place,
    ) -> Result<(), Fault> {
        let mut xyz = [0.0; 3];
        let mut texts: [&[u8]; 3] = [b""; 3];
        for (axis, x) in xyz.iter_mut().enumerate() {
            let Some(word) = words.next() else {
                let what = format!("a vertex has {axis} coordinates and needs 3; repair it or export the mesh again");
                return Err(Fault::malformed(place, what));
            };
            texts[axis] = word;
            *x = number(word).ok_or_else(|| not_a_number(word, place))?;
        }
        self.vertex(xyz, place, |axis| shown(texts[axis]))
    }

    /// Appends a corner to the current face; `index` counts vertices from 0.
    pub(super) fn corner(&mut self, index: u64, place: Place) {
        if index >= self.vertex_count() && self.forward.last().is_none_or(|&(largest, _)| index > largest) {
            self.forward.push((index, place));
        }
        self.soup.face_vertices.push(u32::try_from(index).unwrap_or(u32::MAX));
    }

    /// Ends the current face.
    pub(super) fn end_face(&mut self, place: Place) -> Result<(), Fault> {
        let start = self.soup.face_starts.last().map_or(0, |&start| start as usize);
        let corners = self.soup.face_vertices.len() - start;
        if corners < 3 {
            return Err(Fault::new(place, MeshProblem::ShortFace { corners: corners as u64 }));
        }
        let Ok(end) = u32::try_from(self.soup.face_vertices.len()) else {
            let what = "the faces have more corners than 32-bit indices can count";
            return Err(Fault::new(place, MeshProblem::TooLarge(what.to_owned())));
        };
        self.soup.face_starts.push(end);
        Ok(())
    }

    /// Appends a triangle.
    pub(super) fn triangle(&mut self, corners: [u64; 3], place: Place) -> Result<(), Fault> {
        for corner in corners {
            self.corner(corner, place);
        }
        self.end_face(place)
    }

    /// Returns the soup; fails if an index is out of range or if there is no face.
    pub(super) fn finish(self) -> Result<PolygonSoup, Fault> {
        let count = self.vertex_count();
        if let Some(&(index, place)) = self.forward.iter().find(|&&(index, _)| index >= count) {
            let index = i128::from(index) + i128::from(self.first);
            return Err(Fault::new(place, MeshProblem::IndexOutOfRange { index, count, first: self.first }));
        }
        if self.soup.face_count() == 0 {
            return Err(Fault::new(Place::File, MeshProblem::NoFaces { vertices: count }));
        }
        Ok(self.soup)
    }
}

/// Returns the error for a word that should be a number.
pub(super) fn not_a_number(word: &[u8], place: Place) -> Fault {
    let advice = if word.contains(&b',') { "use a decimal point" } else { "repair it or export the mesh again" };
    Fault::malformed(place, format!("\"{}\" is not a number; {advice}", shown(word)))
}
