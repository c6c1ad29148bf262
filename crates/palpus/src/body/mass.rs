//! Volume, centre of mass and inertia.
//!
//! 1. For a closed mesh, sum over the signed tetrahedra between a reference point and all triangles
//!    (B. Mirtich, *Fast and accurate computation of polyhedral mass properties*, 1996, in the
//!    form of J. Blow and A. Binstock, *How to find the inertia tensor*, 2004). In the first pass,
//!    the reference point is the middle of the bounding box. In the second pass, it is the
//!    centre of mass from the first pass. Therefore a model far from its origin loses no precision.
//! 2. For an open mesh, or a mesh that encloses no volume, use the properties of its convex hull.
//! 3. If the hull is flat, use the properties of a thin sheet over the mesh's triangles.
//!
//! The density is 1. If closed components overlap, the common volume counts twice.

use glam::{DMat3, DVec3};

use super::{Hull, Mesh, convex_hull};
use crate::algebra::{eigen, tolerance};

/// Source of the mass properties.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MassSource {
    /// The solid inside the closed mesh.
    Mesh,
    /// The convex hull, because the mesh is open or encloses no volume.
    Hull,
    /// A thin sheet over the triangles, because even the hull is flat.
    Sheet,
}

impl std::fmt::Display for MassSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Mesh => "mass and inertia are those of the closed solid",
            Self::Hull => "the mesh does not enclose a volume: mass and inertia are those of its convex hull",
            Self::Sheet => "the mesh is flat: mass and inertia are those of a thin sheet",
        })
    }
}

/// Mass properties at density 1. Multiply volume and inertia by the density to get mass and
/// inertia.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Volume in cubed model units; positive.
    pub volume: f64,
    /// Centre of mass in the model's frame, in model units.
    pub center_of_mass: DVec3,
    /// Symmetric inertia tensor about the centre of mass, along the model's axes, in model units to
    /// the fifth power.
    pub inertia: DMat3,
    /// Source of these properties.
    pub source: MassSource,
}

/// Principal moments and axes of an inertia tensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipalInertia {
    /// Principal moments in ascending order, in the unit of [`MassProperties::inertia`].
    pub moments: DVec3,
    /// A rotation matrix. Its columns are the unit axes of the moments.
    pub axes: DMat3,
}

impl MassProperties {
    /// Computes the mass properties of `mesh` by the first of these sources that applies: the
    /// closed solid, the convex hull, a thin sheet.
    pub fn new(mesh: &Mesh) -> Self {
        let middle = mesh.bounds().min + (mesh.bounds().max - mesh.bounds().min) * 0.5;
        let size = mesh.bounding_diagonal();
        let solid = |triangles: &[[DVec3; 3]]| {
            let first = Moments::of_solid(triangles, middle);
            (first.volume > tolerance::LEAST_VOLUME * size * size * size)
                .then(|| Moments::of_solid(triangles, middle + first.first / first.volume))
        };
        let triangles: Vec<[DVec3; 3]> = (0..mesh.triangles().len() as u32).map(|t| mesh.triangle_points(t)).collect();
        if mesh.is_closed()
            && let Some(moments) = solid(&triangles)
        {
            return moments.properties(MassSource::Mesh);
        }
        if let Ok(Hull::Solid { polytope, .. }) = convex_hull(mesh.vertices(), tolerance::COPLANAR * size) {
            let fan = |f: u32| polytope.face_vertices(f).fan().map(|corners| corners.map(|v| polytope.vertex(v)));
            let faces: Vec<[DVec3; 3]> = (0..polytope.face_count() as u32).flat_map(fan).collect();
            if let Some(moments) = solid(&faces) {
                return moments.properties(MassSource::Hull);
            }
        }
        let thickness = tolerance::SHEET_THICKNESS * size;
        let first = Moments::of_sheet(&triangles, thickness, middle);
        Moments::of_sheet(&triangles, thickness, middle + first.first / first.volume).properties(MassSource::Sheet)
    }

