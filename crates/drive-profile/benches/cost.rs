//! What a drive from a file costs: how long a thousand profiles take to be read and checked, and what a status costs beside that of the
//! same drive written by hand, in processor time and in exchanges.
//!
//! `cargo bench -p drive-profile --bench cost`; goals: 1 s, 1.2, and not one exchange more.

use std::{
    hint::black_box,
    sync::Arc,
    time::{Duration, Instant},
};

use drive_core::{Drive, SlaveAddress};
use drive_families::{Family, Options};
use drive_profile::{definition, read, shipped};
use drive_testing::words::Words;

const PROFILES: usize = 1_000;
const STATUSES: u32 = 20_000;
const ROUNDS: usize = 25;

const ATV312: &str = include_str!("../../../tests/profiles/atv312.toml");
const OMRON: &str = include_str!("../../../tests/profiles/3g3ev.toml");

/// `ETA` of an Altivar that runs by the bus with its output at the reference, `rFr`, `FrH`, `LCr`, `OTr` and `ETI` (BBV51701 p. 21, 22).
const ALTIVAR: &[(u16, u16)] =
    &[(3201, 0x0637), (3202, 300), (3203, 300), (3204, 21), (3205, 40), (3206, 0x4010), (8501, 0x000F)];
/// 0020h, 0023h, 0024h and 002Ch of a 3G3EV that runs forward by the bus (§5.2).
const RUNNING: &[(u16, u16)] =
    &[(0x0001, 1), (0x0020, 0x0005), (0x0023, 300), (0x0024, 300), (0x002C, 0x0045)];

fn main() {
    load();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().expect("a runtime");
    runtime.block_on(async {
        poll("Altivar 312", Family::ATV312, ATV312, ALTIVAR).await;
        poll("3G3EV", Family::OMRON_3G3EV, OMRON, RUNNING).await;
    });
}

fn load() {
    let texts: Vec<String> = (0..PROFILES)
        .map(|number| {
            let (_, text) = shipped::TEXTS[number % shipped::TEXTS.len()];
            text.replacen("key = \"", &format!("key = \"n{number}-"), 1)
        })
        .collect();
    let began = Instant::now();
    let read: Vec<_> = texts.iter().map(|text| read(text).map(|profile| profile.key().to_owned())).collect();
    let took = began.elapsed();
    let right = read.iter().filter(|profile| profile.is_ok()).count();
    println!("{right} of {PROFILES} profiles read and checked in {took:?} (goal 1 s)");
}

/// The same words, read by hand and by file.
async fn poll(name: &str, by_hand: Family, text: &str, words: &[(u16, u16)]) {
    let profile = read(text).unwrap_or_else(|refusals| panic!("{refusals}"));
    let by_file = Family::new(definition(&Arc::new(profile)));
    let (mut hand, mut file) = (Duration::MAX, Duration::MAX);
    // In turns, and the best of each: what else the machine does meanwhile is no cost of either.
    for _ in 0..ROUNDS {
        hand = hand.min(measure(by_hand, words).await);
        file = file.min(measure(by_file, words).await);
    }
    let exchanges = |family: Family| family.capabilities().status_exchanges;
    println!(
        "{name}: a status by hand {hand:?} in {} exchanges, by file {file:?} in {}: {:.2} times the processor time (goal 1.2)",
        exchanges(by_hand),
        exchanges(by_file),
        file.as_secs_f64() / hand.as_secs_f64()
    );
}

/// The mean time of a status.
async fn measure(family: Family, words: &[(u16, u16)]) -> Duration {
    let slave = SlaveAddress::try_from(1).expect("it is one");
    let mut drive = opened(family, slave, words);
    drive.status().await.expect("it answers");
    let began = Instant::now();
    for _ in 0..STATUSES {
        black_box(drive.status().await).expect("it answers");
    }
    began.elapsed() / STATUSES
}

fn opened(family: Family, slave: SlaveAddress, words: &[(u16, u16)]) -> Box<dyn Drive> {
    family.open_with(Words::new(family.capabilities(), words), slave, &Options::default())
}
