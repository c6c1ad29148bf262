//! Contacts of two bodies at any pose.

use palpus::{ContactQuery, Proof, QuerySettings};

use crate::body::{body_of, flag, palpus_body};
use crate::handle::{Kind, Table};
use crate::pointer::{In, Out, OutArray};
use crate::result::{Fault, entry, palpus_result};
use crate::value::{palpus_contact, palpus_pose};

/// Largest capacity of a query. The memory of a query is allocated when the query is created.
const MOST_CONTACTS: u64 = 1 << 20;

/// The contacts of a body a with a body b. Only one thread may use a query at a time; different
/// queries can run in parallel.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct palpus_query {
    /// 0 if there is no query.
    pub id: u64,
}

/// Settings of a query.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_query_settings {
    /// Contacts have a separation below the tolerance, m. 0 finds overlaps only.
    pub tolerance: f64,
    /// Maximum number of contacts of one query, 1 to 1048576. If there are more, the deepest are
    /// kept.
    pub capacity: u64,
    /// 1: the depth of each pair of pieces is proven to be the smallest. 0: the depth is a local
    /// minimum.
    pub prove: u32,
    /// Flush pieces give contacts at the corners of their overlap, for tilts up to this angle (rad,
    /// 0 to 1). 0: one exact contact for each pair of pieces.
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

/// Fills in the defaults: tolerance 1 mm, 4096 contacts, no proof, one contact for each pair of
/// pieces.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_query_settings_default(settings: *mut palpus_query_settings) -> palpus_result {
    // SAFETY: the caller follows the header.
    let settings = unsafe { Out::new(settings, "settings") };
    entry(|| settings.put(QuerySettings::default().into()))
}

/// Creates a query and allocates all the memory that it will need. `settings` may be NULL for the
/// defaults.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_query_create(
    a: palpus_body,
    b: palpus_body,
    settings: *const palpus_query_settings,
    query: *mut palpus_query,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (settings, query) = unsafe { (In::new(settings, "settings"), Out::new(query, "query")) };
    entry(|| {
        query.check()?;
        let settings = settings.get_if_any()?.map_or(Ok(QuerySettings::default()), |settings| settings.checked())?;
        let [a, b] = [body_of(a)?, body_of(b)?];
        let id = QUERIES.insert(ContactQuery::new(a.body.clone(), b.body.clone(), settings))?;
        query.put(palpus_query { id })
    })
}

/// Finds all contacts with a separation below the tolerance, with a at `pose_ba` in b's frame. The
/// contacts are in b's frame. Writes the first `capacity` contacts to `contacts`, and the total
/// number to `count`. `contacts` may be NULL if `capacity` is 0. A pose near the previous pose
/// takes the least time. Allocates no memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_query_contacts(
    query: palpus_query,
    pose_ba: *const palpus_pose,
    contacts: *mut palpus_contact,
    capacity: usize,
    count: *mut usize,
) -> palpus_result {
    // SAFETY: the caller follows the header.
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

/// Finds the nearest pair of points with a at `pose_ba` in b's frame, at any distance. If the
/// bodies overlap, finds the deepest contact. The result is in b's frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_query_nearest(
    query: palpus_query,
    pose_ba: *const palpus_pose,
    nearest: *mut palpus_contact,
) -> palpus_result {
    // SAFETY: the caller follows the header.
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

/// Sets the tolerance (m) of the following queries.
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

/// Discards the data of earlier poses. The next result is the same as from a new query.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_query_clear(query: palpus_query) -> palpus_result {
    entry(|| {
        QUERIES.change(query.id, |query| {
            query.clear();
            Ok(())
        })
    })
}

/// Destroys a query.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_query_destroy(query: palpus_query) -> palpus_result {
    entry(|| QUERIES.remove(query.id))
}