    /// Computes the principal moments and axes of the inertia.
    pub fn principal(&self) -> PrincipalInertia {
        let (moments, axes) = eigen(self.inertia);
        PrincipalInertia { moments, axes }
    }
}

/// Volume integrals of a body over x, the position relative to `origin`.
struct Moments {
    origin: DVec3,
    volume: f64,
    /// ∫ x dV.
    first: DVec3,
    /// ∫ x xᵀ dV.
    second: DMat3,
}

impl Moments {
    fn of_solid(triangles: &[[DVec3; 3]], origin: DVec3) -> Self {
        let mut sum = Self { origin, volume: 0.0, first: DVec3::ZERO, second: DMat3::ZERO };
        for corners in triangles {
            let [a, b, c] = corners.map(|p| p - origin);
            let volume = a.dot(b.cross(c)) / 6.0;
            let total = a + b + c;
            sum.volume += volume;
            sum.first += total * (volume / 4.0);
            sum.second += (square(a) + square(b) + square(c) + square(total)) * (volume / 20.0);
        }
        sum
    }

    fn of_sheet(triangles: &[[DVec3; 3]], thickness: f64, origin: DVec3) -> Self {
        let mut sum = Self { origin, volume: 0.0, first: DVec3::ZERO, second: DMat3::ZERO };
        for corners in triangles {
            let [a, b, c] = corners.map(|p| p - origin);
            let volume = 0.5 * (b - a).cross(c - a).length() * thickness;
            let total = a + b + c;
            sum.volume += volume;
            sum.first += total * (volume / 3.0);
            sum.second += (square(a) + square(b) + square(c) + square(total)) * (volume / 12.0);
        }
        sum
    }

    /// Moves the moments from `origin` to the centre of mass by Steiner's theorem.
    fn properties(&self, source: MassSource) -> MassProperties {
        let offset = self.first / self.volume;
        let second = self.second - square(offset) * self.volume;
        let trace = second.x_axis.x + second.y_axis.y + second.z_axis.z;
        let inertia = DMat3::from_diagonal(DVec3::splat(trace)) - second;
        MassProperties { volume: self.volume, center_of_mass: self.origin + offset, inertia, source }
    }
}

