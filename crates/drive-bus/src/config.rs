//! What a line is: where it goes, its timing, its limits.

mod far_end;
mod text;

#[cfg(feature = "serial")]
use std::path::{Path, PathBuf};
use std::{collections::BTreeMap, fmt, time::Duration};

use drive_core::serial::SerialSettings;

pub use self::{
    far_end::{FarEndError, FarEndSettings, MOST_CONNECTIONS},
    text::{CharacterText, LineText, LineTextError, SerialText, baud_of},
};
pub use crate::exchange::echo::Echo;
use crate::{exchange::Machine, gateway::Gateway, pdu::MAX_PDU, protocol::Protocol};

/// Where a line goes. Ways whose feature is not compiled in do not exist.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Endpoint {
    /// A serial port, by its path (`/dev/ttyUSB0`, `COM3`, a pty), opened exclusively. Feature `serial`.
    #[cfg(feature = "serial")]
    Serial(PathBuf),
    /// A TCP connection to `host:port`: a serial server, or with [`Protocol::Tcp`] a gateway or a device. Feature `tcp`.
    #[cfg(feature = "tcp")]
    Tcp(String),
    /// A stream that the caller brings, see [`Line::over`](crate::Line::over).
    Stream,
}

impl Endpoint {
    /// Whether what is there takes the time that characters take on a line: a serial port does. A server that speaks RTU
    /// over TCP may be a program that answers at once; so may whatever is behind a pseudo-terminal or a stream.
    #[must_use]
    pub fn far_end_paces(&self) -> bool {
        match self {
            #[cfg(feature = "serial")]
            Self::Serial(path) => !is_pseudo_terminal(path),
            _ => false,
        }
    }

    /// Whether it is a serial port.
    pub(crate) const fn is_serial(&self) -> bool {
        match self {
            #[cfg(feature = "serial")]
            Self::Serial(_) => true,
            _ => false,
        }
    }

    /// Whether it is a connection, whose bytes the runtime hands over when it has looked.
    pub(crate) const fn is_connection(&self) -> bool {
        match self {
            #[cfg(feature = "tcp")]
            Self::Tcp(_) => true,
            _ => false,
        }
    }
}

/// The path of the port, `tcp://host:port`, or that it is a stream of the caller's.
impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            #[cfg(feature = "serial")]
            Self::Serial(path) => path.display().fmt(f),
            #[cfg(feature = "tcp")]
            Self::Tcp(address) => write!(f, "tcp://{address}"),
            Self::Stream => f.write_str("a stream"),
        }
    }
}

/// How soon an answer that comes twice comes again. Chosen, not measured: a repetition follows its original, and a frame of
/// 20 words takes 25 ms at 19200 bit/s.
pub(crate) const DOUBLE: Duration = Duration::from_millis(50);

/// Linux keeps pseudo-terminals in a directory of their own; the path may be a link to one.
#[cfg(feature = "serial")]
fn is_pseudo_terminal(path: &Path) -> bool {
    path.canonicalize().is_ok_and(|path| path.starts_with("/dev/pts"))
}

/// The kernel's RS-485 mode: it switches the transmitter with RTS (Linux `TIOCSRS485`). For UARTs whose driver has it;
/// USB adapters switch by themselves and have none. Feature `serial`.
#[cfg(feature = "serial")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Rs485 {
    /// RTS is low while we transmit, high otherwise; usually it is the other way round.
    pub inverted: bool,
    /// From the switch of RTS to the first bit, in whole milliseconds.
    pub delay_before_send: Duration,
    /// From the last bit to the switch of RTS, in whole milliseconds. It must be shorter than t3.5, or the beginning of
    /// an answer is lost.
    pub delay_after_send: Duration,
    /// Leave the receiver on while we transmit: what we send comes back as an echo.
    pub receive_while_sending: bool,
}

/// No time of a line is longer: what is more, such as a [`Duration::MAX`] for "for ever", counts as this.
pub const LONGEST: Duration = Duration::from_secs(3_600);

