//! What a frame carries, where its check fits: for whoever looks at a line and takes no part in it.

use bytes::Bytes;

#[cfg(feature = "ascii")]
use crate::exchange::ascii;
#[cfg(feature = "tcp")]
use crate::exchange::mbap::{HEADER, Head};
use crate::{capture::Dissector, exchange::rtu};

/// What stands between the marks of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Content {
    /// A request or an answer of Modbus.
    Pdu {
        /// Whom it is for or from; 0: all slaves.
        slave: u8,
        /// Function code and data.
        pdu: Bytes,
    },
    /// UNI-TELWAY: the master lets a slave speak.
    Poll {
        /// The slave.
        slave: u8,
    },
    /// UNI-TELWAY: a data frame.
    Message {
        /// Whom it is for or from.
        slave: u8,
        /// The network header, and UNI-TE behind it: `unite_of` of drive-unitelway takes them apart.
        message: Bytes,
    },
    /// UNI-TELWAY: one of its single characters.
    Signal(Signal),
}

/// The single characters of UNI-TELWAY.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Signal {
    /// 06h: the data frame was taken.
    Taken,
    /// 15h: the data frame was refused.
    Refused,
    /// 04h: the slave has nothing to say.
    NothingToSay,
}

/// Bytes that are no frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[error("{0}")]
pub struct NoFrame(
    /// What is wrong with them, in words.
    pub &'static str,
);

impl Content {
    /// What these bytes carry on a line that speaks this; under [`Dissector::Data`] Modbus ASCII begins with `:`, and
    /// everything else is UNI-TELWAY.
    ///
    /// # Errors
    /// [`NoFrame`] where they are not exactly one frame with a check that fits.
    pub fn of(dissector: Dissector, bytes: &[u8]) -> Result<Self, NoFrame> {
        match (dissector, bytes) {
            (_, []) => Err(NoFrame("nothing")),
            (Dissector::Rtu, _) => of_rtu(bytes),
            #[cfg(feature = "tcp")]
            (Dissector::Tcp, _) => of_tcp(bytes),
            #[cfg(feature = "ascii")]
            (Dissector::Data, [b':', ..]) => of_ascii(bytes),
            #[cfg(feature = "unitelway")]
            (Dissector::Data, _) => of_unitelway(bytes),
            #[cfg(not(all(feature = "tcp", feature = "unitelway")))]
            _ => Err(NoFrame("this build does not know its protocol")),
        }
    }

    /// Whom it is for or from; a signal does not say.
    #[must_use]
    pub const fn slave(&self) -> Option<u8> {
        match *self {
            Self::Pdu { slave, .. } | Self::Poll { slave } | Self::Message { slave, .. } => Some(slave),
            Self::Signal(_) => None,
        }
    }
}

fn of_rtu(bytes: &[u8]) -> Result<Content, NoFrame> {
    match bytes {
        [slave, pdu @ .., _, _] if rtu::is_frame(bytes) => {
            Ok(Content::Pdu { slave: *slave, pdu: Bytes::copy_from_slice(pdu) })
        }
        [_, _, _, _, ..] => Err(NoFrame("the CRC does not fit")),
        _ => Err(NoFrame("too short for a frame")),
    }
}

#[cfg(feature = "tcp")]
fn of_tcp(bytes: &[u8]) -> Result<Content, NoFrame> {
    let misfit = NoFrame("the header of Modbus TCP does not fit");
    let (header, pdu) = bytes.split_first_chunk::<HEADER>().ok_or(misfit)?;
    match Head::of(*header) {
        Some(head) if head.pdu == pdu.len() => {
            Ok(Content::Pdu { slave: head.unit, pdu: Bytes::copy_from_slice(pdu) })
        }
        _ => Err(misfit),
    }
}

#[cfg(feature = "ascii")]
fn of_ascii(bytes: &[u8]) -> Result<Content, NoFrame> {
    let mut receiver = ascii::Receiver::default();
    let Some((last, before)) = bytes.split_last() else { return Err(NoFrame("nothing")) };
    if before.iter().any(|&character| receiver.hear(character).is_some()) {
        return Err(NoFrame("no frame of Modbus ASCII"));
    }
    match receiver.hear(*last) {
        Some(ascii::Heard::Frame { slave, pdu }) => Ok(Content::Pdu { slave, pdu }),
        Some(ascii::Heard::Garbled { why, .. }) => Err(NoFrame(why)),
        None => Err(NoFrame("no frame of Modbus ASCII")),
    }
}

#[cfg(feature = "unitelway")]
fn of_unitelway(bytes: &[u8]) -> Result<Content, NoFrame> {
    use drive_unitelway::{Heard, Receiver};

    let mut receiver = Receiver::default();
    receiver.push(bytes);
    let content = match receiver.next() {
        Some(Heard::Signal { byte, .. }) => Content::Signal(match byte {
            0x06 => Signal::Taken,
            0x15 => Signal::Refused,
            _ => Signal::NothingToSay,
        }),
        Some(Heard::Poll(slave)) => Content::Poll { slave },
        Some(Heard::Data { address, message }) => Content::Message { slave: address, message },
        Some(Heard::Damaged(_)) => return Err(NoFrame("the BCC does not fit")),
        Some(Heard::Noise(_)) => return Err(NoFrame("no frame that is known")),
        None => return Err(NoFrame("it breaks off")),
    };
    if receiver.is_open() { Err(NoFrame("more than one frame")) } else { Ok(content) }
}
