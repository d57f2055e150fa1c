//! A real broker, and a wire between it and the daemon on which everything is seen.

use std::{
    io::{Read as _, Write as _},
    net::{Shutdown, TcpListener, TcpStream},
    process::{Child, Command, Stdio},
    sync::{Arc, Condvar, Mutex},
    thread,
    time::Duration,
};

use crate::recording::{Message, Packet};

/// Longer than anything takes: a guard against waiting for ever, no measure.
const FOR_EVER: Duration = Duration::from_secs(120);

/// Mosquitto on a port of its own; killed when dropped.
pub(crate) struct Mosquitto {
    child: Child,
    pub(crate) port: u16,
    config: std::path::PathBuf,
}

impl Mosquitto {
    /// `None` where it is not installed, which is said; where `CI` is set it is an error.
    pub(crate) fn start(name: &str) -> Option<Self> {
        let port = free_port();
        let config = super::support::path(&format!("{name}-mosquitto.conf"));
        std::fs::write(&config, format!("listener {port} 127.0.0.1\nallow_anonymous true\n"))
            .expect("the directory can be written");
        match Self::spawn(&config, port) {
            Ok(child) => Some(Self { child, port, config }),
            Err(error) => {
                let _ = drive_testing::peers::is_there(false, &format!("mosquitto ({error})"));
                None
            }
        }
    }

    /// Kills it.
    pub(crate) fn end(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Begins again where it was, and knows nothing of before.
    pub(crate) fn begin(&mut self) {
        self.child = Self::spawn(&self.config, self.port).expect("it has run before");
    }

    /// It listens when this returns.
    fn spawn(config: &std::path::Path, port: u16) -> std::io::Result<Child> {
        let program = if std::path::Path::new("/usr/sbin/mosquitto").exists() {
            "/usr/sbin/mosquitto"
        } else {
            "mosquitto"
        };
        let child = Command::new(program)
            .arg("-c")
            .arg(config)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()?;
        while TcpStream::connect(("127.0.0.1", port)).is_err() {
            crate::support::look_again();
        }
        Ok(child)
    }

    /// Publishes bytes as somebody else's client does.
    pub(crate) fn publish(&self, topic: &str, payload: &[u8], more: &[&str]) {
        let port = self.port.to_string();
        let mut child = Command::new("mosquitto_pub")
            .args(["-V", "mqttv5", "-h", "127.0.0.1", "-p", &port, "-t", topic, "-s"])
            .args(more)
            .stdin(Stdio::piped())
            .spawn()
            .expect("mosquitto_pub is installed beside it");
        child.stdin.take().expect("it is piped").write_all(payload).expect("it reads");
        assert!(child.wait().expect("it runs").success());
    }
}

impl Drop for Mosquitto {
    fn drop(&mut self) {
        self.end();
        let _ = std::fs::remove_file(&self.config);
    }
}

fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("there is a port");
    listener.local_addr().expect("it is bound").port()
}

/// What goes between a broker and the clients whose id has this end.
#[derive(Clone)]
pub(crate) struct Tap {
    seen: Arc<(Mutex<Vec<Packet>>, Condvar)>,
    pub(crate) port: u16,
}

impl Tap {
    pub(crate) fn start(broker: u16, client_id_ends: &'static str) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("there is a port");
        let port = listener.local_addr().expect("it is bound").port();
        let tap = Self { seen: Arc::default(), port };
        let accepting = tap.clone();
        thread::spawn(move || {
            for client in listener.incoming().flatten() {
                let Ok(server) = TcpStream::connect(("127.0.0.1", broker)) else { continue };
                let is_meant = Arc::new(Mutex::new(false));
                for (from, to, is_ours) in [(&client, &server, true), (&server, &client, false)] {
                    let (from, to) = (from.try_clone().expect("a socket"), to.try_clone().expect("a socket"));
                    let (tap, is_meant) = (accepting.clone(), Arc::clone(&is_meant));
                    thread::spawn(move || tap.copy(from, to, is_ours, &is_meant, client_id_ends));
                }
            }
        });
        tap
    }

    fn copy(
        &self,
        mut from: TcpStream,
        mut to: TcpStream,
        is_ours: bool,
        is_meant: &Mutex<bool>,
        ends: &str,
    ) {
        let (mut buffer, mut bytes) = ([0; 65_536], Vec::new());
        while let Ok(count @ 1..) = from.read(&mut buffer) {
            bytes.extend(&buffer[..count]);
            while let Some((first, body, len)) = whole(&bytes) {
                if is_ours && first >> 4 == 1 {
                    *is_meant.lock().unwrap() = client_id(&body).ends_with(ends);
                }
                if *is_meant.lock().unwrap() {
                    let (seen, changed) = &*self.seen;
                    seen.lock().unwrap().extend(packets(first, &body, is_ours));
                    changed.notify_all();
                }
                bytes.drain(..len);
            }
            if to.write_all(&buffer[..count]).is_err() {
                break;
            }
        }
        let _ = to.shutdown(Shutdown::Both);
        let _ = from.shutdown(Shutdown::Both);
    }

