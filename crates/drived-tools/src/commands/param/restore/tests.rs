//! Each family on the simulator in virtual time: kept, replaced by a drive in factory setting, restored.

use std::time::Duration;

use clap::Parser;
use drive_core::{Direction, Frequency};
use drive_families::{Family, SetUp};
use drive_sim::SimSlave;
use tokio::time::sleep;

use super::*;
use crate::commands::param::testing::Bench;

impl Bench {
    /// The drive that is kept, as somebody has set it up.
    async fn kept(family: Family) -> Backup {
        let mut bench = Self::of(family, SetUp::ForTheBus);
        for &(register, word) in settings(family) {
            assert!(bench.machine.poke(register, word), "{family} {register}");
        }
        let file = bench.source.keep().await.unwrap();
        assert!(file.entries.iter().all(|entry| entry.held.is_ok()), "{family}");
        // As it comes back from its file.
        Backup::parse(Path::new("kept.toml"), &file.to_string()).unwrap()
    }

    async fn plan(&mut self, file: &Backup) -> Plan {
        Plan::of(file, &self.source.keep().await.unwrap(), false).unwrap()
    }

    async fn carry(&mut self, plan: &Plan) -> Carried {
        carry(plan, &mut self.source, &mut Ending::listen().unwrap()).await
    }

    async fn differences(&mut self, file: &Backup) -> Vec<&'static str> {
        let now = self.source.keep().await.unwrap();
        let differences = Comparison::of(file, &now, false).differences;
        differences.iter().map(|difference| difference.row.code).collect()
    }

    async fn run(&mut self) {
        let Source::OnLine(one) = &mut self.source else { panic!("it is on a line") };
        one.drive.set_setpoint(Frequency::from_hertz(20).into()).await.unwrap();
        one.drive.start(Direction::Forward).await.unwrap();
    }
}

/// What somebody has set, by the addresses of the manuals: another unit of the ramps, other limits, another wiring, PI
/// instead of preset speeds, another motor.
fn settings(family: Family) -> &'static [(u16, u16)] {
    match family.capabilities().key {
        "atv312" => &[
            // Inr = 0.01, ACC 12.34 s, dEC 2.50 s.
            (9020, 0),
            (9001, 1_234),
            (9002, 250),
            // LSP 10, HSP 40, tFr 70 Hz.
            (3105, 100),
            (3104, 400),
            (3103, 700),
            // UFt = P, UFr.
            (9607, 1),
            (9623, 33),
            // tCC = 3C, rrS, JOG.
            (11_101, 1),
            (11_105, 132),
            (11_110, 0),
            // PIF = AI1, SA2; tCC = 3C leaves PS2 and PS4 without an input.
            (11_901, 1),
            (11_801, 0),
            (11_401, 0),
            (11_402, 0),
            // UnS 230 V, FrS 60 Hz, nSP.
            (9601, 230),
            (9602, 600),
            (9604, 1_745),
            // SLL = rMP.
            (7010, 6),
            // Add.
            (6001, 9),
        ],
        "atv28" => &[(40, 1), (251, 100), (250, 650), (52, 700), (252, 50), (53, 550), (264, 77), (6, 1)],
        "atv58" => &[(252, 789), (253, 100)],
        // ACC, DEC, F603, F803, F111, CMOD, FMOD.
        "atv21" => &[(0x0009, 55), (0x0010, 77), (0x0603, 1), (0x0803, 10), (0x0003, 2), (0x0004, 4)],
        "3g3ev" => &[
            (0x0114, 20),
            (0x0129, 600),
            (0x012A, 500),
            (0x0138, 300),
            (0x0139, 200),
            (0x013A, 100),
            (0x0128, 1),
        ],
        other => panic!("nobody has said it of {other}"),
    }
}

/// Of so many cuts one is followed by the next run: `DRIVED_CUTS_ONE_IN`, 1 for all of them.
fn one_in() -> u64 {
    let given = std::env::var("DRIVED_CUTS_ONE_IN").map_or(Ok(8), |one_in| one_in.parse());
    given.expect("DRIVED_CUTS_ONE_IN is a number")
}

