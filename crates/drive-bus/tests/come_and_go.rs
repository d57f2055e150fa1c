//! Fifteen drives behind a far end of Modbus TCP, each of which comes and goes: how much of the time those that are there are known,
//! and how long a stop waits meanwhile. The far end is of another hand, and all of it in virtual time.

#![cfg(feature = "tcp")]

mod support;

use std::{
    collections::BTreeMap,
    future::ready,
    sync::{Arc, Mutex},
    time::Duration,
};

use drive_bus::{Gateway, Line, LineConfig, Protocol};
use drive_core::{Class, Port, SerialSettings, Terms};
use support::{MS, read, write};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, DuplexStream},
    task::JoinSet,
    time::{Instant, sleep, sleep_until},
};

const SECOND: Duration = Duration::from_secs(1);
const DRIVES: u8 = 15;
/// Each drive is there for so long, and away for as long.
const STAYS: Duration = Duration::from_secs(20);
/// How often each is asked, and how old what is known of it may be.
const EVERY: Duration = Duration::from_secs(1);
const MAX_AGE: Duration = Duration::from_secs(3);
/// How long a drive takes to answer.
const RESPONSE: Duration = Duration::from_millis(20);
/// What is measured, and from when on: the first drives have come and gone by then.
const FROM: Duration = Duration::from_secs(60);
const FOR: Duration = Duration::from_secs(240);
const STATUS: u16 = 3201;
const COMMAND: u16 = 8501;

/// What a far end does.
#[derive(Debug, Clone, Copy)]
struct Habits {
    /// On how many lines of its own its drives are, by their addresses: each serves one question after another.
    lines: u8,
    /// How long it waits for a drive that does not answer.
    waits: Duration,
    /// Whether it says that nobody answered.
    tells: bool,
}

const IN_TURN: Habits = Habits { lines: 1, waits: SECOND, tells: true };
/// Each drive for itself.
const SIDE_BY_SIDE: Habits = Habits { lines: DRIVES, waits: SECOND, tells: true };

struct FarEnd {
    habits: Habits,
    begun: Instant,
    /// Who is there for good, or away for good.
    always: BTreeMap<u8, bool>,
    lines: Vec<tokio::sync::Mutex<()>>,
    /// When each drive has got a stop.
    stops: Mutex<Vec<(u8, Instant)>>,
}

impl FarEnd {
    fn new(habits: Habits, always: &[(u8, bool)]) -> Arc<Self> {
        let lines = (0..habits.lines).map(|_| tokio::sync::Mutex::default()).collect();
        let always = always.iter().copied().collect();
        Arc::new(Self { habits, begun: Instant::now(), always, lines, stops: Mutex::default() })
    }

    /// Since when a drive is there; `None`: it is away. One after another comes.
    fn there_since(&self, drive: u8, now: Instant) -> Option<Instant> {
        if let Some(there) = self.always.get(&drive) {
            return there.then_some(self.begun);
        }
        let phase = STAYS * 2 * drive.into() / DRIVES.into();
        let turns = (now + phase).duration_since(self.begun).as_millis() / STAYS.as_millis();
        let since = (self.begun + STAYS * turns as u32).checked_sub(phase)?;
        turns.is_multiple_of(2).then_some(since)
    }

    fn connect(self: &Arc<Self>) -> DuplexStream {
        let (ours, theirs) = tokio::io::duplex(4_096);
        drop(tokio::spawn(Arc::clone(self).serve(theirs)));
        ours
    }

    async fn serve(self: Arc<Self>, stream: DuplexStream) {
        let (mut from, to) = tokio::io::split(stream);
        let to = Arc::new(tokio::sync::Mutex::new(to));
        let mut asked = JoinSet::new();
        let mut head = [0; 7];
        while from.read_exact(&mut head).await.is_ok() {
            let mut pdu = vec![0; usize::from(head[5]) - 1];
            if from.read_exact(&mut pdu).await.is_err() {
                return;
            }
            let (far, to) = (Arc::clone(&self), Arc::clone(&to));
            asked.spawn(async move {
                let Some(answer) = far.ask(head[6], &pdu).await else { return };
                let [high, low] = (answer.len() as u16 + 1).to_be_bytes();
                let frame = [&[head[0], head[1], 0, 0, high, low, head[6]], &answer[..]].concat();
                let _ = to.lock().await.write_all(&frame).await;
            });
        }
    }

    async fn ask(&self, drive: u8, pdu: &[u8]) -> Option<Vec<u8>> {
        let _turn = self.lines[usize::from(drive % self.habits.lines)].lock().await;
        let now = Instant::now();
        if self.there_since(drive, now).is_none() {
            sleep(self.habits.waits).await;
            return self.habits.tells.then(|| vec![pdu[0] | 0x80, 0x0B]);
        }
        if pdu[..] == [6, 0x21, 0x35, 0, 0] {
            self.stops.lock().unwrap().push((drive, now));
        }
        sleep(RESPONSE).await;
        Some(match pdu {
            [3, .., words] => [&[3, 2 * words][..], &vec![drive; 2 * usize::from(*words)]].concat(),
            _ => pdu.to_vec(),
        })
    }

    fn stopped(&self, drive: u8, since: Instant) -> Option<Instant> {
        let stops = self.stops.lock().unwrap();
        stops.iter().find(|(whose, at)| *whose == drive && *at >= since).map(|(_, at)| *at)
    }
}

