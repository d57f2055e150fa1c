//! Lines with one drive at each address, on which nobody is named twice.

use drive_sim::{Cast, Defects, Exception, Model, Noise, Observation, Panel, Rules, SecondMaster};

use super::{two::verdict, *};
use crate::testing::{Change, Through};

const MS: Duration = Duration::from_millis(1);

/// A line with an Altivar 312 at 5.
fn one() -> (SimLine, SimSlave) {
    let simulated = SimLine::new(Wiring::rtu(serial("19200 8N1")));
    let drive = simulated.add_boxed(5, simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap()).unwrap();
    (simulated, drive)
}

/// What is found at 3 to 7 where something is done to all that the slaves say.
async fn through(change: Change) -> Vec<Find> {
    let (simulated, _) = one();
    let through = Through(simulated, change);
    let open = async |config: LineConfig| Ok(Line::over(through.stream(config.serial), config));
    scanned_over(open, &at_one("19200 8N1", 3..=7)).await
}

fn assert_one(finds: &[Find], world: &str) {
    let [Find { answer: Answer::Slave(alike), step, .. }] = finds else { panic!("{world}: {finds:?}") };
    assert_eq!(step.slave.number(), 5, "{world}");
    let [Likeness { family, certain: true, .. }] = alike[..] else { panic!("{world}: {alike:?}") };
    assert_eq!(family, Family::ATV312, "{world}");
}

fn assert_nobody_twice(finds: &[Find], world: &str) {
    assert!(!finds.iter().any(|find| matches!(find.answer, Answer::Two { .. })), "{world}: {finds:?}");
}

#[tokio::test(start_paused = true)]
async fn bytes_before_each_answer_are_no_second_drive() {
    let worlds: [(&str, Change); 4] = [
        ("00", |_, said| said.insert(0, 0)),
        ("00 00", |_, said| _ = said.splice(0..0, [0, 0])),
        ("FF", |_, said| said.insert(0, 0xFF)),
        ("00 now and then", |at, said| {
            if at.as_millis() % 3 == 0 {
                said.insert(0, 0);
            }
        }),
    ];
    for (world, change) in worlds {
        assert_one(&through(change).await, world);
    }
}

/// "Read Device Identification" is a function of each ATV 312: an older Altivar has the same words, and refuses that one (01h).
#[tokio::test(start_paused = true)]
async fn of_a_drive_that_refuses_to_say_its_name_it_is_said_that_it_may_be_another() {
    let finds = through(|_, said| {
        if said.get(1) == Some(&0x2B) {
            *said = vec![5, 0xAB, 0x01, 0xDF, 0x31];
        }
    });
    let [Find { answer, step, .. }] = &finds.await[..] else { panic!("one answers") };
    let told = answer.words();
    let doubt = "it does not say its name (function 43/14), as each atv312 does by its manual";
    assert!(told.starts_with("likely atv312") && told.contains(doubt), "{told}");
    let kept = crate::scan::save::section("bench", "/dev/ttyS0", &[(step.slave, answer)]);
    assert!(kept.contains("# A GUESS") && kept.contains(doubt), "{kept}");
}

#[tokio::test(start_paused = true)]
async fn bytes_behind_each_answer_are_no_second_drive() {
    let worlds: [(&str, Change); 4] = [
        ("00", |_, said| said.push(0)),
        ("FF 00", |_, said| said.extend([0xFF, 0])),
        ("FF FF FF FF FF", |_, said| said.extend([0xFF; 5])),
        ("FE now and then", |at, said| {
            if at.as_millis() % 3 == 0 {
                said.push(0xFE);
            }
        }),
    ];
    for (world, change) in worlds {
        assert_one(&through(change).await, world);
    }
}

#[tokio::test(start_paused = true)]
async fn a_byte_that_is_cut_is_no_second_drive() {
    let worlds: [(&str, Change); 2] =
        [("first", |_, said| _ = said.remove(0)), ("last", |_, said| _ = said.pop())];
    for (world, change) in worlds {
        let finds = through(change).await;
        let [Find { answer: Answer::Damaged(why), .. }] = &finds[..] else { panic!("{world}: {finds:?}") };
        assert!(why.contains(world), "{why}");
    }
}

