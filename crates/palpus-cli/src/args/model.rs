//! Arguments of the commands that take models without a scene.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use palpus::algebra::tolerance::DEPTH_BUDGET;

use super::PictureArguments;

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus query spoon.obj cup.obj --poses poses.csv --out result.csv --tolerance 0.01\n  make-poses | palpus query spoon.obj cup.obj --poses - | head\n\nPOSES has the columns tx,ty,tz,qx,qy,qz,qw: A placed in B's frame, in model units. The result has one row for each pose, in B's frame. separation is the distance, or minus the depth of the deepest contact; point_a - point_b = separation * normal.\ncertified: the distance, or the depth of every overlapping pair of convex pieces, is proven to be the smallest. contained: 1 A lies inside B's solid, 2 B inside A's, 0 neither."
)]
pub(crate) struct QueryArguments {
    /// The model of body A (obj, stl, ply, off, gltf, glb); `-` reads standard input.
    pub(crate) a: PathBuf,
    /// The model of body B, or `-`.
    pub(crate) b: PathBuf,
    /// Poses of A in B's frame (CSV); `-` reads standard input.
    #[arg(long, value_name = "F.csv")]
    pub(crate) poses: PathBuf,
    /// File for the results (CSV) [default: standard output, as for `-`].
    #[arg(long, value_name = "R.csv")]
    pub(crate) out: Option<PathBuf>,
    /// Prints one JSON document with the same results.
    #[arg(long)]
    pub(crate) json: bool,
    /// Distance below which pieces are in contact, model units [default: 1 % of the smaller model's
    /// diagonal].
    #[arg(long, value_name = "T")]
    pub(crate) tolerance: Option<f64>,
    /// Writes every single contact to this file (CSV).
    #[arg(long, value_name = "C.csv")]
    pub(crate) contacts: Option<PathBuf>,
    /// Uses only the fast local search of the servo loop, without proof that a depth is the
    /// smallest; certified is then false in overlap.
    #[arg(long)]
    pub(crate) local: bool,
}

#[derive(Debug, Args)]
#[command(
    mut_arg("out", |out| out.required(true)),
    after_help = "Examples:\n  palpus depth spoon.obj cup.obj --poses poses.csv --out depths.csv\n  palpus depth peg.stl hole.stl --poses path.csv --out depths.csv --gap 0.01mm --unit mm\n\nPOSES has the columns tx,ty,tz,qx,qy,qz,qw: A placed in B's frame, in model units. The result has one row for each pose, in B's frame. No translation shorter than lower separates the bodies. Moving A by (tx, ty, tz), which has the length upper, separates them.\ncertified: upper - lower is at most the gap. contained: 1 A lies inside B's solid, 2 B inside A's, 0 neither. distance: between the surfaces; negative if one body lies inside the other, empty if the surfaces cross."
)]
pub(crate) struct DepthArguments {
    #[command(flatten)]
    pub(crate) depth: PairArguments,
}

