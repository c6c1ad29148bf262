//! Files of prepared bodies: unchanged inputs, and batches of any content after a valid header with
//! valid hashes.
#![no_main]

use std::cell::OnceCell;

use glam::DVec3;
use palpus::algebra::Alone;
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus_fuzz::{Allowance, Bytes, Folder, Seed, check, target};
use palpus_io::{BodyCache, BodyKey, CacheMiss, ContentHash};

/// Size of the header: magic number, name, length of the index, and hash of the index.
const HEADER_BYTES: usize = 8 + 32 + 8 + 32;
/// Size of the index entry of a batch: its length and its hash.
const ENTRY_BYTES: usize = 8 + 32;

thread_local! {
    static KEPT: OnceCell<Kept> = const { OnceCell::new() };
}

/// A body stored in a cache.
struct Kept {
    folder: Folder,
    soup: PolygonSoup,
    settings: BodySettings,
    key: BodyKey,
    /// The valid file of the body.
    file: Vec<u8>,
}

impl Kept {
    fn new() -> Self {
        let (folder, soup, settings) = (Folder::new("cache"), soup(), BodySettings::default());
        let key = BodyKey::new(&ContentHash::of_soup(&soup), &settings);
        let body = Body::from_soup(&soup, &settings, &mut |_| ()).expect("a valid mesh");
        BodyCache::in_folder(folder.path()).store(&key, &body).expect("a writable folder");
        let entry = std::fs::read_dir(folder.path()).expect("its folder").next().expect("its file").expect("its name");
        let file = std::fs::read(entry.path()).expect("its content");
        std::fs::rename(entry.path(), folder.path().join("name")).expect("its folder");
        std::fs::remove_file(folder.path().join("name")).expect("its folder");
        std::fs::write(folder.path().join("NAME"), entry.file_name().as_encoded_bytes()).expect("its folder");
        Self { folder, soup, settings, key, file }
    }

    fn load(&self, file: &[u8]) -> Result<Body, CacheMiss> {
        let name = std::fs::read_to_string(self.folder.path().join("NAME")).expect("its name");
        self.folder.file(&name, file);
        BodyCache::in_folder(self.folder.path()).load(&self.key, &self.soup, &self.settings, &Alone)
    }

    /// Returns the name and the batches of the valid file.
    fn batches(&self) -> Vec<Vec<u8>> {
        let length = u64::from_le_bytes(self.file[40..48].try_into().expect("eight")) as usize;
        let (rest, index) = self.file.split_at(self.file.len() - length);
        let mut rest = &rest[HEADER_BYTES..];
        let mut batches = Vec::new();
        for entry in index.chunks(ENTRY_BYTES) {
            let length = u64::from_le_bytes(entry[..8].try_into().expect("eight")) as usize;
            let (batch, others) = rest.split_at(length);
            batches.push(batch.to_vec());
            rest = others;
        }
        batches
    }

    /// Returns a file with these batches and with valid lengths and hashes.
    fn of_batches(&self, batches: &[&[u8]]) -> Vec<u8> {
        let mut index = Vec::new();
        for batch in batches {
            index.extend((batch.len() as u64).to_le_bytes());
            index.extend(blake3::hash(batch).as_bytes());
        }
        let mut file = self.file[..40].to_vec();
        file.extend((index.len() as u64).to_le_bytes());
        file.extend(blake3::hash(&index).as_bytes());
        batches.iter().for_each(|batch| file.extend(*batch));
        file.extend(index);
        file
    }
}

/// Returns an L of two pieces and an open sheet beside it, which give solids and plates.
fn soup() -> PolygonSoup {
    let outline = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
    let mut soup = PolygonSoup::new();
    soup.vertices = [0.0, 1.0].iter().flat_map(|&z| outline.map(|(x, y)| DVec3::new(x, y, z))).collect();
    soup.push_face(&[5, 4, 3, 2, 1, 0]);
    soup.push_face(&[6, 7, 8, 9, 10, 11]);
    for k in 0..6 {
        soup.push_face(&[k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k]);
    }
    soup.vertices.extend([[5., 0., 0.], [6., 0., 0.], [6., 1., 0.], [5., 1., 0.]].map(DVec3::from));
    soup.push_face(&[12, 13, 14, 15]);
    soup
}

fn run(data: &[u8]) {
    KEPT.with(|kept| {
        let kept = kept.get_or_init(Kept::new);
        let Some((&first, rest)) = data.split_first() else { return };
        let answer = if first == 0 {
            kept.load(rest)
        } else {
            let mut bytes = Bytes::new(rest);
            let mut batches = Vec::new();
            while !bytes.is_empty() && batches.len() < 64 {
                let length = usize::from(bytes.short());
                batches.push(bytes.take(length));
            }
            kept.load(&kept.of_batches(&batches))
        };
        match answer {
            Ok(body) => check::body(&body),
            Err(miss) => assert!(!miss.to_string().contains('\n')),
        }
    });
}

fn seeds() -> Vec<Seed> {
    let kept = Kept::new();
    let mut batches = vec![1];
    for batch in kept.batches() {
        batches.extend((batch.len() as u16).to_le_bytes());
        batches.extend(batch);
    }
    vec![("file".to_owned(), [&[0][..], &kept.file].concat()), ("batches".to_owned(), batches)]
}

// Integers take few bytes in a file but at least eight bytes in memory.
target!(run: run, allowance: Allowance { per_byte: 200, always: 16 << 20 }, seeds: seeds);
