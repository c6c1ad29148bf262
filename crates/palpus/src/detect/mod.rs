//! Contact determination: all contacts of two bodies at a pose \[K02 §3.4, §4.1\].

mod apart;
mod batch;
mod clear;
mod confirm;
mod contact;
mod counters;
mod exact;
mod found;
mod guard;
mod held;
mod helper;
mod idle;
#[cfg(test)]
mod idle_tests;
mod late;
mod memory;
#[cfg(test)]
mod moved_tests;
mod pair;
mod part;
mod plane;
mod play;
mod prover;
mod query;
mod query_input;
#[cfg(test)]
mod rest_tests;
mod sample;
mod search;
mod settings;
mod sub_step;

pub use batch::ContactBatch;
pub use contact::Contact;
pub use counters::QueryCounters;
pub use helper::Helper;
pub(crate) use play::half_play;
pub use query::ContactQuery;
pub use settings::{Proof, QuerySettings};
