//! Memory of this process and of the machine, where the system tells.

/// Most bytes of memory that this process has had at once.
pub fn peak_bytes() -> Option<u64> {
    field("/proc/self/status", "VmHWM:")
}

/// Bytes of memory that can still be had without swapping.
pub fn available_bytes() -> Option<u64> {
    field("/proc/meminfo", "MemAvailable:")
}

/// The value of a line like `VmHWM:  1234 kB` in bytes.
fn field(file: &str, name: &str) -> Option<u64> {
    // No file of a scene: the kernel's own answer, and none on other systems.
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kilobytes.checked_mul(1024)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    #[test]
    fn the_system_tells() {
        let peak = super::peak_bytes().expect("Linux tells");
        assert!(peak > 1 << 20, "{peak}");
        assert!(super::available_bytes().is_some());
    }
}