/// Configuration of a line; its times are no longer than [`LONGEST`]. Start from one of the constructors and change what is special:
///
/// ```
/// use std::time::Duration;
/// use drive_bus::{LineConfig, SlaveSettings};
/// use drive_core::serial::SerialSettings;
///
/// let config = LineConfig {
///     response_timeout: Duration::from_millis(300),
///     ..LineConfig::serial("/dev/ttyUSB0", SerialSettings::MODBUS_DEFAULT)
/// }
/// .slave(7, SlaveSettings { turnaround: Duration::from_millis(10), ..SlaveSettings::default() });
/// # let _ = config;
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineConfig {
    /// Where the line goes.
    pub endpoint: Endpoint,
    /// What the line speaks.
    pub protocol: Protocol,
    /// Speed and format. On RTU over TCP: those of the far serial side; all silences follow from them. On Modbus TCP they
    /// have no effect.
    pub serial: SerialSettings,
    /// The longest time from the end of a request to the first character of its answer. The ceiling of what the line
    /// learns for each slave, and what holds for a slave that has not answered yet.
    pub response_timeout: Duration,
    /// The shortest response timeout that the line may learn. Too short a timeout makes a bystander mis-frame the next
    /// request when an answer and it overlap.
    pub timeout_floor: Duration,
    /// How long after a request that brought no answer one may still come. For so long the slave is not asked anything
    /// of the same function again, because a late answer could be taken for the new one; other slaves are served
    /// meanwhile. Only the write of a Stop does not wait.
    pub late_window: Duration,
    /// Silence after a broadcast, in which the slaves act on it (MODBUS over Serial Line V1.02 p. 10: 100 to 200 ms).
    pub broadcast_pause: Duration,
    /// Extra silence before a request to another slave than the last.
    pub slave_change_gap: Duration,
    /// The longest pause that the adapter makes inside one frame (USB adapters deliver in chunks). A damaged answer is
    /// given up after such a pause; a good one is never delayed by it.
    pub chunk_gap: Duration,
    /// Whether the adapter echoes.
    pub echo: Echo,
    /// The kernel's RS-485 mode, where the port has it. `None`: left as it is. Feature `serial`.
    #[cfg(feature = "serial")]
    pub rs485: Option<Rs485>,
    /// Make a USB adapter deliver at once (FTDI: 16 ms as delivered, which is longer than most answers), as far as
    /// the system lets us: the port's `low_latency` flag, and the driver's latency timer where the user may write it.
    /// What came of it can be read with [`adapter_latency`](crate::adapter_latency); where the adapter goes on holding
    /// answers back the log says so, once. Feature `serial`.
    #[cfg(feature = "serial")]
    pub low_latency: bool,
    /// How many requests may wait; more are refused with [`PortError::QueueFull`](drive_core::PortError::QueueFull).
    pub queue_limit: usize,
    /// How often a read, or a write of a level inside its lifetime, is sent again after silence or damage.
    pub retries: u32,
    /// After how many unanswered requests in a row a slave counts as off-line. 0: never.
    pub offline_after: u32,
    /// First and longest time between two probes of an off-line slave.
    pub probe_backoff: (Duration, Duration),
    /// Keep no silences and count no character times: for a stream that is no line, and for measurements of everything
    /// but the line.
    pub unpaced: bool,
    /// The gateway between a connection and its drives: what it does that a line cannot see. `None`: one of which nothing is
    /// known on a connection and on Modbus TCP, and none on a serial port or a stream of RTU.
    pub gateway: Option<Gateway>,
    /// How many connections this line may have to its far end at once. With two a stop takes the second while the first waits
    /// for a drive that does not answer; it is open only then, and given up where the far end does not grant it. `None`: two on
    /// Modbus TCP, where gateways serve several clients, and one on RTU over TCP, where few do.
    pub connections: Option<u8>,
    /// Whether the far end takes the time that characters take on a line, so that what comes sooner than request and answer
    /// can is no answer. `None`: it follows from the kind of port, see [`Endpoint::far_end_paces`].
    pub far_end_paces: Option<bool>,
    /// How soon an answer may come a second time on a line on which nothing strange was seen. Two reads of one slave within
    /// this time differ in length where they can. Zero on a stream that the caller brings.
    pub double_window: Duration,
    /// Use the precise timer also on a stream that the caller brings. Not under a paused clock.
    pub precise_timer: bool,
    /// Stay awake for the last character of an answer where its time is known, so that no processor has to be woken for
    /// it: at most 5 % of one processor, nothing on an idle line, nothing where the answers come when they like, nothing
    /// in a process with many lines. Only with the precise timer.
    pub stay_awake: bool,
    /// Settings of single slaves; the others have [`SlaveSettings::default`].
    pub slaves: BTreeMap<u8, SlaveSettings>,
}

