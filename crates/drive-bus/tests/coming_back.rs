//! Drives that come back, and drives that were never there: 31 of them at 19200 8E1, behind a slave program that shares
//! nothing with the line but the wire. All in virtual time.

use std::{
    collections::BTreeMap,
    ops::RangeInclusive,
    sync::{Arc, Mutex},
    time::Duration,
};

use drive_bus::{Line, LineConfig};
use drive_core::serial::SerialSettings;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, DuplexStream},
    task::JoinHandle,
    time::{Instant, sleep, sleep_until},
};
use tokio_modbus::{Request, Response, client::Client};

const DRIVES: u8 = 31;
const WORDS: u8 = 8;

/// Eleven bits at 19200 bit/s.
const CHARACTER: Duration = Duration::from_nanos(572_917);
/// Request of 8 characters, 5 ms, answer of 21, and 3.5 of silence.
const SLOT: Duration = Duration::from_micros(8 * 573 + 5_000 + 21 * 573 + 2_006);
/// A question that nobody answers: 8 characters, the 50 ms that a line waits at the least as delivered, the characters of
/// the answer that does not come, and the silence.
const SHORT_QUESTION: Duration = Duration::from_micros(8 * 573 + 50_000 + 21 * 573 + 2_006);

/// Which drives have power, how long each thinks, and what was asked of whom.
#[derive(Clone)]
struct Plant(Arc<Mutex<State>>);

struct State {
    powered: [bool; 256],
    /// What they need, and for each word besides, where that is not 5 ms.
    slow: BTreeMap<u8, (Duration, Duration)>,
    asked: Vec<(Instant, u8, bool)>,
}

impl Plant {
    fn new(powered: impl IntoIterator<Item = u8>) -> Self {
        let mut state = State { powered: [false; 256], slow: BTreeMap::new(), asked: Vec::new() };
        for address in powered {
            state.powered[usize::from(address)] = true;
        }
        Self(Arc::new(Mutex::new(state)))
    }

    fn power(&self, addresses: impl IntoIterator<Item = u8>, on: bool) {
        let mut state = self.0.lock().unwrap();
        for address in addresses {
            state.powered[usize::from(address)] = on;
        }
    }

    /// Questions that nobody answered, between two times.
    fn in_vain(&self, from: Instant, to: Instant) -> usize {
        let state = self.0.lock().unwrap();
        state.asked.iter().filter(|(at, _, answered)| !answered && (from..to).contains(at)).count()
    }

    /// The slaves' end of the wire: whole requests in, whole answers out when their last character would have come.
    async fn serve(self, mut wire: DuplexStream) {
        let mut frame = [0; 8];
        while wire.read_exact(&mut frame).await.is_ok() {
            let began = Instant::now();
            assert_eq!(crc(&frame[..6]).to_le_bytes(), frame[6..], "a broken request");
            let address = frame[0];
            let (answers, thinks) = {
                let mut state = self.0.lock().unwrap();
                let answers = state.powered[usize::from(address)];
                state.asked.push((began, address, answers));
                let usual = (Duration::from_millis(5), Duration::ZERO);
                let (thinks, each) = state.slow.get(&address).copied().unwrap_or(usual);
                (answers, thinks + each * frame[5].into())
            };
            if !answers {
                continue;
            }
            assert_eq!(frame[1], 3, "only reads are asked here");
            let words = frame[5];
            let mut answer = vec![address, 3, 2 * words];
            answer.extend((0..words).flat_map(|word| [address, word]));
            answer.extend(crc(&answer).to_le_bytes());
            sleep_until(began + CHARACTER * 8 + thinks + CHARACTER * answer.len() as u32).await;
            if wire.write_all(&answer).await.is_err() {
                return;
            }
        }
    }
}

/// CRC-16 with the polynomial A001h (MODBUS over Serial Line V1.02, 6.2.2).
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xA001 } else { crc >> 1 })
    })
}

/// Everybody's statuses: when each drive gave one.
#[derive(Clone, Default)]
struct Seen(Arc<Mutex<BTreeMap<u8, Vec<Instant>>>>);

