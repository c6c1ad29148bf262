//! What an operating system has for a loop that must not be late.
//!
//! 1. **Priority**: the loop's thread runs before every ordinary one (`SCHED_FIFO`).
//! 2. **Memory** that is locked: no page of the program is ever waited for.
//! 3. **A core**: the thread stays on one, an isolated one if there is any. Only with priority: on a core that it had to share, a
//!    pinned thread would wait where a free one moves on. Who draws beside the loop leaves that core ([`leave_core`]).
//!
//! Each is asked for by itself; what is not granted is said with its reason and the one line that mends it, and the loop runs
//! without. Known on Linux; elsewhere nothing is claimed.

use std::fmt;

/// What to claim. The default is everything.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RealTimeOptions {
    /// `SCHED_FIFO` priority, 1 to 98 (the watchdog has one more); `None` leaves the thread as it is.
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

/// What became of one claim.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Claimed {
    /// Granted, in words.
    Granted(String),
    /// Not granted.
    Refused {
        /// The reason.
        why: String,
        /// What to do about it, in one line.
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

/// What became of all claims.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RealTimeClaims {
    /// See [`RealTimeOptions::priority`].
    pub priority: Claimed,
    /// See [`RealTimeOptions::lock_memory`].
    pub memory: Claimed,
    /// See [`RealTimeOptions::pin`].
    pub core: Claimed,
    /// The core that the thread stays on, if it does.
    pub pinned_to: Option<usize>,
}

impl RealTimeClaims {
    /// One line each, with a name.
    pub fn lines(&self) -> [(&'static str, &Claimed); 3] {
        [("priority", &self.priority), ("locked memory", &self.memory), ("own core", &self.core)]
    }
}

/// Claims what `options` say for the calling thread, and the memory for the whole process. Allocates: call it before the loop.
pub fn claim(options: &RealTimeOptions) -> RealTimeClaims {
    let priority = options.priority.map_or(Claimed::NotAsked, system::claim_priority);
    let memory = if options.lock_memory { system::lock_memory() } else { Claimed::NotAsked };
    let has_priority = matches!(priority, Claimed::Granted(_));
    let (core, pinned_to) = match options.pin {
        true if has_priority => system::pin(),
        true => {
            let why = "without priority a pinned thread waits for whoever has its core".to_owned();
            (Claimed::Refused { why, mend: "get the priority first".to_owned() }, None)
        }
        false => (Claimed::NotAsked, None),
    };
    RealTimeClaims { priority, memory, core, pinned_to }
}

/// Keeps the calling thread, and all that it starts from now on, off the core on which `claims` keep a loop. A thread that claims a
/// core has all of the process's to choose from again. To be called once the loop's thread has its claims, before a window is opened:
/// where the processor draws, threads of the graphics library come and go on every core that they may have.
pub fn leave_core(claims: &RealTimeClaims) {
    if let Some(core) = claims.pinned_to {
        system::leave(core);
    }
}

/// Lets the calling thread, started by one that has claimed a priority and a core, run before that thread and anywhere.
pub(crate) fn outrank() {
    system::outrank();
}

#[cfg(target_os = "linux")]
mod system {
    use std::sync::OnceLock;

    use rustix::io::Errno;
    use rustix::mm::{MlockAllFlags, mlockall};
    use rustix::process::{Resource, getpid, getrlimit};
    use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
    use thread_priority::{
        Error, RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
        set_thread_priority_and_policy, thread_native_id, thread_schedule_policy_param,
    };

    use super::Claimed;

    const FIFO: ThreadSchedulePolicy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);

    pub(super) fn claim_priority(priority: u8) -> Claimed {
        // Who may not have that one may have a lower one; the one above it is the watchdog's.
        let allowed = getrlimit(Resource::Rtprio).current.and_then(|most| u8::try_from(most).ok()).unwrap_or(0);
        let lower = allowed.saturating_sub(1).min(priority);
        let refused = match set_priority(priority) {
            Ok(()) => return Claimed::Granted(format!("SCHED_FIFO {priority}")),
            Err(_) if lower > 0 && set_priority(lower).is_ok() => {
                return Claimed::Granted(format!("SCHED_FIFO {lower}, the highest that this user may have"));
            }
            Err(refused) => refused,
        };
        Claimed::Refused {
            why: refused,
            mend: format!(
                "add `{} - rtprio {}` to /etc/security/limits.d/palpus.conf and log in again",
                user(),
                priority + 1
            ),
        }
    }

