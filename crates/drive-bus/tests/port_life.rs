//! The life of a port: what the last connection has left behind is nobody's answer, and one that has gone mute is opened
//! again.

#![cfg(feature = "tcp")]

mod support;

use std::{
    future::ready,
    io,
    pin::Pin,
    sync::atomic::{AtomicU64, Ordering},
    task::{Context, Poll},
    time::Duration,
};

use drive_bus::{Line, LineConfig, Protocol};
use drive_clock::Sleeps;
use drive_core::{Class, PortError, SerialSettings, Terms};
use drive_sim::{Gateway, GatewayInMemory, SimLine, SimSlave, Wiring, models::atv312::Atv312};
use support::{MS, read, write};
use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    time::{Instant, sleep},
};

const SECOND: Duration = Duration::from_secs(1);
/// The acceleration ramp, which can be set to anything.
const ACC: u16 = 9001;

struct Plant {
    drives: Vec<SimSlave>,
    gateway: GatewayInMemory,
    line: Line,
}

fn plant(habits: Gateway) -> Plant {
    plant_on(habits, Sleeps::new())
}

fn plant_on(habits: Gateway, sleeps: Sleeps) -> Plant {
    let simulated = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    let drives =
        (1..=3).map(|address| simulated.add(address, Atv312::under_bus_control()).unwrap()).collect();
    let gateway = simulated.behind(habits);
    let line = line_over(&gateway, habits, sleeps);
    Plant { drives, gateway, line }
}

/// A line over a connection of its own to the gateway.
fn line_over(gateway: &GatewayInMemory, habits: Gateway, sleeps: Sleeps) -> Line {
    let protocol = if habits.rtu { Protocol::Rtu } else { Protocol::Tcp };
    let config = LineConfig { protocol, ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT) };
    let far = gateway.clone();
    Line::over_reopened_by(move || ready(Ok(far.connect())), config, sleeps)
}

/// The ramp as the line tells it.
async fn ramp(line: &Line, slave: u8, spare: u8) -> Result<u16, PortError> {
    let terms = Terms::of(Class::Status).within(2 * SECOND).sparing(spare);
    read(&mut line.slave(slave).with_terms(terms), ACC, 1).await.map(|words| words[0])
}

#[tokio::test(start_paused = true)]
async fn in_two_hundred_reconnects_no_frame_of_the_last_connection_is_taken() {
    let (mut right, mut failed) = (0, 0);
    for round in 0..200_u16 {
        let replays = 1 + usize::from(round % 3);
        let habits = Gateway { rtu: true, replays, replays_when_asked: round % 2 == 0, ..Gateway::default() };
        let plant = plant(habits);
        let spare = (round / 2 % 2) as u8 * 3;
        for value in [100, 200, 300] {
            for (at, drive) in plant.drives.iter().enumerate() {
                assert!(drive.poke(ACC, value + at as u16));
            }
            for slave in [1, 2, 3, 1, 1, 2, 3] {
                match ramp(&plant.line, slave, spare).await {
                    Ok(told) => {
                        right += 1;
                        assert_eq!(
                            told,
                            value + u16::from(slave) - 1,
                            "{slave}, {habits:?}, {spare} to spare"
                        );
                    }
                    Err(_) => failed += 1,
                }
            }
            sleep(13 * SECOND).await;
            plant.gateway.cut();
            sleep(u32::from(round % 5) * 100 * MS).await;
        }
    }
    println!("{right} right, {failed} failed");
    assert!(right > 100 * failed, "{right} right, {failed} failed");
}

