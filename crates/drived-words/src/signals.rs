//! What the program is asked by signals: to end (Ctrl-C, SIGTERM, SIGQUIT), to read its configuration again (SIGHUP), to say how
//! its drives are (SIGUSR1, SIGUSR2).

use std::io;

use crate::failure::Failure;

/// Hears the requests to end from when it is made, so that none is lost between two waits.
pub struct Ending {
    /// When a test asks.
    #[cfg(any(test, feature = "testing"))]
    at: Option<tokio::time::Instant>,
    /// A byte for each. A listener of tokio's can miss one that comes while the first is being made.
    #[cfg(unix)]
    asked: tokio::net::UnixStream,
    #[cfg(unix)]
    signals: Vec<signal_hook::SigId>,
}

impl Ending {
    #[cfg(unix)]
    pub fn listen() -> Result<Self, Failure> {
        use signal_hook::consts::{SIGINT, SIGQUIT, SIGTERM};
        Self::to(&[SIGINT, SIGTERM, SIGQUIT])
    }

    /// The same for a program whose picture is a terminal: that this is gone ends it in order too, unless whoever began it said that
    /// it is to stay.
    #[cfg(unix)]
    pub fn listen_on_terminal() -> Result<Self, Failure> {
        use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
        match is_hangup_ignored() {
            true => Self::listen(),
            false => Self::to(&[SIGINT, SIGTERM, SIGQUIT, SIGHUP]),
        }
    }

    #[cfg(not(unix))]
    pub fn listen_on_terminal() -> Result<Self, Failure> {
        Self::listen()
    }

    #[cfg(unix)]
    fn to(signals: &[i32]) -> Result<Self, Failure> {
        use signal_hook::low_level::pipe;
        let listen = || {
            let (asked, asks) = tokio::net::UnixStream::pair()?;
            let asks = asks.into_std()?;
            let signals = signals.iter().map(|&signal| pipe::register(signal, asks.try_clone()?));
            io::Result::Ok(Self {
                #[cfg(any(test, feature = "testing"))]
                at: None,
                asked,
                signals: signals.collect::<io::Result<_>>()?,
            })
        };
        listen().map_err(|error| cannot_listen(&error))
    }

    #[cfg(not(unix))]
    pub fn listen() -> Result<Self, Failure> {
        Ok(Self {
            #[cfg(any(test, feature = "testing"))]
            at: None,
        })
    }

    /// Asks once, at this time.
    #[cfg(any(test, feature = "testing"))]
    pub const fn at(&mut self, at: tokio::time::Instant) {
        self.at = Some(at);
    }

    /// Waits until the program is asked to end. Safe to drop.
    #[cfg(unix)]
    pub async fn asked(&mut self) {
        #[cfg(any(test, feature = "testing"))]
        if let Some(at) = self.at {
            tokio::time::sleep_until(at).await;
            self.at = None;
            return;
        }
        loop {
            let heard = match self.asked.readable().await {
                // Those that came together are one.
                Ok(()) => self.asked.try_read(&mut [0; 64]),
                Err(error) => Err(error),
            };
            match heard {
                Ok(1..) => return,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                // The other end is in the hands of the signals.
                Ok(0) | Err(_) => std::future::pending().await,
            }
        }
    }

    /// Waits until the program is asked to end. Safe to drop.
    #[cfg(not(unix))]
    pub async fn asked(&mut self) {
        if let Err(error) = tokio::signal::ctrl_c().await {
            tracing::warn!("{}", cannot_listen(&error));
            std::future::pending().await
        }
    }
}

#[cfg(unix)]
impl Drop for Ending {
    fn drop(&mut self) {
        for signal in self.signals.drain(..) {
            signal_hook::low_level::unregister(signal);
        }
    }
}

/// What a daemon is asked besides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wish {
    /// To read its configuration again.
    Reload,
    /// To say how its drives are.
    State,
    /// To end, because its terminal was closed.
    End,
}

/// Hears what a daemon is asked besides ending, from when it is made.
#[cfg(unix)]
pub struct Wishes {
    hangup: tokio::signal::unix::Signal,
    user: [tokio::signal::unix::Signal; 2],
    /// Whether it began on a terminal whose end means something to it.
    on_terminal: bool,
}

#[cfg(unix)]
impl Wishes {
    pub fn listen() -> Result<Self, Failure> {
        use tokio::signal::unix::{SignalKind, signal};
        // Asked before the signal is listened to, which ends its being ignored.
        let on_terminal = has_terminal() && !is_hangup_ignored();
        let listen = |kind| signal(kind).map_err(|error| cannot_listen(&error));
        let user = [listen(SignalKind::user_defined1())?, listen(SignalKind::user_defined2())?];
        Ok(Self { hangup: listen(SignalKind::hangup())?, user, on_terminal })
    }

    /// The next. SIGHUP means that the configuration is to be read again, unless the terminal on which the program began is
    /// gone. Safe to drop.
    pub async fn next(&mut self) -> Wish {
        let [one, two] = &mut self.user;
        tokio::select! {
            _ = self.hangup.recv() => match self.on_terminal && !has_terminal() {
                true => Wish::End,
                false => Wish::Reload,
            },
            _ = one.recv() => Wish::State,
            _ = two.recv() => Wish::State,
        }
    }
}

#[cfg(not(unix))]
pub struct Wishes;

#[cfg(not(unix))]
impl Wishes {
    pub fn listen() -> Result<Self, Failure> {
        Ok(Self)
    }

    pub async fn next(&mut self) -> Wish {
        std::future::pending().await
    }
}

/// Hears Ctrl-Z, so that the terminal is given back before the program stands still.
#[cfg(unix)]
pub struct Suspending(tokio::signal::unix::Signal);

#[cfg(unix)]
impl Suspending {
    pub fn listen() -> Result<Self, Failure> {
        use tokio::signal::unix::{SignalKind, signal};
        let kind = SignalKind::from_raw(rustix::process::Signal::TSTP.as_raw());
        signal(kind).map(Self).map_err(|error| cannot_listen(&error))
    }

    /// Waits until somebody asks. Safe to drop.
    pub async fn asked(&mut self) {
        self.0.recv().await;
    }

    /// Stands still until somebody lets it go on.
    pub fn suspend(&self) {
        // One that cannot be suspended goes on at once.
        let _ = rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::STOP);
    }
}

#[cfg(not(unix))]
pub struct Suspending;

#[cfg(not(unix))]
impl Suspending {
    pub fn listen() -> Result<Self, Failure> {
        Ok(Self)
    }

    pub async fn asked(&mut self) {
        std::future::pending().await
    }

    pub fn suspend(&self) {}
}

/// Whether the program has a terminal. A daemon has none, and one that was closed is none any more.
#[cfg(unix)]
fn has_terminal() -> bool {
    std::fs::File::open("/dev/tty").is_ok()
}

/// Whether `nohup` or the like has the end of the terminal ignored, as Linux tells it.
#[cfg(unix)]
fn is_hangup_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask & 1 == 1)
}

fn cannot_listen(error: &io::Error) -> Failure {
    Failure::Input(format!("cannot listen to Ctrl-C: {error}"))
}
