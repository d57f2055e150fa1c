//! [`Line`]: opening, sharing and closing one line.

use std::{fmt, io, sync::Arc, time::Duration};

use drive_clock::Sleeps;
use tokio::{
    io::{AsyncRead, AsyncWrite},
    sync::watch,
    time::{Instant, sleep},
};

use crate::{
    capture::{self, Dissector, LastFrames, Writing},
    config::{LineConfig, SlaveSettings},
    evidence::{Fact, Finding},
    master::Master,
    pdu::MAX_PDU,
    record::Exchange,
    shared::{Handle, Shared},
    slave::Slave,
    stats::Stats,
    task::Task,
    transport::{BoxedStream, Connector, Given, Guarded, OpenError, begin},
};

/// How long what somebody else was asked for just now may take to come to the line.
const HANDED_ON: Duration = Duration::from_millis(2);

/// One line and the task that owns its port. Cheap to clone; when the last handle ([`Line`] or [`Slave`]) is gone, the
/// exchange that is under way finishes and the port is closed.
///
/// ```
/// use drive_bus::{Line, LineConfig};
/// use drive_core::SerialSettings;
/// use tokio_modbus::client::{Context, Reader};
///
/// # #[tokio::main(flavor = "current_thread", start_paused = true)]
/// # async fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let plant = drive_sim::SimLine::new(drive_sim::Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
/// # let machine = plant.add(1, drive_sim::models::atv312::Atv312::under_bus_control())?;
/// # let stream = plant.in_memory();
/// // On a port: Line::open(LineConfig::serial("/dev/ttyUSB0", SerialSettings::MODBUS_DEFAULT)).await?
/// let line = Line::over(stream, LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
///
/// let mut drive: Context = line.slave(1).into();
/// assert_eq!(drive.read_holding_registers(3201, 1).await??, [0x0240]); // switch on disabled
///
/// assert_eq!(line.stats().slaves[&1].outcomes.answered, 1);
/// line.close().await;
/// # Ok(())
/// # }
/// ```
#[derive(Clone)]
pub struct Line {
    pub(crate) handle: Arc<Handle>,
}

impl Line {
    /// Opens the port and starts the line's task on the current tokio runtime.
    ///
    /// Later losses of the port (unplugged, closed) are repaired by the line itself; only the first opening is
    /// reported here.
    ///
    /// # Errors
    /// [`OpenError`] when the port cannot be opened: it says which and why.
    pub async fn open(config: LineConfig) -> Result<Self, OpenError> {
        let mut connector = Connector::to(&config)?;
        let stream = connector.connect().ok_or(OpenError::NoPort)?.await?;
        Ok(Self::spawn(config, connector, Some(stream), Sleeps::new()))
    }

    /// Starts the line without waiting for its port, which is opened as soon as it is there. Until then calls end with
    /// [`PortError::LineDown`](drive_core::PortError::LineDown).
    ///
    /// # Errors
    /// [`OpenError`] when the configuration names no port.
    ///
    /// # Panics
    /// Outside a tokio runtime, as [`over`](Self::over) and [`over_reopened`](Self::over_reopened): its task lives there.
    pub fn start(config: LineConfig) -> Result<Self, OpenError> {
        let connector = Connector::to(&config)?;
        Ok(Self::spawn(config, connector, None, Sleeps::new()))
    }

    /// A line over a stream that the caller brings: one end of a `tokio::io::duplex`, a pty, a socket. When the stream
    /// ends, or panics, the line is down for good.
    #[must_use]
    pub fn over(stream: impl AsyncRead + AsyncWrite + Send + Unpin + 'static, config: LineConfig) -> Self {
        Self::spawn(config, Connector::None, Some(Box::new(Guarded(stream))), Sleeps::new())
    }

    /// A line over streams that `open` makes: called at once and again whenever the stream has ended. One that panics has ended so; an
    /// opening that panics, or takes longer than 30 s, has failed.
    #[must_use]
    pub fn over_reopened<S, F>(open: impl FnMut() -> F + Send + 'static, config: LineConfig) -> Self
    where
        S: AsyncRead + AsyncWrite + Send + Unpin + 'static,
        F: Future<Output = io::Result<S>> + Send + 'static,
    {
        Self::over_reopened_by(open, config, Sleeps::new())
    }

    /// The same on a computer of which `sleeps` tells when it was asleep: for tests.
    #[doc(hidden)]
    #[must_use]
    pub fn over_reopened_by<S, F>(
        mut open: impl FnMut() -> F + Send + 'static,
        config: LineConfig,
        sleeps: Sleeps,
    ) -> Self
    where
        S: AsyncRead + AsyncWrite + Send + Unpin + 'static,
        F: Future<Output = io::Result<S>> + Send + 'static,
    {
        let given: Given = Box::new(move || begin(&mut open));
        Self::spawn(config, Connector::Given(given), None, sleeps)
    }

    fn spawn(config: LineConfig, connector: Connector, stream: Option<BoxedStream>, sleeps: Sleeps) -> Self {
        let (finished, when_finished) = watch::channel(false);
        let shared = Arc::new(Shared::new(Master::new(Instant::now(), config.clone())));
        let task = Task::new(&config, Arc::clone(&shared), connector, stream, sleeps);
        tokio::spawn(async move {
            task.run().await;
            let _ = finished.send(true);
        });
        Self { handle: Arc::new(Handle::new(shared, when_finished)) }
    }

    /// One slave of this line, 1 to 247. Address 0 is [`broadcast`](Self::broadcast). On Modbus TCP also 248 to 255, which
    /// gateways use for themselves; elsewhere a call to them ends with
    /// [`PortError::NotCarried`](drive_core::PortError::NotCarried).
    #[must_use]
    pub fn slave(&self, address: u8) -> Slave {
        Slave::new(Arc::clone(&self.handle), address)
    }

    /// All slaves at once: writes return after [`LineConfig::broadcast_pause`] with a confirmation made up by the
    /// line, because nobody answers a broadcast; reads are refused with
    /// [`PortError::NotCarried`](drive_core::PortError::NotCarried).
    #[must_use]
    pub fn broadcast(&self) -> Slave {
        self.slave(0)
    }

    /// Whether both are handles of one line.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.handle, &other.handle)
    }

