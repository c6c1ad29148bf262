//! The felt penetration depth on a plane through a body.
//!
//! A *section* is a grid of points on a plane perpendicular to one of the model's axes. At each
//! point three values are computed:
//!
//! * *felt depth*: a probe as small as a point ([`POINT`]) is placed at the point and queried as in
//!   the servo loop ([`ContactQuery`], without memory of other points). The felt depth is the
//!   depth of the deepest contact, which the paper's eq. 5 uses, minus the probe's own size. The
//!   felt depth is zero without contact;
//! * *distance*: the distance to the nearest point of the mesh, on either side;
//! * *inside*: whether the point is inside the mesh, if the mesh is closed.
//!
//! Ideally, the felt depth is equal to the distance inside and zero outside. The pieces can give a
//! smaller depth. Inside points without contact are *unseen*. Contact directions are not compared
//! here (`palpus inspect --sweeps` compares them).

use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::{Pose, Workers, map_in_order, quantile};
use palpus::body::{Body, BodyError};
use palpus::detect::{ContactQuery, QuerySettings};

/// Size of the probing point, relative to the body's size. Near an edge, a felt depth may be wrong
/// by this much.
pub const POINT: f64 = 1e-5;
/// Distance by which a section extends beyond the body's box, relative to the body's size.
const MARGIN: f64 = 0.08;
/// Capacity for the contacts at a point.
const CAPACITY: usize = 1024;
/// Number of rows that one worker computes at a time.
const ROWS_PER_PART: usize = 16;

/// The model's axis that is normal to a plane.
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
    /// All three axes.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Indices of the coordinates normal to the plane, to the right, and up.
    pub(crate) fn coordinates(self) -> [usize; 3] {
        match self {
            Self::X => [0, 1, 2],
            Self::Y => [1, 0, 2],
            Self::Z => [2, 0, 1],
        }
    }

    /// Returns the axis's letter.
    pub fn name(self) -> &'static str {
        ["x", "y", "z"][self.coordinates()[0]]
    }
}

/// A plane normal to an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionPlane {
    /// The axis.
    pub axis: Axis,
    /// Offset of the plane along its normal, m.
    pub offset: f64,
}

impl SectionPlane {
    /// Returns the plane at this share of the body's box, from 0 to 1.
    pub fn through(body: &Body, axis: Axis, part: f64) -> Self {
        let (bounds, k) = (body.mesh().bounds(), axis.coordinates()[0]);
        Self { axis, offset: bounds.min[k] + part * (bounds.max[k] - bounds.min[k]) }
    }

    /// Returns the point of the plane with these coordinates to the right and up.
    pub fn point(&self, right: f64, up: f64) -> DVec3 {
        let [across, to_right, upwards] = self.axis.coordinates();
        let mut point = DVec3::ZERO;
        (point[across], point[to_right], point[upwards]) = (self.offset, right, up);
        point
    }

    /// Returns the corners of the rectangle that a section on this plane covers, in order.
    pub fn corners(&self, body: &Body) -> [DVec3; 4] {
        let [low, high] = self.reach(body);
        [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]].map(|[u, v]| self.point(u, v))
    }

    /// Returns the lower left and the upper right corner of the rectangle that a section covers, to
    /// the right and up.
    fn reach(&self, body: &Body) -> [[f64; 2]; 2] {
        let (bounds, margin) = (body.mesh().bounds(), MARGIN * body.size());
        let [_, right, up] = self.axis.coordinates();
        [[bounds.min[right] - margin, bounds.min[up] - margin], [bounds.max[right] + margin, bounds.max[up] + margin]]
    }

    /// Returns the line segments in which `polygons` intersect the plane: the coordinates of both
    /// ends, to the right and up. A polygon is convex and given by its corners.
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
    /// Distance to the nearest point of the mesh, m.
    pub distance: f64,
    /// True if the point is inside a closed mesh; false for an open mesh.
    pub inside: bool,
    /// Depth of the deepest contact, m; zero without contact.
    pub depth: f64,
}

/// A probe as small as a point, with its queries.
#[derive(Clone, Debug)]
pub struct PointProbe {
    query: ContactQuery,
}