/// Which register the manual wants before which other one.
fn orders(family: Family) -> &'static [(&'static str, &'static str, &'static str)] {
    match family.capabilities().key {
        "atv312" => &[
            ("LAC", "Fr1", "BBV51701 p. 35: L3 puts Fr1 back"),
            ("LAC", "CHCF", "p. 36: CHCF is active with L3"),
            ("LAC", "tCC", "p. 35: L3 puts tCC back"),
            ("tCC", "rrS", "p. 33: tCC puts rrS back"),
            ("tCC", "FSt", "p. 33: and every function of an input"),
            ("CHCF", "Cd1", "p. 37: Cd1 is active with CHCF = SEP"),
            ("Inr", "ACC", "p. 38: Inr changes the ramps"),
            ("Inr", "dEC", "p. 38"),
            ("UFt", "UFr", "p. 27: UFt puts UFr back"),
            ("tFr", "Fr1", "limits before what uses them"),
            ("dEC", "Fr1", "p. 36: with CHCF = SIM it is who commands"),
            ("FrS", "Fr1", "p. 36: behind everything else"),
            ("nSP", "PIF", "what the motor follows behind everything else"),
            ("SA2", "PIF", "p. 45: PI is blocked by a summing input"),
            ("ACC", "UnS", "the ratings of the motor last"),
            ("SLL", "UnS", "the ratings of the motor last"),
            ("UnS", "FrS", ""),
            ("nSP", "Cd1", "who commands after everything"),
        ],
        "atv28" => &[
            ("tCC", "bFr", "what puts others back comes first"),
            ("bFr", "HSP", "BBV51701 p. 28: bFr changes HSP"),
            ("bFr", "tFr", "p. 28: and tFr"),
            ("bFr", "FrS", "p. 28: and FrS"),
            ("tFr", "HSP", "p. 27: HSP at most tFr"),
            ("HSP", "LSP", "p. 27: LSP at most HSP"),
            ("SP2", "FrS", "the ratings of the motor last"),
        ],
        "atv58" => &[],
        "atv21" => &[("F603", "F803", "§6.4: F803 acts at once"), ("ACC", "CMOD", "§6.2")],
        "3g3ev" => &[
            ("n41", "n42", "§5.3 OP4: n41 ≥ n42"),
            ("n56", "n57", "§5.3 OP5: n56 ≥ n57"),
            ("n57", "n58", "§5.3 OP5: n57 ≥ n58"),
        ],
        other => panic!("nobody has said it of {other}"),
    }
}

fn codes(changes: &[Change]) -> Vec<&'static str> {
    changes.iter().map(|change| change.row.code).collect()
}

/// The registers that the machine was written, as the wire has it.
fn seen(machine: &SimSlave) -> Vec<u16> {
    let received = machine.received();
    let writes = received.iter().filter(|request| matches!(request.pdu.first(), Some(0x06 | 0x10)));
    writes.map(|request| u16::from_be_bytes([request.pdu[1], request.pdu[2]])).collect()
}

#[tokio::test(start_paused = true)]
async fn a_drive_in_factory_setting_is_restored_to_no_difference_in_the_order_of_its_manual() {
    for family in Family::BUILT_IN {
        let file = Bench::kept(family).await;
        let mut new = Bench::of(family, SetUp::Factory);
        assert!(!new.differences(&file).await.is_empty(), "{family}");
        let plan = new.plan(&file).await;
        let carried = new.carry(&plan).await;
        assert_eq!(carried.stopped, None, "{family}");
        assert_eq!(new.differences(&file).await, [""; 0], "{family}");

        let written = codes(&carried.written);
        let wire = seen(&new.machine);
        let said: Vec<u16> = carried.written.iter().map(|change| change.row.address).collect();
        assert!(said.ends_with(&wire) && !wire.is_empty(), "{family}: {said:?} {wire:?}");
        let place = |code: &str| written.iter().position(|written| *written == code);
        for (before, after, why) in orders(family) {
            match (place(before), place(after)) {
                (Some(before), Some(after)) if before < after => {}
                _ => panic!("{family}: {before} and {after} ({why}) in {written:?}"),
            }
        }
        for never in ["Add", "SMIL", "SMAL", "SPAL", "tUn", "COd", "CMD", "F802", "n67"] {
            assert!(!written.contains(&never), "{family} {never}");
        }

        let again = new.plan(&file).await;
        assert_eq!(codes(&again.changes), [""; 0], "{family}");
        let before = new.machine.requests(0x06) + new.machine.requests(0x10);
        assert_eq!(new.carry(&again).await.written, [], "{family}");
        assert_eq!(new.machine.requests(0x06) + new.machine.requests(0x10), before, "{family}");
    }
}

