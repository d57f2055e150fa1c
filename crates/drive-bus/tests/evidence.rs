//! One body of evidence: each defect of a line is found by what was heard, is the only one that is found, and a healthy line has
//! none.

#![cfg(all(feature = "tcp", feature = "unitelway"))]

mod support;

use std::time::Duration;

use drive_bus::{
    Line, LineConfig, Protocol,
    evidence::{Defect, Finding, What},
    exchange::{mbap, rtu},
};
use drive_core::{PortError, serial::SerialSettings};
use drive_sim::{LinkHabits, SimLine, Wiring, models::atv58::Atv58};
use support::{MS, characters};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    time::{Instant, sleep},
};
use tokio_modbus::{Request, client::Client};

const SECOND: Duration = Duration::from_secs(1);

/// What a slave with one register of value 1 answers to this read.
fn proper(request: &[u8]) -> Vec<u8> {
    let words = usize::from(request[4]) * 256 + usize::from(request[5]);
    [&[request[1], (words * 2) as u8][..], &[0, 1].repeat(words)].concat()
}

/// What is given back to the nth request: after which pause, and which bytes.
type Pieces = Vec<(Duration, Vec<u8>)>;

/// A line whose far end gives back what `answer` says, and what is found when slave 3 was read for `time`, every `period`.
async fn found(
    config: LineConfig,
    times: (Duration, Duration),
    answer: impl FnMut(usize, &[u8]) -> Pieces + Send + 'static,
) -> (Line, Vec<Finding>) {
    found_at(&[100], config, times, answer).await
}

/// The same, reading these registers in turn.
async fn found_at(
    registers: &[u16],
    config: LineConfig,
    (period, time): (Duration, Duration),
    mut answer: impl FnMut(usize, &[u8]) -> Pieces + Send + 'static,
) -> (Line, Vec<Finding>) {
    let (ours, mut far) = tokio::io::duplex(4_096);
    let is_rtu = config.protocol == Protocol::Rtu;
    let line = Line::over(ours, LineConfig { offline_after: 0, ..config });
    tokio::spawn(async move {
        let mut bytes = vec![0; 512];
        let mut nth = 0;
        while let Ok(len @ 1..) = far.read(&mut bytes).await {
            sleep(if is_rtu { characters(len) } else { Duration::ZERO }).await;
            for (pause, piece) in answer(nth, &bytes[..len]) {
                sleep(pause).await;
                if far.write_all(&piece).await.is_err() {
                    return;
                }
            }
            nth += 1;
        }
    });
    let begun = Instant::now();
    let mut slave = line.slave(3);
    let mut words = 0;
    let mut registers = registers.iter().cycle();
    while begun.elapsed() < time {
        words = words % 8 + 1;
        let register = *registers.next().unwrap();
        let _ = slave.call(Request::ReadHoldingRegisters(register, words)).await;
        sleep(period).await;
    }
    let findings = line.findings();
    (line, findings)
}

fn rtu_line() -> LineConfig {
    LineConfig { retries: 0, ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT) }
}

/// An answer as it is on the wire, a piece of it at once.
fn whole(request: &[u8]) -> Vec<u8> {
    rtu::frame(request[0], &proper(request)).to_vec()
}

/// Its pieces: after 5 ms and the time of its characters.
fn at_once(frame: Vec<u8>) -> Pieces {
    vec![(5 * MS + characters(frame.len()), frame)]
}

fn defects(findings: &[Finding]) -> Vec<Defect> {
    findings.iter().map(|finding| finding.defect).collect()
}

const TEN: (Duration, Duration) = (Duration::from_millis(100), Duration::from_secs(10));

#[tokio::test(start_paused = true)]
async fn a_healthy_line_that_loses_and_damages_one_answer_in_a_hundred_has_no_finding() {
    let (_, findings) = found(rtu_line(), (20 * MS, 60 * SECOND), |nth, request| {
        let mut frame = whole(request);
        match nth % 100 {
            7 => return Vec::new(),
            40 => frame[3] ^= 4,
            60 => _ = frame.remove(0),
            80 => _ = frame.pop(),
            _ => {}
        }
        at_once(frame)
    })
    .await;
    assert_eq!(findings, []);
}

#[tokio::test(start_paused = true)]
async fn an_answer_that_lacks_its_first_or_last_byte_is_known_by_its_check() {
    let cut = |first: bool| {
        move |_: usize, request: &[u8]| {
            let mut frame = whole(request);
            if first {
                frame.remove(0);
            } else {
                frame.pop();
            }
            at_once(frame)
        }
    };
    let (line, findings) = found(rtu_line(), TEN, cut(true)).await;
    assert_eq!(defects(&findings), [Defect::FirstByteCut]);
    assert!(line.evidence().iter().any(|fact| fact.what == What::WithoutFirstByte && fact.slave == Some(3)));
    let (_, findings) = found(rtu_line(), TEN, cut(false)).await;
    assert_eq!(defects(&findings), [Defect::LastByteCut]);
}