    /// What was seen so far.
    pub(crate) fn packets(&self) -> Vec<Packet> {
        self.seen.0.lock().unwrap().clone()
    }

    /// Waits until what was seen is as it should be.
    #[track_caller]
    pub(crate) fn wait_until(&self, what: &str, is_so: impl Fn(&[Packet]) -> bool) {
        let (seen, changed) = &*self.seen;
        let seen = seen.lock().unwrap();
        let waited = changed.wait_timeout_while(seen, FOR_EVER, |seen| !is_so(seen)).unwrap();
        if waited.1.timed_out() {
            drop(waited);
            panic!("never seen: {what}");
        }
    }
}

/// The first whole packet: its first byte, its body, and its length.
fn whole(bytes: &[u8]) -> Option<(u8, Vec<u8>, usize)> {
    let (mut len, mut shift, mut place) = (0_usize, 0, 1);
    loop {
        let byte = *bytes.get(place)?;
        place += 1;
        len |= usize::from(byte & 0x7F) << shift;
        shift += 7;
        if byte < 0x80 {
            break;
        }
    }
    Some((bytes[0], bytes.get(place..place + len)?.to_vec(), place + len))
}

/// Reads the fields of MQTT v5.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn take(&mut self, len: usize) -> &'a [u8] {
        let (head, tail) = self.0.split_at(len);
        self.0 = tail;
        head
    }

    fn byte(&mut self) -> u8 {
        self.take(1)[0]
    }

    fn bytes(&mut self) -> &'a [u8] {
        let len = u16::from_be_bytes(self.take(2).try_into().unwrap());
        self.take(len.into())
    }

    fn text(&mut self) -> String {
        String::from_utf8(self.bytes().to_vec()).expect("it is text")
    }

    fn properties(&mut self) -> &'a [u8] {
        let (mut len, mut shift) = (0_usize, 0);
        loop {
            let byte = self.byte();
            len |= usize::from(byte & 0x7F) << shift;
            shift += 7;
            if byte < 0x80 {
                return self.take(len);
            }
        }
    }
}

fn client_id(connect: &[u8]) -> String {
    let mut fields = Fields(connect);
    // Protocol and version, flags and keep alive.
    fields.bytes();
    fields.take(4);
    fields.properties();
    fields.text()
}

/// The Session Expiry Interval among the properties of a CONNECT: 0 where it is not said.
fn session_expiry(properties: &[u8]) -> u32 {
    let mut fields = Fields(properties);
    while !fields.0.is_empty() {
        match fields.byte() {
            0x11 => return u32::from_be_bytes(fields.take(4).try_into().unwrap()),
            0x27 => drop(fields.take(4)),
            0x21 | 0x22 => drop(fields.take(2)),
            0x17 | 0x19 => drop(fields.take(1)),
            other => panic!("property {other:#x} of CONNECT"),
        }
    }
    0
}

fn packets(first: u8, body: &[u8], is_ours: bool) -> Vec<Packet> {
    let mut fields = Fields(body);
    match first >> 4 {
        1 if is_ours => {
            fields.bytes();
            fields.byte();
            let flags = fields.byte();
            fields.take(2);
            let session_expiry = session_expiry(fields.properties());
            fields.text();
            let will = (flags & 0x04 != 0).then(|| {
                fields.properties();
                Message {
                    topic: fields.text(),
                    payload: fields.bytes().to_vec(),
                    qos: flags >> 3 & 3,
                    retain: flags & 0x20 != 0,
                }
            });
            vec![Packet::Connect { clean_start: flags & 0x02 != 0, session_expiry, will }]
        }
        3 => {
            let (qos, retain) = (first >> 1 & 3, first & 1 != 0);
            let topic = fields.text();
            if qos > 0 {
                fields.take(2);
            }
            fields.properties();
            let message = Message { topic, payload: fields.0.to_vec(), qos, retain };
            vec![if is_ours { Packet::Sent(message) } else { Packet::Heard(message) }]
        }
        8 => {
            fields.take(2);
            fields.properties();
            let mut all = Vec::new();
            while !fields.0.is_empty() {
                all.push(Packet::Subscribe { filter: fields.text(), qos: fields.byte() & 3 });
            }
            all
        }
        14 if is_ours => vec![Packet::Disconnect { reason: body.first().copied().unwrap_or_default() }],
        _ => Vec::new(),
    }
}