    fn set_priority(priority: u8) -> Result<(), String> {
        let value = ThreadPriorityValue::try_from(priority)?;
        set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), FIFO).map_err(
            |error| match error {
                Error::OS(code) if code == Errno::PERM.raw_os_error() => "this user may not have it".to_owned(),
                Error::OS(code) => std::io::Error::from_raw_os_error(code).to_string(),
                other => other.to_string(),
            },
        )
    }

    pub(super) fn lock_memory() -> Claimed {
        // Where there is a limit, locking what is yet to come would make later allocations fail instead of wait.
        let limit = getrlimit(Resource::Memlock).current.filter(|_| !is_privileged());
        let flags = match limit {
            Some(_) => MlockAllFlags::CURRENT,
            None => MlockAllFlags::CURRENT | MlockAllFlags::FUTURE,
        };
        match mlockall(flags) {
            Ok(()) if flags.contains(MlockAllFlags::FUTURE) => Claimed::Granted("all of it".to_owned()),
            Ok(()) => Claimed::Granted("what there is now, not what is allocated later".to_owned()),
            Err(error) => Claimed::Refused {
                why: match limit {
                    Some(bytes) => format!("the limit is {} kB, less than the program has", bytes / 1024),
                    None => error.to_string(),
                },
                mend: format!(
                    "add `{} - memlock unlimited` to /etc/security/limits.d/palpus.conf and log in again",
                    user()
                ),
            },
        }
    }

    /// True for those whom the limit does not bind.
    fn is_privileged() -> bool {
        rustix::process::geteuid().is_root()
    }

    /// The cores that the process has: those of its first thread, as they were before it left one.
    fn cores_of_process() -> Result<CpuSet, Errno> {
        static CORES: OnceLock<Result<CpuSet, Errno>> = OnceLock::new();
        *CORES.get_or_init(|| sched_getaffinity(Some(getpid())))
    }

    pub(super) fn leave(core: usize) {
        // Refused, nothing is lost but quiet.
        if let Ok(mut rest) = sched_getaffinity(None) {
            rest.unset(core);
            let _ = sched_setaffinity(None, &rest);
        }
    }

    /// And on which.
    pub(super) fn pin() -> (Claimed, Option<usize>) {
        let refused = |why: String| {
            (Claimed::Refused { why, mend: "let the process use more cores (taskset, cpuset)".to_owned() }, None)
        };
        let allowed = match cores_of_process() {
            Ok(allowed) => allowed,
            Err(error) => return refused(error.to_string()),
        };
        let isolated = isolated();
        let is_allowed = |core: usize| core < CpuSet::MAX_CPU && allowed.is_set(core);
        let on = |core: usize| {
            let mut one = CpuSet::new();
            one.set(core);
            sched_setaffinity(None, &one)
        };
        // The kernel leaves isolated cores out of what a process has, and grants them to who asks.
        let granted =
            in_turn(&isolated, is_allowed).into_iter().find(|&core| core < CpuSet::MAX_CPU && on(core).is_ok());
        if let Some(core) = granted {
            return (Claimed::Granted(format!("core {core}, isolated")), Some(core));
        }
        if allowed.count() < 2 {
            return refused("there is one core only".to_owned());
        }
        // One of the fastest, and of those the last: interrupts and whatever is started first gather on the first.
        let fastest =
            (0..CpuSet::MAX_CPU).filter(|&core| is_allowed(core)).max_by_key(|core| (top_frequency(*core), *core));
        let Some(core) = fastest else { return (Claimed::NotAsked, None) };
        match on(core) {
            Ok(()) => (Claimed::Granted(format!("core {core}")), Some(core)),
            Err(error) => refused(error.to_string()),
        }
    }

    /// Isolated cores in the order in which they are tried: first those that the process was given.
    pub(super) fn in_turn(isolated: &[usize], is_allowed: impl Fn(usize) -> bool) -> Vec<usize> {
        let (given, others): (Vec<_>, Vec<_>) = isolated.iter().partition(|&&core| is_allowed(core));
        [given, others].concat()
    }

    /// Cores that the kernel keeps free of ordinary work.
    fn isolated() -> Vec<usize> {
        let list = std::fs::read_to_string("/sys/devices/system/cpu/isolated").unwrap_or_default();
        super::cores(&list)
    }

    /// kHz; 0 where the kernel does not say. Cores of different kinds differ in it.
    fn top_frequency(core: usize) -> u64 {
        let path = format!("/sys/devices/system/cpu/cpu{core}/cpufreq/cpuinfo_max_freq");
        std::fs::read_to_string(path).ok().and_then(|text| text.trim().parse().ok()).unwrap_or(0)
    }

    pub(super) fn outrank() {
        // What is not granted here was not granted to the loop either, or is no loss.
        if let Ok((policy, parameters)) = thread_schedule_policy_param(thread_native_id())
            && policy == FIFO
        {
            let above = u8::try_from(parameters.sched_priority + 1).unwrap_or(u8::MAX).min(99);
            let _ = set_priority(above);
            if let Ok(all) = cores_of_process() {
                let _ = sched_setaffinity(None, &all);
            }
        }
    }

    fn user() -> String {
        std::env::var("USER").ok().filter(|name| !name.is_empty()).unwrap_or_else(|| "YOUR_NAME".to_owned())
    }
}

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

    pub(super) fn outrank() {}
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
    #[cfg(target_os = "linux")]
    fn who_leaves_the_core_does_so_with_all_it_starts_and_the_next_loop_gets_it_again() {
        use rustix::thread::sched_getaffinity;

        let Some(core) = std::thread::spawn(|| system::pin().1).join().unwrap() else { return };
        let pinned = RealTimeClaims {
            priority: Claimed::NotAsked,
            memory: Claimed::NotAsked,
            core: Claimed::Granted(String::new()),
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
