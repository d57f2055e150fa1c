//! What a host does to a daemon and to the ports of its lines.

use std::{
    fs::{self, File},
    io::Write as _,
    thread,
    time::{Duration, Instant},
};

use fastrand::Rng;

use super::{super::process, Hour};

/// So long nothing happens behind a fault, in milliseconds: a line is to come back, and a stop to be told.
const PAUSE: std::ops::Range<u64> = 1_500..8_000;

/// From a tenth of a second to eight: as often short ones as long ones.
fn some_time(rng: &mut Rng) -> Duration {
    Duration::from_secs_f64(0.1 * 80_f64.powf(rng.f64()))
}

/// Until the end: it is stopped and continued, has no processor, no descriptor, no room on its disk.
pub(super) fn of_the_daemon(hour: &Hour, mut rng: Rng) {
    while hour.goes_on() {
        hour.wait(Duration::from_millis(rng.u64(PAUSE)));
        let time = some_time(&mut rng);
        let done = match rng.u8(..8) {
            0..=3 => stopped(hour, time),
            4 => processors_are_eaten(time.min(Duration::from_secs(3))),
            5 | 6 => without_descriptors(hour, time.min(Duration::from_secs(5))),
            _ => without_room(hour, time.min(Duration::from_secs(5))),
        };
        hour.count(done.unwrap_or("faults that this host does not have"));
    }
}

/// Until the end: a simulated line is stopped and continued, or its pty is gone and comes back.
pub(super) fn of_the_lines(hour: &Hour, mut rng: Rng) {
    while hour.goes_on() {
        hour.wait(Duration::from_millis(rng.u64(PAUSE)));
        let time = some_time(&mut rng);
        let line = &hour.site.lines[rng.usize(..hour.site.lines.len())];
        if rng.u8(..3) > 0 {
            line.signal("STOP");
            hour.wait(time);
            line.signal("CONT");
            hour.count("a simulated line stopped and continued");
        } else {
            line.kill();
            hour.wait(time);
            match line.begin() {
                Ok(()) => hour.count("a pty gone and back"),
                Err(error) => hour.judge("a simulator", Err(error.to_string())),
            }
        }
    }
}

fn stopped(hour: &Hour, time: Duration) -> Option<&'static str> {
    let pid = hour.site.pid();
    process::signal(pid, "STOP").then_some(())?;
    hour.wait(time);
    process::signal(pid, "CONT");
    Some("the daemon stopped and continued")
}

/// As many threads as there are processors, which do nothing as fast as they can.
fn processors_are_eaten(time: Duration) -> Option<&'static str> {
    let processors = thread::available_parallelism().ok()?.get();
    let begun = Instant::now();
    thread::scope(|scope| {
        for _ in 0..2 * processors {
            scope.spawn(|| {
                while begun.elapsed() < time {
                    std::hint::spin_loop();
                }
            });
        }
    });
    Some("processors eaten")
}

fn without_descriptors(hour: &Hour, time: Duration) -> Option<&'static str> {
    let pid = hour.site.pid();
    let limit = process::free_descriptor(pid)?;
    process::limit_descriptors(pid, limit).then_some(())?;
    hour.wait(time);
    process::limit_descriptors(pid, process::DESCRIPTORS);
    Some("descriptors exhausted")
}

fn without_room(hour: &Hour, time: Duration) -> Option<&'static str> {
    let filler = hour.site.disk()?.join("filler");
    let mut file = File::create(&filler).ok()?;
    while file.write_all(&[0x55; 65_536]).is_ok() {}
    while file.write_all(&[0x55; 512]).is_ok() {}
    hour.wait(time);
    drop(file);
    let _ = fs::remove_file(&filler);
    Some("a full disk")
}
