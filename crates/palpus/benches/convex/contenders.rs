//! The contenders: palpus' walk, its proof and its march, and parry's GJK and EPA. Each keeps the
//! memory that its interface allows.

use glam::DVec3;
use palpus::algebra::Placement;
use palpus::body::{FeaturePair, Polytope};
use palpus::collision::{Proximity, initial_features, march};
use palpus::depth::{Certainty, CertificateMemory, Depth, DepthScratch, Seed, depth, depth_proven};
use parry3d_f64::math::Pose as ParryPose;
use parry3d_f64::query::contact::contact_support_map_support_map_with_params;
use parry3d_f64::query::gjk::{GJKResult, VoronoiSimplex};
use parry3d_f64::shape::ConvexPolyhedron;

use crate::motions::Motion;
use crate::shapes::{ShapePair, triangles};

/// A pair as each contender wants it.
pub(crate) struct Subject<'s> {
    pub(crate) shape: &'s ShapePair,
    parry_a: ConvexPolyhedron,
    parry_b: ConvexPolyhedron,
}

impl<'s> Subject<'s> {
    pub(crate) fn new(shape: &'s ShapePair) -> Self {
        Self { shape, parry_a: parry_of(&shape.a), parry_b: parry_of(&shape.b) }
    }
}

/// The same polytope for parry: its vertices and the triangles of its faces.
fn parry_of(polytope: &Polytope) -> ConvexPolyhedron {
    ConvexPolyhedron::from_convex_mesh(polytope.vertices().to_vec(), &triangles(polytope)).expect("a convex mesh")
}

/// One pose, in both engines' types.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    pub(crate) palpus: Placement,
    pub(crate) parry: ParryPose,
}

/// The name of a contender, as the tables have it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Name {
    Local,
    Proven,
    March,
    ParryEpa,
    ParryGjk,
}

impl Name {
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Local => "palpus local",
            Self::Proven => "palpus proven",
            Self::March => "palpus march",
            Self::ParryEpa => "parry epa",
            Self::ParryGjk => "parry gjk",
        }
    }
}

/// A contender and what it remembers of the last pose.
pub(crate) enum Contender {
    Local { scratch: Box<DepthScratch>, last: Option<Depth> },
    Proven { scratch: Box<DepthScratch>, memory: Box<CertificateMemory>, last: Option<Depth> },
    March { last: Option<FeaturePair> },
    Parry { name: Name, simplex: Box<VoronoiSimplex>, last: Option<DVec3> },
}

impl Contender {
    /// Returns the contenders that answer the question of a motion.
    pub(crate) fn all(motion: Motion) -> Vec<Self> {
        let names: &[Name] = if motion.overlaps() {
            &[Name::Local, Name::Proven, Name::ParryEpa]
        } else {
            &[Name::March, Name::ParryGjk]
        };
        names.iter().copied().map(Self::of).collect()
    }

    pub(crate) fn of(name: Name) -> Self {
        match name {
            Name::Local => Self::Local { scratch: Box::default(), last: None },
            Name::Proven => Self::Proven { scratch: Box::default(), memory: Box::default(), last: None },
            Name::March => Self::March { last: None },
            Name::ParryEpa | Name::ParryGjk => {
                Self::Parry { name, simplex: Box::new(VoronoiSimplex::new()), last: None }
            }
        }
    }

    pub(crate) fn name(&self) -> Name {
        match self {
            Self::Local { .. } => Name::Local,
            Self::Proven { .. } => Name::Proven,
            Self::March { .. } => Name::March,
            Self::Parry { name, .. } => *name,
        }
    }

    /// Forgets the last pose.
    pub(crate) fn forget(&mut self) {
        match self {
            Self::Local { last, .. } => *last = None,
            Self::Proven { memory, last, .. } => {
                *last = None;
                memory.clear();
            }
            Self::March { last } => *last = None,
            Self::Parry { last, .. } => *last = None,
        }
    }

    /// One query; the separation, negative when the bodies overlap.
    #[inline(never)]
    pub(crate) fn query(&mut self, subject: &Subject<'_>, place: &Place) -> f64 {
        let Subject { shape: ShapePair { a, b, .. }, parry_a, parry_b } = subject;
        match self {
            Self::Local { scratch, last } => {
                let answer = depth(a, b, &place.palpus, &[seed(last.as_ref())], scratch);
                *last = Some(answer);
                -answer.depth
            }
            Self::Proven { scratch, memory, last } => {
                let answer = depth_proven(a, b, &place.palpus, &[seed(last.as_ref())], memory, scratch);
                *last = Some(answer);
                // An unproven depth is no answer.
                if answer.certainty == Certainty::GloballyOptimal { -answer.depth } else { f64::NAN }
            }
            Self::March { last } => {
                let start = last.unwrap_or_else(|| initial_features(a, b, &place.palpus));
                let answer = march(a, b, &place.palpus, start);
                *last = Some(answer.features);
                match answer.proximity {
                    Proximity::Disjoint(closest) => closest.distance,
                    Proximity::Overlapping(_) => f64::NAN,
                }
            }
            Self::Parry { simplex, last, .. } => {
                // b is parry's first shape, so that the placement is the same.
                let answer = contact_support_map_support_map_with_params(
                    &place.parry,
                    parry_b,
                    parry_a,
                    f64::MAX,
                    simplex,
                    *last,
                );
                match answer {
                    GJKResult::ClosestPoints(on_b, on_a, normal) => {
                        *last = Some(normal);
                        (on_a - on_b).dot(normal)
                    }
                    _ => f64::NAN,
                }
            }
        }
    }
}

/// The start from the last answer.
fn seed(last: Option<&Depth>) -> Seed {
    last.map_or(Seed::CentroidLine, Depth::seed)
}
