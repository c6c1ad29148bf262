//! Describes the machine and the program of a reproduction, so that readers can judge the figures.
//! The names of the machine and its user are not included.

use std::fs::read_to_string;

type Facts = Vec<(String, String)>;

/// Returns processor, memory and system; unknown facts are left out.
pub(super) fn facts() -> Facts {
    let mut facts = Facts::new();
    let mut add = |name: &str, value: Option<String>| facts.extend(value.map(|value| (name.to_owned(), value)));
    add("processor", read_to_string("/proc/cpuinfo").ok().and_then(|text| processor(&text)));
    add("cores", std::thread::available_parallelism().ok().map(|cores| cores.to_string()));
    add("memory", read_to_string("/proc/meminfo").ok().and_then(|text| memory(&text)));
    add("system", read_to_string("/etc/os-release").ok().and_then(|text| system(&text)));
    add("kernel", read_to_string("/proc/sys/kernel/osrelease").ok().map(|text| text.trim().to_owned()));
    add("architecture", Some(format!("{} {}", std::env::consts::OS, std::env::consts::ARCH)));
    facts
}

/// Returns the versions of the program and of its compiler.
pub(super) fn versions() -> Facts {
    let known = |text: &'static str| Some(text).filter(|text| !text.is_empty());
    let profile = known(env!("PALPUS_PROFILE")).map(|profile| match profile {
        "release" => "release".to_owned(),
        other => format!("{other}: not optimised, so its times are not representative"),
    });
    [
        ("palpus", Some(env!("CARGO_PKG_VERSION").to_owned())),
        ("commit", Some(known(env!("PALPUS_COMMIT")).unwrap_or("not known to this build").to_owned())),
        ("compiler", known(env!("PALPUS_RUSTC")).map(str::to_owned)),
        ("built for", known(env!("PALPUS_TARGET")).map(str::to_owned)),
        ("build", profile),
    ]
    .into_iter()
    .filter_map(|(name, value)| Some((name.to_owned(), value?)))
    .collect()
}

fn processor(cpuinfo: &str) -> Option<String> {
    let line = cpuinfo.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned()).filter(|name| !name.is_empty())
}

fn memory(meminfo: &str) -> Option<String> {
    let kilobytes: f64 =
        meminfo.lines().find_map(|line| line.strip_prefix("MemTotal:"))?.split_whitespace().next()?.parse().ok()?;
    Some(format!("{:.1} GB", kilobytes * 1024.0 / 1e9))
}

fn system(os_release: &str) -> Option<String> {
    let name = os_release.lines().find_map(|line| line.strip_prefix("PRETTY_NAME="))?;
    Some(name.trim_matches('"').to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn machine_is_read_from_kernel_files() {
        assert_eq!(processor("processor\t: 0\nmodel name\t: A Fast One\n").as_deref(), Some("A Fast One"));
        assert_eq!(processor("model name\t:\n"), None);
        assert_eq!(memory("MemTotal:        4000000 kB\n").as_deref(), Some("4.1 GB"));
        assert_eq!(system("ID=x\nPRETTY_NAME=\"X 1\"\n").as_deref(), Some("X 1"));
        assert!(versions().iter().any(|fact| fact.0 == "palpus"));
    }
}
