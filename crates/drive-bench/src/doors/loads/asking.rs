//! As many clients of a gateway as there can be, each asking again as soon as it is answered.

use std::sync::atomic::{AtomicBool, Ordering};

use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::TcpStream,
    time::sleep,
};

use super::{
    Got, Tally, all,
    client::{AGAIN, Client},
};
use crate::doors::{attacks::Target, plant::Size};

const ANSWERED: &str = "reads answered";

pub(super) fn ask(to: &Target, over: &AtomicBool) -> Vec<Got> {
    let gateway = to.gateway;
    all(0..Size::FULL.clients, over, ANSWERED, |number, over| async move {
        let (mut tally, mut client) = (Tally::default(), Client::new(number, gateway));
        while !over.load(Ordering::Relaxed) {
            match client.ask("reads", &mut tally, async |open| one(open, number).await).await {
                Some(what) => tally.count(what),
                None => sleep(AGAIN).await,
            }
        }
        tally
    })
}

/// Four registers from ETA on (BBV51701 p. 21), each client of a drive of its own as far as there are drives.
async fn one(open: &mut TcpStream, number: u16) -> std::io::Result<String> {
    let unit = u8::try_from(number % u16::from(Size::FULL.drives())).unwrap_or_default() + 1;
    open.write_all(&[0, 1, 0, 0, 0, 6, unit, 3, 0x0C, 0x81, 0, 4]).await?;
    let mut head = [0; 9];
    open.read_exact(&mut head).await?;
    if head[7] & 0x80 != 0 {
        return Ok(format!("reads refused by {:02X}h", head[8]));
    }
    let mut words = vec![0; head[8].into()];
    open.read_exact(&mut words).await?;
    Ok(ANSWERED.to_owned())
}