impl LineConfig {
    /// The longest pause inside a frame that an adapter is taken to make where nothing is said of it.
    pub const USUAL_CHUNK_GAP: Duration = Duration::from_millis(20);

    /// The machine of what this line speaks.
    pub(crate) fn machine(&self) -> Box<dyn Machine> {
        self.protocol.machine(self.serial, self.chunk_gap, self.echo)
    }

    /// A serial port, echo found out by the line. Feature `serial`.
    #[cfg(feature = "serial")]
    #[must_use]
    pub fn serial(path: impl Into<PathBuf>, serial: SerialSettings) -> Self {
        Self::to(Endpoint::Serial(path.into()), serial)
    }

    /// RTU over TCP to `host:port`; `serial` is the far side's speed and format. Feature `tcp`.
    #[cfg(feature = "tcp")]
    #[must_use]
    pub fn rtu_over_tcp(address: impl Into<String>, serial: SerialSettings) -> Self {
        Self::to(Endpoint::Tcp(address.into()), serial)
    }

    /// Modbus TCP to `host:port`. The protocol has no silences; an answer is known by its transaction number. Feature `tcp`.
    #[cfg(feature = "tcp")]
    #[must_use]
    pub fn modbus_tcp(address: impl Into<String>) -> Self {
        let endpoint = Endpoint::Tcp(address.into());
        Self { protocol: Protocol::Tcp, ..Self::to(endpoint, SerialSettings::MODBUS_DEFAULT) }
    }

    /// RTU on a stream for [`Line::over`](crate::Line::over).
    #[must_use]
    pub fn stream(serial: SerialSettings) -> Self {
        Self { double_window: Duration::ZERO, ..Self::to(Endpoint::Stream, serial) }
    }

    /// As a line takes it: its times are no longer than [`LONGEST`], and one request may wait in any case, so that a stop may.
    pub(crate) fn bounded(mut self) -> Self {
        for time in [
            &mut self.response_timeout,
            &mut self.timeout_floor,
            &mut self.late_window,
            &mut self.broadcast_pause,
            &mut self.slave_change_gap,
            &mut self.chunk_gap,
            &mut self.probe_backoff.0,
            &mut self.probe_backoff.1,
            &mut self.double_window,
        ] {
            *time = LONGEST.min(*time);
        }
        if let Some(wait) = self.gateway.as_mut().and_then(|gateway| gateway.wait.as_mut()) {
            *wait = LONGEST.min(*wait);
        }
        self.queue_limit = self.queue_limit.max(1);
        self.slaves.values_mut().for_each(|slave| *slave = slave.bounded());
        self
    }