/// Two models, their poses, and how close the bounds of their depth must be.
#[derive(Debug, Args)]
pub(crate) struct PairArguments {
    /// The model of body A (obj, stl, ply, off, gltf, glb); `-` reads standard input.
    pub(crate) a: PathBuf,
    /// The model of body B, or `-`.
    pub(crate) b: PathBuf,
    /// Poses of A in B's frame (CSV); `-` reads standard input.
    #[arg(long, value_name = "F.csv")]
    pub(crate) poses: PathBuf,
    /// The file of the results (CSV); `-` writes to standard output.
    #[arg(long, value_name = "R.csv")]
    pub(crate) out: Option<PathBuf>,
    /// Largest difference of the bounds: a share of the smaller model's diagonal (1%), or a length
    /// (0.01mm, or 0.01 in model units).
    #[arg(long, value_name = "GAP", default_value = "1%")]
    pub(crate) gap: String,
    /// The unit of the models' coordinates, for a gap with a unit: m, cm, mm, inch, …
    #[arg(long, value_name = "UNIT", default_value = "mm")]
    pub(crate) unit: String,
    /// Largest number of evaluations for a pose. If this number is reached, the bounds are farther
    /// apart than the gap and certified is false.
    #[arg(long, value_name = "N", default_value_t = DEPTH_BUDGET)]
    pub(crate) budget: u64,
    /// Accepts only translations from which A can leave B in a straight line, not translations into
    /// pockets of B. The lower bound is still the bound for all separating translations.
    #[arg(long)]
    pub(crate) outside: bool,
    /// Prints a summary as one JSON document.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  palpus clearance peg.obj hole.obj --poses path.csv --html clearance.html\n\nPOSES has the columns tx,ty,tz,qx,qy,qz,qw: A placed in B's frame, in model units. The clearance is the distance of separate bodies, and minus the depth (its upper bound) of overlapping ones. Of neighbouring poses in the file, only the tightest pose is listed."
)]
pub(crate) struct ClearanceArguments {
    #[command(flatten)]
    pub(crate) depth: PairArguments,
    /// Writes a page with pictures of the tightest places (HTML).
    #[arg(long, value_name = "PAGE.html")]
    pub(crate) html: Option<PathBuf>,
    /// Number of the tightest places to list and show.
    #[arg(long, value_name = "N", default_value_t = 5)]
    pub(crate) tightest: usize,
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  palpus prepare cup.obj --pieces cup_pieces.obj")]
pub(crate) struct PrepareArguments {
    /// The models; `-` reads standard input.
    #[arg(required = true)]
    pub(crate) models: Vec<PathBuf>,
    /// Writes every convex piece as a group of an OBJ file (one model only).
    #[arg(long, value_name = "OUT.obj")]
    pub(crate) pieces: Option<PathBuf>,
    /// Prints one JSON document.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus inspect cup.obj --json\n  palpus inspect cup.obj --sweeps\n  palpus inspect cup.obj --picture cup.png"
)]
pub(crate) struct InspectArguments {
    /// The model; `-` reads standard input.
    pub(crate) model: PathBuf,
    /// Also presses small probes into a closed model, to measure to which depth and how exactly
    /// contact is felt.
    #[arg(long)]
    pub(crate) sweeps: bool,
    /// Number of probes of each sweep.
    #[arg(long, default_value_t = 1000, value_name = "N", requires = "sweeps")]
    pub(crate) samples: usize,
    /// Writes a picture (PNG) of the model with its convex pieces in colours.
    #[arg(long, value_name = "FILE")]
    pub(crate) picture: Option<PathBuf>,
    /// Prints one JSON document.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus view cup.obj                                    a window\n  palpus view cup.obj --screenshot cup.png\n  palpus view cup.obj --exploded --dark --screenshot pieces.png\n  palpus view cup.obj --gauss 3 --screenshot gauss.png\n  palpus view cup.obj --depth --axis z --offset 12.5 --screenshot depth.png\n\nDepth: at each point of the plane, the depth that the servo loop computes for a probe as small as a point, the distance to the mesh, and the difference of both."
)]
pub(crate) struct ViewArguments {
    /// The model; `-` reads standard input.
    pub(crate) model: PathBuf,
    /// Writes a picture (PNG) instead of opening a window.
    #[arg(long, value_name = "FILE")]
    pub(crate) screenshot: Option<PathBuf>,
    /// Shows the convex pieces moved apart by this share of their distance from the middle.
    #[arg(long, value_name = "FACTOR", num_args = 0..=1, default_missing_value = "0.6")]
    pub(crate) exploded: Option<f64>,
    /// Shows a piece and its Gauss map, with the normals of the mesh and the normals that only the
    /// hull has. Pieces count from 0 [default: the piece with most faces].
    #[arg(long, value_name = "PIECE", num_args = 0..=1, conflicts_with_all = ["exploded", "depth"])]
    pub(crate) gauss: Option<Option<u32>>,
    /// Shows the felt depth on a plane through the body, and for closed meshes also the true depth.
    #[arg(long, conflicts_with = "exploded")]
    pub(crate) depth: bool,
    /// Axis of the model that is normal to the plane.
    #[arg(long, value_enum, default_value_t = AxisName::Y, value_name = "AXIS")]
    pub(crate) axis: AxisName,
    /// Position of the plane on the axis, model units [default: the middle of the model].
    #[arg(long, value_name = "OFFSET", allow_negative_numbers = true, requires = "depth")]
    pub(crate) offset: Option<f64>,
    /// Number of points along the longer side of the plane.
    #[arg(long, default_value_t = 320, value_name = "N", value_parser = clap::value_parser!(u32).range(8..=4096), requires = "depth")]
    pub(crate) fineness: u32,
    /// Look of the picture.
    #[command(flatten)]
    pub(crate) picture: PictureArguments,
}

/// An axis of a model.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum AxisName {
    /// The plane is seen along −x.
    X,
    /// The plane is seen along +y.
    Y,
    /// The plane is seen along −z.
    Z,
}
