//! Rights of an operating system for a loop that must not be late.
//!
//! 1. **Priority**: the loop's thread runs before every ordinary one (`SCHED_FIFO`).
//! 2. **Memory** that is locked: no page of the program is ever waited for.
//! 3. **A core**: the thread stays on one, an isolated one if there is any. Only with priority: on
//!    a core that it had to share, a pinned thread would wait where a free one moves on. Who draws
//!    beside the loop leaves that core ([`leave_core`]).
//!
//! 4. **The watchdog**: its thread can be started, and runs before the loop's: a loop that never
//!    sleeps would otherwise keep it from its core.
//!
//! Each is requested by itself. A refusal is reported with its reason and the one line that mends
//! it, and the loop runs without. Known on Linux; elsewhere nothing is claimed.

#[cfg(target_os = "linux")]
mod linux;

use std::fmt;

/// Claims to make. The default is all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RealTimeOptions {
    /// `SCHED_FIFO` priority, 1 to 98 (the watchdog has one more); `None` leaves the thread as it
    /// is.
    pub priority: Option<u8>,
    /// Lock the process's memory.
    pub lock_memory: bool,
    /// Keep the thread on one core.
    pub pin: bool,
}

impl Default for RealTimeOptions {
    /// Priority 80, above the kernel's threaded interrupts at 50; locked; pinned.
    fn default() -> Self {
        Self { priority: Some(80), lock_memory: true, pin: true }
    }
}

/// Outcome of one claim.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Claimed {
    /// Granted, in words.
    Granted(String),
    /// Not granted.
    Refused {
        /// The reason.
        why: String,
        /// Advice, in one line.
        mend: String,
    },
    /// It was not asked for, or means nothing here.
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

/// Outcomes of all claims.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RealTimeClaims {
    /// See [`RealTimeOptions::priority`].
    pub priority: Claimed,
    /// See [`RealTimeOptions::lock_memory`].
    pub memory: Claimed,
    /// See [`RealTimeOptions::pin`].
    pub core: Claimed,
    /// The priority of the watchdog's thread, which is above the loop's.
    pub watchdog: Claimed,
    /// The core that the thread stays on, if it does.
    pub pinned_to: Option<usize>,
}

impl RealTimeClaims {
    /// One line each, with a name.
    pub fn lines(&self) -> [(&'static str, &Claimed); 4] {
        [
            ("priority", &self.priority),
            ("locked memory", &self.memory),
            ("own core", &self.core),
            ("watchdog priority", &self.watchdog),
        ]
    }
}

/// Claims what `options` say for the calling thread, and the memory for the whole process.
/// Allocates: call it before the loop.
pub fn claim(options: &RealTimeOptions) -> RealTimeClaims {
    let priority = options.priority.map_or(Claimed::NotAsked, system::claim_priority);
    let memory = if options.lock_memory { system::lock_memory() } else { Claimed::NotAsked };
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
    RealTimeClaims { priority, memory, core, watchdog, pinned_to }
}

/// Starts a thread from the loop's, as the watchdog's is started, and returns its rights.
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
        why: format!("its thread cannot be started ({why}), so that a loop that stands still would hold its force"),
        mend: "let this user start more threads (ulimit -u), or close other programs".to_owned(),
    }
}

/// Keeps the calling thread, and all that it starts from now on, off the core on which `claims`
/// keep a loop. A thread that claims a core has all of the process's to choose from again. To be
/// called once the loop's thread has its claims, before a window is opened: where the processor
/// draws, threads of the graphics library come and go on every core that they may have.
pub fn leave_core(claims: &RealTimeClaims) {
    if let Some(core) = claims.pinned_to {
        system::leave(core);
    }
}

/// Lets the calling thread, started by one that has claimed a priority and a core, run before that
/// thread and anywhere; and says what was granted.
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
            why: format!("palpus does not know how to ask for it on {}", std::env::consts::OS),
            mend: "run the loop on Linux where it matters".to_owned(),
        }
    }

    pub(super) fn claim_priority(_: u8) -> Claimed {
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

/// Cores out of a kernel's list such as `2,4-7`.
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
    fn a_list_of_cores_is_read() {
        assert_eq!(cores("2,4-7\n"), [2, 4, 5, 6, 7]);
        assert_eq!(cores("\n"), [0usize; 0]);
        assert_eq!(cores("x,3-1,9"), [9]);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn isolated_cores_are_tried_though_a_process_has_them_only_if_it_was_given_them() {
        assert_eq!(system::in_turn(&[2, 3, 5], |core| core < 2), [2, 3, 5]);
        assert_eq!(system::in_turn(&[2, 3, 5], |core| core == 5), [5, 2, 3]);
        assert!(system::in_turn(&[], |_| true).is_empty());
    }

    #[test]
    fn every_claim_is_answered_in_one_line_and_the_thread_runs_on() {
        // Not the memory: it is the whole process's, and other tests run in it.
        let options = RealTimeOptions { lock_memory: false, ..RealTimeOptions::default() };
        let claims = std::thread::spawn(move || claim(&options)).join().unwrap();
        assert_eq!(claims.memory, Claimed::NotAsked);
        for (name, claimed) in claims.lines() {
            let text = claimed.to_string();
            assert!(!text.is_empty() && !text.contains('\n'), "{name}: {text}");
        }
        let nothing = RealTimeOptions { priority: None, lock_memory: false, pin: false };
        assert!(claim(&nothing).lines().iter().all(|(_, claimed)| **claimed == Claimed::NotAsked));
    }

    #[test]
    fn a_watchdog_that_cannot_start_or_lacks_its_priority_is_said() {
        let failed = std::io::Error::from_raw_os_error(11);
        let Claimed::Refused { why, mend } = rehearsed(Err(failed)) else { panic!("it did not start") };
        assert!(why.contains("cannot be started") && why.contains("hold its force") && mend.contains("ulimit"));
        // From a thread without priority.
        let Claimed::Refused { why, .. } = rehearse_watchdog() else { panic!("this thread has no priority") };
        assert!(!why.contains("cannot be started") && !why.is_empty(), "{why}");
        let granted = Claimed::Granted("SCHED_FIFO 81".to_owned());
        assert_eq!(rehearsed(Ok(Ok(granted.clone()))), granted);
        // With one, it is granted one above, or it is said why not.
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
    fn who_leaves_the_core_does_so_with_all_it_starts_and_the_next_loop_gets_it_again() {
        use rustix::thread::sched_getaffinity;

        let Some(core) = std::thread::spawn(|| system::pin().1).join().unwrap() else { return };
        let pinned = RealTimeClaims {
            priority: Claimed::NotAsked,
            memory: Claimed::NotAsked,
            core: Claimed::Granted(String::new()),
            watchdog: Claimed::NotAsked,
            pinned_to: Some(core),
        };
        let is_off_the_core =
            move || sched_getaffinity(None).is_ok_and(|cores| cores.count() > 0 && !cores.is_set(core));
        let window = std::thread::spawn(move || {
            leave_core(&RealTimeClaims { pinned_to: None, ..pinned.clone() });
            assert!(!is_off_the_core(), "there was nothing to leave");
            leave_core(&pinned);
            let drawing = std::thread::spawn(is_off_the_core).join().unwrap();
            let next = std::thread::spawn(|| system::pin().1).join().unwrap();
            (is_off_the_core(), drawing, next)
        });
        assert_eq!(window.join().unwrap(), (true, true, Some(core)));
    }
}
