//! What stands between a program and the wire in real plants, in virtual time: a gateway that waits for a dead drive, connections
//! that replay or go mute, a process that stands still.

use std::{future::ready, time::Duration};

use drive_bus::{Line, LineConfig, Protocol, exchange::rtu};
use drive_core::{Class, Port as _, Terms, serial::SerialSettings};
use drive_sim::{Gateway, GatewayInMemory, SimLine, SimSlave, Wiring, models::atv312::Atv312};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, DuplexStream},
    task::JoinSet,
    time::{Instant, sleep, sleep_until, timeout},
};
use tokio_modbus::{Request, Response, client::Client};

use crate::{
    Error,
    report::{Goal, Report, Unit, millis},
};

const SECTION: &str = "strangers";
const SERIAL: SerialSettings = SerialSettings::MODBUS_DEFAULT;
const SECOND: Duration = Duration::from_secs(1);
const DRIVES: u8 = 8;
const DEAD: u8 = 3;
/// How often each drive is asked.
const EVERY: Duration = Duration::from_millis(200);
/// For how long values are counted.
const TIME: Duration = Duration::from_secs(30);
/// The command word of an Altivar 312, and its acceleration ramp, which can be set to anything.
const CMD: u16 = 8_501;
const ACC: u16 = 9_001;

pub(crate) fn measure(report: &mut Report) -> Result<(), Error> {
    let virtual_time =
        tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build()?;
    virtual_time.block_on(async {
        behind_a_gateway(report).await?;
        after_reconnects(report).await?;
        mute(report).await?;
        Ok::<_, Error>(())
    })?;
    stalls(report)
}

struct Plant {
    drives: Vec<SimSlave>,
    gateway: GatewayInMemory,
    line: Line,
}

fn plant(habits: Gateway) -> Result<Plant, Error> {
    plant_by(habits, None)
}

/// Reached by so many connections; `None`: by as many as the line takes by itself.
fn plant_by(habits: Gateway, connections: Option<u8>) -> Result<Plant, Error> {
    let simulated = SimLine::new(Wiring::rtu(SERIAL));
    let added = (1..=DRIVES).map(|address| simulated.add(address, Atv312::under_bus_control()));
    let drives = added.collect::<Result<_, _>>()?;
    let gateway = simulated.behind(habits);
    let protocol = if habits.rtu { Protocol::Rtu } else { Protocol::Tcp };
    let far = gateway.clone();
    let gateway_config = Some(drive_bus::Gateway::default());
    let config = LineConfig { protocol, gateway: gateway_config, connections, ..LineConfig::stream(SERIAL) };
    Ok(Plant { drives, gateway, line: Line::over_reopened(move || ready(Ok(far.connect())), config) })
}

async fn word(line: &Line, slave: u8, spare: u8) -> Option<u16> {
    let mut slave = line.slave(slave).with_terms(Terms::of(Class::Status).within(2 * SECOND).sparing(spare));
    match slave.call(Request::ReadHoldingRegisters(ACC, 1)).await {
        Ok(Ok(Response::ReadHoldingRegisters(words))) => words.first().copied(),
        _ => None,
    }
}

/// What is had of a gateway with a dead drive behind it.
struct Had {
    /// Values of the living.
    values: u32,
    /// How long the slowest of twenty stops took to be confirmed.
    stop: Duration,
}

