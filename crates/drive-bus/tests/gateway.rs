//! A gateway that serves one request at a time and waits three seconds for a drive that does not answer: the living are
//! read, and a stop waits for one question in vain and no more.

#![cfg(feature = "tcp")]

mod support;

use std::{future::ready, ops::Range, time::Duration};

use drive_bus::{
    Line, LineConfig, Protocol,
    evidence::{Fact, Finding, Over, What},
    stats::SecondConnection as Told,
};
use drive_core::{Class, SerialSettings, Terms};
use drive_sim::{
    Gateway, GatewayInMemory, SecondConnection, SimLine, SimSlave, Wiring, models::atv312::Atv312,
};
use support::{MS, read, write};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, DuplexStream},
    task::JoinSet,
    time::{Instant, sleep, sleep_until, timeout},
};

const SECOND: Duration = Duration::from_secs(1);
const ETA: u16 = 3201;
const CMD: u16 = 8501;
const DRIVES: u8 = 8;
/// How often each drive is asked.
const EVERY: Duration = Duration::from_millis(200);

struct Plant {
    drives: Vec<SimSlave>,
    gateway: GatewayInMemory,
    habits: Gateway,
}

fn plant(habits: Gateway) -> Plant {
    let simulated = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    let add = |address| simulated.add(address, Atv312::under_bus_control()).unwrap();
    let drives = (1..=DRIVES).map(add).collect();
    Plant { drives, gateway: simulated.behind(habits), habits }
}

/// The ways in which gateways tell that nobody answers, and speak.
fn kinds() -> [Gateway; 3] {
    let told = Gateway::default();
    [told, Gateway { tells: false, ..told }, Gateway { rtu: true, tells: false, ..told }]
}

impl Plant {
    fn line(&self) -> Line {
        let protocol = if self.habits.rtu { Protocol::Rtu } else { Protocol::Tcp };
        let config = LineConfig { protocol, ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT) };
        Line::over(
            self.gateway.connect(),
            LineConfig { gateway: Some(drive_bus::Gateway::default()), ..config },
        )
    }

    /// A line that may take a second connection.
    fn line_of_two(&self, gateway: drive_bus::Gateway) -> Line {
        let protocol = if self.habits.rtu { Protocol::Rtu } else { Protocol::Tcp };
        let config = LineConfig { protocol, ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT) };
        let far = self.gateway.clone();
        Line::over_reopened(
            move || ready(Ok(far.connect())),
            LineConfig { gateway: Some(gateway), connections: Some(2), ..config },
        )
    }

    fn drive(&self, address: u8) -> &SimSlave {
        &self.drives[usize::from(address) - 1]
    }

    /// When this drive first got a stop, if it has.
    fn stopped(&self, address: u8) -> Option<Instant> {
        let received = self.drive(address).received();
        received.iter().find(|request| request.pdu[..] == [6, 0x21, 0x35, 0, 0]).map(|request| request.at)
    }
}

/// Asks every drive on its grid until `until`, and counts what the living say from `from` on.
async fn polled(line: &Line, dead: &[u8], from: Instant, until: Instant) -> u32 {
    let mut drives = JoinSet::new();
    for address in 1..=DRIVES {
        let mut slave = line.slave(address).with_terms(Terms::of(Class::Status).within(EVERY).sparing(3));
        let counts = !dead.contains(&address);
        drives.spawn(async move {
            let (mut good, mut next) = (0, Instant::now());
            while next < until {
                sleep_until(next).await;
                let answered = read(&mut slave, ETA, 4).await.is_ok();
                let now = Instant::now();
                good += u32::from(answered && counts && now >= from && now < until);
                next = now.max(next + EVERY);
            }
            good
        });
    }
    drives.join_all().await.into_iter().sum()
}

