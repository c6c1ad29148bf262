//! Handles: numbers that stand for the library's values in C.
//!
//! * A handle encodes its kind, its place in the table of that kind, and how often the place was
//!   used before. So a handle that is old, of another kind or otherwise wrong is detected.
//! * Each place has a lock, and no function waits for this lock. If two threads use one world at
//!   the same time, the second thread gets an error at once. The check needs an atomic exchange,
//!   not a system call.
//! * A panic poisons the lock of a half-changed value. That value can then only be destroyed.
//! * Values never move. Tables only grow, by chunks of twice the size.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError, RwLock, TryLockError};

use crate::result::{Fault, palpus_result};

/// Number of places in the first chunk, as a power of two.
const FIRST_CHUNK: u32 = 6;
/// Number of chunks in a table. There are more places than values that fit in memory.
const CHUNKS: usize = 24;
/// Bits of a handle for the place.
const PLACE_BITS: u32 = 32;
/// Bits of a handle for the number of earlier uses of the place.
const GENERATION_BITS: u32 = 28;
/// Largest number of earlier uses that a handle can state.
const MOST_GENERATIONS: u32 = (1 << GENERATION_BITS) - 1;

/// The kinds of values that have handles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Body = 1,
    Query = 2,
    Depth = 3,
    World = 4,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Body => "body",
            Self::Query => "query",
            Self::Depth => "depth",
            Self::World => "world",
        }
    }

    fn of(handle: u64) -> Option<Self> {
        let number = handle >> (PLACE_BITS + GENERATION_BITS);
        [Self::Body, Self::Query, Self::Depth, Self::World].into_iter().find(|&kind| kind as u64 == number)
    }
}

/// The values of one kind.
pub(crate) struct Table<T> {
    kind: Kind,
    chunks: [OnceLock<Box<[Place<T>]>>; CHUNKS],
    /// The free places, and the number of places that were ever used.
    free: Mutex<(Vec<u32>, u32)>,
}

type Place<T> = RwLock<Slot<T>>;

struct Slot<T> {
    generation: u32,
    value: Option<T>,
}

impl<T> Table<T> {
    /// Returns a table without values.
    pub(crate) const fn new(kind: Kind) -> Self {
        Self { kind, chunks: [const { OnceLock::new() }; CHUNKS], free: Mutex::new((Vec::new(), 0)) }
    }

    /// Stores a value and returns its handle.
    pub(crate) fn insert(&self, value: T) -> Result<u64, Fault> {
        let place = {
            let (free, taken) = &mut *self.free();
            free.pop().or_else(|| {
                let next = *taken;
                chunk(next).0.lt(&CHUNKS).then(|| *taken += 1)?;
                Some(next)
            })
        };
        let place = place.ok_or_else(|| {
            Fault::value(format!("there is no room for another {}; destroy one first", self.kind.name()))
        })?;
        let (number, offset) = chunk(place);
        let size = 1_usize << (FIRST_CHUNK + number as u32);
        let empty = || (0..size).map(|_| RwLock::new(Slot { generation: 1, value: None })).collect();
        let slot = &self.chunks[number].get_or_init(empty)[offset];
        let mut slot = slot.write().unwrap_or_else(PoisonError::into_inner);
        slot.value = Some(value);
        Ok((self.kind as u64) << (PLACE_BITS + GENERATION_BITS)
            | u64::from(slot.generation) << PLACE_BITS
            | u64::from(place))
    }

    /// Calls `act` with the value of a handle. No other thread can change the value in the
    /// meantime.
    pub(crate) fn read<R>(&self, handle: u64, act: impl FnOnce(&T) -> Result<R, Fault>) -> Result<R, Fault> {
        let slot = self.place(handle)?.try_read().map_err(|error| self.refused(&error))?;
        match &slot.value {
            Some(value) if slot.generation == generation(handle) => act(value),
            _ => Err(self.wrong(handle)),
        }
    }

    /// Calls `act` with the value of a handle. No other thread can use the value in the meantime.
    pub(crate) fn change<R>(&self, handle: u64, act: impl FnOnce(&mut T) -> Result<R, Fault>) -> Result<R, Fault> {
        let mut slot = self.place(handle)?.try_write().map_err(|error| self.refused(&error))?;
        let is_current = slot.generation == generation(handle);
        match &mut slot.value {
            Some(value) if is_current => act(value),
            _ => Err(self.wrong(handle)),
        }
    }

    /// Removes a value. Its handle is invalid from now on.
    pub(crate) fn remove(&self, handle: u64) -> Result<(), Fault> {
        let place = self.place(handle)?;
        let value = {
            let mut slot = match place.try_write() {
                Ok(slot) => slot,
                Err(TryLockError::Poisoned(slot)) => slot.into_inner(),
                Err(error) => return Err(self.refused(&error)),
            };
            if slot.generation != generation(handle) || slot.value.is_none() {
                return Err(self.wrong(handle));
            }
            slot.generation += 1;
            place.clear_poison();
            // If the next handle of the place would equal an old handle, the place is not used
            // again.
            if slot.generation < MOST_GENERATIONS {
                self.free().0.push(handle as u32);
            }
            slot.value.take()
        };
        drop(value);
        Ok(())
    }