/// An energy meter: 03 and 04 in registers 0 to 199, exception 02 above and 01 for every function but these, or but these and 08.
struct Meter(Rules);

impl Meter {
    const fn new(diagnostics: &'static [u16]) -> Self {
        Self(Rules {
            read_holding: 125,
            read_input: 125,
            write_single: false,
            write_multiple: 0,
            diagnostics,
            event_counter: false,
            broadcast: &[],
            turnaround: Duration::from_millis(5),
        })
    }
}

impl Model for Meter {
    fn rules(&self) -> &Rules {
        &self.0
    }
    fn read(&mut self, address: u16) -> Result<u16, Exception> {
        // Floats of 230 V.
        let word = if address.is_multiple_of(2) { 0x4366 } else { 0x8000 };
        if address < 200 { Ok(word) } else { Err(Exception::ILLEGAL_ADDRESS) }
    }
    fn write(&mut self, _: u16, _: u16, _: Cast) -> Result<(), Exception> {
        Err(Exception::ILLEGAL_FUNCTION)
    }
    fn advance(&mut self, _: Duration) {}
    fn power(&mut self, _: bool) {}
    fn trip(&mut self, _: u16) {}
    fn set_load(&mut self, _: u16) {}
    fn panel(&mut self, _: Panel) {}
    fn observe(&self) -> Observation {
        Observation::default()
    }
    fn peek(&self, _: u16) -> Option<u16> {
        None
    }
    fn poke(&mut self, _: u16, _: u16) -> bool {
        false
    }
}

