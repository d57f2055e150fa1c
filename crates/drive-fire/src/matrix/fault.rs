//! What goes wrong on the wire, at one exchange: everything that a cable, an adapter, a converter or another slave does to one request
//! or one answer.

use std::{fmt, time::Duration};

use super::{Untold, Way};

/// A fault of one exchange.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fault {
    /// Nothing.
    None,
    /// The request does not arrive.
    RequestLost,
    /// One bit of the request is turned round.
    RequestFlipped,
    /// The request ends early.
    RequestTruncated,
    /// The answer does not arrive.
    Lost,
    /// The answer comes later by so many milliseconds.
    Late(u32),
    /// So many bytes are missing at the end of the answer; 0: half of them.
    Truncated(u8),
    /// So many bits of the answer are turned round.
    Flipped(u8),
    /// So many stray bytes directly before the answer.
    NoiseBefore(u8),
    /// One stray byte inside the answer.
    NoiseInside,
    /// So many stray bytes directly behind the answer.
    NoiseAfter(u8),
    /// The adapter gives the request back.
    Echo,
    /// It gives half of the request back.
    EchoPart,
    /// It gives the request back with one bit turned round.
    EchoDamaged,
    /// The adapter gives the request back, and the drive does not hear it.
    EchoAlone,
    /// Before the answer, the same in another slave's name.
    ForeignBefore,
    /// Instead of the answer, the same in another slave's name.
    ForeignInstead,
    /// The answer comes once more, so many milliseconds later.
    Double(u32),
    /// Before the answer, the answer to the exchange before.
    ReplayBefore,
    /// Instead of the answer, the answer to the exchange before.
    ReplayInstead,
    /// Instead of the answer, an exception; the request was carried out nevertheless.
    Exception(u8),
    /// The request is not carried out, and answered by an exception.
    Refused(u8),
    /// The answer comes byte by byte, so many milliseconds apart.
    Dribble(u32),
    /// The answer has another function code.
    WrongFunction,
    /// The answer has a word too many or too few.
    WrongCount(bool),
    /// The confirmation of a write names another value.
    WrongValue,
    /// The confirmation of a write names another register.
    WrongRegister,
    /// The process stands still for so many milliseconds when the answer is due.
    Stall(u32),
    /// From this exchange on nobody hears anything for so many milliseconds.
    Mute(u32),
    /// The port is lost, and is there again half a second later.
    PortLost,
}

impl Fault {
    /// What it is in front of a drive that may hear nothing: the echo of an adapter comes all the same.
    pub(super) fn in_front_of(self, is_deaf: bool) -> Self {
        if self == Self::Echo && is_deaf { Self::EchoAlone } else { self }
    }

    /// Every one of them.
    pub const ALL: &[Self] = &[
        Self::None,
        Self::RequestLost,
        Self::RequestFlipped,
        Self::RequestTruncated,
        Self::Lost,
        Self::Late(20),
        Self::Late(60),
        Self::Late(150),
        Self::Late(300),
        // Around the ceiling of a response timeout, half a second.
        Self::Late(470),
        Self::Late(500),
        Self::Late(530),
        // Around the late window, three quarters of a second, and behind a retry.
        Self::Late(740),
        Self::Late(760),
        Self::Late(1_050),
        Self::Late(1_600),
        Self::Late(3_000),
        Self::Late(10_000),
        Self::Truncated(1),
        Self::Truncated(2),
        Self::Truncated(3),
        Self::Truncated(0),
        Self::Flipped(1),
        Self::Flipped(2),
        Self::Flipped(3),
        Self::Flipped(4),
        Self::NoiseBefore(1),
        Self::NoiseBefore(4),
        Self::NoiseInside,
        Self::NoiseAfter(1),
        Self::NoiseAfter(4),
        Self::Echo,
        Self::EchoPart,
        Self::EchoDamaged,
        Self::EchoAlone,
        Self::ForeignBefore,
        Self::ForeignInstead,
        Self::Double(1),
        Self::Double(10),
        Self::Double(100),
        Self::Double(900),
        Self::ReplayBefore,
        Self::ReplayInstead,
        Self::Exception(1),
        Self::Exception(4),
        Self::Exception(5),
        Self::Exception(6),
        Self::Exception(0x0B),
        Self::Refused(1),
        Self::Refused(2),
        Self::Refused(3),
        Self::Refused(4),
        Self::Refused(5),
        Self::Refused(6),
        Self::Refused(8),
        Self::Refused(0x0A),
        Self::Refused(0x0B),
        Self::Refused(0x21),
        Self::Refused(0x22),
        Self::Refused(0xFF),
        Self::Dribble(1),
        Self::Dribble(15),
        Self::Dribble(40),
        Self::WrongFunction,
        Self::WrongCount(true),
        Self::WrongCount(false),
        Self::WrongValue,
        Self::WrongRegister,
        Self::Stall(60),
        Self::Stall(700),
        Self::Stall(4_000),
        Self::Mute(1_000),
        Self::Mute(20_000),
        Self::PortLost,
    ];

    /// Whether it makes a frame of its own, with a check that fits.
    const fn makes_frames(self) -> bool {
        matches!(
            self,
            Self::ForeignBefore
                | Self::ForeignInstead
                | Self::Exception(_)
                | Self::Refused(_)
                | Self::WrongFunction
                | Self::WrongCount(_)
                | Self::WrongValue
                | Self::WrongRegister
        )
    }