fn line(far: &Arc<FarEnd>, gateway: Gateway) -> Line {
    let far = Arc::clone(far);
    let config = LineConfig::stream(SerialSettings::MODBUS_DEFAULT);
    let config =
        LineConfig { protocol: Protocol::Tcp, gateway: Some(gateway), connections: Some(2), ..config };
    Line::over_reopened(move || ready(Ok(far.connect())), config)
}

/// Of the time in which drives are there, but for the first [`MAX_AGE`], how much they are known. A stop to the drive that is `always`
/// there waits no longer than the line says meanwhile.
async fn known(habits: Habits, gateway: Gateway, always: &[(u8, bool)]) -> f64 {
    let far = FarEnd::new(habits, always);
    let line = line(&far, gateway);
    let (from, until) = (far.begun + FROM, far.begun + FROM + FOR);
    let asked: Arc<Mutex<BTreeMap<u8, Instant>>> = Arc::default();
    let mut drives = JoinSet::new();
    for drive in 1..=DRIVES {
        let mut slave = line.slave(drive).with_terms(Terms::of(Class::Status).within(EVERY).sparing(3));
        let asked = Arc::clone(&asked);
        drives.spawn(async move {
            let mut next = Instant::now();
            while next < until {
                sleep_until(next).await;
                if read(&mut slave, STATUS, 4).await.is_ok() {
                    asked.lock().unwrap().insert(drive, slave.asked_at().unwrap());
                }
                next = Instant::now().max(next + EVERY);
            }
        });
    }
    let looks = async {
        let (mut known, mut there, mut at) = (0, 0, from);
        while at < until {
            sleep_until(at).await;
            for drive in 1..=DRIVES {
                let Some(since) = far.there_since(drive, at) else { continue };
                let last = asked.lock().unwrap().get(&drive).copied().filter(|last| *last >= since);
                let is_known = last.is_some_and(|last| last + MAX_AGE >= at);
                known += u32::from(is_known);
                there += u32::from(is_known || since + MAX_AGE <= at);
            }
            at += 100 * MS;
        }
        f64::from(known) / f64::from(there)
    };
    let stops = async {
        let Some((drive, _)) = always.iter().find(|(_, there)| *there) else { return };
        let mut slave = line.slave(*drive).with_terms(Terms::of(Class::Stop));
        sleep_until(from).await;
        while Instant::now() + 10 * SECOND < until {
            let (called, bound) = (Instant::now(), line.worst_case_stop());
            let bound = bound.min(line.stats().worst_case_stop);
            // Its confirmation may be late: it is repeated until it is there.
            while write(&mut slave, COMMAND, 0).await.is_err() {}
            let waited = far.stopped(*drive, called).expect("it is confirmed") - called;
            assert!(waited <= bound, "{waited:?} of {bound:?} at {:?}, {habits:?}", called - far.begun);
            sleep(1_370 * MS).await;
        }
    };
    tokio::join!(looks, stops).0
}

/// What is known where nothing is said of the far end, and where it is told, each as least as much as that.
async fn at_least(habits: Habits, unknown: f64, told: f64) {
    let said = Gateway { at_once: Some(habits.lines.into()), wait: Some(habits.waits.max(200 * MS)) };
    for (gateway, least) in [(Gateway::default(), unknown), (said, told)] {
        let stays = known(habits, gateway, &[]).await;
        let beside = known(habits, gateway, &[(4, true)]).await;
        println!("{habits:?}, gateway {gateway}: {stays:.3}, beside one that stays {beside:.3}");
        assert!(stays >= least && beside >= least, "{stays} {beside}: {habits:?}, gateway {gateway}");
    }
}

#[tokio::test(start_paused = true)]
async fn drives_of_a_far_end_that_holds_none_up_for_another_are_known_without_being_told_so() {
    at_least(SIDE_BY_SIDE, 0.9, 0.9).await;
    at_least(Habits { tells: false, ..SIDE_BY_SIDE }, 0.75, 0.85).await;
    // It has nothing to wait for: who is away is not answered for.
    at_least(Habits { tells: false, waits: Duration::ZERO, ..SIDE_BY_SIDE }, 0.75, 0.85).await;
    at_least(Habits { tells: false, waits: Duration::ZERO, ..IN_TURN }, 0.75, 0.0).await;
    let each_for_itself = known(SIDE_BY_SIDE, Gateway::NONE, &[]).await;
    assert!(each_for_itself >= 0.9, "{each_for_itself}");
}

#[tokio::test(start_paused = true)]
async fn drives_that_share_four_lines_behind_a_gateway_are_known_and_a_stop_waits_for_two_of_its_line() {
    let habits = Habits { lines: 4, ..IN_TURN };
    at_least(habits, 0.4, 0.3).await;
    at_least(Habits { tells: false, ..habits }, 0.1, 0.2).await;
}

/// Each that goes takes the gateway's wait from all others, and each question to one that is away another one: what the line gives for these
/// is what a stop may meet.
#[tokio::test(start_paused = true)]
async fn behind_a_gateway_that_serves_one_at_a_time_as_much_is_known_as_its_wait_leaves() {
    at_least(IN_TURN, 0.2, 0.2).await;
    at_least(Habits { tells: false, ..IN_TURN }, 0.1, 0.1).await;
    at_least(Habits { waits: 300 * MS, ..IN_TURN }, 0.2, 0.2).await;
    at_least(Habits { waits: 3 * SECOND, ..IN_TURN }, 0.03, 0.03).await;
}