/// Returns the matrix x xᵀ.
fn square(x: DVec3) -> DMat3 {
    DMat3::from_cols(x * x.x, x * x.y, x * x.z)
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::algebra::Pose;
    use crate::algebra::Random;
    use crate::body::PolygonSoup;
    use crate::body::shapes::{cuboid, torus};

    fn placed(mesh: &Mesh, pose: &Pose, scale: f64) -> Mesh {
        let vertices = mesh.vertices().iter().map(|&p| pose.point(p * scale)).collect();
        Mesh::from_soup(&PolygonSoup::from_triangles(vertices, mesh.triangles())).unwrap().0
    }

    fn assert_near(a: &MassProperties, b: &MassProperties, relative: f64, size: f64) {
        assert_eq!(a.source, b.source);
        assert!((a.volume - b.volume).abs() <= relative * a.volume, "{a:?} {b:?}");
        assert!((a.center_of_mass - b.center_of_mass).length() <= relative * size, "{a:?} {b:?}");
        assert!(a.inertia.abs_diff_eq(b.inertia, relative * a.volume * size * size), "{a:?} {b:?}");
    }

    #[test]
    fn box_and_tetrahedron_have_their_textbook_inertia() {
        let (x, y, z) = (1.0, 2.0, 3.0);
        let mass = MassProperties::new(&cuboid(DVec3::ZERO, DVec3::new(x, y, z)));
        let inertia =
            DMat3::from_diagonal(DVec3::new(y * y + z * z, x * x + z * z, x * x + y * y) * (x * y * z / 12.0));
        let center_of_mass = DVec3::new(x, y, z) / 2.0;
        let book = MassProperties { volume: 6.0, center_of_mass, inertia, source: MassSource::Mesh };
        assert_near(&mass, &book, 1e-14, 3.0);

        let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let soup = PolygonSoup::from_triangles(corners, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);
        let mass = MassProperties::new(&Mesh::from_soup(&soup).unwrap().0);
        // About the right-angled corner, ∫x² = 1/60 and ∫xy = 1/120. Steiner's theorem moves them
        // to the centroid.
        let (own, product) = (1.0 / 60.0 - 1.0 / 96.0, 1.0 / 120.0 - 1.0 / 96.0);
        let inertia = DMat3::from_cols(
            DVec3::new(2.0 * own, -product, -product),
            DVec3::new(-product, 2.0 * own, -product),
            DVec3::new(-product, -product, 2.0 * own),
        );
        let book = MassProperties { volume: 1.0 / 6.0, center_of_mass: DVec3::splat(0.25), inertia, ..mass };
        assert_near(&mass, &book, 1e-14, 1.0);
    }

    #[test]
    fn a_fine_torus_approaches_the_smooth_torus() {
        let (major, minor) = (1.0, 0.4);
        let mass = MassProperties::new(&torus(major, minor, 400, 200));
        let volume = 2.0 * std::f64::consts::PI.powi(2) * major * minor * minor;
        let (about_z, across) = (major * major + 0.75 * minor * minor, 0.5 * major * major + 0.625 * minor * minor);
        let inertia = DMat3::from_diagonal(DVec3::new(across, across, about_z) * volume);
        let smooth = MassProperties { volume, center_of_mass: DVec3::ZERO, inertia, source: MassSource::Mesh };
        assert_near(&mass, &smooth, 1e-3, 1.4);
    }

    #[test]
    fn mass_properties_follow_a_moved_turned_scaled_mesh() {
        const SEED: u64 = 0x9e1d;
        let mut random = Random::new(SEED);
        let mesh = torus(1.0, 0.4, 12, 8);
        let mesh = placed(&mesh, &Pose::from_translation(DVec3::new(0.1, 0.2, 0.3)), 0.7);
        let mass = MassProperties::new(&mesh);
        for far in [0.0, 1e3, 1e6] {
            let scale = 1.5 + random.signed();
            let rotation = DQuat::from_scaled_axis(random.vector() * 3.0);
            let pose = Pose::new(rotation, random.vector() * far);
            let turn = DMat3::from_quat(pose.rotation);
            let expected = MassProperties {
                volume: mass.volume * scale.powi(3),
                center_of_mass: pose.point(mass.center_of_mass * scale),
                inertia: turn * mass.inertia * turn.transpose() * scale.powi(5),
                source: MassSource::Mesh,
            };
            // The only allowed error is the rounding of the large coordinates.
            assert_near(&MassProperties::new(&placed(&mesh, &pose, scale)), &expected, 1e-13 + far * 1e-15, scale);
        }
    }

    #[test]
    fn open_and_flat_meshes_have_a_mass() {
        let closed = cuboid(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0));
        let open = PolygonSoup::from_triangles(closed.vertices().to_vec(), &closed.triangles()[..10]);
        let expected = MassProperties { source: MassSource::Hull, ..MassProperties::new(&closed) };
        assert_near(&MassProperties::new(&Mesh::from_soup(&open).unwrap().0), &expected, 1e-13, 3.0);

        let corners = vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let mut plate = PolygonSoup { vertices: corners, ..PolygonSoup::new() };
        plate.push_face(&[0, 1, 2, 3]);
        let mass = MassProperties::new(&Mesh::from_soup(&plate).unwrap().0);
        assert_eq!(mass.source, MassSource::Sheet);
        assert!((mass.center_of_mass - DVec3::new(0.5, 0.5, 0.0)).length() < 1e-15);
        let moments = mass.principal().moments / mass.volume;
        assert!((moments - DVec3::new(1.0 / 12.0, 1.0 / 12.0, 1.0 / 6.0)).length() < 1e-14);
    }
}
