//! Bodies of a few polygons, which may be invalid.
#![no_main]

use palpus::body::Body;
use palpus_fuzz::{Allowance, Bytes, Seed, check, target};

fn run(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let settings = bytes.body_settings();
    let soup = bytes.soup(16, 24);
    match Body::from_soup(&soup, &settings, &mut |_| ()) {
        Ok(body) => check::body(&body),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

fn seeds() -> Vec<Seed> {
    // A tetrahedron: the bytes of settings, counts, points and faces.
    let mut tetrahedron = vec![0, 1, 3];
    tetrahedron.extend([100, 100, 100, 132, 100, 100, 100, 132, 100, 100, 100, 132]);
    tetrahedron.extend([0, 0, 2, 1, 0, 0, 1, 3, 0, 1, 2, 3, 0, 0, 3, 2]);
    vec![("tetrahedron".to_owned(), tetrahedron)]
}

target!(run: run, allowance: Allowance { per_byte: 0, always: 16 << 20 }, seeds: seeds);
