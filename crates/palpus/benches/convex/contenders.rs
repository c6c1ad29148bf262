//! The contenders: the walk, the proof and the march of palpus, and GJK and EPA of parry. Each
//! contender caches data of the previous pose if its interface can use such data.

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

/// A shape pair in the types of both engines.
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

/// Converts a polytope to parry's type.
fn parry_of(polytope: &Polytope) -> ConvexPolyhedron {
    ConvexPolyhedron::from_convex_mesh(polytope.vertices().to_vec(), &triangles(polytope))
        .expect("the polytope is a convex mesh")
}

/// A pose in the types of both engines.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    pub(crate) palpus: Placement,
    pub(crate) parry: ParryPose,
}

/// Identifies a contender.
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

/// A contender with its working memory and the cached data of the previous pose.
pub(crate) enum Contender {
    Local { scratch: Box<DepthScratch>, last: Option<Depth> },
    Proven { scratch: Box<DepthScratch>, memory: Box<CertificateMemory>, last: Option<Depth> },
    March { last: Option<FeaturePair> },
    Parry { name: Name, simplex: Box<VoronoiSimplex>, last: Option<DVec3> },
}

impl Contender {
    /// Returns the contenders for a motion: depth queries if the bodies overlap, distance queries
    /// if they do not.
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

    /// Drops the cached data of the previous pose.
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

    /// Runs one query. Returns the separation, which is negative if the bodies overlap; NaN if the
    /// query has no result.
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
                // A depth without proof does not count as a result.
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
                // Body b is the first shape of parry, because parry then uses the same pose as
                // palpus.
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

/// Returns the seed of the walk from the previous result.
fn seed(last: Option<&Depth>) -> Seed {
    last.map_or(Seed::CentroidLine, Depth::seed)
}
