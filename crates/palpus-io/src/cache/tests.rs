//! Tests that stored bodies are restored bit for bit, and that damaged files give no body.

use glam::DVec3;
use palpus::algebra::{Alone, Random};

use super::*;

const SEED: u64 = 0xcac_4e00;

/// A folder for one test, which is deleted at the end of the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("palpus-cache-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Returns a ring with a square section and an open sheet beside it. Both together give solids and
/// plates, and convex and reflex edges.
fn soup() -> PolygonSoup {
    let mut soup = PolygonSoup::new();
    let sides = 12;
    for s in 0..sides {
        let (sin, cos) = (f64::from(s) / f64::from(sides) * std::f64::consts::TAU).sin_cos();
        for (r, z) in [(1.0, 0.0), (2.0, 0.1), (2.0, 1.0), (1.0, 1.2)] {
            soup.vertices.push(DVec3::new(r * cos, r * sin, z));
        }
    }
    for s in 0..sides {
        let (here, there) = (4 * s, 4 * ((s + 1) % sides));
        for k in 0..4 {
            let l = (k + 1) % 4;
            soup.push_face(&[here + k, there + k, there + l, here + l]);
        }
    }
    let first = soup.vertices.len() as u32;
    soup.vertices.extend([[5., 0., 0.], [6., 0., 0.], [6., 1., 0.], [5., 1., 0.]].map(DVec3::from));
    soup.push_face(&[first, first + 1, first + 2, first + 3]);
    soup
}

fn prepared() -> (PolygonSoup, BodySettings, BodyKey, Body) {
    let (soup, settings) = (soup(), BodySettings { scale: 0.01, ..BodySettings::default() });
    let key = BodyKey::new(&ContentHash::of_soup(&soup), &settings);
    let body = Body::from_soup(&soup, &settings, &mut |_| ()).unwrap();
    (soup, settings, key, body)
}

#[test]
fn stored_body_is_restored_exactly() {
    let folder = Folder::new("round");
    let cache = BodyCache::in_folder(&folder.0);
    let (soup, settings, key, body) = prepared();
    assert!(matches!(cache.load(&key, &soup, &settings, &Alone), Err(CacheMiss::Absent)));
    cache.store(&key, &body).unwrap();
    let again = cache.load(&key, &soup, &settings, &Alone).unwrap();
    assert!(body.polytopes().iter().any(|p| p.is_flat()) && body.polytopes().iter().any(|p| !p.is_flat()));
    // The Debug output contains every field, and each number with all its digits.
    assert_eq!(format!("{body:?}"), format!("{again:?}"));
}

#[test]
fn other_content_or_settings_change_the_name() {
    let (soup, settings, key, _) = prepared();
    let content = ContentHash::of_soup(&soup);
    let mut other = soup.clone();
    other.vertices[3].x += 1e-15;
    assert_ne!(BodyKey::new(&ContentHash::of_soup(&other), &settings), key);
    assert_ne!(BodyKey::new(&content, &BodySettings { scale: 0.02, ..settings }), key);
    assert_ne!(BodyKey::new(&content, &BodySettings { flatness: BodySettings::HAPTIC, ..settings }), key);
    assert_ne!(BodyKey::new(&content, &BodySettings { thick: !settings.thick, ..settings }), key);
    assert_eq!(BodyKey::new(&content, &settings), key);
}

#[test]
fn truncated_or_changed_file_is_rejected() {
    let folder = Folder::new("damage");
    let cache = BodyCache::in_folder(&folder.0);
    let (soup, settings, key, body) = prepared();
    cache.store(&key, &body).unwrap();
    let path = cache.path(&key);
    let whole = fs::read(&path).unwrap();
    let is_damaged = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        matches!(cache.load(&key, &soup, &settings, &Alone), Err(CacheMiss::Damaged { .. }))
    };
    for length in [0, 1, 8, HEADER_BYTES - 1, HEADER_BYTES, whole.len() / 2, whole.len() - 1] {
        assert!(is_damaged(&whole[..length]), "cut to {length}");
    }
    assert!(is_damaged(&[&whole[..], &[0]].concat()));
    for k in (0..whole.len()).step_by(whole.len() / 50) {
        let mut changed = whole.clone();
        changed[k] ^= 0x10;
        assert!(is_damaged(&changed), "byte {k}");
    }
    // Another body is stored under this name.
    let other = BodyKey::new(&ContentHash::of_bytes(b"another"), &settings);
    cache.store(&other, &body).unwrap();
    assert!(is_damaged(&fs::read(cache.path(&other)).unwrap()));
    fs::write(&path, whole).unwrap();
    assert!(cache.load(&key, &soup, &settings, &Alone).is_ok());
}

#[test]
fn invalid_content_with_valid_hash_gives_an_error() {
    let (soup, settings, _, body) = prepared();
    let ground = Ground::new(&soup, &settings).unwrap();
    let mut whole: Vec<Vec<u8>> = Vec::new();
    parts::encode(&body, &mut |batch| {
        whole.push(batch.to_vec());
        Ok(())
    })
    .unwrap();
    let mut generator = Random::new(SEED);
    let mut random = |n: usize| generator.below(n);
    for round in 0..4000 {
        let mut batches = whole.clone();
        for _ in 0..1 + random(3) {
            let bytes = &mut batches[random(whole.len())];
            let k = random(bytes.len());
            match random(4) {
                0 => bytes[k] = random(256) as u8,
                1 => bytes[k] = [0, 0x7f, 0x80, 0xff][random(4)],
                2 => bytes.truncate(k + 1),
                _ => bytes.insert(k, random(256) as u8),
            }
        }
        // A file that is accepted is valid: only a coordinate or a bound differs.
        let with_batch = |k: usize, read: &mut dyn FnMut(&[u8])| -> Result<(), ()> {
            read(&batches[k]);
            Ok(())
        };
        if let Ok(Some(parts)) = parts::decode(batches.len(), with_batch, &Alone)
            && let Ok(body) = Body::restore(ground.clone(), parts, &Alone)
        {
            let sound = body.polytopes().iter().all(|polytope| polytope.validate_topology().is_ok());
            assert!(sound, "seed {SEED:#x}, round {round}");
        }
    }
}

#[test]
fn full_folder_deletes_the_oldest_bodies() {
    let folder = Folder::new("limit");
    let cache = BodyCache::in_folder(&folder.0);
    let (_, settings, _, body) = prepared();
    let keys = [b"a", b"b", b"c"].map(|name| BodyKey::new(&ContentHash::of_bytes(name), &settings));
    for (k, key) in keys.iter().enumerate() {
        cache.store(key, &body).unwrap();
        let time = SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(1000 + k as u64);
        File::options().append(true).open(cache.path(key)).unwrap().set_modified(time).unwrap();
    }
    let size = fs::metadata(cache.path(&keys[0])).unwrap().len();
    cache.prune(2 * size, &cache.path(&keys[2])).unwrap();
    assert_eq!(keys.map(|key| cache.path(&key).exists()), [false, true, true]);
    cache.prune(0, &cache.path(&keys[2])).unwrap();
    assert_eq!(keys.map(|key| cache.path(&key).exists()), [false, false, true]);
}
