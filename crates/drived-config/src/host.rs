//! The machine that the program runs on.

/// The name of this machine, without its domain; `None` where the system gives it none.
pub fn host_name() -> Option<String> {
    #[cfg(unix)]
    let name = rustix::system::uname().nodename().to_string_lossy().into_owned();
    #[cfg(not(unix))]
    let name = std::env::var("COMPUTERNAME").unwrap_or_default();
    name.split('.').next().filter(|name| !name.is_empty()).map(str::to_owned)
}