#[tokio::test(start_paused = true)]
async fn whenever_the_line_is_cut_it_is_told_what_was_written_and_the_next_run_goes_on() {
    for family in Family::BUILT_IN {
        let file = Bench::kept(family).await;
        // By one of its own, so that the line has heard as little of what is counted as of those that are cut.
        let plan = Bench::of(family, SetUp::Factory).plan(&file).await;
        let mut whole = Bench::of(family, SetUp::Factory);
        let begun = whole.machine.all_requests();
        whole.carry(&plan).await;
        let exchanges = whole.machine.all_requests() - begun;
        let mut unknown = 0;
        for cut in 1..exchanges {
            let mut new = Bench::of(family, SetUp::Factory);
            let begun = new.machine.all_requests();
            let machine = new.machine.clone();
            let cutting = tokio::spawn(async move {
                machine.wait_for_requests(begun + cut).await;
                machine.mute();
            });
            let carried = new.carry(&plan).await;
            cutting.await.unwrap();
            let Some(stopped) = &carried.stopped else { panic!("{family}, cut after {cut}: not stopped") };
            unknown += usize::from(stopped.is_unknown);
            let told = stopped.in_words("pump", &carried);
            for Change { row, wanted, .. } in &plan.changes {
                let (address, code) = (row.address, row.code);
                let is_written = carried.written.iter().any(|done| done.row.address == address);
                let is_unknown = stopped.is_unknown && stopped.at.address == address;
                let is_left = carried.left.iter().any(|left| left.address == address);
                let holds = new.machine.peek(address) == Some(*wanted);
                let one = [is_written, is_unknown, is_left].iter().filter(|is_so| **is_so).count();
                assert_eq!(one, 1, "{family}, cut after {cut}: {code}: {told}");
                assert!(!is_written || holds, "{family}, cut after {cut}: {code} is not written: {told}");
                // Another write may have changed it: that is what the manual says of some.
                let is_sent = seen(&new.machine).contains(&address);
                assert!(!is_left || !is_sent, "{family}, cut after {cut}: {code} was sent: {told}");
                assert!(told.contains(code), "{code}: {told}");
            }
            // Each of the cuts is told; of so many the next run is looked at too.
            if cut.is_multiple_of(one_in()) {
                new.machine.unmute();
                let plan = new.plan(&file).await;
                assert_eq!(new.carry(&plan).await.stopped, None, "{family}, cut after {cut}");
                assert_eq!(new.differences(&file).await, [""; 0], "{family}, cut after {cut}");
            }
        }
        assert!(unknown > 0, "{family}: no cut left a write unknown");
    }
}

#[tokio::test(start_paused = true)]
async fn functions_that_exclude_each_other_are_taken_away_before_others_are_given() {
    let mut bench = Bench::of(Family::ATV312, SetUp::Factory);
    let presets = bench.source.keep().await.unwrap();
    let mut pi = presets.clone();
    for (code, word) in [("PIF", 1), ("SA2", 0), ("PS2", 0), ("PS4", 0)] {
        pi.entries.iter_mut().find(|entry| entry.row.code == code).unwrap().held = Ok(word);
    }
    // BBV51701 p. 43: PS4 only with PS2; p. 45: PIF not with SA2 or PS2.
    for (file, now, order) in
        [(&pi, &presets, ["SA2", "PS4", "PS2", "PIF"]), (&presets, &pi, ["PIF", "PS2", "PS4", "SA2"])]
    {
        assert_eq!(codes(&Plan::of(file, now, false).unwrap().changes), order);
    }
}

/// A file in which these stand otherwise.
fn edited(mut file: Backup, words: &[(&str, u16)]) -> Backup {
    for (code, word) in words {
        file.entries.iter_mut().find(|entry| entry.row.code == *code).unwrap().held = Ok(*word);
    }
    file
}

#[tokio::test(start_paused = true)]
async fn a_backup_of_one_drive_goes_into_another_but_for_what_that_one_cannot_have_or_refuses() {
    let kept = Bench::kept(Family::ATV312).await;
    let mut other = Bench::of(Family::ATV312, SetUp::ForTheBus);
    // The firmware is what function 43/14 says of the drive (BBV52816, "Identification").
    let mut file = kept.clone();
    file.head.firmware = Some("0000".to_owned());
    // From L3 back to L1 only by a factory setting (BBV51701 p. 35); at most 500 V on an N4 (p. 28); nCr at most 1.5 In (p. 29);
    // Cd1 = tEr, the terminals (p. 36).
    let file = edited(file, &[("LAC", 0), ("UnS", 600), ("nCr", 60_000), ("Cd1", 1)]);
    let command = other.machine.peek(8_423);
    assert_ne!(command, Some(1));
    let told = say(&mut other, &file, &["--write", "--save"]).await.unwrap();
    let refused: Vec<_> = told.json["refused"].as_array().unwrap().iter().collect();
    let codes: Vec<_> = refused.iter().map(|one| one["mnemonic"].as_str().unwrap()).collect();
    assert_eq!(codes, ["LAC"]);
    for one in refused {
        assert!(one["slave"] == 1 && one["address"].is_u64(), "{one}");
        assert!(one["why"].as_str().unwrap().contains("only by a return to factory settings"), "{one}");
    }
    let line = "refused: atv312@1, slave 1, LAC (3006): ";
    assert!(told.text.iter().any(|text| text.starts_with(line)), "{line} in {:?}", told.text);
    // What VCAL and INV of the other drive forbid is known before anything is written.
    let skipped = told.json["skipped"].as_array().unwrap();
    for (code, why) in [("UnS", "with VCAL N4 against"), ("nCr", "with INV 4.1 A against")] {
        let told = skipped.iter().find(|one| one["mnemonic"] == code).unwrap();
        assert!(told["why"].as_str().unwrap().contains(why), "{told}");
    }
    assert!(told.text.iter().any(|text| text.starts_with("another firmware: ")), "{:?}", told.text);
    let Some((Failure::Drive(why), true)) = &told.failure else { panic!("{:?}", told.failure) };
    assert!(why.contains("1 parameter was refused: LAC") && why.contains("Cd1"), "{why}");
    assert!(why.contains("2 parameters were not restored: UnS, nCr"), "{why}");
    // Everything else is as in the file; who commands and what the motor follows is not, and nothing is in the EEPROM.
    assert_eq!(other.differences(&file).await, ["UnS", "nCr", "LAC", "Cd1", "SA2", "PIF"]);
    assert_eq!((other.machine.peek(8_423), &told.json["saved"]), (command, &json!(false)));
    assert!(other.machine.peek(9_001) == Some(1_234) && other.machine.peek(9_604) == Some(1_745));
}

