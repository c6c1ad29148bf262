//! The newest value, for whoever is slower than the loop.
//!
//! Three slots and one exchange of an index: neither side ever waits, locks or allocates; the reader gets a whole value, the
//! newest that was published, and misses those between.

/// The servo thread's end.
#[derive(Debug)]
pub struct Publisher<T: Send>(triple_buffer::Input<T>);

impl<T: Copy + Send> Publisher<T> {
    /// From now on this is the newest value.
    pub fn publish(&mut self, value: T) {
        self.0.write(value);
    }
}

/// The other end: a window, a live line.
#[derive(Debug)]
pub struct Newest<T: Send>(triple_buffer::Output<T>);

impl<T: Copy + Send> Newest<T> {
    /// The newest value.
    pub fn get(&mut self) -> T {
        *self.0.read()
    }

    /// The newest value, if it has not been got yet.
    pub fn take(&mut self) -> Option<T> {
        self.0.update().then(|| *self.0.output_buffer())
    }
}

/// Two ends of an exchange that begins with `initial`.
pub fn latest<T: Copy + Send>(initial: T) -> (Publisher<T>, Newest<T>) {
    let (input, output) = triple_buffer::triple_buffer(&initial);
    (Publisher(input), Newest(output))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reader_gets_whole_values_and_never_an_older_one() {
        let (mut publisher, mut newest) = latest([0u64; 16]);
        assert_eq!((newest.take(), newest.get()), (None, [0; 16]));
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
}
