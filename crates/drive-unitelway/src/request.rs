//! UNI-TE: the requests of the card's manual (VVDED397054 p. 11–13/35–37), and what their replies say. Words are
//! little-endian.

use bytes::{BufMut, Bytes, BytesMut};

/// The most words of a read and of a write of objects (p. 11/35).
const MOST_READ: u16 = 63;
const MOST_WRITTEN: usize = 60;
/// Segment of internal words, and the type of a 16-bit word (p. 12/36).
const WORDS: [u8; 2] = [0x68, WORD];
const WORD: u8 = 0x07;
/// The negative reply (p. 13/37).
pub(crate) const REFUSED: u8 = 0xFD;
/// The reply to a mirror request.
pub(crate) const MARK: u8 = 0xFB;
/// The reply of what brings nothing but its being done.
const DONE: u8 = 0xFE;
/// The reply to a read of one word, and to one of objects.
const ONE_WORD: u8 = 0x34;
const OBJECTS: u8 = 0x66;
/// For how long a reply of unknown length is waited for, in bytes: that of an identification, with room.
const UNKNOWN_LEN: usize = 64;

/// The requests, by their codes (p. 11/35).
pub mod code {
    /// Who the slave is.
    pub const IDENTIFICATION: u8 = 0x0F;
    /// The protocol's version.
    pub const PROTOCOL_VERSION: u8 = 0x30;
    /// Data that come back as they are.
    pub const MIRROR: u8 = 0xFA;
    /// The counters of the slave's link.
    pub const READ_COUNTERS: u8 = 0xA2;
    /// Sets these counters to 0.
    pub const CLEAR_COUNTERS: u8 = 0xA4;
    /// One word.
    pub const READ_WORD: u8 = 0x04;
    /// Sets one word.
    pub const WRITE_WORD: u8 = 0x14;
    /// Words that follow each other.
    pub const READ_OBJECTS: u8 = 0x36;
    /// Sets words that follow each other.
    pub const WRITE_OBJECTS: u8 = 0x37;
    /// The specific request: it **commands** the drive.
    pub const SPECIFIC: u8 = 0xF2;
}

/// A request that has no form on the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RequestError {
    /// A number of words that a request cannot carry.
    #[error("UNI-TELWAY carries 1 to {most} words in this request, not {quantity}")]
    Quantity {
        /// How many were asked for.
        quantity: usize,
        /// How many there can be.
        most: usize,
    },
    /// More bytes than a frame has room for.
    #[error("a request of {0} bytes is longer than a frame")]
    TooLong(usize),
    /// Address 0: the card's manual names no broadcast for this protocol.
    #[error("UNI-TELWAY has no broadcast here")]
    Broadcast,
}

/// One request, without its category, which the line's settings have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    code: u8,
    body: Bytes,
    expected: Expected,
}

/// What a positive reply has to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Expected {
    /// So many words.
    Words(u16),
    Done,
    /// The very data that were sent.
    Mirrored,
    /// An identification that is whole.
    Identification,
    /// Anything with the code of the reply.
    Any,
}

/// What a slave has replied.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reply {
    /// The words that were asked for.
    Words(Vec<u16>),
    /// It is done.
    Done,
    /// The whole reply from its code on.
    Raw(Bytes),
}

/// That a request was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Refusal {
    /// The negative reply FDh. Of its causes only one is printed, a wrong number of parameters (p. 13/37), without its
    /// number.
    Negative,
    /// The network could not deliver it (header 22h).
    Undeliverable,
}

impl Request {
    /// Request 04h: one word.
    #[must_use]
    pub fn read_word(address: u16) -> Self {
        Self::new(code::READ_WORD, &address.to_le_bytes(), Expected::Words(1))
    }

    /// Request 36h: 1 to 63 words that follow each other. One alone is [`read_word`](Self::read_word).
    ///
    /// # Errors
    /// [`RequestError::Quantity`].
    pub fn read_words(first: u16, quantity: u16) -> Result<Self, RequestError> {
        check_quantity(usize::from(quantity), usize::from(MOST_READ))?;
        if quantity == 1 {
            return Ok(Self::read_word(first));
        }
        let mut body = BytesMut::with_capacity(6);
        put_objects(&mut body, first, quantity);
        Ok(Self::new(code::READ_OBJECTS, &body, Expected::Words(quantity)))
    }