#[tokio::test(start_paused = true)]
async fn whichever_request_is_refused_the_rest_goes_on_and_no_limit_passes_its_neighbour_at_any_moment() {
    // BBV51701 p. 27: LSP ≤ HSP ≤ tFr.
    const LIMITS: [u16; 3] = [3_105, 3_104, 3_103];
    let held_by = |machine: &SimSlave| LIMITS.map(|address| machine.peek(address).unwrap());
    let set = |bench: &Bench, words: [u16; 3]| {
        LIMITS.iter().zip(words).for_each(|(address, word)| assert!(bench.machine.poke(*address, word)));
    };
    let mut passed_over = 0;
    for (held, wanted) in [([100, 400, 700], [550, 650, 1_000]), ([550, 650, 1_000], [100, 400, 600])] {
        let mut other = Bench::of(Family::ATV312, SetUp::Factory);
        set(&other, wanted);
        let mut file = other.source.keep().await.unwrap();
        file.entries.retain(|entry| LIMITS.contains(&entry.row.address));
        let mut whole = Bench::of(Family::ATV312, SetUp::Factory);
        set(&whole, held);
        let plan = whole.plan(&file).await;
        let begun = whole.machine.all_requests();
        whole.carry(&plan).await;
        assert_eq!(held_by(&whole.machine), wanted);
        for refused in begun..whole.machine.all_requests() {
            let mut bench = Bench::of(Family::ATV312, SetUp::Factory);
            set(&bench, held);
            bench.plan(&file).await;
            let machine = bench.machine.clone();
            let watching = tokio::spawn(async move {
                for requests in begun.. {
                    machine.wait_for_requests(requests).await;
                    assert!(held_by(&machine).is_sorted(), "{:?} at request {requests}", held_by(&machine));
                    if requests == refused {
                        machine.refuse_next(drive_sim::Exception::ILLEGAL_VALUE);
                    }
                }
            });
            let carried = bench.carry(&plan).await;
            watching.abort();
            assert!(watching.await.is_err_and(|ended| ended.is_cancelled()), "a limit was passed");
            assert!(held_by(&bench.machine).is_sorted());
            let done = carried.written.len() + carried.refused.len();
            assert!(carried.stopped.is_some() || done == LIMITS.len(), "{refused}: {carried:?}");
            passed_over += usize::from(carried.stopped.is_none() && !carried.refused.is_empty());
        }
    }
    assert!(passed_over >= 6, "{passed_over}");
}

#[tokio::test(start_paused = true)]
async fn values_that_cannot_stand_together_are_refused_before_anything_is_written() {
    // BBV51701 p. 27, 38, 43; 3G3EV §5.3: OP4, OP5.
    let of_312: [(&[(&str, u16)], &str); 3] = [
        (
            &[("LSP", 600), ("HSP", 500)],
            "LSP 60.0 Hz and HSP 50.0 Hz against LSP ≤ HSP ≤ tFr (BBV51701 p. 27)",
        ),
        (&[("tA1", 60), ("tA2", 41)], "tA1 60 % and tA2 41 % against tA1 + tA2 ≤ 100 %"),
        (&[("PS2", 0), ("PS4", 132)], "PS4 LI4 and PS2 nO against PS4 needs PS2"),
    ];
    let of_3g3ev: [(&[(&str, u16)], &str); 2] = [
        (&[("n42", 700), ("n41", 600)], "n42 700 and n41 600 against n42 ≤ n41 (§5.3 OP4)"),
        (&[("n58", 300), ("n57", 200), ("n56", 400)], "n58 300 and n57 200 against n58 ≤ n57 ≤ n56"),
    ];
    for (family, cases) in [(Family::ATV312, &of_312[..]), (Family::OMRON_3G3EV, &of_3g3ev[..])] {
        let mut new = Bench::of(family, SetUp::Factory);
        let now = new.source.keep().await.unwrap();
        for (words, reason) in cases {
            let file = edited(now.clone(), words);
            let Err(Failure::Input(why)) = say(&mut new, &file, &["--write"]).await else {
                panic!("{words:?}")
            };
            assert!(why.contains(reason) && why.contains("nothing was written"), "{why}");
        }
        assert_eq!(seen(&new.machine), [0_u16; 0]);
    }
}

