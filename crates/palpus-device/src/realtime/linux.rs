//! Claims of real-time resources on Linux.

use std::sync::OnceLock;

use palpus_alloc::Extent;
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
    // If this user may not have `priority`, a lower priority may be granted. The next higher
    // priority is reserved for the watchdog.
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
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), FIFO).map_err(|error| {
        match error {
            Error::OS(code) if code == Errno::PERM.raw_os_error() => "this user may not have this priority".to_owned(),
            Error::OS(code) => std::io::Error::from_raw_os_error(code).to_string(),
            other => other.to_string(),
        }
    })
}

pub(super) fn use_large_pages() -> Claimed {
    let extent = if too_much_reserved().is_some() { Extent::Used } else { Extent::All };
    match palpus_alloc::use_large_pages(extent) {
        Ok(bytes) => Claimed::Granted(format!("{} MB", bytes >> 20)),
        Err(error) => Claimed::Refused {
            why: error.to_string(),
            mend: "use Linux 6.1 or later with transparent huge pages (not transparent_hugepage=never)".to_owned(),
        },
    }
}

pub(super) fn lock_memory() -> Claimed {
    // Under a memory limit, the `FUTURE` flag would make later allocations fail.
    let limit = getrlimit(Resource::Memlock).current.filter(|_| !is_privileged());
    let mut flags = match limit {
        Some(_) => MlockAllFlags::CURRENT,
        None => MlockAllFlags::CURRENT | MlockAllFlags::FUTURE,
    };
    let reserved = too_much_reserved();
    flags.set(MlockAllFlags::ONFAULT, reserved.is_some());
    match (mlockall(flags), reserved) {
        (Ok(()), Some(bytes)) => {
            Claimed::Granted(format!("the memory that is used; {:.1} GB are reserved for more contacts", bytes / 1e9))
        }
        (Ok(()), None) if flags.contains(MlockAllFlags::FUTURE) => Claimed::Granted("all memory".to_owned()),
        (Ok(()), None) => Claimed::Granted("present memory only, no later allocations".to_owned()),
        (Err(error), _) => Claimed::Refused {
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

/// Memory that the process has reserved and not used is provided and locked if it is at most this,
/// bytes, and at most [`UNUSED_SHARE`] of the machine's available memory. A scene with many objects
/// reserves much more, and uses little of it.
const UNUSED_MOST: f64 = 1e9;

/// See [`UNUSED_MOST`].
const UNUSED_SHARE: f64 = 0.25;

/// Returns the memory that the process has reserved and not used (bytes), if it is too much to be
/// provided now.
fn too_much_reserved() -> Option<f64> {
    let most = UNUSED_MOST.min(UNUSED_SHARE * available_memory().unwrap_or(f64::MAX));
    unused_memory().filter(|&unused| unused > most)
}

/// Returns the memory that the process has reserved and not used, bytes.
fn unused_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    Some(kilobytes(&status, "VmData:")? - kilobytes(&status, "RssAnon:")?)
}

/// Returns the memory that programs can get without swapping, bytes.
fn available_memory() -> Option<f64> {
    kilobytes(&std::fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")
}

/// Returns the value of a line `name   value kB`, bytes.
fn kilobytes(text: &str, name: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let number: f64 = line.trim().strip_suffix("kB")?.trim_end().parse().ok()?;
    Some(number * 1024.0)
}

/// Returns true if the process runs as root, for which the memory limit does not apply.
fn is_privileged() -> bool {
    rustix::process::geteuid().is_root()
}

/// Returns the cores that the process may use. The first thread could use these cores before it
/// left the loop's core.
fn cores_of_process() -> Result<CpuSet, Errno> {
    static CORES: OnceLock<Result<CpuSet, Errno>> = OnceLock::new();
    *CORES.get_or_init(|| sched_getaffinity(Some(getpid())))
}

pub(super) fn leave(core: usize) {
    // If the system refuses this call, the loop only shares its core with other threads.
    if let Ok(mut rest) = sched_getaffinity(None) {
        rest.unset(core);
        let _ = sched_setaffinity(None, &rest);
    }
}

/// Pins the calling thread to one core. Also returns the core if the claim was granted.
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
    // The kernel leaves isolated cores out of a process's affinity mask, but grants them on
    // request.
    let granted = in_turn(&isolated, is_allowed).into_iter().find(|&core| core < CpuSet::MAX_CPU && on(core).is_ok());
    if let Some(core) = granted {
        return (Claimed::Granted(format!("core {core}, isolated")), Some(core));
    }
    if allowed.count() < 2 {
        return refused("there is only one core".to_owned());
    }
    // Takes the last of the fastest cores: interrupts and the first processes gather on the first
    // core.
    let fastest =
        (0..CpuSet::MAX_CPU).filter(|&core| is_allowed(core)).max_by_key(|core| (top_frequency(*core), *core));
    let Some(core) = fastest else { return (Claimed::NotAsked, None) };
    match on(core) {
        Ok(()) => (Claimed::Granted(format!("core {core}")), Some(core)),
        Err(error) => refused(error.to_string()),
    }
}

/// Returns the isolated cores in the order in which they are tried: cores in the affinity mask of
/// the process come first.
pub(super) fn in_turn(isolated: &[usize], is_allowed: impl Fn(usize) -> bool) -> Vec<usize> {
    let (given, others): (Vec<_>, Vec<_>) = isolated.iter().partition(|&&core| is_allowed(core));
    [given, others].concat()
}

/// Returns the cores that the kernel keeps free of ordinary threads.
fn isolated() -> Vec<usize> {
    let list = std::fs::read_to_string("/sys/devices/system/cpu/isolated").unwrap_or_default();
    super::cores(&list)
}

/// Returns the highest frequency of the core, kHz; 0 if the kernel does not report the frequency.
/// The frequency distinguishes performance cores from efficiency cores.
fn top_frequency(core: usize) -> u64 {
    let path = format!("/sys/devices/system/cpu/cpu{core}/cpufreq/cpuinfo_max_freq");
    std::fs::read_to_string(path).ok().and_then(|text| text.trim().parse().ok()).unwrap_or(0)
}

pub(super) fn outrank() -> Claimed {
    let Some(below) = priority_of_this_thread() else {
        let why = "the loop has no real-time priority that its watchdog could exceed".to_owned();
        return Claimed::Refused { why, mend: "get the priority first".to_owned() };
    };
    // The watchdog may run on any core. On the loop's own core, the watchdog still runs before the
    // loop.
    if let Ok(all) = cores_of_process() {
        let _ = sched_setaffinity(None, &all);
    }
    let above = below.saturating_add(1).min(99);
    match set_priority(above) {
        Ok(()) => Claimed::Granted(format!("SCHED_FIFO {above}")),
        Err(why) => Claimed::Refused {
            why: format!("{why}, so a loop that never sleeps would keep the watchdog off its core and hold its force"),
            mend: format!("add `{} - rtprio {above}` to /etc/security/limits.d/palpus.conf and log in again", user()),
        },
    }
}

/// Returns the priority of the loop that started this thread; `None` for a thread without real-time
/// priority.
fn priority_of_this_thread() -> Option<u8> {
    let (policy, parameters) = thread_schedule_policy_param(thread_native_id()).ok()?;
    u8::try_from(parameters.sched_priority).ok().filter(|_| policy == FIFO)
}

fn user() -> String {
    std::env::var("USER").ok().filter(|name| !name.is_empty()).unwrap_or_else(|| "YOUR_NAME".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_system_tells_its_memory() {
        let text = "VmPeak:\t  2048 kB\nVmData:\t   512 kB\nThreads:\t1\n";
        assert_eq!(kilobytes(text, "VmData:"), Some(524_288.0));
        assert_eq!([kilobytes(text, "RssAnon:"), kilobytes(text, "Threads:")], [None; 2]);
        let (unused, available) = (unused_memory().unwrap(), available_memory().unwrap());
        assert!(unused > 0.0 && available > 0.0, "{unused} and {available} bytes");
    }
}