    /// Request 14h: sets one word.
    #[must_use]
    pub fn write_word(address: u16, word: u16) -> Self {
        let ([a, b], [c, d]) = (address.to_le_bytes(), word.to_le_bytes());
        Self::new(code::WRITE_WORD, &[a, b, c, d], Expected::Done)
    }

    /// Request 37h: sets 1 to 60 words that follow each other.
    ///
    /// # Errors
    /// [`RequestError::Quantity`].
    pub fn write_words(first: u16, words: &[u16]) -> Result<Self, RequestError> {
        check_quantity(words.len(), MOST_WRITTEN)?;
        let mut body = BytesMut::with_capacity(6 + 2 * words.len());
        put_objects(&mut body, first, words.len() as u16);
        for word in words {
            body.put_u16_le(*word);
        }
        Ok(Self::new(code::WRITE_OBJECTS, &body, Expected::Done))
    }

    /// Request FAh: data that come back as they are.
    #[must_use]
    pub fn mirror(data: &[u8]) -> Self {
        Self::new(code::MIRROR, data, Expected::Mirrored)
    }

    /// Request 0Fh: who the slave is.
    #[must_use]
    pub fn identification() -> Self {
        Self::new(code::IDENTIFICATION, &[], Expected::Identification)
    }

    /// Any request, by its code and what follows the category. Of its reply only the code is checked.
    #[must_use]
    pub fn other(code: u8, body: &[u8]) -> Self {
        Self::new(code, body, Expected::Any)
    }

    fn new(code: u8, body: &[u8], expected: Expected) -> Self {
        Self { code, body: Bytes::copy_from_slice(body), expected }
    }

    /// Whether it may change something in the slave.
    #[must_use]
    pub const fn is_write(&self) -> bool {
        !matches!(
            self.code,
            code::IDENTIFICATION
                | code::PROTOCOL_VERSION
                | code::MIRROR
                | code::READ_COUNTERS
                | code::READ_WORD
                | code::READ_OBJECTS
        )
    }

    /// Whether it is the specific request, which commands the drive every time.
    #[must_use]
    pub const fn is_specific(&self) -> bool {
        self.code == code::SPECIFIC
    }

    /// Its bytes.
    pub(crate) fn encode(&self, category: u8) -> Vec<u8> {
        [&[self.code, category], &*self.body].concat()
    }

    /// How many bytes its reply likely has, or a few more: those of the Modbus answer that says the same.
    pub(crate) fn likely_reply(&self) -> usize {
        match self.expected {
            Expected::Words(quantity) => 2 + 2 * usize::from(quantity),
            Expected::Done => 5,
            Expected::Mirrored => 3 + self.body.len(),
            Expected::Identification | Expected::Any => UNKNOWN_LEN,
        }
    }

    /// What a reply says to it.
    ///
    /// # Errors
    /// What does not fit, in words.
    pub(crate) fn check(&self, reply: &Bytes) -> Result<Result<Reply, Refusal>, String> {
        if let [REFUSED] | [REFUSED, _] = **reply {
            return Ok(Err(Refusal::Negative));
        }
        let raw = || Reply::Raw(reply.clone());
        Ok(Ok(match (self.expected, &**reply) {
            (Expected::Words(1), [ONE_WORD, data @ ..]) => Reply::Words(words(data, 1)?),
            (Expected::Words(quantity @ 2..), [OBJECTS, WORD, data @ ..]) => {
                Reply::Words(words(data, quantity)?)
            }
            (Expected::Done, [DONE]) => Reply::Done,
            (Expected::Mirrored, [MARK, mirrored @ ..]) if self.body == mirrored => raw(),
            (Expected::Identification, [0x3F, _product, _subtype, _version, len, rating @ ..])
                if rating.len() == usize::from(*len) =>
            {
                raw()
            }
            (Expected::Any, [code, ..]) if *code == reply_to(self.code) => raw(),
            _ => return Err(format!("the reply {reply:02X?}")),
        }))
    }
}

/// The code of the positive reply.
const fn reply_to(request: u8) -> u8 {
    match request {
        code::MIRROR => MARK,
        code::CLEAR_COUNTERS | code::WRITE_WORD | code::WRITE_OBJECTS => DONE,
        code::SPECIFIC => code::SPECIFIC,
        other => other.wrapping_add(0x30),
    }
}

