//! Real-time resources of the operating system, for a loop that must not be late.
//!
//! 1. **Priority**: the loop's thread runs before every ordinary thread (`SCHED_FIFO`).
//! 2. **Locked memory**: the thread never waits for a page of the program to be loaded.
//! 3. **Large pages**: the thread waits less for the addresses of the memory that it reads
//!    ([`palpus_alloc::use_large_pages`]). They belong to the claim of locked memory.
//! 4. **A core**: the thread stays on one core, if possible on an isolated core. A pinned thread
//!    needs priority: on a core with other threads, a pinned thread would wait, while an unpinned
//!    thread could move to another core. A thread that draws beside the loop should leave this core
//!    ([`leave_core`]).
//! 5. **The watchdog**: its thread can be started and has a higher priority than the loop.
//!    Otherwise a loop that never sleeps would keep the watchdog off its core.
//! 6. **A helper**: on a machine with at least four cores, a second thread of the loop's priority
//!    takes part in the steps of close-fitting parts ([`HelperThread`]).
//!
//! Each resource is requested separately. If one is refused, the result says why and how to fix it,
//! and the loop runs without it. Claims are implemented for Linux; on other systems nothing is
//! claimed.

mod helper;
#[cfg(target_os = "linux")]
mod linux;

pub use helper::HelperThread;

use std::fmt;

/// The resources to claim. The default claims all resources.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RealTimeOptions {
    /// `SCHED_FIFO` priority, 1 to 98 (the watchdog gets the next higher priority); `None` keeps
    /// the thread's priority.
    pub priority: Option<u8>,
    /// Moves the memory of the process to large pages, and locks it.
    pub lock_memory: bool,
    /// Keeps the thread on one core.
    pub pin: bool,
}

impl Default for RealTimeOptions {
    /// Priority 80, which is above the kernel's threaded interrupts (50), with locked memory and a
    /// pinned thread.
    fn default() -> Self {
        Self { priority: Some(80), lock_memory: true, pin: true }
    }
}

/// Outcome of one claim.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Claimed {
    /// The claim was granted; the text describes what was granted.
    Granted(String),
    /// The claim was not granted.
    Refused {
        /// Reason for the refusal.
        why: String,
        /// Remedy for the user, in one line.
        mend: String,
    },
    /// The claim was not requested, or has no meaning on this system.
    NotAsked,
}

impl fmt::Display for Claimed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Granted(what) => write!(f, "{what}"),
            Self::Refused { why, mend } => write!(f, "no: {why}; {mend}"),
            Self::NotAsked => write!(f, "not asked for"),
        }
    }
}

/// Results of all claims.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RealTimeClaims {
    /// Result of [`RealTimeOptions::priority`].
    pub priority: Claimed,
    /// Result of [`RealTimeOptions::lock_memory`].
    pub memory: Claimed,
    /// Large pages for the memory that the process has when it makes its claims. Belongs to
    /// [`RealTimeOptions::lock_memory`].
    pub pages: Claimed,
    /// Result of [`RealTimeOptions::pin`].
    pub core: Claimed,
    /// The priority of the watchdog thread, which is above the priority of the loop.
    pub watchdog: Claimed,
    /// The core to which the thread is pinned; `None` if the thread is not pinned.
    pub pinned_to: Option<usize>,
}

impl RealTimeClaims {
    /// Returns each claim with its name.
    pub fn lines(&self) -> [(&'static str, &Claimed); 5] {
        [
            ("priority", &self.priority),
            ("locked memory", &self.memory),
            ("large pages", &self.pages),
            ("own core", &self.core),
            ("watchdog priority", &self.watchdog),
        ]
    }
}

/// Claims the resources in `options` for the calling thread; memory is locked for the whole
/// process. Allocates, so call it before the loop starts.
pub fn claim(options: &RealTimeOptions) -> RealTimeClaims {
    // Memory is moved while the thread has no priority yet, so that other threads run meanwhile.
    let [pages, memory] = match options.lock_memory {
        true => [system::use_large_pages(), system::lock_memory()],
        false => [Claimed::NotAsked, Claimed::NotAsked],
    };
    let priority = options.priority.map_or(Claimed::NotAsked, system::claim_priority);
    let has_priority = matches!(priority, Claimed::Granted(_));
    let (core, pinned_to) = match options.pin {
        true if has_priority => system::pin(),
        true => {
            let why = "without priority a pinned thread waits for the thread that has its core".to_owned();
            (Claimed::Refused { why, mend: "get the priority first".to_owned() }, None)
        }
        false => (Claimed::NotAsked, None),
    };
    let watchdog = if options.priority.is_some() { rehearse_watchdog() } else { Claimed::NotAsked };
    RealTimeClaims { priority, memory, pages, core, watchdog, pinned_to }
}

/// Starts a thread in the same way as the watchdog thread, and returns the granted priority.
fn rehearse_watchdog() -> Claimed {
    let thread = std::thread::Builder::new().name("watchdog".to_owned()).spawn(outrank);
    rehearsed(thread.map(std::thread::JoinHandle::join))
}

fn rehearsed(answer: std::io::Result<std::thread::Result<Claimed>>) -> Claimed {
    let why = match answer {
        Ok(Ok(claimed)) => return claimed,
        Ok(Err(_)) => "it panicked".to_owned(),
        Err(error) => error.to_string(),
    };
    Claimed::Refused {
        why: format!("its thread cannot be started ({why}), so a stalled loop would hold its force"),
        mend: "let this user start more threads (ulimit -u), or close other programs".to_owned(),
    }
}

/// Keeps the calling thread, and all threads that it starts later, off the core to which `claims`
/// pinned a loop. A thread that claims a core later can again choose from all cores of the process.
///
/// Call this function after the loop's thread has made its claims and before a window is opened.
/// With software rendering, threads of the graphics library run on every core that they may use.
pub fn leave_core(claims: &RealTimeClaims) {
    if let Some(core) = claims.pinned_to {
        system::leave(core);
    }
}

/// Gives the calling thread a higher priority than the loop that started it, and lets it run on any
/// core. Returns what was granted.
pub(crate) fn outrank() -> Claimed {
    system::outrank()
}

#[cfg(target_os = "linux")]
use linux as system;

#[cfg(not(target_os = "linux"))]
mod system {
    use super::Claimed;

