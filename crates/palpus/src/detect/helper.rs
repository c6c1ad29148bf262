//! Threads of the caller that help to compute queries.

use std::sync::Arc;

use super::part::Part;
use crate::algebra::Rounds;

/// Lets a thread of the caller take part in queries that are divided.
///
/// Only queries that follow a motion, of two bodies with many pieces, are divided. The results have
/// the same bits with any number of helpers. A helper thread needs the same priority as the thread
/// of the queries, since that thread waits for a part that a helper has begun. If both compete for
/// one processor core, queries become slower.
///
/// ```
/// use std::sync::atomic::{AtomicBool, Ordering};
/// # use std::sync::Arc;
/// # use palpus::{Body, ContactQuery, Pose, QuerySettings, glam::DVec3};
/// # let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
/// # let body = Arc::new(Body::from_convex(&corners)?);
/// # let mut query = ContactQuery::new(body.clone(), body, QuerySettings::default());
/// let helper = query.helper();
/// let stop = AtomicBool::new(false);
/// std::thread::scope(|scope| {
///     scope.spawn(|| {
///         while !stop.load(Ordering::Relaxed) {
///             if !helper.help() {
///                 std::hint::spin_loop();
///             }
///         }
///     });
///     query.contacts(&Pose::IDENTITY);
///     stop.store(true, Ordering::Relaxed);
/// });
/// # Ok::<(), palpus::BodyError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Helper {
    queries: Vec<Arc<Rounds<Part>>>,
}

impl Helper {
    /// Returns true if there are divided queries to help with.
    pub fn is_useful(&self) -> bool {
        !self.queries.is_empty()
    }

    /// Computes parts of a query that is under way, until no part is left. Returns false if there
    /// was nothing to do. Never waits, allocates memory or calls the system.
    pub fn help(&self) -> bool {
        self.queries.iter().fold(false, |helped, query| query.help() | helped)
    }

    /// Returns a helper for the queries of both.
    pub fn and(mut self, other: Self) -> Self {
        self.queries.extend(other.queries);
        self
    }

    pub(super) fn of(query: Option<&Arc<Rounds<Part>>>) -> Self {
        Self { queries: query.into_iter().cloned().collect() }
    }
}