#[tokio::test(start_paused = true)]
async fn bytes_behind_each_answer_are_told_though_every_answer_is_whole() {
    for later in [false, true] {
        let (line, findings) = found(rtu_line(), TEN, move |_, request| {
            let frame = whole(request);
            match later {
                false => at_once([&frame[..], &[0xFF, 0x00]].concat()),
                true => [at_once(frame), vec![(MS, vec![0xFF, 0x00])]].concat(),
            }
        })
        .await;
        assert_eq!(defects(&findings), [Defect::BytesBehind], "{later}");
        assert_eq!(line.stats().slaves[&3].outcomes.timeouts, 0);
    }
}

#[tokio::test(start_paused = true)]
async fn an_answer_that_comes_with_the_next_question_is_not_told_as_one_that_is_late() {
    let mut kept = Vec::new();
    let (_, findings) = found(rtu_line(), (100 * MS, 60 * SECOND), move |_, request| {
        let last = std::mem::replace(&mut kept, whole(request));
        if last.is_empty() { Vec::new() } else { at_once(last) }
    })
    .await;
    assert_eq!(defects(&findings), [Defect::OneAnswerBehind]);
    assert!(findings[0].next().iter().any(|step| step.contains("longer timeout does not help")));
}

#[tokio::test(start_paused = true)]
async fn exceptions_to_everything_name_who_gives_them() {
    for (code, said) in
        [(0x0B, "the gateway had no answer"), (0x06, "it is busy"), (0x02, "no such register")]
    {
        let (_, findings) = found(rtu_line(), TEN, move |_, request| {
            at_once(rtu::frame(request[0], &[request[1] | 0x80, code]).to_vec())
        })
        .await;
        assert_eq!(defects(&findings), [Defect::RefusesAll(code)]);
        assert!(findings[0].to_string().contains(said), "{}", findings[0]);
    }
}

#[tokio::test(start_paused = true)]
async fn it_is_all_that_were_refused_only_where_none_was_lost() {
    for (lost, said) in [(usize::MAX, "all "), (20, " of ")] {
        let (_, findings) = found(rtu_line(), TEN, move |nth, request| match nth % lost {
            7 if lost != usize::MAX => Vec::new(),
            _ => at_once(rtu::frame(request[0], &[request[1] | 0x80, 2]).to_vec()),
        })
        .await;
        assert_eq!(defects(&findings), [Defect::RefusesAll(2)]);
        let (refused, asked) = findings[0].share;
        let told = findings[0].to_string();
        assert_eq!(refused == asked, lost == usize::MAX, "{told}");
        assert!(told.split("questions").next().is_some_and(|begin| begin.contains(said)), "{told}");
    }
}

#[tokio::test(start_paused = true)]
async fn one_that_refuses_some_and_answers_others_is_healthy() {
    let (_, findings) = found(rtu_line(), TEN, |nth, request| match nth % 3 {
        0 => at_once(rtu::frame(request[0], &[request[1] | 0x80, 2]).to_vec()),
        _ => at_once(whole(request)),
    })
    .await;
    assert_eq!(findings, []);
}

#[tokio::test(start_paused = true)]
async fn two_that_answer_differently_are_told_and_a_far_end_that_repeats_is_not_taken_for_them() {
    let second = |differs: bool| {
        move |_: usize, request: &[u8]| {
            let first = whole(request);
            let mut pdu = proper(request);
            if differs {
                pdu[3] ^= 0x10;
            }
            let other = rtu::frame(request[0], &pdu).to_vec();
            let after = 5 * MS + characters(other.len());
            [at_once(first), vec![(after, other)]].concat()
        }
    };
    let (line, findings) = found(rtu_line(), TEN, second(true)).await;
    assert_eq!(defects(&findings), [Defect::TwoAtOneAddress], "{:?}", line.evidence());
    let (_, findings) = found(rtu_line(), TEN, second(false)).await;
    assert_eq!(defects(&findings), [Defect::AnswersTwice]);
}

