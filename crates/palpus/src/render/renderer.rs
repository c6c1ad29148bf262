//! One turn of the loop in five named calls.
