//! Captures of a line: pcapng files that Wireshark opens and decodes as Modbus without any setting.
//!
//! Each frame is a packet of link type 252 (`WIRESHARK_UPPER_PDU`), which names the dissector to be used: `mbrtu` or
//! `mbtcp`. The direction is in the packet's flags: outbound is the master. Formats: the IETF draft
//! draft-ietf-opsawg-pcapng, and `epan/exported_pdu.h` of Wireshark for the tags.
//!
//! ```
//! use drive_bus::{Line, LineConfig, capture};
//! use drive_core::SerialSettings;
//! # use std::sync::{Arc, Mutex};
//! # use tokio_modbus::client::{Context, Reader};
//! # #[derive(Clone, Default)]
//! # struct File(Arc<Mutex<Vec<u8>>>);
//! # impl std::io::Write for File {
//! #     fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
//! #         self.0.lock().unwrap().write(bytes)
//! #     }
//! #     fn flush(&mut self) -> std::io::Result<()> {
//! #         Ok(())
//! #     }
//! # }
//!
//! # #[tokio::main(flavor = "current_thread")]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let plant = drive_sim::SimLine::new(drive_sim::Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
//! # plant.add(1, drive_sim::models::atv312::Atv312::under_bus_control())?;
//! # let file = File::default();
//! let line = Line::over(plant.in_memory(), LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
//! let writing = line.capture(file.clone())?; // or a std::fs::File
//! # let mut drive: Context = line.slave(1).into();
//! # drive.read_holding_registers(3201, 1).await??;
//! line.close().await;
//! writing.finished().await?;
//!
//! # let bytes = file.0.lock().unwrap().clone();
//! let recording = capture::read(&bytes)?;
//! let frames: Vec<_> = recording.frames.iter().map(|frame| frame.direction).collect();
//! assert_eq!(frames, [capture::Direction::Sent, capture::Direction::Received]);
//! # Ok(())
//! # }
//! ```

mod last;
mod pcapng;

use std::{
    io::{self, Write},
    sync::Arc,
    thread,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use bytes::Bytes;
use tokio::{
    sync::{mpsc, oneshot},
    time::Instant,
};

pub(crate) use self::last::Last;
pub use self::{
    last::{Heard, LastFrames},
    pcapng::{ReadError, Reader, Recording, Writer, read},
};

use crate::{config::LineConfig, protocol::Protocol};

/// How many frames may wait for a slow disk before the next are left out: those of a minute at 19200 bit/s, and less than
/// 2 MiB.
const BACKLOG: usize = 4_096;

/// Who sent a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Direction {
    /// The master: this line.
    Sent,
    /// Anybody else.
    Received,
    /// The capture does not say.
    Unknown,
}

/// One frame, or what stood in its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Captured {
    /// When its last byte was handed over, since 1970.
    pub at: Duration,
    /// Who sent it.
    pub direction: Direction,
    /// Its bytes, check included.
    pub bytes: Bytes,
}

/// What the line speaks, as Wireshark calls it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Dissector {
    /// Modbus RTU.
    Rtu,
    /// Modbus TCP.
    Tcp,
    /// Bytes: Wireshark has no dissector for Modbus ASCII and UNI-TELWAY that a capture could name.
    Data,
}

impl Dissector {
    /// That of what a line of this configuration speaks.
    #[must_use]
    pub const fn of(config: &LineConfig) -> Self {
        match config.protocol {
            Protocol::Rtu => Self::Rtu,
            #[cfg(feature = "tcp")]
            Protocol::Tcp => Self::Tcp,
            #[cfg(any(feature = "ascii", feature = "unitelway"))]
            _ => Self::Data,
        }
    }

    /// What a name of [`Self::name`] means, behind which there may be padding.
    fn named(name: &[u8]) -> Option<Self> {
        let name = name.split(|&byte| byte == 0).next()?;
        [Self::Rtu, Self::Tcp, Self::Data].into_iter().find(|known| known.name() == name)
    }

    const fn name(self) -> &'static [u8] {
        match self {
            Self::Rtu => b"mbrtu",
            Self::Tcp => b"mbtcp",
            Self::Data => b"data",
        }
    }
}

/// The end of a capture at the line's task.
#[derive(Debug)]
pub(crate) struct Tap {
    frames: mpsc::Sender<Heard>,
    last: Arc<Last>,
    began: (SystemTime, Instant),
    /// What came in since the last frame was complete, and when its last byte did.
    incoming: Option<(Instant, Vec<u8>)>,
}

impl Tap {
    pub(crate) fn sent(&mut self, now: Instant, bytes: &Bytes) -> bool {
        self.complete() && self.push(now, Direction::Sent, bytes.clone())
    }

    pub(crate) fn received(&mut self, now: Instant, bytes: &[u8], complete: bool) -> bool {
        let (at, incoming) = self.incoming.get_or_insert_with(|| (now, Vec::new()));
        *at = now;
        incoming.extend_from_slice(bytes);
        !complete || self.complete()
    }

    fn complete(&mut self) -> bool {
        match self.incoming.take() {
            Some((at, bytes)) => self.push(at, Direction::Received, bytes.into()),
            None => true,
        }
    }

    /// False: nobody takes frames any more.
    fn push(&self, now: Instant, direction: Direction, bytes: Bytes) -> bool {
        let since = self.began.0.duration_since(UNIX_EPOCH).unwrap_or_default();
        let at = since + now.saturating_duration_since(self.began.1);
        // One that finds no room has its number all the same, by which it is missed.
        let heard = Heard { number: self.last.count(), at: now, frame: Captured { at, direction, bytes } };
        !matches!(self.frames.try_send(heard), Err(mpsc::error::TrySendError::Closed(_)))
    }
}

/// A capture that is being written.
#[derive(Debug)]
pub struct Writing(oneshot::Receiver<io::Result<()>>);

impl Writing {
    /// Waits until the capture has ended and everything is written.
    ///
    /// # Errors
    /// The sink's.
    pub async fn finished(self) -> io::Result<()> {
        self.0.await.unwrap_or_else(|_| Err(io::Error::other("the writer of the capture is gone")))
    }
}

/// A tap, and the thread that writes what it gives, and keeps the last of it beside, until the line is closed. It is a plain
/// thread, because a paused clock stands still while one of tokio's blocking threads works.
pub(crate) fn start(
    sink: impl Write + Send + 'static,
    dissector: Dissector,
    last: Arc<Last>,
) -> io::Result<(Tap, Writing)> {
    let mut writer = Writer::new(sink, dissector)?;
    let (frames, captured) = mpsc::channel::<Heard>(BACKLOG);
    let (finished, writing) = oneshot::channel();
    let kept = Arc::clone(&last);
    thread::Builder::new().name("capture".to_owned()).spawn(move || {
        // Whoever does not ask for the end of the capture does not want its error either.
        let _ = finished.send(write_all(&mut writer, captured, &kept));
    })?;
    let began = (SystemTime::now(), Instant::now());
    Ok((Tap { frames, last, began, incoming: None }, Writing(writing)))
}

fn write_all(
    writer: &mut Writer<impl Write>,
    mut captured: mpsc::Receiver<Heard>,
    last: &Last,
) -> io::Result<()> {
    while let Some(heard) = captured.blocking_recv() {
        last.keep(heard.clone());
        writer.write(&heard.frame)?;
        if captured.is_empty() {
            writer.flush()?;
        }
    }
    writer.flush()
}