#[tokio::test(start_paused = true)]
async fn functions_of_inputs_are_never_equal_on_the_way_and_change_places_by_nobody() {
    // 3G3EV §5.3, OP1.
    let mut bench = Bench::of(Family::OMRON_3G3EV, SetUp::Factory);
    let now = bench.source.keep().await.unwrap();
    let held = ["n06", "n07", "n08"].map(|code| {
        let address = now.entries.iter().find(|entry| entry.row.code == code).unwrap().row.address;
        now.word(address).unwrap()
    });
    let [one, two, three] = held;
    let turned = edited(now.clone(), &[("n06", two), ("n07", three), ("n08", 9)]);
    assert_eq!(codes(&Plan::of(&turned, &now, false).unwrap().changes), ["n08", "n07", "n06"]);
    let swapped = edited(now.clone(), &[("n06", two), ("n07", one)]);
    let Err(Failure::Input(why)) = Plan::of(&swapped, &now, false) else { panic!("taken") };
    assert!(why.contains("no order of n07, n06 keeps the drive from"), "{why}");
}

#[tokio::test(start_paused = true)]
async fn a_write_that_the_drive_ignores_is_told_with_what_was_read_back() {
    let mut bench = Bench::of(Family::ATV312, SetUp::Factory);
    let now = bench.source.keep().await.unwrap();
    // ACC, 3.0 s from the factory (BBV52816 p. 12).
    let file = edited(now, &[("ACC", 45)]);
    let machine = bench.machine.clone();
    let forgetting = tokio::spawn(async move {
        machine.wait_until(|_| machine.requests(0x06) > 0).await;
        assert!(machine.poke(9_001, 30));
    });
    let told = say(&mut bench, &file, &["--write"]).await.unwrap();
    forgetting.await.unwrap();
    let [one] = &**told.json["refused"].as_array().unwrap() else { panic!("{:?}", told.json) };
    assert_eq!(one["why"], "it was written and reads back as 3.0 s: the drive has not taken 4.5 s");
    assert_eq!(told.failure.unwrap().0.code(), 1);
}

/// As behind a cut of the supply between the last reading and the save.
#[tokio::test(start_paused = true)]
async fn what_the_drive_does_not_hold_any_more_behind_the_save_is_not_told_as_saved() {
    let mut bench = Bench::of(Family::ATV312, SetUp::Factory);
    let file = edited(bench.source.keep().await.unwrap(), &[("ACC", 45)]);
    let machine = bench.machine.clone();
    let cut = tokio::spawn(async move {
        // That of ACC, and the save.
        machine.wait_until(|_| machine.requests(0x06) > 1).await;
        machine.poke(9_001, 30)
    });
    let told = say(&mut bench, &file, &["--write", "--save"]).await.unwrap();
    assert!(cut.await.unwrap());
    let Some((Failure::Drive(why), false)) = &told.failure else { panic!("{:?}", told.text) };
    assert!(why.contains("ACC"), "{why}");
    assert_eq!(told.json["saved"], json!(false));
    assert!(!told.text.iter().any(|text| text.starts_with("saved")), "{:?}", told.text);
}

#[tokio::test(start_paused = true)]
async fn the_line_itself_is_changed_only_if_that_is_asked_for_and_last() {
    let mut bench = Bench::of(Family::ATV312, SetUp::Factory);
    let now = bench.source.keep().await.unwrap();
    let file = Bench::kept(Family::ATV312).await;
    let without = Plan::of(&file, &now, false).unwrap();
    assert!(!codes(&without.changes).contains(&"Add"));
    let skipped = without.skipped.iter().find(|(row, _)| row.code == "Add").unwrap();
    assert!(skipped.1.contains("--with-communication"), "{}", skipped.1);
    let with = Plan::of(&file, &now, true).unwrap();
    assert_eq!(codes(&with.changes).last(), Some(&"Add"));
}

/// What the command line says, for a file and a bench.
async fn say(bench: &mut Bench, file: &Backup, more: &[&str]) -> Result<Told, Failure> {
    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }
    let line = Line::parse_from(["restore", "kept.toml", "--json"].iter().chain(more));
    let mut ending = Ending::listen().unwrap();
    restore(&line.args, Path::new("kept.toml"), file, &mut bench.source, &mut ending).await
}

#[tokio::test(start_paused = true)]
async fn nothing_is_written_without_write_to_another_family_or_to_another_rating() {
    let file = Bench::kept(Family::ATV312).await;
    let mut new = Bench::of(Family::ATV312, SetUp::Factory);
    let told = say(&mut new, &file, &[]).await.unwrap();
    assert!(told.failure.is_none() && told.text.iter().any(|text| text.contains("nothing has been written")));
    let mut other = Bench::of(Family::ATV28, SetUp::Factory);
    let Err(Failure::Input(why)) = say(&mut other, &file, &["--write"]).await else { panic!("taken") };
    assert!(why.contains("the file is of the family atv312"), "{why}");

    // INV, the nominal current of the drive (BBV51701 p. 26).
    let mut larger = file.clone();
    let inv = larger.entries.iter_mut().find(|entry| entry.row.code == "INV").unwrap();
    inv.held = inv.held.clone().map(|word| word + 1);
    let Err(Failure::Input(why)) = say(&mut new, &larger, &["--write"]).await else { panic!("taken") };
    assert!(why.contains("INV is") && why.contains("--other-model"), "{why}");
    for machine in [&new.machine, &other.machine] {
        assert_eq!(seen(machine), [0_u16; 0], "something was written");
    }
    let told = say(&mut new, &larger, &["--write", "--other-model"]).await.unwrap();
    assert!(told.failure.is_none(), "{:?}", told.failure);
}