/// One dead drive of eight behind a gateway of 3 x 1 s, over one connection and over two, beside a blocking loop. The gateway
/// serves one request at a time in all, or one of each connection.
async fn behind_a_gateway(report: &mut Report) -> Result<(), Error> {
    let told = |what: &str| format!("{what}, one of 8 dead behind a gateway of 3 x 1 s");
    for (one_line, serves) in [(true, "one wire"), (false, "a wire for each connection")] {
        let habits = Gateway { one_line, ..Gateway::default() };
        let mut loops = 0;
        for patience in [SECOND, 4 * SECOND] {
            loops = loops.max(by_a_loop(habits, patience).await?);
        }
        let what = told(&format!("a blocking loop on {serves}: values of the living in 30 s"));
        report.note(SECTION, what, Unit::Count, f64::from(loops));
        for (connections, times) in [(1, 1), (2, 5)] {
            let Had { values, stop } = had(habits, connections).await?;
            let over = format!("this line over {connections} on {serves}");
            let goal = Goal::AtLeast(f64::from(loops * times));
            report.row(
                SECTION,
                told(&format!("{over}: values of the living in 30 s")),
                Unit::Count,
                f64::from(values),
                goal,
            );
            let goal = Goal::AtMost(millis(3 * SECOND + SECOND / 2));
            report.row(
                SECTION,
                told(&format!("{over}: a stop confirmed within")),
                Unit::Millis,
                millis(stop),
                goal,
            );
        }
    }
    Ok(())
}

/// Over so many connections.
async fn had(habits: Gateway, connections: u8) -> Result<Had, Error> {
    let plant = plant_by(habits, Some(connections))?;
    let died = Instant::now() + 3 * SECOND;
    let mut polls = JoinSet::new();
    for address in 1..=DRIVES {
        let mut slave =
            plant.line.slave(address).with_terms(Terms::of(Class::Status).within(EVERY).sparing(3));
        polls.spawn(async move {
            let (mut good, mut next) = (0_u32, Instant::now());
            while next < died + TIME {
                sleep_until(next).await;
                let answered = matches!(slave.call(Request::ReadHoldingRegisters(3_201, 4)).await, Ok(Ok(_)));
                good += u32::from(answered && address != DEAD && Instant::now() >= died);
                next = Instant::now().max(next + EVERY);
            }
            good
        });
    }
    sleep_until(died).await;
    plant.drives.iter().filter(|drive| drive.address() == DEAD).for_each(SimSlave::mute);
    let mut stop = Duration::ZERO;
    for _ in 0..20 {
        sleep(1_117 * SECOND / 1_000).await;
        let called = Instant::now();
        let mut slave = plant.line.slave(4).with_terms(Terms::of(Class::Stop));
        slave.call(Request::WriteSingleRegister(CMD, 0)).await??;
        stop = stop.max(called.elapsed());
    }
    Ok(Had { values: polls.join_all().await.into_iter().sum(), stop })
}

/// What a loop gets that asks one after another and waits so long for each.
async fn by_a_loop(habits: Gateway, patience: Duration) -> Result<u32, Error> {
    let plant = plant(habits)?;
    plant.drives.iter().filter(|drive| drive.address() == DEAD).for_each(SimSlave::mute);
    let mut stream = plant.gateway.connect();
    let (until, mut good, mut number) = (Instant::now() + TIME, 0, 0_u16);
    while Instant::now() < until {
        for address in 1..=DRIVES {
            number += 1;
            let [high, low] = number.to_be_bytes();
            stream.write_all(&[high, low, 0, 0, 0, 6, address, 3, 0x0C, 0x81, 0, 4]).await?;
            let answered = timeout(patience, answer_to(&mut stream, number)).await;
            good += u32::from(answered.is_ok_and(|answered| answered.unwrap_or(false)));
        }
    }
    Ok(good)
}

async fn answer_to(stream: &mut DuplexStream, number: u16) -> Result<bool, Error> {
    loop {
        let mut head = [0; 7];
        stream.read_exact(&mut head).await?;
        let mut pdu = vec![0; usize::from(head[5]).saturating_sub(1)];
        stream.read_exact(&mut pdu).await?;
        if head[..2] == number.to_be_bytes() {
            return Ok(pdu.first() == Some(&3));
        }
    }
}

