//! Describes the machine from what the operating system reports. Systems other than Linux report
//! little.

use std::fs::read_to_string;

use serde::Serialize;

/// Properties of a machine that matter for a real-time loop.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct Machine {
    pub(super) system: &'static str,
    /// Number of cores that the program may use.
    pub(super) cores: Option<usize>,
    /// Isolated cores, in the kernel's list format: the scheduler puts no ordinary work on them.
    pub(super) isolated_cores: Option<String>,
    /// Frequency governors of the cores, each with the number of its cores.
    pub(super) governors: Option<Vec<(String, usize)>>,
    /// True for a kernel with `PREEMPT_RT`, in which real-time threads also preempt kernel code.
    pub(super) real_time_kernel: Option<bool>,
    /// The highest real-time priority that the user may have; 0 if the user may have no such
    /// priority.
    pub(super) priority_limit: Option<String>,
    /// Amount of memory that the user may lock: bytes or `unlimited`.
    pub(super) memory_limit: Option<String>,
    /// True if the user may set any priority and lock any memory, regardless of the limits.
    pub(super) above_limits: Option<bool>,
    /// True in a virtual machine.
    pub(super) virtual_machine: Option<bool>,
}

impl Machine {
    pub(super) fn look() -> Self {
        let limits = read_to_string("/proc/self/limits").ok();
        let limit = |name: &str| limits.as_deref().and_then(|text| soft_limit(text, name));
        Self {
            system: std::env::consts::OS,
            cores: std::thread::available_parallelism().ok().map(usize::from),
            isolated_cores: line_of("/sys/devices/system/cpu/isolated"),
            governors: governors(),
            real_time_kernel: real_time_kernel(),
            priority_limit: limit("Max realtime priority"),
            memory_limit: limit("Max locked memory"),
            above_limits: read_to_string("/proc/self/status").ok().and_then(|text| is_above_limits(&text)),
            virtual_machine: read_to_string("/proc/cpuinfo").ok().and_then(|text| is_virtual(&text)),
        }
    }

    /// Returns the names and values as text for the report.
    pub(super) fn lines(&self) -> [(&'static str, String); 4] {
        let unknown = || "not known here".to_owned();
        let of = |value: &Option<String>| value.clone().unwrap_or_else(unknown);
        let memory = self.memory_limit.as_ref().map_or_else(unknown, |bytes| match bytes.parse::<u64>() {
            Ok(bytes) => format!("{} kB", bytes / 1024),
            Err(_) => bytes.clone(),
        });
        let governors = self.governors.as_ref().map_or_else(unknown, |governors| {
            let each = governors.iter().map(|(name, cores)| format!("{name} ({cores} cores)"));
            each.collect::<Vec<_>>().join(", ")
        });
        let cores = self.cores.map_or_else(unknown, |cores| match self.isolated_cores.as_deref() {
            None | Some("") => cores.to_string(),
            Some(isolated) => format!("{cores}, isolated: {isolated}"),
        });
        let kernel = match (self.real_time_kernel, self.virtual_machine) {
            (None, _) => format!("{}, not known here", self.system),
            (Some(real_time), guest) => format!(
                "{}, {}{}",
                self.system,
                if real_time { "real-time" } else { "ordinary, not real-time" },
                if guest == Some(true) { ", in a virtual machine" } else { "" }
            ),
        };
        let limits = match self.above_limits {
            Some(true) => "do not bind this user".to_owned(),
            _ => format!("priority up to {}, locked memory up to {memory}", of(&self.priority_limit)),
        };
        [("limits", limits), ("cores", cores), ("governor", governors), ("kernel", kernel)]
    }

    /// Returns true if the governor of a core may lower its frequency.
    pub(super) fn has_slow_governor(&self) -> bool {
        self.governors.iter().flatten().any(|(name, _)| name != "performance")
    }
}

/// Returns the first of the two values of a limit in `/proc/self/limits`.
fn soft_limit(text: &str, name: &str) -> Option<String> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next().map(str::to_owned)
}

/// Counts the cores with each governor.
fn governors() -> Option<Vec<(String, usize)>> {
    let mut counted: Vec<(String, usize)> = Vec::new();
    for core in 0..std::thread::available_parallelism().map_or(1, usize::from) {
        let name = line_of(&format!("/sys/devices/system/cpu/cpu{core}/cpufreq/scaling_governor"))?;
        match counted.iter_mut().find(|known| known.0 == name) {
            Some(known) => known.1 += 1,
            None => counted.push((name, 1)),
        }
    }
    Some(counted)
}

fn real_time_kernel() -> Option<bool> {
    match line_of("/sys/kernel/realtime") {
        Some(text) => Some(text == "1"),
        None => line_of("/proc/version").map(|text| text.contains("PREEMPT_RT")),
    }
}

/// Returns true if the program may set priorities and lock memory.
fn is_above_limits(status: &str) -> Option<bool> {
    const IPC_LOCK: u64 = 1 << 14;
    const SYS_NICE: u64 = 1 << 23;
    let held = status.lines().find_map(|line| line.strip_prefix("CapEff:"))?;
    let held = u64::from_str_radix(held.trim(), 16).ok()?;
    Some(held & (IPC_LOCK | SYS_NICE) == IPC_LOCK | SYS_NICE)
}

/// Returns true if the processor reports a hypervisor; `None` if the processor reports no features.
fn is_virtual(cpuinfo: &str) -> Option<bool> {
    let flags = cpuinfo.lines().find_map(|line| line.strip_prefix("flags")?.split_once(':'))?.1;
    Some(flags.split_whitespace().any(|flag| flag == "hypervisor"))
}

fn line_of(path: &str) -> Option<String> {
    read_to_string(path).ok().map(|text| text.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_read_by_name() {
        let text = "Limit                     Soft Limit           Hard Limit           Units     \n\
                    Max locked memory         8388608              unlimited            bytes     \n\
                    Max realtime priority     0                    0                    \n";
        assert_eq!(soft_limit(text, "Max locked memory").as_deref(), Some("8388608"));
        assert_eq!(soft_limit(text, "Max realtime priority").as_deref(), Some("0"));
        assert_eq!(soft_limit(text, "Max nothing"), None);
    }

    #[test]
    fn capabilities_lift_the_limits() {
        assert_eq!(is_above_limits("Name:\tx\nCapEff:\t000001ffffffffff\n"), Some(true));
        assert_eq!(is_above_limits("CapEff:\t0000000000000000\n"), Some(false));
        assert_eq!(is_above_limits(""), None);
    }

    #[test]
    fn virtual_machine_is_detected_from_flags() {
        assert_eq!(is_virtual("flags\t\t: fpu sse hypervisor\n"), Some(true));
        assert_eq!(is_virtual("flags\t\t: fpu sse\n"), Some(false));
        assert_eq!(is_virtual("Features\t: neon\n"), None);
    }

    #[test]
    fn unknown_facts_are_marked() {
        let lines = Machine { system: "none", ..Machine::default() }.lines();
        assert!(lines.iter().all(|(_, value)| value.contains("not known here")));
    }
}
