//! Large pages for the memory that a process has already obtained.
//!
//! The processor caches the addresses of some 2000 pages. With pages of 4 kB these are 8 MB, and a
//! step on close-fitting parts reads more than that in each tick. It then waits for addresses more
//! than for data, most of all in a virtual machine, where an address takes two translations. A
//! large page has 2 MB on most machines.

use std::io;
use std::ops::Range;

/// Which memory is moved to large pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// All memory, also what the process has reserved and never used. The system provides it now.
    All,
    /// The large pages of which the process has used at least half.
    Used,
}

/// Moves the anonymous memory of this process (heap, large blocks, stacks of threads) to large
/// pages, as far as the system has them. Returns the number of bytes that are now in large pages.
///
/// The contents of the memory do not change, and pointers to it stay valid. The memory is copied:
/// between 0.1 and 2 s for each 500 MB. Memory that is obtained later has small pages. Call this
/// function when everything that a loop needs has been made, and before the loop starts.
///
/// # Errors
/// The system's error, if no memory could be moved. On other systems than Linux, and on Linux
/// before 6.1, large pages are not available in this way.
pub fn use_large_pages(extent: Extent) -> io::Result<usize> {
    let size = system::large_page()?;
    let mut bytes = 0;
    let mut refused = None;
    for Range { start, end } in whole_pages(&system::memory()?, size) {
        for page in (start..end).step_by(size) {
            if extent == Extent::Used && !system::is_used(page, size) {
                continue;
            }
            match system::collapse(page, size) {
                Ok(()) => bytes += size,
                Err(error) => refused = Some(error),
            }
        }
    }
    match refused {
        Some(error) if bytes == 0 => Err(error),
        _ => Ok(bytes),
    }
}

/// Returns the parts of the writable, anonymous memory in the list `maps` (the format of Linux's
/// `/proc/self/maps`) that whole pages of `size` bytes (a power of two) can hold.
fn whole_pages(maps: &str, size: usize) -> Vec<Range<usize>> {
    let range = |line: &str| {
        // Addresses, rights, offset, device and inode; then the name of a file or of a use.
        let mut fields = line.split_whitespace();
        let (start, end) = fields.next()?.split_once('-')?;
        let is_writable = fields.next()? == "rw-p";
        let is_anonymous = fields.nth(3).is_none_or(|name| name == "[heap]" || name.starts_with("[anon"));
        let start = usize::from_str_radix(start, 16).ok()?.checked_next_multiple_of(size)?;
        let end = usize::from_str_radix(end, 16).ok()? / size * size;
        (is_writable && is_anonymous && start < end).then_some(start..end)
    };
    maps.lines().filter_map(range).collect()
}

#[cfg(target_os = "linux")]
mod system {
    use std::io;

    /// Returns the size of a large page, bytes.
    pub(super) fn large_page() -> io::Result<usize> {
        let size = std::fs::read_to_string("/sys/kernel/mm/transparent_hugepage/hpage_pmd_size").ok();
        let size = size.and_then(|size| size.trim().parse().ok()).filter(|size: &usize| size.is_power_of_two());
        size.ok_or_else(|| io::Error::new(io::ErrorKind::Unsupported, "the system has no large pages"))
    }

    /// Returns the list of the process's memory.
    pub(super) fn memory() -> io::Result<String> {
        std::fs::read_to_string("/proc/self/maps")
    }

    /// Returns true if the process has used at least half of the `size` bytes from `start`. Memory
    /// of which nothing is known counts as used.
    pub(super) fn is_used(start: usize, size: usize) -> bool {
        // No page is smaller.
        let mut pages = vec![0; size / 4096];
        // SAFETY: the call reads nothing from the range, and writes one byte for each of its pages.
        let answer = unsafe { libc::mincore(std::ptr::without_provenance_mut(start), size, pages.as_mut_ptr()) };
        answer != 0 || 2 * pages.iter().filter(|page| **page & 1 == 1).count() >= pages.len()
    }

    /// Moves the memory from `start` to one large page of `size` bytes.
    pub(super) fn collapse(start: usize, size: usize) -> io::Result<()> {
        // SAFETY: the call moves memory to other pages and changes neither its contents nor its
        // rights. If the range is no longer in use, the call fails.
        let answer = unsafe { libc::madvise(std::ptr::without_provenance_mut(start), size, libc::MADV_COLLAPSE) };
        if answer == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use std::io;

    pub(super) fn large_page() -> io::Result<usize> {
        Err(io::ErrorKind::Unsupported.into())
    }

    pub(super) fn memory() -> io::Result<String> {
        Err(io::ErrorKind::Unsupported.into())
    }

    pub(super) fn is_used(_: usize, _: usize) -> bool {
        false
    }

    pub(super) fn collapse(_: usize, _: usize) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAPS: &str = "\
555555554000-555555574000 r--p 00000000 fe:00 123                        /usr/bin/palpus
555555800000-555556400000 rw-p 00000000 00:00 0                          [heap]
7fffe0000000-7fffe0021000 rw-p 00000000 00:00 0
7fffe0021000-7fffe4000000 ---p 00000000 00:00 0
7fffe4100000-7fffe4900000 rw-p 00000000 00:00 0
7fffe5000000-7fffe5800000 rw-p 00000000 00:00 0                          [anon: glibc: malloc]
7fffe6000000-7fffe6800000 rw-s 00000000 00:01 77                         /dev/zero (deleted)
7fffe7000000-7fffe7800000 rw-p 00000000 fe:00 124                        /usr/lib/lib.so
7ffffffde000-7ffffffff000 rw-p 00000000 00:00 0                          [stack]
not a line of memory";

    #[test]
    fn whole_pages_of_anonymous_memory_are_listed() {
        let pages = [
            0x5555_5580_0000..0x5555_5640_0000,
            0x7fff_e420_0000..0x7fff_e480_0000,
            0x7fff_e500_0000..0x7fff_e580_0000,
        ];
        assert_eq!(whole_pages(MAPS, 2 << 20), pages);
        assert!(whole_pages(MAPS, 1 << 40).is_empty());
        assert!(whole_pages("", 2 << 20).is_empty());
    }

    #[test]
    fn contents_stay_the_same() {
        let block: Vec<usize> = (0..2_000_000).collect();
        let place = block.as_ptr();
        // Without large pages, the call fails and changes nothing.
        let moved = use_large_pages(Extent::All);
        assert_eq!(block.as_ptr(), place);
        assert!(block.iter().enumerate().all(|(k, &value)| k == value));
        assert!(moved.is_err() || cfg!(target_os = "linux"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn memory_that_was_never_used_is_told_from_used_memory() {
        const PAGE: usize = 2 << 20;
        let mut block = Vec::<u8>::with_capacity(16 * PAGE);
        let from = block.as_ptr().addr().next_multiple_of(PAGE);
        block.push(1);
        let last = from + 14 * PAGE;
        assert!(!system::is_used(last, PAGE));
        block.resize(16 * PAGE, 1);
        assert!(system::is_used(last, PAGE));
    }
}