#[tokio::test(start_paused = true)]
async fn a_master_that_asks_every_four_and_a_half_seconds_is_found_with_its_period() {
    let begun = Instant::now();
    let mut asked = 0;
    let (_, findings) = found(rtu_line(), (100 * MS, 20 * SECOND), move |_, request| {
        let answer = at_once(whole(request));
        if begun.elapsed() < (asked + 1) * 4_500 * MS {
            return answer;
        }
        asked += 1;
        // It asks slave 9, which is not there.
        let others = rtu::frame(9, &[3, 0x0C, 0x81, 0, 2]).to_vec();
        [answer, vec![(30 * MS + characters(8), others)]].concat()
    })
    .await;
    let [Finding { defect: Defect::SecondMaster(Some(every)), .. }] = findings[..] else {
        panic!("{findings:?}")
    };
    assert!(every.abs_diff(4_500 * MS) < 200 * MS, "{every:?}");
}

#[tokio::test(start_paused = true)]
async fn a_line_that_is_silent_from_the_eighth_second_fell_silent_then() {
    let begun = Instant::now();
    let (_, findings) = found(rtu_line(), (100 * MS, 20 * SECOND), move |_, request| {
        if begun.elapsed() < 8 * SECOND { at_once(whole(request)) } else { Vec::new() }
    })
    .await;
    let [Finding { defect: Defect::FellSilent(since), slave: None, .. }] = findings[..] else {
        panic!("{findings:?}")
    };
    assert!(since.abs_diff(12 * SECOND) < SECOND, "{since:?}");
}

#[tokio::test(start_paused = true)]
async fn a_far_end_faster_than_the_speed_is_named_and_heard_once_that_is_set() {
    let at_once = |_: usize, request: &[u8]| vec![(Duration::ZERO, whole(request))];
    // The request's own characters have passed; the answer's have not.
    let paced = |paces| LineConfig { far_end_paces: Some(paces), ..rtu_line() };
    let (_, findings) = found(paced(true), TEN, at_once).await;
    assert_eq!(defects(&findings), [Defect::FarEndFaster]);
    let (line, findings) = found(paced(false), TEN, at_once).await;
    assert_eq!(findings, []);
    assert_eq!(line.stats().slaves[&3].outcomes.timeouts, 0);
}

#[tokio::test(start_paused = true)]
async fn answers_with_the_transaction_number_zero_are_known() {
    let config = LineConfig { protocol: Protocol::Tcp, ..rtu_line() };
    let (_, findings) = found(config, TEN, |_, request| {
        vec![(5 * MS, mbap::frame(0, request[6], &proper(&request[6..])).to_vec())]
    })
    .await;
    assert_eq!(defects(&findings), [Defect::NumberZero]);
}

#[tokio::test(start_paused = true)]
async fn a_link_that_acknowledges_too_late_names_the_setting() {
    let config = LineConfig { protocol: "unitelway".parse().unwrap(), ..rtu_line() };
    let (_, findings) = found(config, (100 * MS, 30 * SECOND), |_, _| vec![(150 * MS, vec![0x06])]).await;
    assert_eq!(defects(&findings), [Defect::LinkTimeout]);
    assert!(findings[0].next()[0].contains("link-timeout"), "{:?}", findings[0].next());
}

/// Altivar 58 at 1, 2 and 3 on UNI-TELWAY, of which the second acknowledges so late, read every second for a minute by a line that
/// waits so long. The manual of the card (VVDED397054) prints no time for an acknowledgement: any is lawful.
async fn with_a_slow_one(late: Duration, protocol: &str) -> (Line, [usize; 3]) {
    let settings: SerialSettings = "19200 8O1".parse().unwrap();
    let simulated =
        SimLine::new(Wiring { protocol: drive_sim::Protocol::UniTelway, ..Wiring::rtu(settings) });
    for address in 1..=3 {
        let drive = simulated.add(address, Atv58::default()).unwrap();
        if address == 2 {
            drive.set_link_habits(LinkHabits { acknowledges_after: Some(late), ..LinkHabits::default() });
        }
    }
    let config = LineConfig { protocol: protocol.parse().unwrap(), ..LineConfig::stream(settings) };
    let line = Line::over(simulated.in_memory(), config);
    let mut read = [0; 3];
    for _ in 0..60 {
        for (address, read) in (1..).zip(&mut read) {
            let request = Request::ReadHoldingRegisters(401, 2);
            *read += usize::from(line.slave(address).call(request).await.is_ok());
        }
        sleep(SECOND).await;
    }
    (line, read)
}