    /// How the line is configured now.
    #[must_use]
    pub fn config(&self) -> LineConfig {
        self.handle.shared.master().config().clone()
    }

    /// Sets what is special about one slave, from its next request on.
    pub fn configure_slave(&self, address: u8, settings: SlaveSettings) {
        self.handle.shared.master().configure_slave(address, settings);
    }

    /// What the line has counted so far.
    #[must_use]
    pub fn stats(&self) -> Stats {
        self.handle.shared.master().stats(Instant::now())
    }

    /// What the line has heard last that is no plain answer, the oldest first: kept always, and bounded.
    #[must_use]
    pub fn evidence(&self) -> Vec<Fact> {
        self.handle.shared.master().evidence()
    }

    /// What is wrong with the line by what it has heard lately; nothing for a line that loses or damages one question in a hundred.
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        self.handle.shared.master().findings(Instant::now())
    }

    /// Keeps the last `count` exchanges from now on, each with its bytes: some 200 bytes an exchange. A line keeps none unless
    /// it is asked to.
    pub fn keep_exchanges(&self, count: usize) {
        self.handle.shared.master().keep_exchanges(count);
    }

    /// The last exchanges that ended, the oldest first, as many as [are kept](Self::keep_exchanges).
    #[must_use]
    pub fn exchanges(&self) -> Vec<Exchange> {
        self.handle.shared.master().exchanges()
    }

    /// How often the line's task has come round, to see from outside that it lives: asking makes it come round once more,
    /// whether its port is there or not, so that a number that stays the same for seconds is that of a task that hangs.
    #[must_use]
    pub fn rounds(&self) -> u64 {
        let rounds = self.handle.shared.rounds();
        self.handle.shared.wake.notify_one();
        rounds
    }

    /// The longest time from the call of a Stop to its first bit on the line, whatever is asked on it: see
    /// [`LineConfig::worst_case_stop`], with the longest PDUs there are.
    #[must_use]
    pub fn worst_case_stop(&self) -> Duration {
        self.handle.shared.master().config().worst_case_stop(MAX_PDU, MAX_PDU)
    }

    /// Writes every frame to `sink` as a pcapng file from now on, until the line is closed or another capture begins. The
    /// writing happens on a thread of its own; frames that it cannot take in time are left out. What is returned
    /// says when it has ended, and gives the sink's error, if it had one.
    ///
    /// # Errors
    /// The sink's, when it does not take the head of the file.
    pub fn capture(&self, sink: impl io::Write + Send + 'static) -> io::Result<Writing> {
        let dissector = Dissector::of(self.handle.shared.master().config());
        let (tap, writing) = capture::start(sink, dissector, Arc::clone(&self.handle.shared.last))?;
        *self.handle.shared.tap() = Some(tap);
        Ok(writing)
    }

    /// What [captures](Self::capture) have heard on the line since a moment, as far as it is kept: the last 16 384 frames and 1 MiB of
    /// them, also when the capture has ended. Nothing where none ran. It takes nothing from a capture, and the line does not wait
    /// for it.
    #[must_use]
    pub fn last_frames(&self, since: Instant) -> LastFrames {
        self.handle.shared.last.since(since)
    }

    /// Gives up what [is kept](Self::last_frames) of before a moment: some 100 bytes a frame.
    pub fn forget_frames(&self, before: Instant) {
        self.handle.shared.last.forget(before);
    }

    /// Closes the line: what waits ends with [`PortError::Closed`](drive_core::PortError::Closed), but for the write of a stop, which
    /// is sent; the exchange that is under way finishes, the port is closed. Returns when it is.
    ///
    /// What a fleet was asked a moment ago may not have come to the line yet: shut it down, and await that, before its
    /// lines are closed.
    pub async fn close(&self) {
        // A task that was told of a stop before has run by then, and the stop is in the queue.
        sleep(HANDED_ON).await;
        self.handle.close().await;
    }
}

impl fmt::Debug for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Line").field("endpoint", &self.handle.shared.master().config().endpoint).finish()
    }
}