#[tokio::test(start_paused = true)]
async fn a_macro_configuration_of_another_drive_is_said_before_anything_is_written_and_set_by_hand() {
    let mut file = Bench::kept(Family::ATV312).await;
    // BBV51701 p. 32: CFG, 0 = StS, 1 = Std, which is its factory setting; a write loads that configuration at once.
    file.entries.iter_mut().find(|entry| entry.row.code == "CFG").unwrap().held = Ok(0);
    let mut new = Bench::of(Family::ATV312, SetUp::Factory);
    assert!(new.differences(&file).await.contains(&"CFG"), "diff shows it");
    let told = say(&mut new, &file, &[]).await.unwrap();
    let first =
        told.text.iter().find(|text| text.starts_with("before anything is written: CFG was StS and is Std"));
    assert!(first.is_some_and(|text| text.contains("p. 32")), "{:?}", told.text);
    let Err(Failure::Input(why)) = say(&mut new, &file, &["--write"]).await else { panic!("written") };
    assert!(
        why.contains("nothing was written: CFG was StS and is Std") && why.contains("--other-macro"),
        "{why}"
    );
    assert_eq!(seen(&new.machine), [0_u16; 0]);
    // Somebody sets it at the keypad; then it is restored as any other file.
    assert!(new.machine.poke(3_052, 0));
    let told = say(&mut new, &file, &["--write"]).await.unwrap();
    assert!(told.failure.is_none(), "{:?}", told.failure);
    assert_eq!(new.differences(&file).await, [""; 0]);
    // Without that the rest is written if it is asked for, and CFG never.
    let mut other = Bench::of(Family::ATV312, SetUp::Factory);
    let told = say(&mut other, &file, &["--write", "--other-macro"]).await.unwrap();
    assert!(told.failure.is_none(), "{:?}", told.failure);
    assert_eq!(other.differences(&file).await, ["CFG"]);
    assert!(!seen(&other.machine).contains(&3_052));
}

#[tokio::test(start_paused = true)]
async fn what_acts_only_after_a_power_cycle_is_said_before_and_after_it_is_written() {
    // 3G3EV §2.1, note 3: n02, n39, n40 and n63 to n67 need a power cycle; §2.1: n39 is 0 from the factory.
    let mut bench = Bench::of(Family::OMRON_3G3EV, SetUp::Factory);
    let mut file = bench.source.keep().await.unwrap();
    file.entries.iter_mut().find(|entry| entry.row.code == "n39").unwrap().held = Ok(1);
    let told = say(&mut bench, &file, &[]).await.unwrap();
    let needs = "after the next power-up";
    assert!(told.text.iter().any(|text| text.contains(needs)), "{:?}", told.text);
    assert!(told.json["changes"][0]["acts_later"].as_str().is_some_and(|said| said.contains(needs)));
    let told = say(&mut bench, &file, &["--write"]).await.unwrap();
    assert!(
        told.text.iter().any(|text| text.starts_with("n39: ") && text.contains(needs)),
        "{:?}",
        told.text
    );
    // What acts at once is not said to act later: n19, the acceleration.
    let of = |family: Family, address| family.capabilities().restoring.acts_later(address).is_some();
    assert!(of(Family::OMRON_3G3EV, 0x0102) && !of(Family::OMRON_3G3EV, 0x0114));
    // Altivar 21 §6.1: protocol, speed and parity after a reset, the address at once; §6.3: the blocks after a reset.
    for (address, later) in [
        (0x0829, true),
        (0x0800, true),
        (0x0801, true),
        (0x0802, false),
        (0x0870, true),
        (0x0875, true),
        (0x0803, false),
    ] {
        assert_eq!(of(Family::ATV21, address), later, "{address:04X}h");
    }
}

#[tokio::test(start_paused = true)]
async fn a_value_that_the_manual_does_not_allow_is_refused_before_anything_is_written() {
    let mut file = Bench::kept(Family::ATV312).await;
    // JGF, 0 to 10 Hz (BBV51701 p. 45).
    file.entries.iter_mut().find(|entry| entry.row.code == "JGF").unwrap().held = Ok(101);
    let mut new = Bench::of(Family::ATV312, SetUp::Factory);
    let Err(Failure::Input(why)) = say(&mut new, &file, &["--write"]).await else { panic!("taken") };
    assert!(why.contains("JGF") && why.contains("10.1 Hz is not allowed"), "{why}");
    assert_eq!(seen(&new.machine), [0_u16; 0]);
}

