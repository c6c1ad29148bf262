//! The felt penetration depth on a plane through a body.
//!
//! A *section* is a grid of points on a plane across one of the model's axes. At each point:
//!
//! * *felt depth*: a probe as small as a point ([`POINT`]) is placed there and queried as in the
//!   servo loop ([`ContactQuery`], without memory of other points): the depth of the deepest
//!   contact, which is what eq. 5 takes, less the probe's own extent. Zero where there is no
//!   contact;
//! * *distance*: to the nearest point of the mesh, whichever side it is on;
//! * *inside*: whether the point is within the mesh, where that is closed.
//!
//! For an exact answer the felt depth equals the distance inside and is zero outside. The pieces
//! can give a smaller depth; inside points without contact are *unseen*. Contact directions are not
//! compared here (`palpus inspect --sweeps` does that).

use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::{Pose, Workers, map_in_order, quantile};
use palpus::body::{Body, BodyError};
use palpus::detect::{ContactQuery, QuerySettings};

/// Size of the probing point, relative to the body's size: near an edge a felt depth may be wrong
/// by as much.
pub const POINT: f64 = 1e-5;
/// How far a section reaches beyond the body's box, relative to its size.
const MARGIN: f64 = 0.08;
/// Capacity for the contacts at a point.
const CAPACITY: usize = 1024;
/// Rows that one worker computes at a time.
const ROWS_PER_PART: usize = 16;

/// Across which of the model's axes a plane lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axis {
    /// Seen along −x: y to the right, z up.
    X,
    /// Seen along +y: x to the right, z up.
    #[default]
    Y,
    /// Seen along −z: x to the right, y up.
    Z,
}

impl Axis {
    /// All three.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// The coordinate across the plane, to the right, and up.
    pub(crate) fn coordinates(self) -> [usize; 3] {
        match self {
            Self::X => [0, 1, 2],
            Self::Y => [1, 0, 2],
            Self::Z => [2, 0, 1],
        }
    }

    /// Its letter.
    pub fn name(self) -> &'static str {
        ["x", "y", "z"][self.coordinates()[0]]
    }
}

/// A plane across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionPlane {
    /// Which.
    pub axis: Axis,
    /// Offset of the plane along its normal, m.
    pub offset: f64,
}

impl SectionPlane {
    /// At `part` of the way through the body's box, from 0 to 1.
    pub fn through(body: &Body, axis: Axis, part: f64) -> Self {
        let (bounds, k) = (body.mesh().bounds(), axis.coordinates()[0]);
        Self { axis, offset: bounds.min[k] + part * (bounds.max[k] - bounds.min[k]) }
    }

    /// The point of the plane that is so far to the right and up.
    pub fn point(&self, right: f64, up: f64) -> DVec3 {
        let [across, to_right, upwards] = self.axis.coordinates();
        let mut point = DVec3::ZERO;
        (point[across], point[to_right], point[upwards]) = (self.offset, right, up);
        point
    }

    /// Corners of the rectangle that a section on this plane covers, in order.
    pub fn corners(&self, body: &Body) -> [DVec3; 4] {
        let [low, high] = self.reach(body);
        [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]].map(|[u, v]| self.point(u, v))
    }

    /// The lower left and the upper right corner of what a section covers, to the right and up.
    fn reach(&self, body: &Body) -> [[f64; 2]; 2] {
        let (bounds, margin) = (body.mesh().bounds(), MARGIN * body.size());
        let [_, right, up] = self.axis.coordinates();
        [[bounds.min[right] - margin, bounds.min[up] - margin], [bounds.max[right] + margin, bounds.max[up] + margin]]
    }

    /// The lines in which `polygons` meet the plane: right and up of both ends. A polygon is convex
    /// and counted through its corners.
    pub(crate) fn cut<'a>(&self, polygons: impl Iterator<Item = Vec<DVec3>> + 'a) -> Vec<[[f64; 2]; 2]> {
        let [across, right, up] = self.axis.coordinates();
        let height = |p: &DVec3| p[across] - self.offset;
        polygons
            .filter_map(|corners| {
                let mut ends = Vec::new();
                for (k, from) in corners.iter().enumerate() {
                    let to = &corners[(k + 1) % corners.len()];
                    if (height(from) < 0.0) != (height(to) < 0.0) {
                        let at = from.lerp(*to, height(from) / (height(from) - height(to)));
                        ends.push([at[right], at[up]]);
                    }
                }
                (ends.len() == 2).then(|| [ends[0], ends[1]])
            })
            .collect()
    }
}