/// A 3G3EV has the loop-back of function 08 (its manual, §4.1) and n01 to n68 at 0101h and on (§2.1).
#[tokio::test(start_paused = true)]
async fn an_energy_meter_is_no_3g3ev() {
    for diagnostics in [&[][..], &[0]] {
        let simulated = SimLine::new(Wiring::rtu(serial("19200 8N1")));
        simulated.add_boxed(6, Box::new(Meter::new(diagnostics))).unwrap();
        let finds = scanned(&simulated, &at_one("19200 8N1", 5..=7)).await;
        let [Find { answer: Answer::Slave(alike), .. }] = &finds[..] else { panic!("{finds:?}") };
        assert_eq!(alike[..], [], "{diagnostics:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_second_master_is_no_second_drive() {
    for every in [40, 90, 130, 250] {
        for words in [1, 4] {
            let (simulated, _) = one();
            // He reads of the same drive what we read of it, and of one that is not there.
            let requests = vec![(5, vec![3, 0x0C, 0x81, 0, words]), (9, vec![3, 0, 0, 0, 1])];
            let second_master = Some(SecondMaster { requests, every: every * MS, unheard: None });
            simulated.set_defects(Defects { second_master, ..Defects::default() });
            let finds = scanned(&simulated, &at_one("19200 8N1", 3..=10)).await;
            assert_nobody_twice(&finds, &format!("{words} words every {every} ms"));
            assert!(
                finds.iter().any(|find| find.step.slave.number() == 5),
                "{words} every {every}: {finds:?}"
            );
        }
    }
}

#[tokio::test(start_paused = true)]
async fn each_family_is_named_beside_a_master_that_was_heard_before() {
    for family in Family::BUILT_IN {
        for every in [310, 400, 490] {
            let simulated = SimLine::new(Wiring::rtu(serial("19200 8N1")));
            simulated.add_boxed(5, simulated::model(family, SetUp::ForTheBus).unwrap()).unwrap();
            // He reads of the same drive, and of one that is not there.
            let requests = vec![(5, vec![3, 0x0C, 0x81, 0, 1]), (9, vec![3, 0, 0, 0, 1])];
            let second_master = Some(SecondMaster { requests, every: every * MS, unheard: None });
            simulated.set_defects(Defects { second_master, ..Defects::default() });
            let plan = at_one("19200 8N1", 1..=9);
            let open =
                async |config: LineConfig| Ok(Line::over(simulated.in_memory_at(config.serial), config));
            let mut sweep = Sweep::new(&plan, LineConfig::stream(SerialSettings::MODBUS_DEFAULT), WAIT, open);
            sweep.is_shared = true;
            let finds = found_by(&mut sweep).await;
            let found = finds.iter().find(|find| find.step.slave.number() == 5).map(|find| &find.answer);
            assert_eq!(found.and_then(Answer::only), Some(family), "every {every} ms: {finds:?}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_master_that_begins_to_ask_behind_the_beginning_ends_a_scan_that_nobody_stands_beside() {
    let (simulated, _) = one();
    let requests = vec![(5, vec![3, 0x0C, 0x81, 0, 1])];
    let second_master = Some(SecondMaster { requests, every: 250 * MS, unheard: None });
    simulated.set_defects(Defects { second_master, ..Defects::default() });
    let plan = at_one("19200 8N1", 1..=247);
    let open = async |config: LineConfig| Ok(Line::over(simulated.in_memory_at(config.serial), config));
    for is_alone in [true, false] {
        let mut sweep = Sweep::new(&plan, LineConfig::stream(SerialSettings::MODBUS_DEFAULT), WAIT, open);
        sweep.ends_at_another = is_alone;
        let mut asked = 0;
        let told = |told| {
            asked += usize::from(matches!(told, Told::At { .. }));
            Ok(())
        };
        let ended = sweep.run(|_, _| true, told).await;
        sweep.close().await;
        match (is_alone, ended) {
            (true, Err(Failure::Input(why))) => {
                assert!(why.contains("has begun to ask on this line") && asked < 40, "{asked}: {why}");
            }
            (false, Ok(())) => assert_eq!(asked, 247),
            (_, ended) => panic!("{is_alone}: {ended:?}"),
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_slow_neighbour_is_no_second_drive() {
    for millis in [101, 105, 108, 111, 115, 120, 130, 150, 180, 300] {
        let (simulated, drive) = one();
        drive.set_turnaround(Some(Duration::from_millis(millis)));
        for address in [4, 6, 7] {
            simulated
                .add_boxed(address, simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap())
                .unwrap();
        }
        let finds = scanned(&simulated, &at_one("19200 8N1", 3..=8)).await;
        let mut found: Vec<u8> = finds.iter().map(|find| find.step.slave.number()).collect();
        found.sort_unstable();
        assert_eq!(found, [4, 5, 6, 7], "{millis} ms");
        for find in &finds {
            assert!(
                matches!(&find.answer, Answer::Slave(alike) if alike.len() == 1),
                "{millis} ms: {find:?}"
            );
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_cable_that_damages_a_bit_of_each_answer_or_of_some_is_no_second_drive() {
    for rate in [ALWAYS / 10, ALWAYS / 3, ALWAYS / 2, ALWAYS * 4 / 5, ALWAYS] {
        for seed in 0..20 {
            let (simulated, _) = one();
            simulated.set_faults(drive_sim::Faults::seeded(seed).with(Fault::Flipped, rate));
            let finds = scanned(&simulated, &at_one("19200 8N1", 3..=7)).await;
            assert_nobody_twice(&finds, &format!("{rate}, seed {seed}"));
            assert_eq!(finds.len(), 1, "{rate}, seed {seed}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn bursts_of_noise_are_no_second_drive() {
    for share in [20_000, 50_000, 100_000, 200_000] {
        for seed in 0..20 {
            let (simulated, _) = one();
            let noise = Some(Noise { share, burst: 2 * MS, seed });
            simulated.set_defects(Defects { noise, ..Defects::default() });
            assert_nobody_twice(
                &scanned(&simulated, &at_one("19200 8N1", 3..=7)).await,
                &format!("{share}, {seed}"),
            );
        }
    }
}

#[tokio::test(start_paused = true)]
async fn noise_that_damages_one_answer_in_ten_is_not_taken_for_two_drives() {
    for seed in 0..20 {
        let simulated = SimLine::new(Wiring::rtu(serial("19200 8N1")));
        simulated.set_faults(drive_sim::Faults::seeded(seed).with(Fault::Flipped, ALWAYS / 10));
        simulated.add_boxed(5, simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap()).unwrap();
        let answer = verdict(&simulated).await;
        assert!(matches!(&answer, Answer::Slave(alike) if alike.len() == 1), "{seed}: {answer:?}");
    }
}