/// What a loop gets that asks one drive after another and waits `patience` for each, over Modbus TCP.
async fn naive(mut stream: DuplexStream, patience: Duration, dead: &[u8], until: Instant) -> u32 {
    let (mut good, mut transaction) = (0, 0_u16);
    loop {
        for address in 1..=DRIVES {
            transaction += 1;
            let [high, low] = transaction.to_be_bytes();
            stream.write_all(&[high, low, 0, 0, 0, 6, address, 3, 0x0C, 0x81, 0, 4]).await.unwrap();
            let answer = async {
                loop {
                    let mut head = [0; 7];
                    stream.read_exact(&mut head).await.unwrap();
                    let mut pdu = vec![0; usize::from(head[5]) - 1];
                    stream.read_exact(&mut pdu).await.unwrap();
                    if head[..2] == [high, low] {
                        return pdu[0] == 3;
                    }
                }
            };
            let answered = timeout(patience, answer).await.unwrap_or(false);
            if Instant::now() >= until {
                return good;
            }
            good += u32::from(answered && !dead.contains(&address));
        }
    }
}

#[tokio::test(start_paused = true)]
async fn the_living_behind_a_gateway_are_read_at_least_as_often_as_by_a_loop_that_waits() {
    let time = 30 * SECOND;
    let mut loops = Vec::new();
    for patience in [SECOND, 4 * SECOND] {
        let plant = plant(Gateway::default());
        plant.drive(3).mute();
        loops.push(naive(plant.gateway.connect(), patience, &[3], Instant::now() + time).await);
    }
    for habits in kinds() {
        let plant = plant(habits);
        let line = plant.line();
        let died = Instant::now() + 3 * SECOND;
        let polling = polled(&line, &[3], died, died + time);
        let dies = async {
            sleep_until(died).await;
            plant.drive(3).mute();
        };
        let (good, ()) = tokio::join!(polling, dies);
        println!("{habits:?}: {good}, loops {loops:?}, {:?}", line.stats().slaves[&1].outcomes);
        // All there are is 7 * 150.
        assert!(good >= 5 * loops.iter().max().unwrap(), "{good} with {habits:?}, a loop {loops:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_behind_a_gateway_waits_for_one_question_in_vain() {
    for habits in kinds() {
        let mut worst = Duration::ZERO;
        for after in (0..40).map(|n| 173 * MS * n).chain([33 * SECOND]) {
            let plant = plant(habits);
            let line = plant.line();
            let died = Instant::now() + 2 * SECOND;
            let stops = async {
                sleep_until(died).await;
                plant.drive(3).mute();
                sleep(after).await;
                let called = Instant::now();
                let mut slave = line.slave(4).with_terms(Terms::of(Class::Stop));
                let confirmed = write(&mut slave, CMD, 0).await;
                assert!(confirmed.is_ok(), "{confirmed:?}, {after:?} with {habits:?}");
                plant.stopped(4).expect("it is confirmed") - called
            };
            let polling = polled(&line, &[3], died, died + after + 5 * SECOND);
            let (waited, _) = tokio::join!(stops, polling);
            worst = worst.max(waited);
            let bound = line.worst_case_stop();
            assert!(waited <= bound, "{waited:?} of {bound:?}, {after:?} with {habits:?}");
        }
        println!("{habits:?}: a stop waited for {worst:?}");
        assert!(worst <= habits.wait * habits.attempts + SECOND / 2, "{worst:?} with {habits:?}");
    }
}

/// The waits of stops that are given at so many times after three drives have died.
async fn waits(habits: Gateway, times: Range<u32>, line: impl Fn(&Plant) -> Line) -> Vec<Duration> {
    let mut waits = Vec::new();
    for after in times.map(|n| 211 * MS * n) {
        let plant = plant(habits);
        let line = line(&plant);
        let died = Instant::now() + 2 * SECOND;
        let stops = async {
            sleep_until(died).await;
            (1..=3).for_each(|address| plant.drive(address).mute());
            sleep(after).await;
            let (called, bound) = (Instant::now(), line.worst_case_stop());
            let learned = line.stats().worst_case_stop;
            let mut slave = line.slave(6).with_terms(Terms::of(Class::Stop));
            assert!(write(&mut slave, CMD, 0).await.is_ok(), "{after:?} with {habits:?}");
            let waited = plant.stopped(6).expect("it is confirmed") - called;
            assert!(waited <= bound.min(learned), "{waited:?} of {bound:?}, {learned:?}, {after:?}");
            waited
        };
        let polling = polled(&line, &[1, 2, 3], died, died + after + 8 * SECOND);
        let (waited, _) = tokio::join!(stops, polling);
        waits.push(waited);
    }
    waits
}

#[tokio::test(start_paused = true)]
async fn several_that_die_at_once_behind_a_gateway_delay_a_stop_by_no_more_than_the_line_says() {
    for habits in kinds() {
        let worst = waits(habits, 0..60, Plant::line).await.into_iter().max();
        println!("{habits:?}: a stop waited for {worst:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn drives_behind_a_gateway_whose_power_comes_back_are_read_again() {
    for habits in kinds() {
        let plant = plant(habits);
        let line = plant.line();
        let begin = Instant::now();
        let power = async {
            sleep(5 * SECOND).await;
            plant.drives.iter().for_each(SimSlave::mute);
            sleep(60 * SECOND).await;
            plant.drives.iter().for_each(SimSlave::unmute);
        };
        // All of them are back 30 s later: 8 drives, 5 times a second, for 10 s.
        let (good, ()) = tokio::join!(polled(&line, &[], begin + 95 * SECOND, begin + 105 * SECOND), power);
        assert!(good >= 390, "{good} with {habits:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_of_all_is_repeated_to_who_comes_back_however_many_were_in_vain_before_it() {
    for habits in kinds() {
        let plant = plant(habits);
        let line = plant.line();
        polled(&line, &[], Instant::now(), Instant::now() + 5 * SECOND).await;
        plant.drives.iter().for_each(SimSlave::mute);
        let back = Instant::now() + 60 * SECOND;
        let mut stops = JoinSet::new();
        for address in 1..=DRIVES {
            let mut slave = line.slave(address).with_terms(Terms::of(Class::Stop));
            stops.spawn(async move { while write(&mut slave, CMD, 0).await.is_err() {} });
        }
        sleep_until(back).await;
        plant.drives.iter().for_each(SimSlave::unmute);
        stops.join_all().await;
        let waited: Vec<Duration> =
            (1..=DRIVES).filter_map(|address| plant.stopped(address)).map(|at| at - back).collect();
        // One in vain takes the gateway's wait, and the next may wait for four times as long as that.
        let longest = habits.wait * habits.attempts * 5;
        assert!(
            waited.len() == usize::from(DRIVES) && waited.iter().all(|waited| *waited <= longest),
            "{waited:?}"
        );
    }
}

/// The same by a line that may take two connections.
async fn waits_with_two(habits: Gateway) -> Vec<Duration> {
    waits(habits, 1..40, |plant| plant.line_of_two(drive_bus::Gateway::default())).await
}

#[tokio::test(start_paused = true)]
async fn where_a_gateway_grants_two_connections_a_stop_waits_for_one_question_in_vain_whoever_has_died() {
    for habits in kinds() {
        let worst = waits_with_two(habits).await.into_iter().max().unwrap();
        println!("{habits:?}: a stop waited for {worst:?}");
        assert!(worst <= habits.wait * habits.attempts + SECOND / 2, "{worst:?} with {habits:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn where_two_connections_are_served_side_by_side_a_stop_waits_for_no_dead_drive() {
    for habits in kinds() {
        let habits = Gateway { one_line: false, ..habits };
        let mut waits = waits_with_two(habits).await;
        waits.sort();
        println!("{habits:?}: a stop waited for {:?}", waits.last());
        // Only one that is given in the half second in which the first drive's death is not known yet waits for that.
        let longest = waits.last().unwrap();
        assert!(*longest < SECOND, "{waits:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_second_connection_that_is_not_granted_is_given_up_and_told_and_the_living_are_read() {
    let all = [
        (SecondConnection::Refused, "the far end has ended it"),
        (SecondConnection::NeverServed, "it gives no answer"),
        (SecondConnection::EndsTheFirst, "the far end has ended the first for it"),
        (SecondConnection::SilencesTheFirst, "with it the first gave no answer any more"),
    ];
    for (second, why) in all {
        for habits in kinds() {
            let habits = Gateway { second, ..habits };
            let plant = plant(habits);
            let line = plant.line_of_two(drive_bus::Gateway::default());
            let died = Instant::now() + 3 * SECOND;
            let until = died + 60 * SECOND;
            let stops = async {
                sleep_until(died).await;
                plant.drive(3).mute();
                let mut slave = line.slave(4).with_terms(Terms::of(Class::Stop));
                while Instant::now() + 5 * SECOND < until {
                    let called = Instant::now();
                    let confirmed = write(&mut slave, CMD, 0).await;
                    let at = died.elapsed();
                    assert!(
                        confirmed.is_ok(),
                        "{confirmed:?} after {:?}, {at:?} with {habits:?}",
                        called.elapsed()
                    );
                    assert!(called.elapsed() <= line.worst_case_stop(), "{:?} {habits:?}", called.elapsed());
                    sleep(1_700 * MS).await;
                }
            };
            let (good, ()) = tokio::join!(polled(&line, &[3], died, until), stops);
            let stats = line.stats();
            println!("{second:?}, rtu {}: {good} values, opened {}", habits.rtu, stats.opened);
            assert_eq!(stats.far_end.unwrap().second, Told::GivenUp(why), "{habits:?}");
            assert!(stats.opened <= 3, "{} with {habits:?}", stats.opened);
            assert!(good >= 1_000, "{good} with {habits:?}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_overtakes_a_run_word_is_confirmed_only_by_the_stop_behind_that_word() {
    // What is configured is not so: it serves one request of each connection at a time.
    let habits = Gateway { one_line: false, ..Gateway::default() };
    let gateway = drive_bus::Gateway { at_once: Some(2), ..drive_bus::Gateway::default() };
    let plant = plant(habits);
    let line = plant.line_of_two(gateway);
    for address in 1..=DRIVES {
        read(&mut line.slave(address), ETA, 1).await.unwrap();
    }
    plant.drive(3).mute();
    let dead = Terms::of(Class::Status).within(20 * MS);
    assert!(read(&mut line.slave(3).with_terms(dead), ETA, 1).await.is_err());
    // It waits behind the dead drive, and nobody knows what becomes of it.
    let mut run = line.slave(4).with_terms(Terms::of(Class::Command).within(400 * MS));
    assert!(write(&mut run, CMD, 15).await.is_err());
    let words = || -> Vec<u8> {
        let received = plant.drive(4).received();
        let words = received.iter().filter(|request| request.pdu[..3] == [6, 0x21, 0x35]);
        words.map(|request| request.pdu[4]).collect()
    };
    assert_eq!(words(), [0; 0]);
    let called = Instant::now();
    let confirmed = write(&mut line.slave(4).with_terms(Terms::of(Class::Stop)), CMD, 0).await;
    println!("{confirmed:?} after {:?}: {:?}", called.elapsed(), words());
    assert!(confirmed.is_ok());
    assert_eq!(words(), [0, 15, 0], "a stop at once, the run word, and the stop that counts");
    let first = plant.stopped(4).unwrap() - called;
    assert!(first < 100 * MS, "{first:?}");
}

#[tokio::test(start_paused = true)]
async fn a_line_whose_drives_answer_opens_no_second_connection() {
    let plant = plant(Gateway { second: SecondConnection::EndsTheFirst, ..Gateway::default() });
    let line = plant.line_of_two(drive_bus::Gateway::default());
    let begin = Instant::now();
    polled(&line, &[], begin, begin + 20 * SECOND).await;
    let stats = line.stats();
    assert_eq!((stats.opened, stats.far_end.unwrap().second), (1, Told::Unused));
}

#[tokio::test(start_paused = true)]
async fn what_comes_or_does_not_over_the_second_connection_stands_in_the_evidence_with_its_owner() {
    let over_second = |line: &Line| {
        let mut facts = line.evidence();
        facts.retain(|fact| fact.over == Over::Second);
        facts
    };
    for habits in kinds() {
        // It serves the first only: who is asked over the second is silent there, and is not called dead for it.
        let plant = plant(Gateway { second: SecondConnection::NeverServed, ..habits });
        let line = plant.line_of_two(drive_bus::Gateway::default());
        let died = Instant::now() + 3 * SECOND;
        let stop = async {
            sleep_until(died).await;
            plant.drive(3).mute();
            sleep(SECOND).await;
            write(&mut line.slave(4).with_terms(Terms::of(Class::Stop)), CMD, 0).await
        };
        let (_, stopped) = tokio::join!(polled(&line, &[3], died, died + 20 * SECOND), stop);
        assert!(stopped.is_ok(), "{stopped:?} {habits:?}");
        let facts = over_second(&line);
        assert!(
            facts.iter().any(|fact| fact.what == What::Silence && fact.slave.is_some()),
            "{facts:?} {habits:?}"
        );
        let findings = line.findings();
        let living = |finding: &Finding| finding.slave != Some(3);
        assert!(!findings.iter().any(living), "{findings:?} {habits:?}");

        // It serves both, and says each answer twice.
        let plant = self::plant(Gateway { doubles_after: Some(30 * MS), one_line: false, ..habits });
        let line = plant.line_of_two(drive_bus::Gateway::default());
        for address in 1..=DRIVES {
            let _ = read(&mut line.slave(address), ETA, 1).await;
        }
        plant.drive(3).mute();
        let _ = read(&mut line.slave(3).with_terms(Terms::of(Class::Status).within(20 * MS)), ETA, 1).await;
        for _ in 0..3 {
            let _ = write(&mut line.slave(4).with_terms(Terms::of(Class::Stop)), CMD, 0).await;
            sleep(100 * MS).await;
        }
        let facts = over_second(&line);
        let again = |fact: &Fact| fact.slave == Some(4) && fact.what == What::Doubled;
        assert!(facts.iter().any(again), "{facts:?} {:?} {habits:?}", line.stats().far_end);
    }
}

/// mbusd takes twice as long as for a read until it refuses what it does not pass on.
#[tokio::test(start_paused = true)]
async fn a_question_that_takes_longer_than_others_is_asked_twice_and_not_until_its_attempts_are_over() {
    let plant = plant(Gateway::default());
    // It is known to do one thing at a time, so that nothing is sent before what it still owes has come.
    let gateway = drive_bus::Gateway { at_once: Some(1), wait: Some(2 * SECOND) };
    let config = LineConfig::stream(SerialSettings::MODBUS_DEFAULT);
    let config = LineConfig { protocol: Protocol::Tcp, response_timeout: 200 * MS, ..config };
    let line = Line::over(plant.gateway.connect(), LineConfig { gateway: Some(gateway), ..config });
    let drive = plant.drive(1);
    drive.set_turnaround(Some(100 * MS));
    let mut slave = line.slave(1);
    for _ in 0..50 {
        read(&mut slave, ETA, 1).await.unwrap();
    }
    drive.set_turnaround(Some(250 * MS));
    let before = drive.all_requests();
    timeout(10 * SECOND, read(&mut slave, ETA, 1)).await.expect("it ends").unwrap();
    let asked = drive.all_requests() - before;
    assert!(asked <= 2, "asked {asked} times");
}