#[tokio::test(start_paused = true)]
async fn one_that_acknowledges_later_than_the_link_waits_is_named_among_others_and_read_when_it_waits() {
    for late in [130, 150, 250] {
        let (line, read) = with_a_slow_one(late * MS, "unitelway").await;
        assert_eq!(read, [60, 0, 60], "{late} ms");
        let [finding] = line.findings()[..] else { panic!("{late} ms: {:?}", line.findings()) };
        assert_eq!((finding.defect, finding.slave), (Defect::LinkTimeout, Some(2)), "{late} ms");
        assert!(finding.next()[0].contains("link-timeout"), "{late} ms");
    }
    let (line, read) = with_a_slow_one(150 * MS, "unitelway,link-timeout=200ms").await;
    assert_eq!((read, line.findings()), ([60; 3], Vec::new()));
    let (line, read) = with_a_slow_one(60 * MS, "unitelway").await;
    assert_eq!((read, line.findings()), ([60; 3], Vec::new()), "within the time that the line waits");
}

#[tokio::test(start_paused = true)]
async fn answers_to_another_master_are_no_second_answers_to_us() {
    let asked = |others: bool| {
        move |nth: usize, request: &[u8]| {
            let mut pdu = proper(request);
            pdu[3] ^= 0x10;
            let other = rtu::frame(3, &pdu);
            let first = at_once(whole(request));
            let his = rtu::frame(3, &[3, 0, 7, 0, request[5]]).to_vec();
            let second = vec![(5 * MS + characters(other.len()), other.to_vec())];
            match (others, nth % 4) {
                (true, 0) => [first, vec![(5 * MS + characters(8), his)], second].concat(),
                (false, 0) => [first, second].concat(),
                _ => first,
            }
        }
    };
    let (_, findings) = found(rtu_line(), TEN, asked(false)).await;
    assert_eq!(defects(&findings), [Defect::TwoAtOneAddress]);
    let (_, findings) = found(rtu_line(), TEN, asked(true)).await;
    assert!(matches!(defects(&findings)[..], [Defect::SecondMaster(_)]), "{findings:?}");
}

#[tokio::test(start_paused = true)]
async fn one_question_that_is_damaged_whenever_it_is_asked_is_two_drives_and_one_bit_of_each_is_a_cable() {
    // What two say at once that differ in the first word of register 200.
    let differ = |_: usize, request: &[u8]| {
        let mut frame = whole(request);
        if request[3] == 200 {
            let last = frame.len() - 1;
            frame[4] ^= 0x41;
            frame[last] ^= 0x17;
        }
        at_once(frame)
    };
    let (_, findings) = found_at(&[100, 100, 200], rtu_line(), (20 * MS, 60 * SECOND), differ).await;
    assert_eq!(defects(&findings), [Defect::TwoAtOneAddress]);
    let (line, findings) = found(rtu_line(), TEN, |nth, request| {
        let mut frame = whole(request);
        let bit = nth * 7 % (frame.len() * 8);
        frame[bit / 8] ^= 1 << (bit % 8);
        at_once(frame)
    })
    .await;
    assert_eq!(findings, [], "{:?}", line.evidence());
    assert!(line.evidence().iter().any(|fact| matches!(fact.what, What::OneBitWrong(_))));
}

#[tokio::test(start_paused = true)]
async fn what_is_kept_is_bounded_and_counts_what_came_lately() {
    let (line, findings) = found(rtu_line(), (Duration::ZERO, 300 * SECOND), |nth, request| {
        // A defect that was mended long ago.
        let mut frame = whole(request);
        if nth < 50 {
            frame.remove(0);
        }
        at_once(frame)
    })
    .await;
    assert_eq!(findings, []);
    assert!(line.evidence().len() <= 64);
}

/// How a read of slave 3 ends to which this comes.
async fn ends(answer: impl FnMut(usize, &[u8]) -> Pieces + Send + 'static) -> PortError {
    let (line, _) = found(rtu_line(), (100 * MS, Duration::ZERO), answer).await;
    let mut slave = line.slave(3);
    PortError::from_modbus(slave.call(Request::ReadHoldingRegisters(100, 1)).await.unwrap_err())
}

#[tokio::test(start_paused = true)]
async fn where_bytes_came_nobody_is_told_that_no_answer_came() {
    let noise = ends(|_, _| vec![(5 * MS, vec![0xFF, 0x00, 0xFE])]).await;
    assert!(noise.to_string().contains("3 bytes came, FF 00 FE: no frame whose check fits"), "{noise}");
    let cut = ends(|_, request| at_once(whole(request)[1..].to_vec())).await;
    assert!(cut.to_string().contains("the answer without its first byte"), "{cut}");
    let silent = ends(|_, _| Vec::new()).await;
    assert!(matches!(silent, PortError::Timeout { .. }), "{silent}");
    let anothers = ends(|_, request| at_once(rtu::frame(4, &proper(request)).to_vec())).await;
    assert!(matches!(anothers, PortError::Timeout { .. }), "{anothers}");
}
