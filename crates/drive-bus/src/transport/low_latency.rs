//! USB adapters that hold back what they have received: FTDI's wait up to 16 ms for more, as delivered, which is longer
//! than most answers.
//!
//! Linux has two ways to make that 1 ms: the port's `low_latency` flag, which whoever may open the port may set, and the
//! driver's `latency_timer` in sysfs, which usually needs root. Other adapters have neither and need none.

#[cfg(target_os = "linux")]
mod flag;

use std::{
    fs, io,
    path::{Path, PathBuf},
    time::Duration,
};

use tokio_serial::SerialStream;

/// The least that an adapter can wait.
const SHORTEST: Duration = Duration::from_millis(1);

/// How long the USB adapter at `path` holds back what it has received, as its driver reports it (FTDI `latency_timer`).
/// `None` where there is no such thing: no USB adapter, another driver, another system.
#[must_use]
pub fn adapter_latency(path: &Path) -> Option<Duration> {
    LatencyTimer::of(path)?.read()
}

/// Makes the adapter at `path`, open as `port`, deliver at once, as far as the system lets us. What is given back is how
/// long it goes on holding answers back all the same; a line works nevertheless, only slower.
pub(super) fn lower(port: &SerialStream, path: &Path) -> Option<Duration> {
    match set_flag(port) {
        Ok(set) => tracing::debug!(port = %path.display(), set, "low_latency flag"),
        Err(error) => tracing::debug!(port = %path.display(), %error, "low_latency flag not set"),
    }
    LatencyTimer::of(path)?.lower()
}

#[cfg(target_os = "linux")]
fn set_flag(port: &SerialStream) -> io::Result<bool> {
    flag::set(port)
}

#[cfg(not(target_os = "linux"))]
fn set_flag(_: &SerialStream) -> io::Result<bool> {
    Ok(false)
}

/// The file in which Linux keeps the latency timer of an adapter, in milliseconds.
#[derive(Debug)]
struct LatencyTimer(PathBuf);

impl LatencyTimer {
    fn of(path: &Path) -> Option<Self> {
        // The path may be a link of udev's, /dev/serial/by-id/….
        let device = fs::canonicalize(path).ok()?;
        Some(Self(Path::new("/sys/class/tty").join(device.file_name()?).join("device/latency_timer")))
    }

    fn read(&self) -> Option<Duration> {
        let millis = fs::read_to_string(&self.0).ok()?;
        Some(Duration::from_millis(millis.trim().parse().ok()?))
    }

    /// Writes the timer where it is still too long; how long it is then, if that is too long.
    fn lower(&self) -> Option<Duration> {
        let too_long = || self.read().filter(|latency| *latency > SHORTEST);
        too_long()?;
        if let Err(error) = fs::write(&self.0, SHORTEST.as_millis().to_string()) {
            tracing::debug!(timer = %self.0.display(), %error, "latency timer not written");
        }
        too_long()
    }
}

#[cfg(test)]
mod tests {
    use std::env;

    use super::*;

    /// A timer in a file of its own.
    fn timer(name: &str, content: &str) -> LatencyTimer {
        let file = env::temp_dir().join(format!("latency-timer-{}-{name}", std::process::id()));
        fs::write(&file, content).unwrap();
        LatencyTimer(file)
    }

    #[test]
    fn a_long_timer_is_made_short_and_read_back() {
        let timer = timer("long", "16\n");
        assert_eq!(timer.read(), Some(Duration::from_millis(16)));
        assert_eq!(timer.lower(), None);
        assert_eq!(fs::read_to_string(&timer.0).unwrap(), "1");
        fs::remove_file(timer.0).unwrap();
    }

    #[test]
    fn a_short_timer_is_left_alone_and_one_that_is_none_says_nothing() {
        for content in ["1\n", "0\n", "", "soon"] {
            let timer = timer("short", content);
            assert_eq!(timer.lower(), None);
            assert_eq!(fs::read_to_string(&timer.0).unwrap(), content);
            fs::remove_file(timer.0).unwrap();
        }
    }

    #[test]
    fn a_path_without_an_adapter_has_no_latency() {
        assert_eq!(adapter_latency(Path::new("/dev/null")), None);
        assert_eq!(adapter_latency(Path::new("/dev/no-such-port")), None);
    }
}
