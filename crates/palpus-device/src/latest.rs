//! The newest value, for readers slower than the loop.
//!
//! Three slots and one exchange of an index: neither side ever waits, locks or allocates; the
//! reader gets a whole value, the newest that was published, and misses those between. A value with
//! memory of its own (a list of contacts) is written into a slot that is there already
//! ([`Publisher::publish_with`]).

use std::sync::Arc;

/// The servo thread's end.
pub struct Publisher<T: Send>(triple_buffer::Input<Slot<T>>);

impl<T: Send> Publisher<T> {
    /// From now on this is the newest value. The one that stood in its slot is dropped here.
    pub fn publish(&mut self, value: T) {
        self.publish_with(|slot| *slot = value);
    }

    /// Has `fill` overwrite an older value, which is the newest from then on.
    pub fn publish_with(&mut self, fill: impl FnOnce(&mut T)) {
        fill(&mut self.0.input_buffer_mut().value);
        self.0.publish();
    }
}

/// The other end: a window, a live line.
pub struct Newest<T: Send>(triple_buffer::Output<Slot<T>>);

impl<T: Send> Newest<T> {
    /// The newest value.
    pub fn get(&mut self) -> &T {
        &self.0.read().value
    }

    /// The newest value, if it has not been got yet.
    pub fn take(&mut self) -> Option<&T> {
        self.0.update().then(|| &self.0.output_buffer().value)
    }
}

/// Two ends of an exchange that begins with `initial`.
pub fn latest<T: Copy + Send + Sync + 'static>(initial: T) -> (Publisher<T>, Newest<T>) {
    latest_of(move || initial)
}

/// Two ends of an exchange whose three slots are made by `make`, each with all the memory that it
/// will need.
pub fn latest_of<T: Send>(make: impl Fn() -> T + Send + Sync + 'static) -> (Publisher<T>, Newest<T>) {
    let first = Slot { value: make(), make: Arc::new(make) };
    let (input, output) = triple_buffer::triple_buffer(&first);
    (Publisher(input), Newest(output))
}

/// A value that is made anew where it would be copied: a copied list has no room to spare.
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
    fn the_reader_gets_whole_values_and_never_an_older_one() {
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
    fn a_list_is_written_into_room_that_is_there() {
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
