//! Contact determination: all contacts of two bodies at a pose \[K02 §3.4, §4.1\].

mod batch;
mod confirm;
mod contact;
mod counters;
mod exact;
mod guard;
mod held;
mod late;
mod memory;
mod pair;
mod prover;
mod query;
#[cfg(test)]
mod rest_tests;
mod sample;
mod search;
mod sub_step;

pub use batch::ContactBatch;
pub use contact::Contact;
pub use counters::QueryCounters;
pub use query::{ContactQuery, Proof, QuerySettings};
