//! Endpoints: how a master reaches a line.

mod gateway;
#[cfg(unix)]
mod pty;
mod tcp;
mod wired;

use std::{fmt, io};

use drive_clock::Timer;
use drive_core::SerialSettings;
use tokio::{io::DuplexStream, net::TcpListener, task::JoinHandle};
use tokio_serial::{DataBits, FlowControl, SerialPortBuilderExt, StopBits};

use crate::{line::SimLine, wire::Master};

pub use gateway::{Gateway, GatewayInMemory, SecondConnection};

/// Characters that an endpoint in memory keeps for a master that does not read, about as many as a pty keeps.
const MEMORY: usize = 4_096;

/// An endpoint that is being served. Dropping it ends the service; the line and its drives stay.
pub struct Serving {
    task: JoinHandle<io::Result<()>>,
    /// What is to be undone at the end.
    #[cfg(unix)]
    pty: Option<pty::Pty>,
}

impl Serving {
    fn new(task: JoinHandle<io::Result<()>>) -> Self {
        Self {
            task,
            #[cfg(unix)]
            pty: None,
        }
    }

    /// Waits until the service ends by itself: a port was unplugged, a master in memory went away.
    ///
    /// # Errors
    /// What went wrong with the port.
    ///
    /// # Cancellation
    /// Safe to drop, and to call again.
    pub async fn ended(&mut self) -> io::Result<()> {
        match (&mut self.task).await {
            Ok(result) => result,
            Err(error) if error.is_cancelled() => Ok(()),
            Err(error) => Err(io::Error::other(error)),
        }
    }

    /// The device of a pty endpoint, for instance `/dev/pts/7`.
    #[cfg(unix)]
    #[must_use]
    pub fn device(&self) -> Option<&str> {
        self.pty.as_ref().map(pty::Pty::device)
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl fmt::Debug for Serving {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Serving").field("ended", &self.task.is_finished()).finish_non_exhaustive()
    }
}

impl SimLine {
    /// Serves a master in memory, on tokio's own clock, paused or not. The service ends when the master's end is
    /// dropped.
    ///
    /// # Panics
    /// Outside a tokio runtime, as every endpoint does.
    #[must_use]
    pub fn in_memory(&self) -> DuplexStream {
        self.in_memory_with(Timer::tokio(), self.wiring().settings)
    }

    /// Serves a master in memory to tens of microseconds, in real time: not under a paused clock.
    #[must_use]
    pub fn in_memory_precise(&self) -> DuplexStream {
        self.in_memory_with(Timer::precise(), self.wiring().settings)
    }

    /// [`in_memory`](Self::in_memory) for a master whose port is set to this: slaves with other settings hear it, and are
    /// heard, as a UART hears another speed or format. A character with a wrong parity or stop bit is read as a zero where
    /// the format has a parity, and as it is where it has none: so does a port of Linux that a serial port library has set.
    #[must_use]
    pub fn in_memory_at(&self, settings: SerialSettings) -> DuplexStream {
        self.in_memory_with(Timer::tokio(), settings)
    }

    fn in_memory_with(&self, timer: Timer, settings: SerialSettings) -> DuplexStream {
        let (master, slaves) = tokio::io::duplex(MEMORY);
        let wire = self.wiring().wire(false);
        let tuned = Master::of(settings);
        // Detached: it ends by itself with the master's end.
        drop(tokio::spawn(wired::serve(self.shared().clone(), slaves, timer, wire, move || Some(tuned))));
        master
    }

    /// Serves masters on a pty with a symbolic link to it, one after another or several at once as on a real port. A
    /// link that is there already is replaced; anything else at that path is an error. The link goes with the
    /// [`Serving`].
    ///
    /// A pty does not pace: the line paces by itself. A master that has set another speed or parity than a slave hears it as
    /// a UART would, as far as a pty tells what was set: the speed, two stop bits, an odd parity, any parity that is checked
    /// (`INPCK`), and none where errors are ignored (`IGNPAR` alone). Data bits, and what is not told of the parity, are
    /// taken for the line's, and so is everything of a master that sets nothing. An unpaced line takes whatever a master sets.
    ///
    /// # Errors
    /// No pty can be had, or the link cannot be made.
    #[cfg(unix)]
    pub fn serve_pty(&self, link: impl Into<std::path::PathBuf>) -> io::Result<Serving> {
        let (settings, unpaced) = (self.wiring().settings, self.wiring().unpaced);
        let (port, kept, pty) = pty::open(link.into(), settings)?;
        let wire = self.wiring().wire(false);
        let tuned = move || if unpaced { Some(Master::of(settings)) } else { kept.master(settings) };
        let task = tokio::spawn(wired::serve(self.shared().clone(), port, Timer::precise(), wire, tuned));
        let mut serving = Serving::new(task);
        serving.pty = Some(pty);
        Ok(serving)
    }

    /// Serves a master at the other end of a real serial port, with the line's speed and format. The port paces; what
    /// is recorded of silences is as good as its driver's delivery.
    ///
    /// # Errors
    /// The port cannot be opened or set.
    pub fn serve_serial(&self, path: &str) -> io::Result<Serving> {
        let settings = self.wiring().settings;
        let format = settings.format();
        let port = tokio_serial::new(path, settings.baud())
            .data_bits(if format.data_bits() == 7 { DataBits::Seven } else { DataBits::Eight })
            .stop_bits(if format.stop_bits() == 2 { StopBits::Two } else { StopBits::One })
            .parity(match format.parity() {
                drive_core::serial::Parity::None => tokio_serial::Parity::None,
                drive_core::serial::Parity::Even => tokio_serial::Parity::Even,
                drive_core::serial::Parity::Odd => tokio_serial::Parity::Odd,
            })
            .flow_control(FlowControl::None)
            .open_native_async()?;
        let wire = self.wiring().wire(true);
        Ok(Serving::new(tokio::spawn(wired::serve(
            self.shared().clone(),
            port,
            Timer::precise(),
            wire,
            move || Some(Master::of(settings)),
        ))))
    }

    /// Serves masters that speak the line's protocol over TCP, as a serial server does: one connection at a time,
    /// because a line has one master. The next one waits until it has ended. The service itself ends only with its
    /// listener.
    #[must_use]
    pub fn serve_rtu_tcp(&self, listener: TcpListener) -> Serving {
        Serving::new(tokio::spawn(tcp::serve_rtu(self.clone(), listener)))
    }

    /// Serves Modbus TCP, several connections at once; the unit identifier is the slave's address, 0 is a broadcast.
    /// Answers come after the slave's turnaround; of the faults, [`Fault::Lost`](crate::Fault::Lost) and
    /// [`Fault::Late`](crate::Fault::Late) act, because TCP itself delivers intact. A client that does not speak Modbus TCP is disconnected.
    #[must_use]
    pub fn serve_modbus_tcp(&self, listener: TcpListener) -> Serving {
        Serving::new(tokio::spawn(tcp::serve_modbus(self.clone(), listener)))
    }
}
