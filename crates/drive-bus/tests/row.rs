//! A row of reads of one word each, of which one answer comes twice: each would take the answer of the one before.

mod support;

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
    time::Duration,
};

use drive_bus::{Line, Slave};
use drive_core::Port;
use support::{MS, doubling, read};
use tokio::time::sleep;

/// How much later the far end says one of its answers once more.
const AGAIN: Duration = Duration::from_millis(6);

/// A far end: what its registers say, how often it was asked, and which of its answers it says twice.
#[derive(Default)]
struct FarEnd {
    words: BTreeMap<u16, u16>,
    asked: usize,
    doubles: Option<usize>,
}

/// A line with such a far end.
fn line(words: &[(u16, u16)]) -> (Line, Slave, Arc<Mutex<FarEnd>>) {
    let far_end =
        Arc::new(Mutex::new(FarEnd { words: words.iter().copied().collect(), ..FarEnd::default() }));
    let this = Arc::clone(&far_end);
    let (line, slave) = doubling::line(move |register| {
        let mut far_end = this.lock().unwrap();
        far_end.asked += 1;
        let twice = far_end.doubles == Some(far_end.asked - 1);
        (far_end.words[&register], twice.then_some(AGAIN))
    });
    (line, slave, far_end)
}

/// Reads these registers one after the other, and gives those that were told wrong and are not withdrawn behind the row.
async fn wrong_in_a_row(slave: &mut Slave, words: &[(u16, u16)]) -> Vec<(u16, u16)> {
    let mut wrong = Vec::new();
    for &(register, word) in words {
        let told = read(slave, register, 1).await.expect("it answers")[0];
        if told != word {
            wrong.push((register, told, slave.asked_at()));
        }
    }
    wrong.retain(|(_, _, asked_at)| slave.retracted() != *asked_at);
    wrong.into_iter().map(|(register, told, _)| (register, told)).collect()
}

/// What an Altivar 21 says in FD01, FD00, FE03, FE45, FE46, FE02 and FA00 while its motor runs at 50 Hz.
const RUNS: [(u16, u16); 7] = [
    (0xFD01, 0x6400),
    (0xFD00, 5_000),
    (0xFE03, 6_213),
    (0xFE45, 2),
    (0xFE46, 4),
    (0xFE02, 5_000),
    (0xFA00, 0xC400),
];
/// The same while it stands.
const STANDS: [(u16, u16); 7] =
    [(0xFD01, 0x4000), (0xFD00, 0), (0xFE03, 0), (0xFE45, 2), (0xFE46, 4), (0xFE02, 5_000), (0xFA00, 0xC000)];

/// For each answer of the third row that comes twice, behind two rows of `before`: what was told wrong in it and the two behind.
async fn wrong_beside_a_first_double(
    before: &[(u16, u16)],
    then: &[(u16, u16)],
) -> Vec<(usize, Vec<(u16, u16)>)> {
    let mut all = Vec::new();
    for place in 0..then.len() {
        let (_line, mut slave, far_end) = line(before);
        for _ in 0..2 {
            assert_eq!(wrong_in_a_row(&mut slave, before).await, []);
            sleep(300 * MS).await;
        }
        {
            let mut far_end = far_end.lock().unwrap();
            far_end.words = then.iter().copied().collect();
            far_end.doubles = Some(far_end.asked + place);
        }
        for _ in 0..3 {
            let wrong = wrong_in_a_row(&mut slave, then).await;
            if !wrong.is_empty() {
                all.push((place, wrong));
            }
        }
    }
    all
}

#[tokio::test(start_paused = true)]
async fn the_first_answer_that_comes_twice_puts_no_row_of_reads_out_of_step() {
    assert_eq!(wrong_beside_a_first_double(&RUNS, &RUNS).await, []);
    assert_eq!(wrong_beside_a_first_double(&STANDS, &STANDS).await, []);
}

#[tokio::test(start_paused = true)]
async fn nor_where_what_it_says_changes_in_that_very_row() {
    // What says once more what it said, and another too, is told at once: the next one shows whether it was its own, and else
    // withdraws it.
    let [status, output, current, rest @ ..] = STANDS;
    for changed in [
        [(status.0, 0x6400), output, current],
        [status, output, (current.0, 1_250)],
        [(status.0, 0x6400), (output.0, 150), (current.0, 1_250)],
    ] {
        let then = [&changed[..], &rest[..]].concat();
        assert_eq!(wrong_beside_a_first_double(&STANDS, &then).await, [], "{changed:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn what_is_read_for_the_first_time_is_asked_once_though_all_of_it_says_the_same() {
    let words: Vec<(u16, u16)> = (1..=100).map(|register| (register, 0)).collect();
    let (_line, mut slave, far_end) = line(&words);
    assert_eq!(wrong_in_a_row(&mut slave, &words).await, []);
    assert_eq!(far_end.lock().unwrap().asked, words.len());
}

#[tokio::test(start_paused = true)]
async fn a_row_that_says_what_it_said_and_one_that_says_something_new_are_asked_once() {
    for words in [&STANDS[..4], &RUNS[..4]] {
        let (line, mut slave, far_end) = line(words);
        wrong_in_a_row(&mut slave, words).await;
        let first = far_end.lock().unwrap().asked;
        for round in 1..=20_u16 {
            sleep(100 * MS).await;
            // A load that is never twice the same, of a motor that runs.
            if words[0].1 == RUNS[0].1 {
                far_end.lock().unwrap().words.insert(0xFE03, 6_213 + round);
            }
            for (register, _) in words {
                read(&mut slave, *register, 1).await.expect("it answers");
            }
        }
        let asked = far_end.lock().unwrap().asked - first;
        assert_eq!(asked, 20 * words.len(), "{:?}", line.stats().slaves[&1]);
        assert_eq!(line.stats().slaves[&1].outcomes.mismatches, 0);
    }
}

#[tokio::test(start_paused = true)]
async fn a_read_that_says_once_more_what_another_did_is_told() {
    let (_line, mut slave, far_end) = line(&RUNS);
    assert_eq!(wrong_in_a_row(&mut slave, &RUNS).await, []);
    // What was still to come has come.
    sleep(1_100 * MS).await;
    let once = far_end.lock().unwrap().asked;
    // The output reaches what the reference is.
    far_end.lock().unwrap().words.insert(0xFD00, 4_998);
    assert_eq!(read(&mut slave, 0xFD00, 1).await.unwrap(), [4_998]);
    assert_eq!(read(&mut slave, 0xFE02, 1).await.unwrap(), [5_000]);
    far_end.lock().unwrap().words.insert(0xFD00, 5_000);
    assert_eq!(read(&mut slave, 0xFD00, 1).await.unwrap(), [5_000]);
    assert_eq!(far_end.lock().unwrap().asked - once, 4, "the last alone was asked twice");
}