/// Result for a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Felt {
    /// To the nearest point of the mesh, m.
    pub distance: f64,
    /// Within a closed mesh; false for an open one.
    pub inside: bool,
    /// Depth of the deepest contact, m; zero without contact.
    pub depth: f64,
}

/// A probe as small as a point, and its queries.
#[derive(Clone, Debug)]
pub struct Feeler {
    query: ContactQuery,
}

impl Feeler {
    /// Creates a probe for `body`.
    ///
    /// # Errors
    /// If the body is so small that no probe is smaller.
    pub fn new(body: &Arc<Body>) -> Result<Self, BodyError> {
        let radius = POINT * body.size();
        // Rotated, so that no face of it is parallel to typical faces of models.
        let axes = TURNED.map(|axis| DVec3::from_array(axis) * radius);
        let corners: Vec<DVec3> = axes.iter().flat_map(|&axis| [axis, -axis]).collect();
        let probe = Arc::new(Body::from_convex(&corners)?);
        let settings = QuerySettings { tolerance: 0.0, capacity: CAPACITY, ..QuerySettings::default() };
        Ok(Self { query: ContactQuery::new(probe, body.clone(), settings) })
    }

    /// Returns what is felt at `point`, in the body's frame.
    pub fn feel(&mut self, point: DVec3) -> Felt {
        self.query.clear();
        let contacts = self.query.contacts(&Pose::from_translation(point)).iter();
        let deepest = contacts.min_by(|x, y| x.separation.total_cmp(&y.separation)).copied();
        let (probe, body) = (self.query.a(), self.query.b());
        let depth = deepest.map_or(0.0, |contact| {
            let reach = |v: &DVec3| -contact.normal.dot(*v);
            -contact.separation - probe.mesh().vertices().iter().map(reach).fold(0.0, f64::max)
        });
        let tree = body.tree();
        Felt {
            distance: tree.nearest(point).map_or(f64::INFINITY, |near| near.distance),
            inside: body.mesh().is_closed() && tree.inside(point),
            depth: depth.max(0.0),
        }
    }
}

/// Orthonormal: columns (6, 3, 2)/7 and its like.
const TURNED: [[f64; 3]; 3] =
    [[6.0 / 7.0, 3.0 / 7.0, 2.0 / 7.0], [-3.0 / 7.0, 2.0 / 7.0, 6.0 / 7.0], [2.0 / 7.0, -6.0 / 7.0, 3.0 / 7.0]];

/// Depths on a plane. Samples stand in rows from the lower left corner, [`Section::cell`] apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Where.
    pub plane: SectionPlane,
    /// The first sample: to the right and up, m.
    pub low: [f64; 2],
    /// m from a sample to the next.
    pub cell: f64,
    /// Samples a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// The mesh is closed, so that there is an inside.
    pub closed: bool,
    /// Row by row.
    pub samples: Vec<Felt>,
}

