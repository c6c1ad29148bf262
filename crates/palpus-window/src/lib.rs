//! Pictures, the window and the plots of palpus.
//!
//! A [`Scene`] holds the bodies and a [`Moment`], which has contacts and forces. A [`Camera`] and a
//! [`Style`] define the view and the look. [`paint`] makes a [`Picture`] without a display, a
//! graphics library or a system package, bit for bit the same on every run. [`Picture::write_png`]
//! saves it.
//!
//! * `camera` — the camera: orbit, pan, zoom, standard views.
//! * `solid` — a body as triangles with a normal for each corner and a piece for each triangle,
//!   whole or with its pieces apart.
//! * `coarse` — a solid with fewer triangles, for software rendering.
//! * `moment` — the visible state of one tick; filled in the servo thread without allocation.
//! * `moments` — the moments of a whole run, within a memory limit.
//! * `scene` — bodies, a moment, a caption.
//! * `raster` — draws triangles into a layer of colours and depths.
//! * `marks` — dots, arrows and turning arrows, in a size that suits the picture.
//! * `letters` — a font made of strokes.
//! * `paint` — combines the layers: bodies, then translucent bodies, then marks, then text.
//! * `piece`, `gauss` — one convex piece: its numbers, and its Gauss map on the sphere of
//!   directions.
//! * `section`, `section_panel`, `section_picture` — the felt depth on a plane through a body: the
//!   values, a picture, and a page.
//! * `sheet` — a page for flat drawings.
//! * `ground` — a plane below the bodies with a grid, and their shadow on it.
//! * `xray` — the region in which a body is transparent, because it hides a probe.
//! * `picture`, `png`, `palette` — pixels, and how they are stored.
//! * `window` — shows the scene of a run in a window, drawn by the graphics library (feature
//!   `gui`).
//!
//! Lengths are in metres. Frames are named in the documentation of each item. "View" means the
//! camera's frame: x right, y up, z towards the viewer.

mod camera;
#[cfg(feature = "gui")]
mod coarse;
mod gauss;
mod ground;
mod letters;
mod marks;
mod moment;
mod moments;
mod paint;
mod palette;
mod picture;
mod piece;
mod png;
mod raster;
mod scene;
mod section;
mod section_panel;
mod section_picture;
mod sheet;
mod solid;
mod style;
#[cfg(feature = "gui")]
mod window;
mod xray;

pub use camera::{Camera, Projected, View};
pub use gauss::{PieceOf, before_surface_faces, paint_gauss, paint_gauss_half};
pub use moment::{Moment, ShownAnchor, ShownCluster, ShownContact};
pub use moments::{Moments, Progress};
pub use paint::paint;
pub use picture::{Picture, Rgb};
pub use piece::{PieceNumbers, richest_piece};
pub use scene::{BodyPart, Look, Scene, ShownBody, Unit};
pub use section::{Axis, Felt, POINT, PointProbe, Section, SectionNumbers, SectionPlane};
pub use section_panel::{SectionOf, Shown, contour_step, depth_colour, paint_section_panel};
pub use section_picture::paint_section;
pub use solid::Solid;
pub use style::{Style, Theme};
#[cfg(feature = "gui")]
pub use window::{
    Cap, ComparedTick, FileKind, Loading, MeshFile, Numbers, Painted, Preset, Replayed, ReplayedTick, Run, SeenTick,
    Start, Viewed, Wanted, WindowError, has_display, open, show_recording, view,
};
