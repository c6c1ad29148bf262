//! Pictures, the window and the plots of palpus.
//!
//! A [`Scene`] holds the bodies, and a [`Moment`] of contacts and forces. A [`Camera`] and a
//! [`Style`] say from where and how it is shown. [`paint`] makes a [`Picture`] of them without a
//! display, a graphics library or a system package, the same to the bit on every run;
//! [`Picture::write_png`] keeps it.
//!
//! * `camera` — where the eye is: orbit, pan, zoom, standard views.
//! * `solid` — a body as triangles with a normal per corner and a piece per triangle; whole, or its
//!   pieces apart.
//! * `coarse` — the same in fewer triangles, for machines whose processor draws.
//! * `moment` — what one tick has to show; filled in the servo thread without obtaining memory.
//! * `moments` — those of a whole run, as far as there is room.
//! * `scene` — bodies, a moment, a caption.
//! * `raster` — triangles into a layer of colours and depths.
//! * `marks` — dots, arrows, a turning arrow, in the size that the picture needs.
//! * `letters` — a font of strokes.
//! * `paint` — the layers put together: bodies, then translucent bodies, then marks, then words.
//! * `piece`, `gauss` — one convex piece: its numbers, and its Gauss map on the sphere of
//!   directions.
//! * `section`, `section_panel`, `section_picture` — how deep a body is felt on a plane through it,
//!   that as a picture, and as a page.
//! * `sheet` — a page for what is drawn flat.
//! * `ground` — a plane below the bodies with a grid, and their shadow on it.
//! * `xray` — where a body is seen through, since it hides a probe.
//! * `picture`, `png`, `palette` — pixels, and how they are kept.
//! * `window` — with the feature `gui`: the same scene, live, through the machine's graphics
//!   library, beside the servo loop.
//!
//! Lengths are metres, frames are named where they stand; "view" is the eye's frame: x right, y up,
//! z towards the viewer.

mod camera;
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
pub use gauss::{PieceOf, before_own_faces, paint_gauss, paint_gauss_half};
pub use moment::{Moment, ShownAnchor, ShownCluster, ShownContact};
pub use moments::{Moments, Progress};
pub use paint::paint;
pub use picture::{Picture, Rgb};
pub use piece::{PieceNumbers, richest_piece};
pub use scene::{BodyPart, Look, Scene, ShownBody, Unit};
pub use section::{Axis, Feeler, Felt, POINT, Section, SectionNumbers, SectionPlane};
pub use section_panel::{SectionOf, Shown, contour_step, depth_colour, paint_section_panel};
pub use section_picture::paint_section;
pub use solid::Solid;
pub use style::{Style, Theme};
#[cfg(feature = "gui")]
pub use window::{
    Cap, ComparedTick, FileKind, Loading, MeshFile, Numbers, Painted, Preset, Replayed, ReplayedTick, Run, SeenTick,
    Start, Viewed, Wanted, WindowError, has_display, open, show_recording, view,
};