    /// Why it cannot happen on this way to a drive, if it cannot.
    #[must_use]
    pub fn impossible_on(self, way: Way) -> Option<&'static str> {
        match (self, way) {
            (
                Self::Echo | Self::EchoPart | Self::EchoDamaged | Self::EchoAlone,
                Way::RtuOverTcp | Way::ModbusTcp,
            ) => Some("a socket does not echo what is sent"),
            (
                Self::RequestFlipped
                | Self::RequestTruncated
                | Self::Flipped(_)
                | Self::Truncated(_)
                | Self::NoiseInside,
                Way::ModbusTcp,
            ) => Some("TCP delivers whole what it delivers"),
            (fault, Way::UniTelway) if fault.makes_frames() => {
                Some("UNI-TELWAY has no such frame: a slave speaks when it is polled, and refuses by FDh")
            }
            (Self::Echo | Self::EchoPart | Self::EchoDamaged | Self::EchoAlone, Way::UniTelway) => {
                Some("the line of UNI-TELWAY is configured without an echo")
            }
            _ => None,
        }
    }

    /// What comes of it, `fast` or in the time of the line, and cannot be told from what is right by anything that this way carries.
    #[must_use]
    pub fn untold(self, way: Way, fast: bool) -> Option<Untold> {
        Some(match (self, way) {
            (
                Self::ReplayInstead | Self::ReplayBefore,
                Way::Rtu | Way::Ascii | Way::RtuOverTcp | Way::UniTelway,
            ) => Untold::answer("an earlier answer of the same shape, in time, where nothing is numbered"),
            (Self::Exception(1 | 6), _) => Untold::own_words(
                "a drive that says that it has done nothing, and has (Modbus Application Protocol, section 7)",
            ),
            (Self::Double(_), Way::Rtu | Way::Ascii | Way::RtuOverTcp) => {
                Untold::value("the first answer that comes twice, to a read that cannot differ")
            }
            (Self::Late(700..), Way::Rtu | Way::Ascii | Way::RtuOverTcp) => {
                Untold::value("an answer later than the late window, to a read that cannot differ")
            }
            (Self::EchoAlone, _) if fast => Untold::confirmation(
                "the first echo of an adapter that had never echoed, where time proves nothing",
            ),
            (Self::Flipped(2..), Way::Ascii) => {
                Untold::answer("two turned bits can cancel each other out in the LRC")
            }
            (Self::Flipped(2..), Way::UniTelway) => {
                Untold::answer("two turned bits can cancel each other out in the BCC")
            }
            (Self::Flipped(4..), _) => {
                Untold::answer("four turned bits can give a CRC that fits, one time in 65 536")
            }
            (Self::NoiseInside, Way::Ascii | Way::UniTelway) => {
                Untold::answer("a byte more can cancel itself out in a sum of eight bits")
            }
            _ => return None,
        })
    }

    /// How long the fault lasts, behind which everything is well again.
    #[must_use]
    pub fn lasts(self) -> Duration {
        Duration::from_millis(match self {
            Self::Late(ms) | Self::Double(ms) | Self::Stall(ms) | Self::Mute(ms) => ms.into(),
            Self::PortLost => 500,
            _ => 0,
        })
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("no fault"),
            Self::RequestLost => f.write_str("request lost"),
            Self::RequestFlipped => f.write_str("request with a turned bit"),
            Self::RequestTruncated => f.write_str("request cut short"),
            Self::Lost => f.write_str("answer lost"),
            Self::Late(ms) => write!(f, "answer late by {ms} ms"),
            Self::Truncated(0) => f.write_str("half an answer"),
            Self::Truncated(bytes) => write!(f, "answer short by {bytes}"),
            Self::Flipped(bits) => write!(f, "answer with {bits} turned bits"),
            Self::NoiseBefore(bytes) => write!(f, "{bytes} stray bytes before"),
            Self::NoiseInside => f.write_str("a stray byte inside"),
            Self::NoiseAfter(bytes) => write!(f, "{bytes} stray bytes behind"),
            Self::Echo => f.write_str("echo"),
            Self::EchoPart => f.write_str("half an echo"),
            Self::EchoDamaged => f.write_str("damaged echo"),
            Self::EchoAlone => f.write_str("echo, and the drive hears nothing"),
            Self::ForeignBefore => f.write_str("another slave's answer before"),
            Self::ForeignInstead => f.write_str("another slave's answer instead"),
            Self::Double(ms) => write!(f, "answer again after {ms} ms"),
            Self::ReplayBefore => f.write_str("the answer before, before"),
            Self::ReplayInstead => f.write_str("the answer before, instead"),
            Self::Exception(code) => write!(f, "carried out, exception {code:02X}h"),
            Self::Refused(code) => write!(f, "refused, exception {code:02X}h"),
            Self::Dribble(ms) => write!(f, "a byte each {ms} ms"),
            Self::WrongFunction => f.write_str("another function"),
            Self::WrongCount(true) => f.write_str("a word too many"),
            Self::WrongCount(false) => f.write_str("a word too few"),
            Self::WrongValue => f.write_str("another value confirmed"),
            Self::WrongRegister => f.write_str("another register confirmed"),
            Self::Stall(ms) => write!(f, "process stands still for {ms} ms"),
            Self::Mute(ms) => write!(f, "mute for {ms} ms"),
            Self::PortLost => f.write_str("port lost"),
        }
    }
}