#[tokio::test(start_paused = true)]
async fn nothing_is_written_to_a_drive_whose_motor_runs() {
    for family in [Family::ATV21, Family::ATV28, Family::ATV312, Family::OMRON_3G3EV] {
        let file = Bench::kept(family).await;
        let mut running = Bench::of(family, SetUp::ForTheBus);
        running.run().await;
        sleep(Duration::from_secs(1)).await;
        let plan = running.plan(&file).await;
        let before = running.machine.requests(0x06) + running.machine.requests(0x10);
        let carried = running.carry(&plan).await;
        let stopped = carried.stopped.unwrap_or_else(|| panic!("{family}: written while it runs"));
        assert!(stopped.why.contains("at standstill") && !stopped.is_unknown, "{family}: {}", stopped.why);
        assert_eq!(running.machine.requests(0x06) + running.machine.requests(0x10), before, "{family}");
        assert!(running.machine.observe().running, "{family}");
    }
}

#[tokio::test(start_paused = true)]
async fn the_eeprom_is_written_only_where_it_is_asked_for_or_the_drive_does_it_by_itself() {
    for family in Family::BUILT_IN {
        let file = Bench::kept(family).await;
        for save in [false, true] {
            let mut new = Bench::of(family, SetUp::Factory);
            let before = new.machine.observe().eeprom_writes;
            let more: &[&str] = if save { &["--write", "--save"] } else { &["--write"] };
            let told = say(&mut new, &file, more).await.unwrap();
            assert_eq!(told.failure, None, "{family}");
            let written = told.json["written"].as_array().unwrap().len();
            let writes = new.machine.observe().eeprom_writes - before;
            let expected = match family.capabilities().key {
                // A save is one write of all (BBV51701 p. 20; 3G3EV §4.5). That of SLL, which no power-off changes, is one
                // by itself (BBV51701 p. 9).
                "atv312" => u32::from(save) + 1,
                "3g3ev" => u32::from(save),
                // Each write is one (Altivar 21 Modbus §8.1); not known of the other two, so each counts.
                _ => writes,
            };
            assert_eq!(writes, expected, "{family} {save}: {:?}", told.text);
            if family == Family::ATV21 {
                assert_eq!(usize::try_from(writes).unwrap(), written, "{:?}", told.text);
            }
            if [Family::ATV312, Family::OMRON_3G3EV].contains(&family) {
                new.machine.power_cycle();
                sleep(Duration::from_secs(5)).await;
                assert_eq!(new.differences(&file).await.is_empty(), save, "{family}");
            }
        }
    }
}

#[tokio::test(start_paused = true)]
async fn of_a_file_that_was_cut_off_it_is_said_what_it_does_not_have() {
    let mut file = Bench::kept(Family::ATV312).await;
    let mut whole = Bench::of(Family::ATV312, SetUp::ForTheBus);
    let told = say(&mut whole, &file, &[]).await.unwrap();
    assert_eq!(told.json["not_in_file"], serde_json::json!([]), "{:?}", told.text);
    assert!(!told.text.iter().any(|text| text.contains("cut off")), "{:?}", told.text);

    let lost: Vec<_> = file.entries.drain(40..).map(|entry| entry.row.code).collect();
    assert!(lost.contains(&"SLL"));
    let told = say(&mut whole, &file, &[]).await.unwrap();
    let said = told.json["not_in_file"].as_array().unwrap();
    assert!(said.contains(&"SLL".into()) && said.len() <= lost.len(), "{said:?}");
    assert!(told.text.iter().any(|text| text.contains("cut off") && text.contains("SLL")), "{:?}", told.text);
}

