//! What the tests of several tools share.

use std::time::Duration;

use drive_core::SerialSettings;
use drive_sim::SimLine;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, DuplexStream},
    time::Instant,
};

/// What is done to what the slaves say, at a time since the beginning.
pub(crate) type Change = fn(Duration, &mut Vec<u8>);

/// A simulated line, behind something that changes what its slaves say.
pub(crate) struct Through(pub(crate) SimLine, pub(crate) Change);

impl Through {
    pub(crate) fn stream(&self, serial: SerialSettings) -> DuplexStream {
        let (ours, near) = tokio::io::duplex(4_096);
        let (mut from_us, mut to_us) = tokio::io::split(near);
        let (mut from_slaves, mut to_slaves) = tokio::io::split(self.0.in_memory_at(serial));
        let (change, begun) = (self.1, Instant::now());
        tokio::spawn(async move { tokio::io::copy(&mut from_us, &mut to_slaves).await });
        tokio::spawn(async move {
            let mut bytes = vec![0; 512];
            while let Ok(len @ 1..) = from_slaves.read(&mut bytes).await {
                let mut said = bytes[..len].to_vec();
                change(begun.elapsed(), &mut said);
                if to_us.write_all(&said).await.is_err() {
                    return;
                }
            }
        });
        ours
    }
}
