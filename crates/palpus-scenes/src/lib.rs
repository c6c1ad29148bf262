//! The paper's scenes and scripted hands as code.