    fn not_here() -> Claimed {
        Claimed::Refused {
            why: format!("palpus cannot request this on {}", std::env::consts::OS),
            mend: "run the loop on Linux if you need it".to_owned(),
        }
    }

    pub(super) fn claim_priority(_: u8) -> Claimed {
        not_here()
    }

    pub(super) fn use_large_pages() -> Claimed {
        not_here()
    }

    pub(super) fn lock_memory() -> Claimed {
        not_here()
    }

    pub(super) fn pin() -> (Claimed, Option<usize>) {
        (not_here(), None)
    }

    pub(super) fn leave(_: usize) {}

    pub(super) fn outrank() -> Claimed {
        not_here()
    }
}

/// Parses a kernel list of cores such as `2,4-7`.
#[cfg(any(target_os = "linux", test))]
fn cores(list: &str) -> Vec<usize> {
    let mut cores = Vec::new();
    for part in list.trim().split(',').filter(|part| !part.is_empty()) {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        if let (Ok(first), Ok(last)) = (first.parse::<usize>(), last.parse::<usize>())
            && last < 1 << 16
        {
            cores.extend(first..=last);
        }
    }
    cores
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn list_of_cores_is_parsed() {
        assert_eq!(cores("2,4-7\n"), [2, 4, 5, 6, 7]);
        assert_eq!(cores("\n"), [0usize; 0]);
        assert_eq!(cores("x,3-1,9"), [9]);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn isolated_cores_outside_the_affinity_mask_are_tried() {
        assert_eq!(system::in_turn(&[2, 3, 5], |core| core < 2), [2, 3, 5]);
        assert_eq!(system::in_turn(&[2, 3, 5], |core| core == 5), [5, 2, 3]);
        assert!(system::in_turn(&[], |_| true).is_empty());
    }

    #[test]
    fn every_claim_returns_one_line() {
        // Memory is not locked here, since that would affect the whole process and its other tests.
        let options = RealTimeOptions { lock_memory: false, ..RealTimeOptions::default() };
        let claims = std::thread::spawn(move || claim(&options)).join().unwrap();
        assert_eq!([&claims.memory, &claims.pages], [&Claimed::NotAsked; 2]);
        for (name, claimed) in claims.lines() {
            let text = claimed.to_string();
            assert!(!text.is_empty() && !text.contains('\n'), "{name}: {text}");
        }
        let nothing = RealTimeOptions { priority: None, lock_memory: false, pin: false };
        assert!(claim(&nothing).lines().iter().all(|(_, claimed)| **claimed == Claimed::NotAsked));
    }

    #[test]
    fn watchdog_without_thread_or_priority_is_refused() {
        let failed = std::io::Error::from_raw_os_error(11);
        let Claimed::Refused { why, mend } = rehearsed(Err(failed)) else {
            panic!("a thread that did not start must be refused")
        };
        assert!(why.contains("cannot be started") && why.contains("hold its force") && mend.contains("ulimit"));
        // This thread has no real-time priority.
        let Claimed::Refused { why, .. } = rehearse_watchdog() else { panic!("this thread has no priority") };
        assert!(!why.contains("cannot be started") && !why.is_empty(), "{why}");
        let granted = Claimed::Granted("SCHED_FIFO 81".to_owned());
        assert_eq!(rehearsed(Ok(Ok(granted.clone()))), granted);
        // If the loop gets a priority, the watchdog gets a higher priority, or the result says why
        // it does not.
        let options = RealTimeOptions { lock_memory: false, pin: false, ..RealTimeOptions::default() };
        let claims = std::thread::spawn(move || claim(&options)).join().unwrap();
        match (&claims.priority, &claims.watchdog) {
            (Claimed::Granted(loops), Claimed::Granted(watchdogs)) => assert_ne!(loops, watchdogs),
            (Claimed::Refused { .. }, Claimed::Refused { mend, .. }) => assert!(mend.contains("priority first")),
            (_, Claimed::Refused { why, .. }) => assert!(why.contains("hold its force"), "{why}"),
            (loops, watchdogs) => panic!("{loops}, {watchdogs}"),
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn threads_leave_the_core_of_a_pinned_loop() {
        use rustix::thread::sched_getaffinity;

        let Some(core) = std::thread::spawn(|| system::pin().1).join().unwrap() else { return };
        let pinned = RealTimeClaims {
            priority: Claimed::NotAsked,
            memory: Claimed::NotAsked,
            pages: Claimed::NotAsked,
            core: Claimed::Granted(String::new()),
            watchdog: Claimed::NotAsked,
            pinned_to: Some(core),
        };
        let is_off_the_core =
            move || sched_getaffinity(None).is_ok_and(|cores| cores.count() > 0 && !cores.is_set(core));
        let window = std::thread::spawn(move || {
            leave_core(&RealTimeClaims { pinned_to: None, ..pinned.clone() });
            assert!(!is_off_the_core(), "no core was claimed");
            leave_core(&pinned);
            let drawing = std::thread::spawn(is_off_the_core).join().unwrap();
            let next = std::thread::spawn(|| system::pin().1).join().unwrap();
            (is_off_the_core(), drawing, next)
        });
        assert_eq!(window.join().unwrap(), (true, true, Some(core)));
    }
}
