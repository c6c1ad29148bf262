//! Exact single linkage of contacts.
