//! A broker of MQTT v5 that only the daemon talks to: it lets it in, grants what it asks for, brings back what it says to itself, keeps
//! what it has said last, and gives it whatever it is to be given, packets that are none among it (OASIS MQTT 5.0, section 3). What the
//! manual of `drived` says of every connection and every message of the daemon is held here against each of them.

use std::{
    collections::VecDeque,
    io::{self, Read, Write},
    net::{Shutdown, TcpListener, TcpStream},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
    time::Duration,
};

/// What was said last, in so many messages.
const KEPT: usize = 400;

/// What of a drive holds for a moment, and goes when it is not told again.
const OF_NOW: [&str; 4] = ["/state", "/measurements", "/fault", "/last_command"];
/// What happens once, and is nothing for whoever comes later.
const NEWS: [&str; 3] = ["/outcome", "/event", "/echo"];

/// Something that the daemon has said.
#[derive(Debug, Clone)]
pub(super) struct Said {
    pub(super) topic: String,
    pub(super) text: String,
    /// Its Correlation Data.
    pub(super) correlation: Option<Vec<u8>>,
}

#[derive(Default)]
struct Shared {
    /// To the daemon, while it is connected and has subscribed.
    daemon: Option<TcpStream>,
    said: VecDeque<Said>,
    /// What it says to itself is not brought back.
    holds_echoes: bool,
    /// What it said that has no form, or not the one that it is to have.
    wrong: Option<String>,
}

/// It ends with the program: nobody but the daemon knows it.
pub(super) struct Broker {
    pub(super) port: u16,
    shared: Arc<Mutex<Shared>>,
}

fn locked(shared: &Mutex<Shared>) -> MutexGuard<'_, Shared> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Broker {
    pub(super) fn start() -> io::Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let port = listener.local_addr()?.port();
        let shared = Arc::new(Mutex::new(Shared::default()));
        let of_thread = Arc::clone(&shared);
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                // One after the other: the daemon has one connection.
                let _ = serve(stream, &of_thread);
                locked(&of_thread).daemon = None;
            }
        });
        Ok(Self { port, shared })
    }

    /// Whether the daemon is there.
    pub(super) fn has_daemon(&self) -> bool {
        locked(&self.shared).daemon.is_some()
    }

    /// Gives the daemon these bytes, whatever they are. False: it is not there.
    pub(super) fn give(&self, bytes: &[u8]) -> bool {
        let mut shared = locked(&self.shared);
        shared.daemon.as_mut().is_some_and(|daemon| daemon.write_all(bytes).is_ok())
    }

    /// The first that the daemon has said of this kind.
    pub(super) fn first(&self, is_it: impl Fn(&Said) -> bool) -> Option<Said> {
        locked(&self.shared).said.iter().find(|said| is_it(said)).cloned()
    }

    /// What it has said until now is forgotten.
    pub(super) fn forget(&self) {
        locked(&self.shared).said.clear();
    }

    /// Whether what the daemon says to itself comes back to it.
    pub(super) fn hold_echoes(&self, holds: bool) {
        locked(&self.shared).holds_echoes = holds;
    }

    /// The connection to the daemon is lost.
    pub(super) fn lose(&self) {
        if let Some(daemon) = locked(&self.shared).daemon.take() {
            let _ = daemon.shutdown(Shutdown::Both);
        }
    }

    /// What it said that has no form, or not the one that it is to have.
    pub(super) fn wrong(&self) -> Option<String> {
        locked(&self.shared).wrong.clone()
    }
}

fn serve(mut stream: TcpStream, shared: &Mutex<Shared>) -> io::Result<()> {
    // One that says nothing for so long is gone.
    stream.set_read_timeout(Some(Duration::from_secs(120)))?;
    loop {
        let (kind, body) = packet(&mut stream)?;
        let mut answers = Vec::new();
        match (kind >> 4, body.as_slice()) {
            // CONNECT, SUBSCRIBE, PINGREQ, DISCONNECT.
            (1, _) => {
                // Behind the name and the version: a will, which is kept (section 3.1.2.3).
                if body.get(7).is_none_or(|flags| flags & 0x24 != 0x24) {
                    wrong(shared, "CONNECT with a will that is kept", &body)?;
                }
                answers.extend([0x20, 3, 0, 0, 0]);
            }
            (8, [a, b, rest @ ..]) => {
                let Some(filters) = filters(rest) else { return wrong(shared, "SUBSCRIBE", &body) };
                let granted = vec![1; filters];
                answers.extend(framed(0x90, &[&[*a, *b, 0], &granted[..]].concat()));
                locked(shared).daemon = Some(stream.try_clone()?);
            }
            (12, _) => answers.extend([0xD0, 0]),
            (14, _) => return Ok(()),
            (3, _) => {
                let Some(Published { said, id, payload, expires }) = publish(kind, &body) else {
                    return wrong(shared, "PUBLISH", &body);
                };
                let is_of = |topics: &[&str]| topics.iter().any(|topic| said.topic.ends_with(topic));
                let is_kept = kind & 1 == 1 && !payload.is_empty();
                if is_kept && is_of(&NEWS) {
                    wrong(shared, "news that are not kept", &body)?;
                }
                if is_kept && is_of(&OF_NOW) && !expires {
                    wrong(shared, "state that expires", &body)?;
                }
                if let Some([a, b]) = id {
                    answers.extend([0x40, 2, a, b]);
                }
                let mut shared = locked(shared);
                if said.topic.ends_with("/echo") && !shared.holds_echoes {
                    answers.extend(message(&said.topic, &payload, None));
                }
                shared.said.push_back(said);
                let more = shared.said.len().saturating_sub(KEPT);
                shared.said.drain(..more);
            }
            // PUBACK, UNSUBSCRIBE and whatever else needs nothing here.
            _ => {}
        }
        // Under the lock, so that nothing comes into the midst of a packet.
        let _shared = locked(shared);
        stream.write_all(&answers)?;
    }
}

