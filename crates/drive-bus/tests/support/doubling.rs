//! A far end that may answer at any time, and says what it likes once more.

use std::time::Duration;

use drive_bus::{Line, LineConfig, Slave, exchange::rtu};
use drive_core::{Class, SerialSettings, Terms};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    sync::mpsc,
    time::sleep,
};

/// How long it takes for an answer.
const RESPONSE: Duration = Duration::from_millis(12);

/// A line whose times prove nothing, and its slave 1: what it says to a read of this register, of one word, and after how long it says
/// that once more.
pub(crate) fn line(mut says: impl FnMut(u16) -> (u16, Option<Duration>) + Send + 'static) -> (Line, Slave) {
    let (ours, far) = tokio::io::duplex(4_096);
    let config = LineConfig::stream(SerialSettings::MODBUS_DEFAULT);
    let line = Line::over(ours, LineConfig { far_end_paces: Some(false), ..config });
    let (mut from, mut to) = tokio::io::split(far);
    let (say, mut said) = mpsc::unbounded_channel::<Vec<u8>>();
    tokio::spawn(async move {
        while let Some(frame) = said.recv().await {
            if to.write_all(&frame).await.is_err() {
                return;
            }
        }
    });
    tokio::spawn(async move {
        let mut bytes = [0; 256];
        while let Ok(8) = from.read(&mut bytes).await {
            let (word, again) = says(u16::from_be_bytes([bytes[2], bytes[3]]));
            let frame = rtu::frame(1, &[&[3, 2][..], &word.to_be_bytes()].concat()).to_vec();
            let say = say.clone();
            tokio::spawn(async move {
                sleep(RESPONSE).await;
                let _ = say.send(frame.clone());
                if let Some(again) = again {
                    sleep(again).await;
                    let _ = say.send(frame);
                }
            });
        }
    });
    let slave = line.slave(1).with_terms(Terms::of(Class::Status));
    (line, slave)
}
