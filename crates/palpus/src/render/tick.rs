//! Everything that one turn of the loop produced.
