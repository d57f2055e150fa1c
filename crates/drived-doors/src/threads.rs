//! On which threads what is done. Whoever comes is heard where nothing else is done, and there a stop is carried out: however many read,
//! it is the next. What is read is made by threads to which the system gives a processor after all others.

use std::{io, num::NonZero, thread::available_parallelism};

use tokio::runtime::{Builder, Handle, Runtime};

/// By how much the threads of readings stand back, as `nice` has it: beside them others get three times as much.
const STANDS_BACK: i32 = 5;

/// Where things are done.
#[derive(Debug, Clone)]
pub(super) struct Threads {
    /// Connections, and stops.
    pub(super) doors: Handle,
    /// Everything else that is commanded: what it begins lives on where the lines do.
    pub(super) commands: Handle,
    /// What only reads.
    pub(super) readings: Handle,
}

impl Threads {
    /// Everything where this is called.
    pub(super) fn of_this_runtime() -> Self {
        let here = Handle::current();
        Self { doors: here.clone(), commands: here.clone(), readings: here }
    }
}

/// Threads that end with this.
pub(super) struct Own(Vec<Runtime>);

impl Own {
    /// Threads for doors and for readings; where the system gives none everything is done where this is called.
    pub(super) fn start() -> (Threads, Self) {
        match (runtime("doors", 1, 0), runtime("readings", processors(), STANDS_BACK)) {
            (Ok(doors), Ok(readings)) => {
                let threads = Threads {
                    doors: doors.handle().clone(),
                    commands: Handle::current(),
                    readings: readings.handle().clone(),
                };
                (threads, Self(vec![doors, readings]))
            }
            (doors, readings) => {
                let why = doors.and(readings).err().map(|error| error.to_string()).unwrap_or_default();
                tracing::warn!("the doors have no threads of their own: {why}: a stop comes after who reads");
                (Threads::of_this_runtime(), Self(Vec::new()))
            }
        }
    }
}

impl Drop for Own {
    fn drop(&mut self) {
        // Who is still served by then was waited for.
        self.0.drain(..).for_each(Runtime::shutdown_background);
    }
}

fn processors() -> usize {
    available_parallelism().map_or(1, NonZero::get)
}

fn runtime(name: &str, threads: usize, stands_back: i32) -> io::Result<Runtime> {
    let stand_back = move || {
        // Of this thread alone. Where it is not taken the threads are as all others.
        #[cfg(target_os = "linux")]
        if stands_back > 0 {
            let _ = rustix::process::setpriority_process(None, stands_back);
        }
    };
    Builder::new_multi_thread()
        .worker_threads(threads)
        .thread_name(name)
        .on_thread_start(stand_back)
        .enable_all()
        .build()
}
