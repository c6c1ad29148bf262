//! Settings of queries.

/// Selects whether depths are proven.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Proof {
    /// The walk gives the depth without a proof. The depth is a local minimum, as in \[K02 §3.3\].
    /// Servo loops use this.
    #[default]
    None,
    /// The depth of every overlapping pair of pieces is proven globally least.
    Prove,
}

/// Settings of a [`ContactQuery`](super::ContactQuery). The query allocates its memory for these
/// settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuerySettings {
    /// Contacts are nearer than this, model units; 0 finds overlaps only.
    pub tolerance: f64,
    /// Contacts press below this separation, model units; `None`: below the tolerance. If so many
    /// pairs touch that only a sample is measured, a pair outside the sample is measured only if it
    /// presses harder than the sample.
    pub contact_offset: Option<f64>,
    /// Largest number of contacts of one query, at least one. If there are more, the deepest are
    /// kept.
    pub capacity: usize,
    /// Selects whether depths are proven globally least.
    pub proof: Proof,
    /// Contacts at the corners of flush pieces' patches, for tilts up to this angle (rad, above 0
    /// and below a right angle), and contacts beside edges where a surface bends inward. `None`: at
    /// most one contact for each pair of pieces, at its exact witness points.
    pub patch_angle: Option<f64>,
    /// The bodies may turn relative to each other by this angle (rad) before the next query. If
    /// the query finds patches, it also finds those that only such a turn would bring into contact:
    /// parts of a curved rim, for example, that tilts onto a flat face. 0: it does not look for
    /// them.
    pub turn: f64,
    /// If true, the query guards against tunnelling: a fast body does not pass a thin part between
    /// two queries.
    pub guard: bool,
    /// If true, the query keeps contacts from query to query, for pairs that a work quota leaves
    /// out: see [`ContactQuery::run_within`](super::ContactQuery::run_within).
    pub holding: bool,
}

impl Default for QuerySettings {
    /// Returns settings for contacts within 1 mm (if the model unit is the metre), at most 4096 of
    /// them. Depths are not proven. The poses may be in any order.
    fn default() -> Self {
        Self {
            tolerance: 1e-3,
            contact_offset: None,
            capacity: 4096,
            proof: Proof::None,
            patch_angle: None,
            turn: 0.0,
            guard: false,
            holding: false,
        }
    }
}
