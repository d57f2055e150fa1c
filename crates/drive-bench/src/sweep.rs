//! The sweep of the living drives with dead ones on the line.

use std::time::Duration;

use drive_bus::Line;
use tokio::time::Instant;
use tokio_modbus::{Request, client::Client};

use crate::{
    Error, millis,
    rig::{FIRST, QUANTITY, Rig, runtime},
    row,
};

const DEAD: [u8; 3] = [3, 14, 25];

/// The mean time of a sweep over `slaves`, after what is dead is known to be.
async fn sweeps(line: &Line, slaves: &[u8], time: Duration) -> Result<Duration, Error> {
    let settle = Instant::now() + time / 2;
    let mut begin = Instant::now();
    let (end, mut count) = (begin + time, 0_u32);
    while Instant::now() < end {
        if Instant::now() < settle {
            (begin, count) = (Instant::now(), 0);
        }
        let reads: Vec<_> = slaves
            .iter()
            .map(|&address| {
                let mut slave = line.slave(address);
                tokio::spawn(async move {
                    let answer = slave.call(Request::ReadHoldingRegisters(FIRST, QUANTITY)).await;
                    answer.is_ok() || DEAD.contains(&address)
                })
            })
            .collect();
        for read in reads {
            if !read.await? {
                return Err("a living drive did not answer".into());
            }
        }
        count += 1;
    }
    Ok(begin.elapsed() / count.max(1))
}

pub(crate) fn measure(time: Duration) -> Result<Vec<String>, Error> {
    let rig = Rig::start(31, false)?;
    for address in DEAD {
        rig.line.slave(address).ok_or("a drive is missing")?.mute();
    }
    let living: Vec<u8> = (1..=31).filter(|address| !DEAD.contains(address)).collect();
    let all: Vec<u8> = (1..=31).collect();
    let (without, with) = runtime()?.block_on(async {
        let line = Line::open(rig.config()).await?;
        let measured = tokio::spawn(async move {
            let without = sweeps(&line, &living, time).await?;
            let with = sweeps(&line, &all, time * 3).await?;
            line.close().await;
            Ok::<_, Error>((without, with))
        });
        measured.await?
    })?;
    let ratio = with.as_nanos() * 1_000 / without.as_nanos().max(1);
    Ok(vec![row(
        "sweep of 28 drives, and of 31 with 3 dead",
        format!("{} and {}: {}.{:03} ×", millis(without), millis(with), ratio / 1_000, ratio % 1_000),
        "≤ 1.05 ×",
    )])
}
