//! GJK distance: the fallback of the march and its cross-check.
