//! Contacts of two bodies at any pose.

use palpus::{ContactQuery, Proof, QuerySettings};

use crate::body::{body_of, flag, palpus_body};
use crate::handle::{Kind, Table};
use crate::pointer::{In, Out, OutArray};
use crate::result::{Fault, entry, palpus_result};
use crate::value::{palpus_contact, palpus_pose};

/// Most contacts that a query may be asked to hold: memory for them is obtained at once.
const MOST_CONTACTS: u64 = 1 << 20;

/// The contacts of a body a with a body b. One thread at a time; any number of queries at once.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct palpus_query {
    /// 0 for none.
    pub id: u64,
}

/// Settings of a query.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_query_settings {
    /// m: contacts are nearer than this; 0 finds overlaps only.
    pub tolerance: f64,
    /// The most contacts of one query, 1 to 1048576; of more, the deepest are kept.
    pub capacity: u64,
    /// 1: the depth of each pair of pieces is proven the least. 0: it is the least nearby.
    pub prove: u32,
    /// rad, 0 to 1: flush pieces give contacts at the corners of their overlap for tilts up to this
    /// angle. 0: one exact contact for each pair of pieces.
    pub patch_angle: f64,
}

static QUERIES: Table<ContactQuery> = Table::new(Kind::Query);

impl palpus_query_settings {
    fn checked(&self) -> Result<QuerySettings, Fault> {
        let Self { tolerance, capacity, prove, patch_angle } = *self;
        checked_tolerance(tolerance)?;
        if !(1..=MOST_CONTACTS).contains(&capacity) {
            return Err(Fault::value(format!("capacity is {capacity}, but must be from 1 to {MOST_CONTACTS}")));
        }
        if !(0.0..=1.0).contains(&patch_angle) {
            return Err(Fault::value(format!("patch_angle is {patch_angle}, but must be an angle from 0 to 1 rad")));
        }
        Ok(QuerySettings {
            tolerance,
            capacity: capacity as usize,
            proof: if flag("prove", prove)? { Proof::Prove } else { Proof::None },
            patch_angle: (patch_angle > 0.0).then_some(patch_angle),
            ..QuerySettings::default()
        })
    }
}

fn checked_tolerance(tolerance: f64) -> Result<(), Fault> {
    if tolerance >= 0.0 && tolerance.is_finite() {
        return Ok(());
    }
    Err(Fault::value(format!("tolerance is {tolerance}, but must be a length in m, 0 or more")))
}

impl From<QuerySettings> for palpus_query_settings {
    fn from(settings: QuerySettings) -> Self {
        Self {
            tolerance: settings.tolerance,
            capacity: settings.capacity as u64,
            prove: (settings.proof == Proof::Prove).into(),
            patch_angle: settings.patch_angle.unwrap_or(0.0),
        }
    }
}

/// Fills in: 1 mm, 4096 contacts, not proven, one contact for each pair of pieces.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_query_settings_default(settings: *mut palpus_query_settings) -> palpus_result {
    // SAFETY: the caller keeps to the header.
    let settings = unsafe { Out::new(settings, "settings") };
    entry(|| settings.put(QuerySettings::default().into()))
}

/// Makes a query, with all memory that it will need. `settings` may be NULL for the defaults.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_query_create(
    a: palpus_body,
    b: palpus_body,
    settings: *const palpus_query_settings,
    query: *mut palpus_query,
) -> palpus_result {
    // SAFETY: the caller keeps to the header.
    let (settings, query) = unsafe { (In::new(settings, "settings"), Out::new(query, "query")) };
    entry(|| {
        query.check()?;
        let settings = settings.get_if_any()?.map_or(Ok(QuerySettings::default()), |settings| settings.checked())?;
        let [a, b] = [body_of(a)?, body_of(b)?];
        let id = QUERIES.insert(ContactQuery::new(a.body.clone(), b.body.clone(), settings))?;
        query.put(palpus_query { id })
    })
}

/// Finds all contacts nearer than the tolerance with a at `pose_ba` in b's frame; they are in b's
/// frame. Writes the first `capacity` of them to `contacts`, and how many there are to `count`.
/// `contacts` may be NULL with a capacity of 0. Poses near the last one are answered fastest.
/// Obtains no memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_query_contacts(
    query: palpus_query,
    pose_ba: *const palpus_pose,
    contacts: *mut palpus_contact,
    capacity: usize,
    count: *mut usize,
) -> palpus_result {
    // SAFETY: the caller keeps to the header.
    let (pose, contacts, count) = unsafe {
        (In::new(pose_ba, "pose_ba"), OutArray::new(contacts, capacity, "contacts"), Out::new(count, "count"))
    };
    entry(|| {
        contacts.check()?;
        count.check()?;
        let pose = pose.get()?.checked().map_err(|fault| fault.of("pose_ba"))?;
        QUERIES.change(query.id, |query| {
            let found = query.contacts(&pose);
            found.iter().take(capacity).enumerate().for_each(|(k, contact)| contacts.put(k, contact.into()));
            count.put(found.len())
        })
    })
}

/// Finds the nearest pair of points with a at `pose_ba` in b's frame, whatever the distance; where
/// the bodies overlap, the deepest contact. It is in b's frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_query_nearest(
    query: palpus_query,
    pose_ba: *const palpus_pose,
    nearest: *mut palpus_contact,
) -> palpus_result {
    // SAFETY: the caller keeps to the header.
    let (pose, nearest) = unsafe { (In::new(pose_ba, "pose_ba"), Out::new(nearest, "nearest")) };
    entry(|| {
        nearest.check()?;
        let pose = pose.get()?.checked().map_err(|fault| fault.of("pose_ba"))?;
        QUERIES.change(query.id, |query| match query.nearest(&pose) {
            Some(contact) => nearest.put((&contact).into()),
            None => Err(Fault::new(palpus_result::PalpusErrorMesh, "a body has no pieces")),
        })
    })
}

/// Contacts are nearer than `tolerance` (m) from the next query on.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_query_set_tolerance(query: palpus_query, tolerance: f64) -> palpus_result {
    entry(|| {
        checked_tolerance(tolerance)?;
        QUERIES.change(query.id, |query| {
            query.set_tolerance(tolerance);
            Ok(())
        })
    })
}

/// Forgets the past: the next answer is that of a new query.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_query_clear(query: palpus_query) -> palpus_result {
    entry(|| {
        QUERIES.change(query.id, |query| {
            query.clear();
            Ok(())
        })
    })
}

/// Lets go of a query.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_query_destroy(query: palpus_query) -> palpus_result {
    entry(|| QUERIES.remove(query.id))
}