    fn to(endpoint: Endpoint, serial: SerialSettings) -> Self {
        let echo = if endpoint.is_serial() { Echo::Auto } else { Echo::Off };
        Self {
            endpoint,
            protocol: Protocol::Rtu,
            serial,
            // What most masters wait, and several times what a drive here needs.
            response_timeout: Duration::from_millis(500),
            // Chosen, not measured: ten times what a drive needs that answers in 5 ms, for when it saves to its EEPROM.
            timeout_floor: Duration::from_millis(50),
            // One and a half response timeouts, as where a slave has its own.
            late_window: Duration::from_millis(750),
            // The least that the specification wants.
            broadcast_pause: Duration::from_millis(100),
            slave_change_gap: Duration::ZERO,
            // FTDI's adapters deliver every 16 ms as delivered.
            chunk_gap: Self::USUAL_CHUNK_GAP,
            echo,
            #[cfg(feature = "serial")]
            rs485: None,
            #[cfg(feature = "serial")]
            low_latency: true,
            // Four requests for each of 247 slaves; a longer queue would be older than its lifetimes.
            queue_limit: 1_024,
            // Three attempts: on a line that damages one frame in a hundred one read in a million fails.
            retries: 2,
            // The attempts of one call: it fails, and the next fails fast.
            offline_after: 3,
            // Back in a second where a plug was pulled, and hardly a load where a drive is off for the night.
            probe_backoff: (Duration::from_millis(500), Duration::from_secs(10)),
            unpaced: false,
            gateway: None,
            connections: None,
            far_end_paces: None,
            double_window: DOUBLE,
            precise_timer: false,
            stay_awake: true,
            slaves: BTreeMap::new(),
        }
    }

    /// This configuration with the settings of one slave.
    #[must_use]
    pub fn slave(mut self, slave: u8, settings: SlaveSettings) -> Self {
        self.slaves.insert(slave, settings);
        self
    }

    /// The longest time from the call of a Stop to its first bit on the line, when no other Stop waits and requests and
    /// answers are no longer than these PDUs (253 at most): the longest exchange that may be under way, whole, the
    /// silences after it, and one foreign frame or as much noise. What the host itself adds, some tenths of a
    /// millisecond, comes on top; so does a port that takes no bytes, which counts as lost after a second.
    ///
    /// A Stop that is **repeated** to a slave that is off-line may wait longer: all such repetitions together take a fifth of
    /// the line.
    ///
    /// Behind a [`Gateway`] it ends where the stop is on the drives' line, and what the gateway may be waiting for is in it:
    /// one question in vain, and one more where it is not known how many requests it serves at once.
    ///
    /// With [`Echo::Auto`] it includes the one read that finds out about the echo, though that happens only before the
    /// first write after opening.
    #[must_use]
    pub fn worst_case_stop(&self, longest_request: usize, longest_answer: usize) -> Duration {
        let config = self.clone().bounded();
        let timeouts = config.slaves.values().filter_map(|slave| slave.response_timeout);
        let timeout = timeouts.chain([config.response_timeout]).max().unwrap_or(config.response_timeout);
        let timeout = timeout.max(config.broadcast_pause);
        let asks_echo = config.echo == Echo::Auto && config.protocol.asks_for_echo();
        let bound = config.stop_bound((longest_request, longest_answer), timeout, asks_echo, true);
        let Some(gateway) = config.far_end() else { return bound };
        bound + gateway.stop_waits() + config.behind_gateway((longest_request, longest_answer), timeout)
    }

    /// What there may be between the line's port and the drives.
    #[must_use]
    pub fn far_end(&self) -> Option<Gateway> {
        let is_likely = self.endpoint.is_connection() || !self.protocol.is_paced();
        let gateway = self.gateway.or_else(|| is_likely.then(Gateway::default));
        gateway.filter(|gateway| gateway.wait != Some(Duration::ZERO))
    }

    /// Whether stops may take a second connection.
    pub(crate) fn takes_second_connection(&self) -> bool {
        let likely = self.endpoint.is_connection() && !self.protocol.is_paced();
        let granted = self.connections.map_or(likely, |connections| connections > 1);
        granted && self.far_end().is_some()
    }

    /// How long a gateway may be busy with one more exchange that is answered, on a line of which the settings are known.
    pub(crate) fn behind_gateway(&self, (request, answer): (usize, usize), timeout: Duration) -> Duration {
        self.serial.characters(self.request_len(request) + self.answer_len(answer)) + timeout
    }

