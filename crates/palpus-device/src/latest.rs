//! Passes the newest value from the servo loop to slower readers.
//!
//! The exchange is a triple buffer: three slots and one atomic swap of an index. Neither side
//! waits, locks or allocates. The reader gets the newest complete value and misses the values
//! between two reads. A value that owns memory, such as a list of contacts, is overwritten in
//! place, so that its memory is reused ([`Publisher::publish_with`]).

use std::sync::Arc;

/// The end of the servo thread, which writes values.
pub struct Publisher<T: Send>(triple_buffer::Input<Slot<T>>);

impl<T: Send> Publisher<T> {
    /// Makes `value` the newest value. Drops the old value of the slot.
    pub fn publish(&mut self, value: T) {
        self.publish_with(|slot| *slot = value);
    }

    /// Lets `fill` overwrite an old value in place, and makes the result the newest value.
    pub fn publish_with(&mut self, fill: impl FnOnce(&mut T)) {
        fill(&mut self.0.input_buffer_mut().value);
        self.0.publish();
    }
}

/// The end of the reader, such as a window or a live status line.
pub struct Newest<T: Send>(triple_buffer::Output<Slot<T>>);

impl<T: Send> Newest<T> {
    /// Returns the newest value.
    pub fn get(&mut self) -> &T {
        &self.0.read().value
    }

    /// Returns the newest value if it was not read before.
    pub fn take(&mut self) -> Option<&T> {
        self.0.update().then(|| &self.0.output_buffer().value)
    }
}

/// Returns both ends of an exchange whose first value is `initial`.
pub fn latest<T: Copy + Send + Sync + 'static>(initial: T) -> (Publisher<T>, Newest<T>) {
    latest_of(move || initial)
}

/// Returns both ends of an exchange whose three slots are made by `make`. Each slot must be made
/// with all the memory that it will need.
pub fn latest_of<T: Send>(make: impl Fn() -> T + Send + Sync + 'static) -> (Publisher<T>, Newest<T>) {
    let first = Slot { value: make(), make: Arc::new(make) };
    let (input, output) = triple_buffer::triple_buffer(&first);
    (Publisher(input), Newest(output))
}

/// A slot whose clone is made by `make`, since a cloned list would lose its spare capacity.
struct Slot<T> {
    value: T,
    make: Arc<dyn Fn() -> T + Send + Sync>,
}

impl<T> Clone for Slot<T> {
    fn clone(&self) -> Self {
        Self { value: (self.make)(), make: Arc::clone(&self.make) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reader_gets_complete_values_in_order() {
        let (mut publisher, mut newest) = latest([0u64; 16]);
        assert_eq!(newest.take(), None);
        assert_eq!(*newest.get(), [0; 16]);
        let last = 200_000;
        std::thread::scope(|scope| {
            scope.spawn(move || (1..=last).for_each(|k| publisher.publish([k; 16])));
            let mut before = 0;
            while before < last {
                let value = newest.get();
                assert!(value.iter().all(|part| *part == value[0]) && value[0] >= before);
                before = value[0];
            }
        });
        assert_eq!(newest.take(), None);
    }

    #[test]
    fn list_reuses_the_memory_of_its_slot() {
        let (mut publisher, mut newest) = latest_of(|| Vec::<u32>::with_capacity(100));
        for k in 0..10 {
            publisher.publish_with(|list| {
                assert!(list.capacity() >= 100);
                list.clear();
                list.extend(0..k);
            });
        }
        assert_eq!(newest.take().map(Vec::len), Some(9));
    }
}
