//! What the machine itself does to a wait: beside it a program can be judged.

use std::{num::NonZeroU64, thread, time::Duration};

use drive_core::serial::SerialSettings;
use rustix::{
    io::Errno,
    thread::{clock_nanosleep_absolute, set_current_timer_slack},
    time::{ClockId, Timespec},
};

use crate::{
    Error,
    report::{Report, Unit, micros, quantile},
    usage::monotonic,
};

/// By how much waits of t3.5 end too late when nothing runs but `threads` that wait, one system call a wait, for `time`.
pub(crate) fn alone(report: &mut Report, section: &str, threads: u16, time: Duration) -> Result<(), Error> {
    let waiting: Vec<_> = (0..threads).map(|number| thread::spawn(move || waits(number, time))).collect();
    let mut late = Vec::new();
    for thread in waiting {
        late.extend(thread.join().map_err(|_| "a thread that waited has panicked")??);
    }
    let name = format!("the machine alone, {} waits of t3.5, too late by", late.len());
    for (quantile_name, per_mille) in [("p50", 500), ("p99", 990), ("p99.9", 999), ("at the worst", 1_000)] {
        let late = micros(quantile(&mut late, per_mille));
        report.note(section, format!("{name}: {quantile_name}"), Unit::Micros, late);
    }
    Ok(())
}

fn waits(number: u16, time: Duration) -> Result<Vec<Duration>, Error> {
    // Else the kernel lets each of them end 50 us later, so that it may take several at once; a timer descriptor has none of that.
    set_current_timer_slack(NonZeroU64::new(1))?;
    let end = monotonic() + time;
    let mut late = Vec::new();
    let mut pause = u64::from(number) + 1;
    while monotonic() < end {
        // Not all at the same time, and with as much between as a slot has.
        pause = pause * 31 % 97;
        until(monotonic() + Duration::from_micros(18_000 + 47 * pause))?;
        let due = monotonic() + SerialSettings::MODBUS_DEFAULT.t3_5();
        until(due)?;
        late.push(monotonic().saturating_sub(due));
    }
    Ok(late)
}

fn until(due: Duration) -> Result<(), Error> {
    let due = Timespec { tv_sec: i64::try_from(due.as_secs())?, tv_nsec: due.subsec_nanos().into() };
    while let Err(error) = clock_nanosleep_absolute(ClockId::Monotonic, &due) {
        if error != Errno::INTR {
            return Err(error.into());
        }
    }
    Ok(())
}
