//! Healthy lines: whatever drives, at whatever speed, with the noise that every line has, get no verdict.

use drive_sim::{Defects, Noise};

use super::*;

/// A random line: up to 12 drives of any families, at a speed and in a format that all of them have, with as much noise
/// as damages one question in two hundred at the most.
fn line(seed: u64) -> Bench {
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    let families: Vec<Family> =
        (0..=random.below(12)).map(|_| Family::BUILT_IN[random.below(Family::BUILT_IN.len())]).collect();
    let speeds = [9_600, 19_200, 38_400].into_iter();
    let formats = [CharacterFormat::F8N1, CharacterFormat::F8E1, CharacterFormat::F8O1];
    let possible: Vec<SerialSettings> = speeds
        .flat_map(|baud| formats.map(|format| SerialSettings::new(baud, format).unwrap()))
        .filter(|serial| {
            let fits = |family: &Family| {
                let able = family.capabilities();
                able.speeds.contains(&serial.baud()) && able.formats.contains(&serial.format())
            };
            families.iter().all(fits)
        })
        .collect();
    let serial = possible.get(random.below(possible.len().max(1))).copied();
    // 3G3EV and Altivar 28 share no format with some: then all are of the first family.
    let (serial, families) = match serial {
        Some(serial) => (serial, families),
        None => (families[0].capabilities().factory, vec![families[0]; families.len()]),
    };
    let bench = Bench::at(serial, &families);
    for (machine, family) in bench.machines.iter().zip(&families) {
        let turnaround = Duration::from_micros(3_000 + random.below(25_000) as u64);
        // A 3G3EV waits as long as its n65 says.
        if *family != Family::OMRON_3G3EV {
            machine.set_turnaround(Some(turnaround));
        }
    }
    let burst = Duration::from_micros(200 + random.below(1_500) as u64);
    // So many bursts that up to one of two hundred questions with their answers, of 20 characters, is hit.
    let most = burst.as_nanos() * 5_000 / serial.characters(20).as_nanos();
    let share = u32::try_from(random.below(usize::try_from(most).unwrap().max(1))).unwrap();
    bench.line.set_defects(Defects { noise: Some(Noise { share, burst, seed }), ..Defects::default() });
    bench
}

struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 >> 11).unwrap() % bound
    }
}

/// Looks at so many lines, and tells those that were judged wrongly.
async fn judged(seeds: std::ops::Range<u64>) -> String {
    let mut wrong = String::new();
    for seed in seeds {
        let bench = line(seed);
        let seen = bench.seen(Duration::from_secs(20)).await;
        if !judge(&seen).is_empty() {
            wrong.push_str(&format!("\n=== seed {seed}\n{}", told(&seen)));
        }
    }
    wrong
}

/// `DRIVED_HEALTHY_LINES` says how many.
#[tokio::test(start_paused = true)]
async fn a_healthy_line_with_some_noise_gets_no_verdict() {
    let runs = std::env::var("DRIVED_HEALTHY_LINES").ok().and_then(|runs| runs.parse().ok()).unwrap_or(60);
    let wrong = judged(0..runs).await;
    assert!(wrong.is_empty(), "{wrong}");
}