fn words(data: &[u8], quantity: u16) -> Result<Vec<u16>, String> {
    let (words, rest) = data.as_chunks::<2>();
    let fits = rest.is_empty() && words.len() == usize::from(quantity);
    let decoded = || words.iter().map(|word| u16::from_le_bytes(*word)).collect();
    fits.then(decoded).ok_or_else(|| format!("{} bytes instead of {quantity} words", data.len()))
}

const fn check_quantity(quantity: usize, most: usize) -> Result<(), RequestError> {
    if 1 <= quantity && quantity <= most { Ok(()) } else { Err(RequestError::Quantity { quantity, most }) }
}

fn put_objects(body: &mut BytesMut, first: u16, quantity: u16) {
    body.put_slice(&WORDS);
    body.put_u16_le(first);
    body.put_u16_le(quantity);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_and_written_one_by_one_and_as_objects() {
        // The manual's sample reads W250 to W253 (p. 12/36): code and category 0736h, six bytes of parameters.
        let read = Request::read_words(250, 4).unwrap();
        assert_eq!(read.encode(7), [0x36, 0x07, 0x68, 0x07, 0xFA, 0x00, 0x04, 0x00]);
        assert_eq!(Request::read_words(250, 1).unwrap().encode(7), [0x04, 0x07, 0xFA, 0x00]);
        assert_eq!(Request::write_word(400, 6).encode(7), [0x14, 0x07, 0x90, 0x01, 0x06, 0x00]);
        let write = Request::write_words(400, &[6, 500]).unwrap();
        let expected = [0x37, 0x07, 0x68, 0x07, 0x90, 0x01, 0x02, 0x00, 0x06, 0x00, 0xF4, 0x01];
        assert_eq!(write.encode(7), expected);
        assert_eq!(Request::mirror(&[0xA5, 0x37]).encode(7), [0xFA, 0x07, 0xA5, 0x37]);
    }

    #[test]
    fn more_words_than_a_request_carries_are_refused() {
        for quantity in [0, 64] {
            assert!(Request::read_words(0, quantity).is_err(), "{quantity}");
        }
        for quantity in [0, 61] {
            assert!(Request::write_words(0, &vec![0; quantity]).is_err(), "{quantity}");
        }
    }

    #[test]
    fn a_reply_is_taken_only_if_it_fits_its_request() {
        let check = |request: &Request, reply: &[u8]| request.check(&Bytes::copy_from_slice(reply));
        let read = Request::read_words(250, 2).unwrap();
        let words = Reply::Words(vec![500, 0x1234]);
        assert_eq!(check(&read, &[0x66, 0x07, 0xF4, 0x01, 0x34, 0x12]), Ok(Ok(words)));
        for refused in [&[0xFD][..], &[0xFD, 0x06]] {
            assert_eq!(check(&read, refused), Ok(Err(Refusal::Negative)), "{refused:02X?}");
        }
        let wrong: [&[u8]; 6] = [
            &[0x66, 0x07, 0xF4, 0x01],
            &[0x66, 0x07, 0xF4, 0x01, 0x34],
            &[0x66, 0x08, 0xF4, 0x01, 0x34, 0x12],
            &[0x34, 0xF4, 0x01],
            &[0xFE],
            &[],
        ];
        for reply in wrong {
            assert!(check(&read, reply).is_err(), "{reply:02X?}");
        }
        let write = Request::write_word(400, 6);
        assert_eq!(check(&write, &[0xFE]), Ok(Ok(Reply::Done)));
        assert!(check(&write, &[0xFE, 0]).is_err());
        let echo = Request::mirror(&[0xA5, 0x37]);
        let echoed = Reply::Raw(Bytes::from_static(&[0xFB, 0xA5, 0x37]));
        assert_eq!(check(&echo, &[0xFB, 0xA5, 0x37]), Ok(Ok(echoed)));
        assert!(check(&echo, &[0xFB, 0xA5, 0x38]).is_err());
    }

    #[test]
    fn every_request_of_the_manual_has_its_reply_code() {
        for (request, reply) in [
            (0x0F, 0x3F),
            (0x30, 0x60),
            (0xFA, 0xFB),
            (0xA2, 0xD2),
            (0xA4, 0xFE),
            (0x04, 0x34),
            (0x14, 0xFE),
            (0x36, 0x66),
            (0x37, 0xFE),
            (0xF2, 0xF2),
        ] {
            assert_eq!(reply_to(request), reply, "{request:02X}h");
        }
    }
}