    /// The longest wait of a Stop where answers have `timeout` to begin; `asks_echo`: the adapter may be asked for its
    /// echo before; `disturbed`: there may be foreign frames, noise and damage.
    pub(crate) fn stop_bound(
        &self,
        (request, answer): (usize, usize),
        timeout: Duration,
        asks_echo: bool,
        disturbed: bool,
    ) -> Duration {
        let pauses = self.slaves.values().map(|slave| slave.turnaround).max().unwrap_or_default();
        let silence = self.silence() + pauses.max(self.slave_change_gap);
        let exchange = |request| self.longest_exchange(request, answer, timeout, disturbed) + silence;
        let echo_read = if asks_echo { exchange(5) } else { Duration::ZERO };
        exchange(request) + echo_read + if disturbed { self.longest_stray() } else { Duration::ZERO }
    }

    /// How long an exchange with these PDUs takes at the most, when its answer has `timeout` to begin.
    fn longest_exchange(
        &self,
        request: usize,
        answer: usize,
        timeout: Duration,
        disturbed: bool,
    ) -> Duration {
        let (request, answer) = (self.request_len(request), self.answer_len(answer));
        let alone = self.characters(request + answer) + timeout;
        #[cfg(feature = "unitelway")]
        if let Protocol::UniTelway(settings) = self.protocol {
            // Its slaves are waited for while others are served.
            let all = drive_unitelway::longest(self.serial.baud(), settings, self.chunk_gap, request, answer);
            return if disturbed { all } else { all.min(alone) };
        }
        alone + if disturbed { self.protocol.overtime(self.serial, self.chunk_gap) } else { Duration::ZERO }
    }

    /// How long what belongs to no exchange, the frame of a foreign master or noise, may hold a Stop up.
    pub(crate) fn longest_stray(&self) -> Duration {
        if self.is_paced() {
            self.characters(self.request_len(MAX_PDU)) + self.chunk_gap
        } else {
            Duration::ZERO
        }
    }

    /// How many characters the frame of a request with a PDU of this length has.
    pub(crate) const fn request_len(&self, pdu: usize) -> usize {
        self.protocol.request_len(pdu)
    }

    /// How many characters come back until the answer with a PDU of this length has come.
    pub(crate) const fn answer_len(&self, pdu: usize) -> usize {
        self.protocol.answer_len(pdu)
    }

    /// The time that so many characters take on the line.
    pub(crate) fn characters(&self, characters: usize) -> Duration {
        if self.is_paced() { self.serial.characters(characters) } else { Duration::ZERO }
    }

    /// The silence before any request, see [`Protocol::silence`].
    #[must_use]
    pub const fn silence(&self) -> Duration {
        if self.is_paced() { self.protocol.silence(self.serial) } else { Duration::ZERO }
    }

    /// Whether frames need silences between them.
    pub(crate) const fn is_paced(&self) -> bool {
        !self.unpaced && self.protocol.is_paced()
    }
}

/// What is special about one slave.
///
/// ```
/// use drive_bus::{LineConfig, SlaveSettings};
/// use drive_core::SerialSettings;
/// use std::time::Duration;
///
/// // The pause that a 3G3EV needs at 9600 bit/s: 24 bits and 10 ms.
/// let pause = SlaveSettings { turnaround: Duration::from_micros(12_500), ..SlaveSettings::default() };
/// let config = LineConfig::serial("/dev/ttyUSB0", SerialSettings::MODBUS_DEFAULT).slave(5, pause);
/// assert_eq!(config.slaves[&5].response_timeout, None, "the line's own");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct SlaveSettings {
    /// Silence that this slave needs after its answer before the next request **to it** (3G3EV: 24 bits + 10 ms).
    /// Other slaves are served meanwhile. Shorter values than t3.5 have no effect.
    pub turnaround: Duration,
    /// Its own ceiling of the response timeout; `None`: the line's.
    pub response_timeout: Option<Duration>,
}

impl SlaveSettings {
    pub(crate) fn bounded(self) -> Self {
        Self {
            turnaround: self.turnaround.min(LONGEST),
            response_timeout: self.response_timeout.map(|time| time.min(LONGEST)),
        }
    }
}
