//! Arguments of whatever makes pictures.

use clap::{Args, ValueEnum};

/// How pictures look.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Pictures")]
pub(crate) struct PictureArguments {
    /// Width and height, pixels.
    #[arg(long, default_value = "1280x800", value_name = "WxH")]
    pub(crate) size: Size,
    /// From where.
    #[arg(long, value_enum, default_value_t = Direction::Oblique, value_name = "SIDE")]
    pub(crate) from: Direction,
    /// How much nearer than where everything is in the picture.
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR")]
    pub(crate) zoom: f64,
    /// Light on dark.
    #[arg(long)]
    pub(crate) dark: bool,
    /// Each convex piece in a colour of its own, also in pictures of runs.
    #[arg(long)]
    pub(crate) pieces: bool,
    /// One colour a body, and nothing to be seen through it.
    #[arg(long, conflicts_with = "pieces")]
    pub(crate) plain: bool,
    /// The sides of the triangles.
    #[arg(long)]
    pub(crate) wireframe: bool,
    /// Neither numbers nor legend.
    #[arg(long)]
    pub(crate) no_words: bool,
}

impl Default for PictureArguments {
    /// As when nothing is said.
    fn default() -> Self {
        let size = Size([1280, 800]);
        let from = Direction::Oblique;
        Self { size, from, zoom: 1.0, dark: false, pieces: false, plain: false, wireframe: false, no_words: false }
    }
}

/// Width and height of a picture, pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Size(pub(crate) [usize; 2]);

impl std::str::FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |text: &str| text.parse().ok().filter(|side| (MIN_SIDE..=MAX_SIDE).contains(side));
        let size = text.split_once('x').and_then(|(width, height)| Some(Self([side(width)?, side(height)?])));
        size.ok_or_else(|| format!("a size is two numbers from {MIN_SIDE} to {MAX_SIDE}, such as 1280x800"))
    }
}

/// Pixels: smaller pictures show nothing.
const MIN_SIDE: usize = 16;
/// Pixels: larger ones need more memory than most machines have.
const MAX_SIDE: usize = 8192;

/// From where a picture is taken.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Direction {
    /// From the front, the right and above.
    Oblique,
    /// Along +y.
    Front,
    /// Along −y.
    Back,
    /// Along +x.
    Left,
    /// Along −x.
    Right,
    /// Along −z.
    Top,
    /// Along +z.
    Bottom,
}