impl PointProbe {
    /// Creates a probe for `body`.
    ///
    /// # Errors
    ///
    /// Fails if the body is so small that no smaller probe exists.
    pub fn new(body: &Arc<Body>) -> Result<Self, BodyError> {
        let radius = POINT * body.size();
        // Rotated, so that no face of the probe is parallel to typical faces of models.
        let axes = TURNED.map(|axis| DVec3::from_array(axis) * radius);
        let corners: Vec<DVec3> = axes.iter().flat_map(|&axis| [axis, -axis]).collect();
        let probe = Arc::new(Body::from_convex(&corners)?);
        let settings = QuerySettings { tolerance: 0.0, capacity: CAPACITY, ..QuerySettings::default() };
        Ok(Self { query: ContactQuery::new(probe, body.clone(), settings) })
    }

    /// Returns the values at `point`, in the body's frame.
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

/// Orthonormal axes (6, 3, 2)/7, with permuted components and signs.
const TURNED: [[f64; 3]; 3] =
    [[6.0 / 7.0, 3.0 / 7.0, 2.0 / 7.0], [-3.0 / 7.0, 2.0 / 7.0, 6.0 / 7.0], [2.0 / 7.0, -6.0 / 7.0, 3.0 / 7.0]];

/// Depths on a plane. Samples are stored in rows from the lower left corner, [`Section::cell`]
/// apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// The plane.
    pub plane: SectionPlane,
    /// Position of the first sample, to the right and up, m.
    pub low: [f64; 2],
    /// Distance between samples, m.
    pub cell: f64,
    /// Number of samples in a row.
    pub columns: usize,
    /// Number of rows.
    pub rows: usize,
    /// True if the mesh is closed, so that points can be inside.
    pub closed: bool,
    /// Values, row by row.
    pub samples: Vec<Felt>,
}

impl Section {
    /// Computes the depths on a grid with at most `finest` samples along its longer side, on
    /// `workers`. The result does not depend on the workers.
    ///
    /// # Errors
    ///
    /// See [`PointProbe::new`].
    pub fn of(
        body: &Arc<Body>,
        plane: SectionPlane,
        finest: usize,
        workers: &dyn Workers,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, BodyError> {
        let mut section = Self::laid(body, plane, finest);
        let probe = PointProbe::new(body)?;
        let part = |k: usize| {
            let mut probe = probe.clone();
            let rows = k * ROWS_PER_PART..section.rows.min((k + 1) * ROWS_PER_PART);
            rows.flat_map(|row| section.feel_row(row, &mut probe)).collect::<Vec<Felt>>()
        };
        let parts = map_in_order(workers, section.rows.div_ceil(ROWS_PER_PART), 1, part, progress);
        section.samples = parts.concat();
        Ok(section)
    }

    /// Creates the grid without values.
    pub fn laid(body: &Body, plane: SectionPlane, finest: usize) -> Self {
        let [low, high] = plane.reach(body);
        let sides = [high[0] - low[0], high[1] - low[1]];
        let cell = sides[0].max(sides[1]).max(f64::MIN_POSITIVE) / finest.max(2) as f64;
        let [columns, rows] = sides.map(|side| (side / cell).round().max(1.0) as usize);
        let low = low.map(|low| low + 0.5 * cell);
        Self { plane, low, cell, columns, rows, closed: body.mesh().is_closed(), samples: Vec::new() }
    }

    /// Computes one row.
    pub fn feel_row(&self, row: usize, probe: &mut PointProbe) -> Vec<Felt> {
        (0..self.columns).map(|column| probe.feel(self.point(column, row))).collect()
    }

    /// Returns the position of a sample.
    pub fn point(&self, column: usize, row: usize) -> DVec3 {
        self.plane.point(self.low[0] + column as f64 * self.cell, self.low[1] + row as f64 * self.cell)
    }

    /// Returns the values at a sample; `None` if not computed yet.
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
    /// Number of samples inside the mesh.
    pub inside: usize,
    /// Number of inside samples without contact.
    pub unseen: usize,
    /// The largest felt depth, m.
    pub deepest_felt: f64,
    /// The largest distance of an inside sample, m.
    pub deepest: f64,
    /// First decile and median of the felt depth relative to the distance, over inside samples that
    /// are farther than a cell from the surface.
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
