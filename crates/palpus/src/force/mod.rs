//! Contacts, clusters, penalty force, shading, friction \[K02 §4\].

mod cluster;
mod contact;
mod friction;
mod pair_query;
mod penalty;
mod representative;
mod shading;

pub use contact::Contact;
