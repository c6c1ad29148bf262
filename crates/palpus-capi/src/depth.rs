//! How deep two bodies of any shape are in each other, with proof.

use std::sync::Arc;

use palpus::depth::Containment;
use palpus::{GlobalDepth, GlobalMemory, GlobalSettings};

use crate::body::{Shared, body_of, flag, palpus_body};
use crate::handle::{Kind, Table};
use crate::pointer::{In, Out};
use crate::result::{Fault, entry, palpus_result};
use crate::value::palpus_pose;

/// The penetration depth of a body a in a body b. One thread at a time.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct palpus_depth {
    /// 0 for none.
    pub id: u64,
}

/// How near the bounds of a depth come, and what may be spent.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_depth_settings {
    /// m: the search ends if upper - lower is no more than this.
    pub gap: f64,
    /// The search ends after about so many evaluations.
    pub budget: u64,
    /// 1: only translations count as free from which a can leave b in a straight line.
    pub outside: u32,
}

/// Bounds of the least translation that frees a from b, in b's frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct palpus_depth_bounds {
    /// m: no shorter translation frees the bodies. 0 if they are free.
    pub lower: f64,
    /// m: the length of `translation`.
    pub upper: f64,
    /// m: moving a by this frees the bodies.
    pub translation: [f64; 3],
    /// 1 if the gap is as small as was asked for.
    pub certified: u32,
    /// 1: a lies in b's solid. 2: b lies in a's. 0: neither.
    pub contained: u32,
    /// m: distance of the surfaces if the bodies are free or one lies in the other; else -1.
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

/// Fills in what suits two bodies: a gap of 1 % of the smaller one, and a budget for most poses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_depth_settings_default(
    a: palpus_body,
    b: palpus_body,
    settings: *mut palpus_depth_settings,
) -> palpus_result {
    // SAFETY: the caller keeps to the header.
    let settings = unsafe { Out::new(settings, "settings") };
    entry(|| {
        let [a, b] = [body_of(a)?, body_of(b)?];
        let GlobalSettings { gap, budget, outside } = GlobalSettings::new(&a.body, &b.body);
        settings.put(palpus_depth_settings { gap, budget, outside: outside.into() })
    })
}

/// Prepares two bodies for depths: once for each body, up to minutes for large ones, on all cores.
/// `settings` may be NULL for the defaults.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_depth_create(
    a: palpus_body,
    b: palpus_body,
    settings: *const palpus_depth_settings,
    depth: *mut palpus_depth,
) -> palpus_result {
    // SAFETY: the caller keeps to the header.
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

/// Bounds the depth with a at `pose_ba` in b's frame. Takes milliseconds, and obtains memory: not
/// for a haptic loop.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_depth_bound(
    depth: palpus_depth,
    pose_ba: *const palpus_pose,
    bounds: *mut palpus_depth_bounds,
) -> palpus_result {
    // SAFETY: the caller keeps to the header.
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

/// Lets go of a depth.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_depth_destroy(depth: palpus_depth) -> palpus_result {
    entry(|| DEPTHS.remove(depth.id))
}