#[tokio::test(start_paused = true)]
async fn of_a_drive_that_tells_nothing_nobody_says_that_it_holds_what_the_file_has() {
    // The 3G3EV has no identification: the first that it does not answer is a parameter.
    let file = Bench::kept(Family::OMRON_3G3EV).await;
    for more in [&[][..], &["--write"]] {
        let mut silent = Bench::of(Family::OMRON_3G3EV, SetUp::ForTheBus);
        silent.machine.mute();
        let told = say(&mut silent, &file, more).await.unwrap();
        let Some((Failure::Drive(why), false)) = &told.failure else { panic!("{:?}", told.text) };
        assert!(why.contains("nothing could be read") && why.ends_with("nothing was written"), "{why}");
        assert!(!told.text.iter().any(|text| text.contains("nothing to write")), "{:?}", told.text);
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_falls_silent_behind_the_last_write_has_put_nothing_back() {
    let file = Bench::kept(Family::OMRON_3G3EV).await;
    let mut new = Bench::of(Family::OMRON_3G3EV, SetUp::Factory);
    let plan = new.plan(&file).await;
    let mut carried = new.carry(&plan).await;
    new.machine.mute();
    let Some(Failure::Drive(why)) = verify(&file, &mut new.source, false, &plan, &mut carried).await else {
        panic!("a drive that tells nothing is as the file says")
    };
    assert!(
        why.starts_with("all is written, and not read once more: 3g3ev@1: nothing could be read"),
        "{why}"
    );
}

#[tokio::test(start_paused = true)]
async fn who_commands_stays_as_it_is_where_a_setting_of_the_file_could_not_be_read_or_restored() {
    // Cd1 = tEr, the terminals (BBV51701 p. 36).
    let kept = edited(Bench::kept(Family::ATV312).await, &[("Cd1", 1)]);
    let unread = |mut backup: Backup| {
        backup.entries.iter_mut().find(|entry| entry.row.code == "ACC").unwrap().held =
            Err("mute".to_owned());
        backup
    };
    for is_of_the_file in [true, false] {
        let mut new = Bench::of(Family::ATV312, SetUp::ForTheBus);
        let command = new.machine.peek(8_423);
        assert_ne!(command, Some(1));
        if is_of_the_file {
            let told = say(&mut new, &unread(kept.clone()), &[]).await.unwrap();
            assert!(told.text.iter().any(|text| text.starts_with("missing: ACC: who commands")));
            let told = say(&mut new, &unread(kept.clone()), &["--write", "--save"]).await.unwrap();
            let Some((Failure::Drive(why), true)) = &told.failure else { panic!("{:?}", told.failure) };
            assert!(why.contains("1 parameter was not restored: ACC") && why.contains("Cd1"), "{why}");
            assert_eq!(told.json["saved"], json!(false));
            let held_back = told.json["held_back"].as_array().unwrap();
            assert!(held_back.contains(&json!("Cd1")), "{held_back:?}");
        } else {
            let now = unread(new.source.keep().await.unwrap());
            let plan = Plan::of(&kept, &now, false).unwrap();
            let carried = new.carry(&plan).await;
            assert!(carried.held_back.iter().any(|row| row.code == "Cd1"), "{carried:?}");
        }
        assert_eq!(new.machine.peek(8_423), command);
        // The rest is written all the same: dEC.
        assert_eq!(new.machine.peek(9_002), Some(250));
    }
    // What a person has left out himself, the line's own settings, is none of that.
    let mut new = Bench::of(Family::ATV312, SetUp::ForTheBus);
    let told = say(&mut new, &kept, &["--write"]).await.unwrap();
    assert!(told.failure.is_none(), "{:?}", told.failure);
    assert!(told.text.iter().any(|text| text.starts_with("not written: Add")), "{:?}", told.text);
    assert_eq!(new.machine.peek(8_423), Some(1));
}

/// A file of these settings, for a drive that holds these registers else and refuses one of them: what is held back then.
struct Case {
    file: &'static [(&'static str, u16)],
    holds: &'static [(u16, u16)],
    refused: &'static str,
    held_back: &'static [&'static str],
}

#[tokio::test(start_paused = true)]
async fn who_gives_the_reference_which_is_who_commands_with_chcf_sim_stays_as_it_is_behind_a_refusal() {
    let said = |words: &'static [(&'static str, u16)]| async move {
        let mut file = Bench::of(Family::ATV312, SetUp::ForTheBus).source.keep().await.unwrap();
        file.entries.retain(|entry| words.iter().any(|(code, _)| *code == entry.row.code));
        edited(file, words)
    };
    // CHCF = SIM (BBV51701 p. 36), where LAC goes back only by a factory setting (p. 35); an input that takes command in forced local mode
    // (p. 55); a summing input beside PI, in the step of Fr1 (p. 45).
    let cases = [
        Case {
            file: &[("LAC", 0), ("Fr1", 1), ("rFC", 97)],
            holds: &[(8_401, 1)],
            refused: "LAC",
            held_back: &["Fr1", "rFC"],
        },
        Case {
            file: &[("LAC", 0), ("FLO", 132), ("FLOC", 2)],
            holds: &[],
            refused: "LAC",
            held_back: &["FLOC", "FLO"],
        },
        Case {
            file: &[("SA2", 2), ("Fr1", 164)],
            holds: &[(8_413, 1), (11_801, 0), (11_401, 0), (11_402, 0), (11_901, 1)],
            refused: "SA2",
            held_back: &["Fr1"],
        },
    ];
    for Case { file: words, holds, refused, held_back } in cases {
        let file = said(words).await;
        let mut drive = Bench::of(Family::ATV312, SetUp::ForTheBus);
        for (register, word) in holds {
            assert!(drive.machine.poke(*register, *word), "{register}");
        }
        let plan = drive.plan(&file).await;
        let carried = drive.carry(&plan).await;
        let codes = |rows: &[&'static drive_core::Row]| rows.iter().map(|row| row.code).collect::<Vec<_>>();
        let refusals: Vec<_> = carried.refused.iter().map(|(row, _)| *row).collect();
        assert_eq!(
            (codes(&refusals), codes(&carried.held_back)),
            (vec![refused], held_back.to_vec()),
            "{words:?}"
        );
        assert_eq!(carried.written, [], "{words:?}");
    }
}
