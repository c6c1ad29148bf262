//! All contacts of two bodies within the tolerance.
