//! A cable to a simulated line on which one answer comes twice, or something that nobody has asked for.

use std::{
    sync::{Arc, Mutex},
    time::Duration,
};

use drive_sim::SimLine;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex, split},
    spawn,
    sync::mpsc::{UnboundedSender, unbounded_channel},
    time::{sleep, timeout},
};

/// What ends a frame: longer than any pause in one, shorter than any answer takes.
const SILENCE: Duration = Duration::from_millis(2);

/// The cable.
#[derive(Debug, Clone)]
pub struct Doubling {
    seen: Arc<Mutex<Seen>>,
    say: UnboundedSender<Vec<u8>>,
}

#[derive(Debug, Default)]
struct Seen {
    answers: usize,
    last: Vec<u8>,
    doubles: Option<(usize, Duration)>,
}

impl Doubling {
    /// A cable to this line, and its end.
    #[must_use]
    pub fn to(simulated: &SimLine) -> (Self, DuplexStream) {
        let (ours, end) = duplex(4_096);
        let (mut from_master, mut to_master) = split(end);
        let (mut from_line, mut to_line) = split(simulated.in_memory());
        let (say, mut said) = unbounded_channel::<Vec<u8>>();
        spawn(async move { tokio::io::copy(&mut from_master, &mut to_line).await });
        spawn(async move {
            while let Some(bytes) = said.recv().await {
                if to_master.write_all(&bytes).await.is_err() {
                    return;
                }
            }
        });
        let cable = Self { seen: Arc::default(), say };
        spawn(cable.clone().carry(async move |bytes: &mut [u8]| from_line.read(bytes).await.unwrap_or(0)));
        (cable, ours)
    }

    async fn carry(self, mut read: impl AsyncFnMut(&mut [u8]) -> usize) {
        let mut bytes = [0; 512];
        loop {
            let mut frame = Vec::new();
            while let Ok(len) =
                timeout(if frame.is_empty() { Duration::MAX } else { SILENCE }, read(&mut bytes)).await
            {
                if len == 0 || self.say.send(bytes[..len].to_vec()).is_err() {
                    return;
                }
                frame.extend_from_slice(&bytes[..len]);
            }
            let again = {
                let mut seen = self.seen.lock().expect("nobody panics with it");
                seen.answers += 1;
                seen.last.clone_from(&frame);
                seen.doubles.filter(|(which, _)| *which + 1 == seen.answers)
            };
            if let Some((_, after)) = again {
                let say = self.say.clone();
                spawn(async move {
                    sleep(after).await;
                    let _ = say.send(frame);
                });
            }
        }
    }

    /// Behind so many answers from now on one comes once more, so much later.
    ///
    /// # Panics
    /// Never.
    pub fn double(&self, behind: usize, after: Duration) {
        let mut seen = self.seen.lock().expect("nobody panics with it");
        seen.doubles = Some((seen.answers + behind, after));
    }

    /// The answer that came last.
    ///
    /// # Panics
    /// Never.
    #[must_use]
    pub fn last(&self) -> Vec<u8> {
        self.seen.lock().expect("nobody panics with it").last.clone()
    }

    /// These bytes come, though nobody has asked.
    pub fn say(&self, bytes: &[u8]) {
        let _ = self.say.send(bytes.to_vec());
    }
}
