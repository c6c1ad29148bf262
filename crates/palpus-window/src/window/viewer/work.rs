//! Background work of the window on a model: the Gauss map of the picked piece, and depth on the
//! plane.

use std::sync::Arc;

use palpus::body::Body;

use crate::camera::Camera;
use crate::gauss::paint_gauss_half;
use crate::picture::Picture;
use crate::scene::Unit;
use crate::section::{PointProbe, Section, SectionNumbers, SectionPlane};
use crate::section_panel::{SectionOf, Shown, paint_section_panel};
use crate::style::Theme;
use crate::window::background::{Background, JobState};

/// Numbers of samples along the longer side of a section: first few samples, then more.
const FINENESSES: [usize; 3] = [48, 120, 280];

/// Identifies a Gauss map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GaussQuestion {
    pub(super) piece: u32,
    pub(super) from: Camera,
    pub(super) theme: Theme,
    /// Width and height of the map, pixels.
    pub(super) size: usize,
}

/// Starts a thread that paints Gauss maps.
pub(super) fn gauss_painter(
    body: Arc<Body>,
    wake: impl Fn() + Send + Sync + 'static,
) -> Background<GaussQuestion, Picture> {
    Background::new(wake, move |asked: GaussQuestion, state: &JobState<GaussQuestion, Picture>| {
        let GaussQuestion { piece, from, theme, size } = asked;
        // The first map is coarse, because the view may still be turning.
        for size in [size / 2, size] {
            if !state.is_superseded() {
                state.answer(paint_gauss_half(&body, piece, &from, theme, size));
            }
        }
    })
}

/// Identifies a picture of a section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SectionQuestion {
    pub(super) plane: SectionPlane,
    pub(super) shown: Shown,
    pub(super) theme: Theme,
    /// Width of the picture, pixels.
    pub(super) width: usize,
}

/// The part of a section that is computed so far.
pub(super) struct SectionAnswer {
    pub(super) section: Arc<Section>,
    pub(super) numbers: SectionNumbers,
    pub(super) picture: Picture,
}

/// Starts a thread that computes sections: first coarse, then finer.
pub(super) fn section_sampler(
    body: Arc<Body>,
    unit: Unit,
    wake: impl Fn() + Send + Sync + 'static,
) -> Background<SectionQuestion, SectionAnswer> {
    let mut probe: Option<PointProbe> = None;
    let mut known: Option<Arc<Section>> = None;
    Background::new(wake, move |asked: SectionQuestion, state: &JobState<SectionQuestion, SectionAnswer>| {
        if probe.is_none() {
            probe = PointProbe::new(&body).ok();
        }
        let Some(probe) = probe.as_mut() else { return };
        for fineness in FINENESSES {
            let had = known.take().filter(|known| known.plane == asked.plane);
            let fine = Section::laid(&body, asked.plane, fineness);
            let section = match had {
                Some(had) if had.cell <= fine.cell => had,
                had => {
                    let Some(felt) = felt(fine, probe, state) else {
                        known = had;
                        return;
                    };
                    Arc::new(felt)
                }
            };
            known = Some(Arc::clone(&section));
            let last = section.cell <= Section::laid(&body, asked.plane, FINENESSES[FINENESSES.len() - 1]).cell;
            state.answer(answered(&body, &asked, section, unit));
            if last || state.is_superseded() {
                return;
            }
        }
    })
}

/// Computes all rows, unless a newer request arrives.
fn felt<Q, A>(mut section: Section, probe: &mut PointProbe, state: &JobState<Q, A>) -> Option<Section> {
    for row in 0..section.rows {
        if state.is_superseded() {
            return None;
        }
        let samples = section.feel_row(row, probe);
        section.samples.extend(samples);
    }
    Some(section)
}

fn answered(body: &Body, asked: &SectionQuestion, section: Arc<Section>, unit: Unit) -> SectionAnswer {
    let numbers = section.numbers();
    let height = (asked.width * section.rows).div_ceil(section.columns.max(1)).clamp(1, MOST_TALL * asked.width.max(1));
    let shown = SectionOf { section: &section, body, name: "", unit };
    let deepest = numbers.deepest.max(numbers.deepest_felt);
    let picture = paint_section_panel(&shown, asked.shown, deepest, asked.theme, asked.width, height);
    SectionAnswer { numbers, picture, section }
}

/// Largest height of a section, in widths.
const MOST_TALL: usize = 2;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::section::Axis;
    use glam::DVec3;
    use std::sync::mpsc::channel;

    #[test]
    fn section_is_refined_and_reused_for_another_look() {
        let side = |k: usize, bit: usize| (k >> bit & 1) as f64;
        let points: Vec<DVec3> = (0..8).map(|k| DVec3::new(side(k, 0), side(k, 1), side(k, 2))).collect();
        let body = Arc::new(Body::from_convex(&points).expect("the box has a hull"));
        let plane = SectionPlane::through(&body, Axis::Z, 0.5);
        let (woken, waking) = channel();
        let background = section_sampler(Arc::clone(&body), Unit::Model, move || {
            let _ = woken.send(());
        });
        let finest = |shown| {
            background.ask(SectionQuestion { plane, shown, theme: Theme::Dark, width: 60 });
            let mut last = None;
            while background.is_busy() {
                waking.recv().expect("the job wakes the window");
                last = background.answer().or(last.take());
            }
            last.expect("the job has answered")
        };
        let (felt, again) = (finest(Shown::Felt), finest(Shown::Missing));
        assert_eq!(felt.section.columns, FINENESSES[2]);
        assert!(Arc::ptr_eq(&felt.section, &again.section));
        assert!((felt.numbers.deepest - 0.5).abs() < 0.01 && felt.picture != again.picture);
    }
}