#[tokio::test(start_paused = true)]
async fn what_a_server_has_kept_of_another_client_is_no_answer_over_the_next_port() {
    for replays_when_asked in [true, false] {
        let habits = Gateway { rtu: true, replays: 1, replays_when_asked, ..Gateway::default() };
        let plant = plant(habits);
        ramp(&plant.line, 1, 0).await.expect("it answers");
        // Nothing that this line was answered last: nobody here can know that it is owed.
        assert!(plant.drives[1].poke(ACC, 100));
        let other = line_over(&plant.gateway, habits, Sleeps::new());
        assert_eq!(ramp(&other, 2, 3).await, Ok(100));
        drop(other);
        assert!(plant.drives[1].poke(ACC, 200));
        plant.gateway.cut();
        sleep(100 * MS).await;
        assert_eq!(ramp(&plant.line, 2, 3).await, Ok(200), "when it is asked: {replays_when_asked}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_connection_that_goes_mute_is_open_again_within_five_seconds() {
    for rtu in [true, false] {
        let habits = Gateway { rtu, mute_after: Some(20 * SECOND), ..Gateway::default() };
        let plant = plant(habits);
        let begun = Instant::now();
        let (mut last, mut longest) = (begun, Duration::ZERO);
        while begun.elapsed() < 60 * SECOND {
            for slave in 1..=3 {
                if ramp(&plant.line, slave, 3).await.is_ok() {
                    longest = longest.max(last.elapsed());
                    last = Instant::now();
                }
            }
            sleep(100 * MS).await;
        }
        longest = longest.max(last.elapsed());
        println!("longest without a value: {longest:?}, opened {}", plant.line.stats().opened);
        assert!(longest < 6 * SECOND, "{longest:?}");
        assert!(plant.line.stats().opened >= 3);
    }
}

#[tokio::test(start_paused = true)]
async fn drives_without_power_have_their_connection_opened_again_less_and_less_often() {
    let plant = plant(Gateway { rtu: true, tells: false, ..Gateway::default() });
    ramp(&plant.line, 1, 3).await.unwrap();
    plant.drives.iter().for_each(SimSlave::mute);
    for _ in 0..3_000 {
        let _ = ramp(&plant.line, 1, 3).await;
        sleep(100 * MS).await;
    }
    // After 4, 12, 28, 60 and every 60 s of five minutes.
    let opened = plant.line.stats().opened;
    assert!((4..=11).contains(&opened), "{opened}");
    plant.drives.iter().for_each(SimSlave::unmute);
    let back = Instant::now();
    while ramp(&plant.line, 1, 3).await.is_err() {
        sleep(100 * MS).await;
    }
    assert!(back.elapsed() < 15 * SECOND, "{:?}", back.elapsed());
}

#[tokio::test(start_paused = true)]
async fn a_stop_waits_for_nothing_that_a_new_connection_is_listened_to_for() {
    let plant = plant(Gateway { rtu: true, replays: 3, ..Gateway::default() });
    ramp(&plant.line, 1, 3).await.unwrap();
    sleep(SECOND).await;
    plant.gateway.cut();
    sleep(MS).await;
    let called = Instant::now();
    let mut slave = plant.line.slave(1).with_terms(Terms::of(Class::Stop));
    write(&mut slave, 8501, 0).await.unwrap();
    let received = plant.drives[0].received();
    let stop = received.iter().find(|request| request.pdu[..] == [6, 0x21, 0x35, 0, 0]).unwrap();
    assert!(stop.at - called < 20 * MS, "{:?}", stop.at - called);
}

/// For how many seconds the computer of a test was asleep.
static ASLEEP: AtomicU64 = AtomicU64::new(0);

#[tokio::test(start_paused = true)]
async fn a_computer_that_slept_has_lost_its_line_and_takes_nothing_that_lay_in_it() {
    let clocks = || {
        let asleep = Duration::from_secs(ASLEEP.load(Ordering::Relaxed));
        Some([SECOND, SECOND + asleep, SECOND])
    };
    for rtu in [true, false] {
        let plant = plant_on(Gateway { rtu, replays: 3, ..Gateway::default() }, Sleeps::by(clocks));
        assert!(plant.drives[0].poke(ACC, 100));
        assert_eq!(ramp(&plant.line, 1, 3).await, Ok(100));
        assert_eq!(plant.line.stats().opened, 1);
        ASLEEP.fetch_add(3_600, Ordering::Relaxed);
        assert!(plant.drives[0].poke(ACC, 200));
        assert_eq!(ramp(&plant.line, 1, 3).await, Ok(200));
        let stats = plant.line.stats();
        assert_eq!((stats.lost, stats.opened), (1, 2), "{rtu}");
        // Only once.
        assert_eq!(ramp(&plant.line, 1, 3).await, Ok(200));
        assert_eq!(plant.line.stats().opened, 2);
    }
}

/// How somebody's stream, or his opening of it, ends.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Evil {
    PanicsReading,
    PanicsWriting,
    PanicsOpening,
    PanicsAtOnce,
    OpensNever,
}

/// A stream of somebody else's, which may panic.
struct Theirs<S> {
    stream: S,
    evil: Option<Evil>,
}

impl<S: AsyncRead + Unpin> AsyncRead for Theirs<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        assert_ne!(self.evil, Some(Evil::PanicsReading), "no");
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Theirs<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        assert_ne!(self.evil, Some(Evil::PanicsWriting), "no");
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

/// `over_reopened`: "One that panics has ended so; an opening that panics, or takes longer than 30 s, has failed."
#[tokio::test(start_paused = true)]
async fn a_stream_of_somebody_elses_that_panics_or_is_never_opened_is_a_port_that_is_lost_and_opened_again() {
    use Evil::{OpensNever, PanicsAtOnce, PanicsOpening, PanicsReading, PanicsWriting};
    for evil in [PanicsReading, PanicsWriting, PanicsOpening, PanicsAtOnce, OpensNever] {
        let simulated = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
        let drive = simulated.add(1, Atv312::new()).expect("the address is free");
        assert!(drive.poke(ACC, 77));
        let mut left = 1;
        let open = move || {
            let evil = (std::mem::take(&mut left) > 0).then_some(evil);
            assert_ne!(evil, Some(PanicsAtOnce), "no");
            let stream = simulated.in_memory();
            async move {
                assert_ne!(evil, Some(PanicsOpening), "no");
                if evil == Some(OpensNever) {
                    std::future::pending::<()>().await;
                }
                Ok(Theirs { stream, evil })
            }
        };
        let line = Line::over_reopened(open, LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
        let begun = Instant::now();
        let told = loop {
            match ramp(&line, 1, 0).await {
                Ok(told) => break told,
                Err(error) => assert!(begun.elapsed() < 60 * SECOND, "{evil:?}: {error}"),
            }
            sleep(100 * MS).await;
        };
        assert_eq!(told, 77, "{evil:?}");
    }
}