fn wrong(shared: &Mutex<Shared>, what: &str, body: &[u8]) -> io::Result<()> {
    locked(shared).wrong.get_or_insert(format!("no {what}: {body:02X?}"));
    Ok(())
}

/// Its first byte, and what stands behind its length.
fn packet(stream: &mut TcpStream) -> io::Result<(u8, Vec<u8>)> {
    let mut byte = [0];
    stream.read_exact(&mut byte)?;
    let (kind, mut len, mut shift) = (byte[0], 0_usize, 0);
    loop {
        stream.read_exact(&mut byte)?;
        len |= usize::from(byte[0] & 0x7F) << shift;
        shift += 7;
        if byte[0] < 0x80 || shift > 21 {
            break;
        }
    }
    let mut body = vec![0; len];
    stream.read_exact(&mut body)?;
    Ok((kind, body))
}

/// A number of one to four bytes at the beginning, and what is behind it.
fn number(bytes: &[u8]) -> Option<(usize, &[u8])> {
    let mut value = 0;
    for (at, byte) in bytes.iter().enumerate().take(4) {
        value |= usize::from(byte & 0x7F) << (7 * at);
        if *byte < 0x80 {
            return Some((value, &bytes[at + 1..]));
        }
    }
    None
}

/// A text or data with its length in two bytes, and what is behind it.
fn counted(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let [a, b, rest @ ..] = bytes else { return None };
    rest.split_at_checked(u16::from_be_bytes([*a, *b]).into())
}

/// How many filters stand behind the properties of a SUBSCRIBE.
fn filters(bytes: &[u8]) -> Option<usize> {
    let (len, rest) = number(bytes)?;
    let (mut rest, mut filters) = (rest.get(len..)?, 0);
    while !rest.is_empty() {
        let (_, behind) = counted(rest)?;
        rest = behind.get(1..)?;
        filters += 1;
    }
    Some(filters)
}

/// A PUBLISH.
struct Published {
    said: Said,
    id: Option<[u8; 2]>,
    payload: Vec<u8>,
    expires: bool,
}

fn publish(kind: u8, body: &[u8]) -> Option<Published> {
    let (topic, mut rest) = counted(body)?;
    let id = if kind & 0x06 == 0 {
        None
    } else {
        let [a, b, behind @ ..] = rest else { return None };
        rest = behind;
        Some([*a, *b])
    };
    let (len, rest) = number(rest)?;
    let (own, payload) = rest.split_at_checked(len)?;
    let (expires, correlation) = properties(own)?;
    let topic = String::from_utf8(topic.to_vec()).ok()?;
    let said = Said { topic, text: String::from_utf8_lossy(payload).into_owned(), correlation };
    Some(Published { said, id, payload: payload.to_vec(), expires })
}

/// Whether it expires, and its Correlation Data (section 2.2.2: format, expiry, content type, response topic, alias, user property).
fn properties(mut bytes: &[u8]) -> Option<(bool, Option<Vec<u8>>)> {
    let (mut expires, mut correlation) = (false, None);
    while let [name, behind @ ..] = bytes {
        expires |= *name == 0x02;
        bytes = match name {
            0x01 => behind.get(1..)?,
            0x02 => behind.get(4..)?,
            0x03 | 0x08 => counted(behind)?.1,
            0x09 => {
                let (data, behind) = counted(behind)?;
                correlation = Some(data.to_vec());
                behind
            }
            0x23 => behind.get(2..)?,
            0x26 => counted(counted(behind)?.1)?.1,
            _ => return None,
        };
    }
    Some((expires, correlation))
}

fn framed(kind: u8, body: &[u8]) -> Vec<u8> {
    let (mut frame, mut len) = (vec![kind], body.len());
    loop {
        frame.push((len & 0x7F) as u8 | if len > 0x7F { 0x80 } else { 0 });
        len >>= 7;
        if len == 0 {
            break;
        }
    }
    frame.extend(body);
    frame
}

/// A PUBLISH, at least once where it has an identifier.
pub(super) fn message(topic: &str, payload: &[u8], id: Option<u16>) -> Vec<u8> {
    let mut body = (topic.len() as u16).to_be_bytes().to_vec();
    body.extend(topic.as_bytes());
    body.extend(id.iter().flat_map(|id| id.to_be_bytes()));
    body.push(0);
    body.extend(payload);
    framed(if id.is_some() { 0x32 } else { 0x30 }, &body)
}

/// The same with what MQTT 5.0 may say beside it: properties as they are written, in its section 2.2.2.
pub(super) fn message_with(topic: &str, payload: &[u8], flags: u8, properties: &[u8]) -> Vec<u8> {
    let mut body = (topic.len() as u16).to_be_bytes().to_vec();
    body.extend(topic.as_bytes());
    body.push(properties.len().min(127) as u8);
    body.extend(&properties[..properties.len().min(127)]);
    body.extend(payload);
    framed(0x30 | flags, &body)
}