impl Section {
    /// Feels the body on a grid with at most `finest` samples along its longer side, on `workers`.
    /// The answer does not depend on them.
    ///
    /// # Errors
    /// See [`Feeler::new`].
    pub fn of(
        body: &Arc<Body>,
        plane: SectionPlane,
        finest: usize,
        workers: &dyn Workers,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, BodyError> {
        let mut section = Self::laid(body, plane, finest);
        let feeler = Feeler::new(body)?;
        let part = |k: usize| {
            let mut feeler = feeler.clone();
            let rows = k * ROWS_PER_PART..section.rows.min((k + 1) * ROWS_PER_PART);
            rows.flat_map(|row| section.feel_row(row, &mut feeler)).collect::<Vec<Felt>>()
        };
        let parts = map_in_order(workers, section.rows.div_ceil(ROWS_PER_PART), 1, part, progress);
        section.samples = parts.concat();
        Ok(section)
    }

    /// The grid, nothing felt yet.
    pub fn laid(body: &Body, plane: SectionPlane, finest: usize) -> Self {
        let [low, high] = plane.reach(body);
        let sides = [high[0] - low[0], high[1] - low[1]];
        let cell = sides[0].max(sides[1]).max(f64::MIN_POSITIVE) / finest.max(2) as f64;
        let [columns, rows] = sides.map(|side| (side / cell).round().max(1.0) as usize);
        let low = low.map(|low| low + 0.5 * cell);
        Self { plane, low, cell, columns, rows, closed: body.mesh().is_closed(), samples: Vec::new() }
    }

    /// Computes one row.
    pub fn feel_row(&self, row: usize, feeler: &mut Feeler) -> Vec<Felt> {
        (0..self.columns).map(|column| feeler.feel(self.point(column, row))).collect()
    }

    /// Place of a sample.
    pub fn point(&self, column: usize, row: usize) -> DVec3 {
        self.plane.point(self.low[0] + column as f64 * self.cell, self.low[1] + row as f64 * self.cell)
    }

    /// Result at a sample; `None` where it was not computed yet.
    pub fn at(&self, column: usize, row: usize) -> Option<&Felt> {
        self.samples.get(row * self.columns + column)
    }

    /// Computes statistics of the section.
    pub fn numbers(&self) -> SectionNumbers {
        let largest = |of: fn(&Felt) -> f64, which: fn(&&Felt) -> bool| {
            self.samples.iter().filter(which).map(of).filter(|x| x.is_finite()).fold(0.0, f64::max)
        };
        let inside = || self.samples.iter().filter(|felt| felt.inside);
        let mut ratios: Vec<f64> =
            inside().filter(|felt| felt.distance > self.cell).map(|felt| felt.depth / felt.distance).collect();
        SectionNumbers {
            inside: inside().count(),
            unseen: inside().filter(|felt| felt.depth <= 0.0).count(),
            deepest_felt: largest(|felt| felt.depth, |_| true),
            deepest: largest(|felt| felt.distance, |felt| felt.inside),
            ratio: [0.1, 0.5].map(|share| quantile(&mut ratios, share)),
        }
    }
}

/// Statistics of a section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionNumbers {
    /// Samples within the mesh.
    pub inside: usize,
    /// Number of those without contact.
    pub unseen: usize,
    /// The largest felt depth, m.
    pub deepest_felt: f64,
    /// The largest distance of an inside sample, m.
    pub deepest: f64,
    /// First decile and median of felt depth as a part of the distance, over inside samples farther
    /// than a cell from the surface.
    pub ratio: [Option<f64>; 2],
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpus::algebra::Alone;

    fn cube() -> Body {
        let side = |k: usize, bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let points: Vec<DVec3> = (0..8).map(|k| DVec3::new(side(k, 0), side(k, 1), side(k, 2))).collect();
        Body::from_convex(&points).expect("the cube has a hull")
    }

    #[test]
    fn section_of_a_cube_has_the_right_depths() {
        let body = Arc::new(cube());
        for axis in Axis::ALL {
            let plane = SectionPlane::through(&body, axis, 0.4);
            let section = Section::of(&body, plane, 24, &Alone, &mut |_| ()).expect("the section can be computed");
            assert_eq!(section.samples.len(), section.columns * section.rows);
            for row in 0..section.rows {
                for column in 0..section.columns {
                    let (felt, p) =
                        (section.at(column, row).expect("the point was probed"), section.point(column, row));
                    let outside = (p.abs() - DVec3::ONE).max(DVec3::ZERO).length();
                    let depth = (DVec3::ONE - p.abs()).min_element();
                    assert_eq!(felt.inside, depth > 0.0);
                    let expected = if felt.inside { depth } else { outside };
                    assert!((felt.distance - expected).abs() < 1e-12);
                    assert!((felt.depth - depth.max(0.0)).abs() < 4.0 * POINT * body.size(), "{p} {felt:?} {depth}");
                }
            }
            let numbers = section.numbers();
            assert!(numbers.inside > 100 && numbers.unseen == 0 && numbers.deepest > 0.7, "{numbers:?}");
        }
    }

    #[test]
    fn plane_cuts_a_cube_in_a_square() {
        let body = cube();
        let plane = SectionPlane::through(&body, Axis::X, 0.3);
        let mesh = body.mesh();
        let lines = plane.cut((0..mesh.triangles().len() as u32).map(|t| mesh.triangle_points(t).to_vec()));
        let length: f64 = lines.iter().map(|[a, b]| (a[0] - b[0]).hypot(a[1] - b[1])).sum();
        assert!((length - 8.0).abs() < 1e-12, "{length}");
    }
}