    fn free(&self) -> MutexGuard<'_, (Vec<u32>, u32)> {
        self.free.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn place(&self, handle: u64) -> Result<&Place<T>, Fault> {
        let (number, offset) = chunk(handle as u32);
        let chunk = self.chunks.get(number).filter(|_| Kind::of(handle) == Some(self.kind));
        chunk.and_then(OnceLock::get).map(|chunk| &chunk[offset]).ok_or_else(|| self.wrong(handle))
    }

    #[cold]
    fn wrong(&self, handle: u64) -> Fault {
        let name = self.kind.name();
        let text = match Kind::of(handle) {
            Some(kind) if kind == self.kind => format!("the {name} was destroyed, or never created"),
            Some(kind) => format!("the handle belongs to a {}, but must belong to a {name}", kind.name()),
            None if handle == 0 => format!("the {name}'s handle is 0: it was not created"),
            None => format!("{handle:#x} is not the handle of a {name}"),
        };
        Fault::new(palpus_result::PalpusErrorHandle, text)
    }

    #[cold]
    fn refused<G>(&self, error: &TryLockError<G>) -> Fault {
        let name = self.kind.name();
        match error {
            TryLockError::WouldBlock => {
                let text = format!("another thread is using the {name}; use it from one thread at a time");
                Fault::new(palpus_result::PalpusErrorBusy, text)
            }
            TryLockError::Poisoned(_) => {
                let text = format!("a defect of palpus left the {name} in an invalid state; destroy it");
                Fault::new(palpus_result::PalpusErrorInternal, text)
            }
        }
    }
}

/// Returns the chunk of a place, and the index within the chunk.
fn chunk(place: u32) -> (usize, usize) {
    let shifted = u64::from(place) + (1 << FIRST_CHUNK);
    let number = shifted.ilog2() - FIRST_CHUNK;
    (number as usize, (shifted - (1 << (number + FIRST_CHUNK))) as usize)
}

fn generation(handle: u64) -> u32 {
    (handle >> PLACE_BITS) as u32 & MOST_GENERATIONS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::entry;

    #[test]
    fn old_and_foreign_handles_give_errors() {
        let table = Table::new(Kind::Body);
        let handles: Vec<u64> = (0..500).map(|k| table.insert(k).unwrap()).collect();
        for (k, &handle) in handles.iter().enumerate() {
            assert_eq!(table.read(handle, |value| Ok(*value)).unwrap(), k);
        }
        table.remove(handles[70]).unwrap();
        let next = table.insert(7).unwrap();
        assert_eq!(next as u32, handles[70] as u32, "the place is used again");
        let worlds = Table::new(Kind::World);
        let world = worlds.insert(1).unwrap();
        for wrong in [0, 1, u64::MAX, handles[70], world, next + 1000, next + (1 << 40)] {
            assert!(table.read(wrong, |_| Ok(())).is_err(), "{wrong:#x}");
            assert!(table.change(wrong, |_| Ok(())).is_err(), "{wrong:#x}");
            assert!(table.remove(wrong).is_err(), "{wrong:#x}");
        }
        assert_eq!(table.read(next, |value| Ok(*value)).unwrap(), 7);
    }

    #[test]
    fn concurrent_use_gives_an_error() {
        let table = Table::new(Kind::World);
        let handle = table.insert(1).unwrap();
        let nested = |second: &dyn Fn() -> Result<(), Fault>| table.change(handle, |_| second());
        assert!(nested(&|| table.change(handle, |_| Ok(()))).is_err());
        assert!(nested(&|| table.read(handle, |_| Ok(()))).is_err());
        assert!(nested(&|| table.remove(handle)).is_err());
        table.read(handle, |_| table.read(handle, |_| Ok(()))).unwrap();
        table.remove(handle).unwrap();
    }

    #[test]
    fn after_a_panic_a_value_can_only_be_destroyed() {
        let table: Table<u32> = Table::new(Kind::World);
        let handle = table.insert(1).unwrap();
        assert_eq!(entry(|| table.change(handle, |_| panic!("half way"))), palpus_result::PalpusErrorInternal);
        assert_eq!(entry(|| table.change(handle, |_| Ok(()))), palpus_result::PalpusErrorInternal);
        assert_eq!(entry(|| table.remove(handle)), palpus_result::PalpusOk);
        let next = table.insert(2).unwrap();
        assert_eq!(table.change(next, |value| Ok(*value)).unwrap(), 2);
    }
}
