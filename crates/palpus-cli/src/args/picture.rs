//! Arguments of the commands that make pictures.

use clap::{Args, ValueEnum};

/// Look of pictures.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Pictures")]
pub(crate) struct PictureArguments {
    /// Width and height, pixels.
    #[arg(long, default_value = "1280x800", value_name = "WxH")]
    pub(crate) size: Size,
    /// The side from which the picture is taken.
    #[arg(long, value_enum, default_value_t = Direction::Oblique, value_name = "SIDE")]
    pub(crate) from: Direction,
    /// Zoom; at 1 everything is in the picture.
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR")]
    pub(crate) zoom: f64,
    /// Uses the dark theme.
    #[arg(long)]
    pub(crate) dark: bool,
    /// Gives each convex piece a colour of its own, also in pictures of runs.
    #[arg(long)]
    pub(crate) pieces: bool,
    /// Gives each body one opaque colour.
    #[arg(long, conflicts_with = "pieces")]
    pub(crate) plain: bool,
    /// Draws the edges of the triangles.
    #[arg(long)]
    pub(crate) wireframe: bool,
    /// Draws no numbers and no legend.
    #[arg(long)]
    pub(crate) no_words: bool,
}

impl Default for PictureArguments {
    /// Returns the values without any option.
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

/// Smallest side of a picture, pixels; smaller pictures show nothing.
const MIN_SIDE: usize = 16;
/// Largest side of a picture, pixels; larger pictures need more memory than most machines have.
const MAX_SIDE: usize = 8192;

/// The side from which a picture is taken.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Direction {
    /// From the front, the right and above.
    Oblique,
    /// Looks along +y.
    Front,
    /// Looks along −y.
    Back,
    /// Looks along +x.
    Left,
    /// Looks along −x.
    Right,
    /// Looks along −z.
    Top,
    /// Looks along +z.
    Bottom,
}
