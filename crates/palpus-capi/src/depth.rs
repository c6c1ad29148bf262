//! Penetration depth of two bodies of any shape, with proven bounds.

use std::sync::Arc;

use palpus::depth::Containment;
use palpus::{GlobalDepth, GlobalMemory, GlobalSettings};

use crate::body::{Shared, body_of, flag, palpus_body};
use crate::handle::{Kind, Table};
use crate::pointer::{In, Out};
use crate::result::{Fault, entry, palpus_result};
use crate::value::palpus_pose;

/// The penetration depth of a body a in a body b. Only one thread may use a depth at a time.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct palpus_depth {
    /// 0 if there is no depth.
    pub id: u64,
}

/// The requested accuracy of the bounds, and the limit of the work.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_depth_settings {
    /// The search ends if upper - lower is at most this gap, m.
    pub gap: f64,
    /// The search ends after about this many evaluations.
    pub budget: u64,
    /// 1: a translation counts as free only if a can then leave b along a straight line.
    pub outside: u32,
}

/// Bounds of the shortest translation that separates a from b, in b's frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct palpus_depth_bounds {
    /// No shorter translation separates the bodies, m. 0 if the bodies are already separate.
    pub lower: f64,
    /// The length of `translation`, m.
    pub upper: f64,
    /// Moving a by this translation separates the bodies, m.
    pub translation: [f64; 3],
    /// 1 if the gap between the bounds is at most the requested gap.
    pub certified: u32,
    /// 1: a lies in b's solid. 2: b lies in a's solid. 0: neither.
    pub contained: u32,
    /// Distance of the surfaces if the bodies are separate or one lies in the other, m. Otherwise
    /// -1.
    pub distance: f64,
}

struct Depth {
    a: Arc<Shared>,
    b: Arc<Shared>,
    settings: GlobalSettings,
    memory: GlobalMemory,
}

static DEPTHS: Table<Depth> = Table::new(Kind::Depth);

impl palpus_depth_settings {
    fn checked(&self) -> Result<GlobalSettings, Fault> {
        let Self { gap, budget, outside } = *self;
        if !(gap >= 0.0 && gap.is_finite()) {
            return Err(Fault::value(format!("gap is {gap}, but must be a length in m, 0 or more")));
        }
        Ok(GlobalSettings { gap, budget, outside: flag("outside", outside)? })
    }
}

/// Fills in the defaults for two bodies: a gap of 1 % of the smaller body's size, and a budget that
/// is enough for most poses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_depth_settings_default(
    a: palpus_body,
    b: palpus_body,
    settings: *mut palpus_depth_settings,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let settings = unsafe { Out::new(settings, "settings") };
    entry(|| {
        let [a, b] = [body_of(a)?, body_of(b)?];
        let GlobalSettings { gap, budget, outside } = GlobalSettings::new(&a.body, &b.body);
        settings.put(palpus_depth_settings { gap, budget, outside: outside.into() })
    })
}

/// Prepares two bodies for depth queries. The first preparation of a large body takes up to minutes
/// on all cores; later preparations reuse its result. `settings` may be NULL for the defaults.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_depth_create(
    a: palpus_body,
    b: palpus_body,
    settings: *const palpus_depth_settings,
    depth: *mut palpus_depth,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (settings, depth) = unsafe { (In::new(settings, "settings"), Out::new(depth, "depth")) };
    entry(|| {
        depth.check()?;
        let settings = settings.get_if_any()?.map(|settings| settings.checked()).transpose()?;
        let [a, b] = [body_of(a)?, body_of(b)?];
        let settings = settings.unwrap_or_else(|| GlobalSettings::new(&a.body, &b.body));
        let _ = (a.interior(), b.interior());
        let id = DEPTHS.insert(Depth { a, b, settings, memory: GlobalMemory::default() })?;
        depth.put(palpus_depth { id })
    })
}

/// Computes bounds of the depth with a at `pose_ba` in b's frame. Takes milliseconds and allocates
/// memory, so do not call it in a haptic loop.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_depth_bound(
    depth: palpus_depth,
    pose_ba: *const palpus_pose,
    bounds: *mut palpus_depth_bounds,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (pose, bounds) = unsafe { (In::new(pose_ba, "pose_ba"), Out::new(bounds, "bounds")) };
    entry(|| {
        bounds.check()?;
        let pose = pose.get()?.checked().map_err(|fault| fault.of("pose_ba"))?;
        DEPTHS.change(depth.id, |depth| {
            let Depth { a, b, settings, memory } = depth;
            let bracket = GlobalDepth::new(&a.body, a.interior(), &b.body, b.interior()).run(&pose, settings, memory);
            bounds.put(palpus_depth_bounds {
                lower: bracket.lower,
                upper: bracket.upper,
                translation: bracket.translation.to_array(),
                certified: bracket.certified.into(),
                contained: match bracket.containment {
                    Containment::Neither => 0,
                    Containment::AInB => 1,
                    Containment::BInA => 2,
                },
                distance: bracket.distance.unwrap_or(-1.0),
            })
        })
    })
}

/// Destroys a depth.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_depth_destroy(depth: palpus_depth) -> palpus_result {
    entry(|| DEPTHS.remove(depth.id))
}
