//! The contacts with which the pairs outside the sample are compared.

use glam::DVec3;

use crate::algebra::tolerance::SAMPLE_LOADS;
use crate::algebra::{Directions, LANES};

/// Contacts with which other pairs are compared.
#[derive(Clone, Debug)]
pub(super) struct Loads {
    fours: Vec<LoadLanes>,
    /// Number of contacts.
    pub(super) count: usize,
}

/// Four of these contacts. Lanes without a contact have no engagement.
#[derive(Clone, Copy, Debug)]
struct LoadLanes {
    normals: Directions,
    /// Engagement (model units), times the contact's count if that is below 1.
    engagements: [f64; LANES],
    pieces: [[u32; 2]; LANES],
}

impl Loads {
    /// Allocates memory.
    pub(super) fn new() -> Self {
        Self { fours: Vec::with_capacity(SAMPLE_LOADS.div_ceil(LANES)), count: 0 }
    }

    pub(super) fn clear(&mut self) {
        self.fours.clear();
        self.count = 0;
    }

    pub(super) fn copy(&mut self, other: &Self) {
        self.fours.clear();
        self.fours.extend_from_slice(&other.fours);
        self.count = other.count;
    }

    /// Adds a contact, if there is room for it.
    pub(super) fn push(&mut self, normal: DVec3, engagement: f64, pieces: [u32; 2]) {
        if self.count == SAMPLE_LOADS {
            return;
        }
        let lane = self.count % LANES;
        if lane == 0 {
            self.fours.push(LoadLanes {
                normals: Directions::NONE,
                engagements: [0.0; LANES],
                pieces: [[0; 2]; LANES],
            });
        }
        if let Some(four) = self.fours.last_mut() {
            four.normals.set(lane, normal);
            (four.engagements[lane], four.pieces[lane]) = (engagement, pieces);
            self.count += 1;
        }
    }

    /// Adds `more` (model units) to all engagements. Those that would be negative are 0.
    pub(super) fn deepen(&mut self, more: f64) {
        for k in 0..self.count {
            let engagement = &mut self.fours[k / LANES].engagements[k % LANES];
            *engagement = (*engagement + more).max(0.0);
        }
    }

    /// Returns how many contacts that `counts` accepts have at least this `engagement` (model units)
    /// along `normal`. Stops at `enough`, because many others press as hard as most contacts do.
    pub(super) fn count_from(
        &self,
        engagement: f64,
        normal: DVec3,
        enough: u32,
        counts: impl Fn([u32; 2]) -> bool,
    ) -> u32 {
        let mut number = 0;
        for four in &self.fours {
            let alike = four.normals.alike(normal);
            for ((alike, load), &pieces) in alike.iter().zip(&four.engagements).zip(&four.pieces) {
                number += u32::from(alike * load >= engagement && counts(pieces));
            }
            if number >= enough {
                break;
            }
        }
        number
    }

    /// Returns the largest engagement along `normal` of the contacts that `counts` accepts, with
    /// the kernel of [`crate::force::LoadSharing`].
    #[inline]
    pub(super) fn most(&self, normal: DVec3, counts: impl Fn([u32; 2]) -> bool) -> f64 {
        let mut most = [0.0; LANES];
        for four in &self.fours {
            let alike = four.normals.alike(normal);
            for k in 0..LANES {
                let felt = if counts(four.pieces[k]) { alike[k] * four.engagements[k] } else { 0.0 };
                most[k] = if felt > most[k] { felt } else { most[k] };
            }
        }
        most.into_iter().fold(0.0, f64::max)
    }
}
