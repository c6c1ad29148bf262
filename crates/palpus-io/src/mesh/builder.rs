//! Collects vertices and faces into a [`PolygonSoup`], and checks that every coordinate is finite
//! and every index is in range.

use glam::DVec3;
use palpus::body::PolygonSoup;

use super::fault::{Fault, MeshProblem, Place};
use super::lines::{number, shown};

/// The largest coordinate that is read, in model units.
///
/// Moments of inertia are sums of fifth powers of coordinates; beyond about 1e60 they overflow.
/// Nothing real is larger than 1e30 of its unit, and a damaged exponent usually is.
pub const MAX_COORDINATE: f64 = 1e30;

pub(super) struct SoupBuilder {
    soup: PolygonSoup,
    /// Number of the first vertex in the file's own counting, for errors.
    first: u64,
    /// Indices beyond the vertices that were known when the index was read, with their places; each
    /// is larger than all before it. The first of them that is still out of range at the end is the
    /// first wrong index of the file.
    forward: Vec<(u64, Place)>,
}

impl SoupBuilder {
    /// `first` is the number that the format gives to the first vertex (1 in OBJ, else 0).
    pub(super) fn new(first: u64) -> Self {
        Self { soup: PolygonSoup::new(), first, forward: Vec::new() }
    }

    pub(super) fn vertex_count(&self) -> u64 {
        self.soup.vertices.len() as u64
    }

    pub(super) fn corner_count(&self) -> u64 {
        self.soup.face_vertices.len() as u64
    }

    /// Reserves memory; the caller has compared the counts with the size of the file.
    pub(super) fn reserve_vertices(&mut self, vertices: u64) {
        self.soup.vertices.reserve(vertices as usize);
    }

    /// Appends a vertex whose coordinates stand in the file as `text(axis)`.
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
            let what = "the file has more vertices than 32-bit indices can name";
            return Err(Fault::new(place, MeshProblem::TooLarge(what.to_owned())));
        }
        self.soup.vertices.push(DVec3::from_array(xyz));
        Ok(())
    }

    /// Appends the vertex that the first three words of a text line spell.
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

    /// Appends a corner, counted from 0, to the face being built.
    pub(super) fn corner(&mut self, index: u64, place: Place) {
        if index >= self.vertex_count() && self.forward.last().is_none_or(|&(largest, _)| index > largest) {
            self.forward.push((index, place));
        }
        self.soup.face_vertices.push(u32::try_from(index).unwrap_or(u32::MAX));
    }

    /// Ends the face whose corners were appended last.
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

    /// The soup, if every index is in range and there is a face.
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

/// The fault of a word that should be a number.
pub(super) fn not_a_number(word: &[u8], place: Place) -> Fault {
    let advice =
        if word.contains(&b',') { "write decimals with a point" } else { "repair it or export the mesh again" };
    Fault::malformed(place, format!("\"{}\" is not a number; {advice}", shown(word)))
}