async fn after_reconnects(report: &mut Report) -> Result<(), Error> {
    const ROUNDS: u16 = 200;
    let (mut right, mut wrong) = (0_u32, 0_u32);
    for round in 0..ROUNDS {
        let habits = Gateway {
            rtu: true,
            replays: 1 + usize::from(round % 3),
            replays_when_asked: round % 2 == 0,
            ..Gateway::default()
        };
        let plant = plant(habits)?;
        for value in [100, 200] {
            for drive in &plant.drives {
                if !drive.poke(ACC, value + u16::from(drive.address())) {
                    return Err("the ramp cannot be set".into());
                }
            }
            for slave in [1, 2, 3, 1, 1, 2, 3] {
                if let Some(told) = word(&plant.line, slave, (round / 2 % 2) as u8 * 3).await {
                    let is_right = told == value + u16::from(slave);
                    right += u32::from(is_right);
                    wrong += u32::from(!is_right);
                }
            }
            sleep(13 * SECOND).await;
            plant.gateway.cut();
            sleep(u32::from(round % 5) * SECOND / 10).await;
        }
    }
    let what = format!(
        "{ROUNDS} reconnects that replay up to three frames: replayed frames taken, of {right} values"
    );
    report.row(SECTION, what, Unit::Count, f64::from(wrong), Goal::AtMost(0.0));
    Ok(())
}

async fn mute(report: &mut Report) -> Result<(), Error> {
    let plant = plant(Gateway { rtu: true, mute_after: Some(20 * SECOND), ..Gateway::default() })?;
    let begun = Instant::now();
    let (mut last, mut longest) = (begun, Duration::ZERO);
    while begun.elapsed() < 120 * SECOND {
        for slave in 1..=DRIVES {
            if word(&plant.line, slave, 3).await.is_some() {
                longest = longest.max(last.elapsed());
                last = Instant::now();
            }
        }
        sleep(SECOND / 10).await;
    }
    let what = "a connection that goes mute every 20 s: the longest time without a value";
    report.row(SECTION, what, Unit::Millis, millis(longest.max(last.elapsed())), Goal::AtMost(6_000.0));
    Ok(())
}

/// In real time: the process stands still while an answer lies in its port.
fn stalls(report: &mut Report) -> Result<(), Error> {
    const STALLS: u32 = 100;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let wrong = runtime.block_on(async {
        let (ours, mut theirs) = tokio::io::duplex(512);
        let patience = 20 * SECOND;
        let config = LineConfig {
            response_timeout: patience,
            timeout_floor: patience,
            chunk_gap: patience,
            ..LineConfig::stream(SERIAL)
        };
        let line = Line::over(ours, config);
        let (said, mut truth) = tokio::sync::mpsc::unbounded_channel();
        tokio::spawn(async move {
            let mut request = [0; 8];
            for stall in 0_u32.. {
                if theirs.read_exact(&mut request).await.is_err() {
                    return;
                }
                let words = vec![0; usize::from(request[5]) * 2];
                let answer = rtu::frame(request[0], &[&[3, request[5] * 2], &words[..]].concat());
                let _ = said.send(Instant::now());
                let _ = theirs.write_all(&answer).await;
                #[expect(clippy::disallowed_methods, reason = "it is to block the runtime")]
                std::thread::sleep(Duration::from_millis(u64::from(1 + stall % 20)));
            }
        });
        let mut wrong = 0_u32;
        for _ in 0..STALLS {
            let mut slave = line.slave(1).with_terms(Terms::default().sparing(2));
            slave.call(Request::ReadHoldingRegisters(7, 1)).await??;
            let true_at = truth.recv().await.ok_or("nobody was asked")?;
            wrong += u32::from(slave.asked_at().is_none_or(|shown| shown > true_at));
        }
        Ok::<_, Error>(wrong)
    })?;
    let what = format!("{STALLS} stalls of the process: values told to be younger than they are");
    report.row(SECTION, what, Unit::Count, f64::from(wrong), Goal::AtMost(0.0));
    Ok(())
}