impl Seen {
    fn first_since(&self, address: u8, since: Instant) -> Option<Instant> {
        self.0.lock().unwrap().get(&address)?.iter().find(|at| **at >= since).copied()
    }

    fn count(&self, addresses: RangeInclusive<u8>, from: Instant, to: Instant) -> usize {
        let seen = self.0.lock().unwrap();
        let times = addresses.filter_map(|address| seen.get(&address)).flatten();
        times.filter(|at| (from..to).contains(at)).count()
    }
}

/// A line on which every drive is asked for its status as fast as it answers, and when it does not, as soon as the line
/// lets.
fn polled(plant: &Plant) -> (Line, Seen, Vec<JoinHandle<()>>) {
    let (ours, theirs) = tokio::io::duplex(512);
    let line = Line::over(ours, LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
    let seen = Seen::default();
    let mut tasks = vec![tokio::spawn(plant.clone().serve(theirs))];
    for address in 1..=DRIVES {
        let (mut slave, seen) = (line.slave(address), seen.clone());
        tasks.push(tokio::spawn(async move {
            loop {
                match slave.call(Request::ReadHoldingRegisters(100, WORDS.into())).await {
                    Ok(answer) => {
                        let words = (0..WORDS).map(|word| u16::from_be_bytes([address, word])).collect();
                        assert_eq!(answer, Ok(Response::ReadHoldingRegisters(words)));
                        seen.0.lock().unwrap().entry(address).or_default().push(Instant::now());
                    }
                    Err(_) => sleep(Duration::from_millis(50)).await,
                }
            }
        }));
    }
    (line, seen, tasks)
}

const SECOND: Duration = Duration::from_secs(1);

/// What a full line carries in so many seconds, all drives alive. The paused clock of tokio goes by whole milliseconds, so
/// that it is a little less than the wire would carry.
async fn full_rate(seen: &Seen, seconds: u32) -> usize {
    sleep(5 * SECOND).await;
    let from = Instant::now();
    sleep(20 * SECOND).await;
    seen.count(1..=DRIVES, from, Instant::now()) * seconds as usize / 20
}

#[tokio::test(start_paused = true)]
async fn with_twenty_that_never_answer_the_living_are_seen_within_two_sweeps_and_a_short_question_each() {
    let last: Vec<u8> = (1..=11).collect();
    let first: Vec<u8> = (21..=31).collect();
    let mixed: Vec<u8> = (1..=DRIVES).filter(|address| address % 3 == 2).take(11).chain([31]).collect();
    for living in [last, first, mixed] {
        let plant = Plant::new(living.iter().copied());
        let start = Instant::now();
        let (_line, seen, tasks) = polled(&plant);
        sleep(60 * SECOND).await;
        let dead = u32::from(DRIVES) - living.len() as u32;
        let bound = SLOT * 2 * living.len() as u32 + SHORT_QUESTION * dead;
        for address in &living {
            let took = seen.first_since(*address, start).unwrap() - start;
            assert!(took <= bound, "drive {address} of {living:?}: {took:?} of {bound:?}");
        }
        tasks.iter().for_each(JoinHandle::abort);
    }
}

#[tokio::test(start_paused = true)]
async fn twenty_drives_are_back_five_seconds_after_their_power_and_nobody_had_to_wait_for_them() {
    for lost in [1..=20, 12..=31, 6..=25] {
        let plant = Plant::new(1..=DRIVES);
        let (_line, seen, tasks) = polled(&plant);
        let alone = full_rate(&seen, 5).await;
        plant.power(lost.clone(), false);
        sleep(20 * SECOND).await;
        // What the living get of the line while the others are away.
        for _ in 0..24 {
            let from = Instant::now();
            sleep(5 * SECOND).await;
            let answered = seen.count(1..=DRIVES, from, Instant::now());
            assert!(answered * 100 >= alone * 90, "{lost:?}: {answered} of {alone} in five seconds");
        }
        plant.power(lost.clone(), true);
        let on = Instant::now();
        sleep(15 * SECOND).await;
        for address in lost.clone() {
            let took = seen.first_since(address, on).map(|at| at - on);
            assert!(took.is_some_and(|took| took <= 5 * SECOND), "drive {address} of {lost:?}: {took:?}");
        }
        tasks.iter().for_each(JoinHandle::abort);
    }
}

#[tokio::test(start_paused = true)]
async fn one_that_comes_alone_among_twenty_is_found_within_twelve_seconds() {
    for known in [true, false] {
        let plant = Plant::new(1..=11);
        if known {
            plant.power(12..=DRIVES, true);
        }
        let (_line, seen, tasks) = polled(&plant);
        let alone = full_rate(&seen, 13).await;
        plant.power(12..=DRIVES, false);
        sleep(60 * SECOND).await;
        for address in [12, 19, 25, 31] {
            plant.power([address], true);
            let on = Instant::now();
            sleep(13 * SECOND).await;
            let took = seen.first_since(address, on).map(|at| at - on);
            assert!(took.is_some_and(|took| took <= 12 * SECOND), "drive {address}, {known}: {took:?}");
            let living = seen.count(1..=11, on, Instant::now());
            let found = seen.count(12..=DRIVES, on, Instant::now());
            assert!((living + found) * 100 >= alone * 90, "{living} and {found} of {alone}");
            plant.power([address], false);
            sleep(20 * SECOND).await;
        }
        tasks.iter().for_each(JoinHandle::abort);
    }
}

#[tokio::test(start_paused = true)]
async fn the_share_of_the_probes_grows_with_the_number_of_the_lost_and_three_cost_two_per_cent() {
    let mut before = 0.0;
    for lost in [1_u8, 3, 8, 14, 20] {
        let plant = Plant::new(1..=DRIVES);
        let (_line, seen, tasks) = polled(&plant);
        let alone = full_rate(&seen, 300).await as f64;
        plant.power(DRIVES - lost + 1..=DRIVES, false);
        sleep(60 * SECOND).await;
        let from = Instant::now();
        sleep(300 * SECOND).await;
        let answered = seen.count(1..=DRIVES, from, Instant::now()) as f64;
        let share = 1.0 - answered / alone;
        let probes = plant.in_vain(from, Instant::now());
        assert!(probes >= 20, "{lost} lost, {probes} probes");
        assert!(share <= 0.10, "{lost} lost: {share}");
        if lost <= 3 {
            assert!(1.0 / (1.0 - share) <= 1.02, "{lost} lost: {share}");
        }
        assert!(share >= before - 0.002, "{lost} lost: {share} after {before}");
        println!("{lost} lost: {share:.4} of the line, {probes} questions in vain in five minutes");
        before = share;
        tasks.iter().for_each(JoinHandle::abort);
    }
}

#[tokio::test(start_paused = true)]
async fn a_slow_drive_among_fast_ones_is_found_all_the_same_and_so_is_one_that_is_slow_with_many_words() {
    for slow in
        [(300, 0), (5, 40)].map(|(all, each)| (Duration::from_millis(all), Duration::from_millis(each)))
    {
        let plant = Plant::new(1..=10);
        plant.0.lock().unwrap().slow.insert(10, slow);
        let start = Instant::now();
        let (_line, seen, tasks) = polled(&plant);
        sleep(300 * SECOND).await;
        assert!(seen.first_since(10, start).is_some(), "{slow:?}, with 21 dead beside it");
        let from = Instant::now();
        sleep(60 * SECOND).await;
        assert!(seen.count(10..=10, from, Instant::now()) > 10, "{slow:?}, and it stays");
        tasks.iter().for_each(JoinHandle::abort);
    }
}

#[tokio::test(start_paused = true)]
async fn the_bound_of_a_stop_follows_what_the_line_has_learned() {
    let plant = Plant::new(1..=DRIVES);
    let (line, _seen, _tasks) = polled(&plant);
    let configured = LineConfig::stream(SerialSettings::MODBUS_DEFAULT).worst_case_stop(5, 2 + 2 * 8);
    sleep(5 * SECOND).await;
    let learned = line.stats().worst_case_stop;
    // One exchange with a drive that stays silent, at the 50 ms that a line waits at the least, and the silence.
    assert!(learned <= SHORT_QUESTION + CHARACTER * 4, "{learned:?}");
    assert!(learned >= SLOT && learned < configured / 5, "{learned:?} of {configured:?}");
}
