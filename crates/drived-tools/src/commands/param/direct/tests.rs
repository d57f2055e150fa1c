//! What `drived param` refuses on a line, and how it shows what is read.

use drive_core::{Direction, Frequency, Motion};
use drive_families::{Family, SetUp};

use super::*;
use crate::commands::param::{source::Source, testing::Bench};

/// LSP ≤ HSP ≤ tFr (BBV51701 p. 27), tFr 60 Hz; a reference of 20 Hz below LSP is followed as LSP.
#[tokio::test(start_paused = true)]
async fn a_limit_is_written_within_the_manuals_rule_and_with_what_the_motor_did_that_follows_it() {
    let mut bench = Bench::of(Family::ATV312, SetUp::ForTheBus);
    let machine = bench.machine.clone();
    let Source::OnLine(one) = &mut bench.source else { panic!("it is on a line") };
    let [hsp, lsp] = ["HSP", "LSP"].map(|code| Row::find(one.drive.capabilities().rows, code).unwrap());
    write(one, hsp, 700).await.unwrap_err();
    assert_eq!(machine.peek(3_104), Some(500));
    assert_eq!(write(one, lsp, 10).await.unwrap().1, None, "it stands");
    one.drive.set_setpoint(Frequency::from_hertz(20).into()).await.unwrap();
    one.drive.start(Direction::Forward).await.unwrap();
    let (written, running) = write(one, lsp, 450).await.unwrap();
    assert!(written.changed);
    assert_eq!(running.map(|status| status.motion), Some(Motion::Driven));
    machine.wait_until(|seen| seen.output_frequency == 4_500).await;
}

/// bEn ≤ LSP ≤ HSP ≤ tFr (BBV51701 p. 27, 47): HSP of 50 Hz and tFr of 60 Hz as the drive leaves the factory.
#[tokio::test(start_paused = true)]
async fn a_limit_that_passes_another_is_refused_as_a_restore_refuses_it() {
    let mut bench = Bench::of(Family::ATV312, SetUp::ForTheBus);
    let Source::OnLine(one) = &mut bench.source else { panic!("it is on a line") };
    let capabilities = one.drive.capabilities();
    for (code, word, allowed) in
        [("HSP", 700, false), ("LSP", 510, false), ("HSP", 600, true), ("LSP", 450, true), ("ACC", 700, true)]
    {
        let row = Row::find(capabilities.rows, code).unwrap();
        let written = write(one, row, word).await;
        assert_eq!(written.is_ok(), allowed, "{code} {word}: {written:?}");
        if let Err(failure) = written {
            let told = failure.to_string();
            assert!(told.contains("LSP ≤ HSP ≤ tFr") && told.contains("nothing was written"), "{told}");
        }
    }
}

/// Mnemonics and words.
type Held<'a> = &'a [(&'a str, u16)];
/// A register, a word, what the drive holds, and what is told.
type Refused<'a> = (&'a str, u16, Held<'a>, &'a [&'a str]);
/// A register, a word, and what the drive holds.
type Taken<'a> = (&'a str, u16, Held<'a>);

/// What becomes of a word that is written to a drive that holds what is given, and what the drive holds before and then.
async fn written(
    set_up: SetUp,
    held: Held<'_>,
    (code, word): (&str, u16),
) -> (Result<(), String>, [Option<u16>; 2]) {
    let mut bench = Bench::of(Family::ATV312, set_up);
    let machine = bench.machine.clone();
    let Source::OnLine(one) = &mut bench.source else { panic!("it is on a line") };
    let row = |code: &str| Row::find(one.drive.capabilities().rows, code).unwrap();
    for (code, word) in held {
        assert!(machine.poke(row(code).address, *word), "{code}");
    }
    let row = row(code);
    let before = machine.peek(row.address);
    let outcome = write(one, row, word).await.map(drop).map_err(|failure| failure.to_string());
    (outcome, [before, machine.peek(row.address)])
}

/// Words that are refused with a reason before the drive gets them: it holds what it held.
async fn refuses(set_up: SetUp, cases: &[Refused<'_>]) {
    for (code, word, held, reasons) in cases {
        let (outcome, [before, holds]) = written(set_up, held, (code, *word)).await;
        let told = outcome.expect_err(&format!("{code} {word} was taken with {held:?}"));
        for reason in *reasons {
            assert!(told.contains(reason), "{code} {word}: {reason:?} is not in {told:?}");
        }
        assert_eq!(holds, before, "{code}");
    }
}

/// Words that are taken.
async fn takes(set_up: SetUp, cases: &[Taken<'_>]) {
    for (code, word, held) in cases {
        let (outcome, [_, holds]) = written(set_up, held, (code, *word)).await;
        assert_eq!((outcome, holds), (Ok(()), Some(*word)), "{code} with {held:?}");
    }
}

/// In is W3017, 4.1 A here. ItH 0.2 to 1.5 In (BBV51701 p. 27), CLI, CL2, nCr, nCr2 0.25 to 1.5 (p. 28, 29, 48, 49), Ctd to 1.5
/// (p. 28), IdC to 1, SdC1 and SdC2 to 1.2 (p. 40, 41), Ibr to 1.36 (p. 47).
#[tokio::test(start_paused = true)]
async fn a_current_above_or_below_what_the_manual_lets_this_drive_have_is_refused() {
    let by_nominal: &[&str] = &["INV 4.1 A", "BBV51701 p.", "nothing was written"];
    for (code, above) in [
        ("ItH", 63),
        ("CLI", 63),
        ("CL2", 63),
        ("nCr", 63),
        ("nCr2", 63),
        ("Ctd", 63),
        ("IdC", 42),
        ("SdC1", 51),
        ("SdC2", 51),
        ("Ibr", 57),
    ] {
        let cases: [Refused<'_>; 2] = [(code, above, &[], by_nominal), (code, 1_000, &[], by_nominal)];
        refuses(SetUp::ForTheBus, &cases).await;
    }
    let below: [Refused<'_>; 3] = [
        ("ItH", 7, &[], &["0.2 to 1.5 In", "0.8 A to 6.2 A"]),
        ("CLI", 9, &[], by_nominal),
        ("nCr", 9, &[], by_nominal),
    ];
    refuses(SetUp::ForTheBus, &below).await;
    let within: [Taken<'_>; 4] = [("ItH", 35, &[]), ("CLI", 50, &[]), ("IdC", 41, &[]), ("Ibr", 55, &[])];
    takes(SetUp::ForTheBus, &within).await;
}

/// "0.2 to 1.5 In", "0 to 1.5 In" and "0 to In" of the twin (BBV51701 p. 27, 28, 40); In is W555 here (p. 57).
#[tokio::test(start_paused = true)]
async fn a_current_that_the_rating_of_an_altivar_28_forbids_is_refused_as_on_its_twin() {
    let mut bench = Bench::of(Family::ATV28, SetUp::ForTheBus);
    let machine = bench.machine.clone();
    let Source::OnLine(one) = &mut bench.source else { panic!("it is on a line") };
    assert!(machine.poke(555, 41));
    for (code, word) in [("ItH", 1_000), ("ItH", 7), ("Ctd", 63), ("IdC", 42)] {
        let row = Row::find(one.drive.capabilities().rows, code).unwrap();
        let before = machine.peek(row.address);
        let told = write(one, row, word).await.unwrap_err().to_string();
        assert!(told.contains("INV 4.1 A") && told.contains("nothing was written"), "{told}");
        assert_eq!(machine.peek(row.address), before, "{code}");
    }
}

/// VCAL 1 is M2, to 240 V; 3 is N4, to 500 V (BBV51701 p. 26, 28); UnS/FrS at most 7 and 14 (p. 29).
#[tokio::test(start_paused = true)]
async fn a_motor_voltage_that_the_drive_does_not_have_is_refused_and_so_is_too_much_of_it_for_a_frequency() {
    let cases: [Refused<'_>; 5] = [
        ("UnS", 501, &[], &["VCAL N4", "100 V to 500 V", "p. 28"]),
        ("UnS", 500, &[("VCAL", 1), ("UnS", 230)], &["VCAL M2", "100 V to 240 V"]),
        ("FrS", 100, &[], &["UnS 400 V", "FrS 10.0 Hz", "14 for N4", "p. 29"]),
        ("UnS", 500, &[("FrS", 300)], &["UnS 500 V", "FrS 30.0 Hz"]),
        ("UnS2", 501, &[], &["VCAL N4"]),
    ];
    refuses(SetUp::ForTheBus, &cases).await;
    takes(SetUp::ForTheBus, &[("UnS", 500, &[]), ("FrS", 300, &[])]).await;
}

/// 0.01: "between 0.05 s and 327.6 s" (BBV51701 p. 38).
#[tokio::test(start_paused = true)]
async fn a_ramp_that_is_too_short_for_its_increment_is_refused() {
    for code in ["ACC", "dEC", "AC2", "dE2"] {
        let short: [Refused<'_>; 2] = [
            (code, 4, &[("Inr", 0)], &["Inr 0.01", "0.05 s to 327.60 s", "p. 38"]),
            (code, 1, &[("Inr", 0)], &["Inr 0.01"]),
        ];
        refuses(SetUp::ForTheBus, &short).await;
        takes(SetUp::ForTheBus, &[(code, 5, &[("Inr", 0)]), (code, 1, &[("Inr", 1)])]).await;
    }
}

/// SPAL and SPDL: "1 to 65535", a 32-bit value (BBV51701 p. 18), so the high word is 0; SMIL is LSP and SMAL HSP.
#[tokio::test(start_paused = true)]
async fn a_speed_that_the_profile_does_not_have_is_refused() {
    let cases: [Refused<'_>; 7] = [
        ("SPAL", 0, &[], &["1 rpm to 65535 rpm"]),
        ("SPDL", 0, &[], &["1 rpm to 65535 rpm"]),
        ("SPAL high", 1, &[], &["not allowed"]),
        ("SPDL high", 1, &[], &["not allowed"]),
        ("SMIL high", 1, &[], &["not allowed"]),
        ("SMAL high", 1, &[], &["not allowed"]),
        ("SMIL", 2_000, &[], &["SMIL 2000 rpm", "SMAL 1500 rpm", "p. 18"]),
    ];
    refuses(SetUp::ForTheBus, &cases).await;
    takes(SetUp::ForTheBus, &[("SPAL", 1, &[]), ("SMIL", 300, &[])]).await;
}

/// Reserved bits "must never be written to" (BBV51701 p. 7); which these are, and which outputs are written only while they are not
/// assigned, is on p. 20.
#[tokio::test(start_paused = true)]
async fn a_bit_that_is_reserved_or_only_read_is_refused_and_an_output_that_a_function_has() {
    for bit in [2, 5, 6, 7, 8, 10, 11, 12] {
        refuses(SetUp::ForTheBus, &[("CMI", 1 << bit, &[], &["not allowed", "reserved"])]).await;
    }
    for bit in [0, 1, 2, 3, 4, 5, 6, 7, 11, 12, 13, 14, 15] {
        refuses(SetUp::ForTheBus, &[("IOLR", 1 << bit, &[], &["not allowed", "only be read"])]).await;
    }
    let cases: [Refused<'_>; 4] = [
        ("IOLR", 0x0100, &[("r1", 1)], &["r1 FLt", "p. 20"]),
        ("IOLR", 0x0200, &[("r2", 2)], &["r2 rUn"]),
        ("IOLR", 0x0400, &[("dO", 129)], &["dO OCr"]),
        ("AO1R", 5_000, &[("dO", 129)], &["dO OCr", "p. 20"]),
    ];
    refuses(SetUp::ForTheBus, &cases).await;
    takes(SetUp::ForTheBus, &[("AO1R", 5_000, &[("dO", 0)]), ("CMI", 0x2000, &[])]).await;
}

/// LEt = LO with EtF by a bit "causes an EtF external detected fault", which only switching off ends (BBV51701 p. 52).
#[tokio::test(start_paused = true)]
async fn an_external_fault_that_would_trip_as_soon_as_it_is_written_is_refused_from_either_side() {
    let cases: [Refused<'_>; 2] = [
        ("LEt", 0, &[("EtF", 172)], &["EtF Cd12 and LEt LO", "p. 52"]),
        ("EtF", 172, &[("LEt", 0)], &["EtF Cd12 and LEt LO", "p. 52"]),
    ];
    refuses(SetUp::ForTheBus, &cases).await;
    takes(SetUp::ForTheBus, &[("EtF", 172, &[("LEt", 1)]), ("LEt", 0, &[("EtF", 131)])]).await;
}

/// "L3 can only be restored to L2 or L1 and L2 to L1 by means of a factory setting" (BBV51701 p. 35).
#[tokio::test(start_paused = true)]
async fn an_access_level_is_not_lowered_by_a_write() {
    let cases: [Refused<'_>; 3] = [
        ("LAC", 0, &[], &["LAC", "factory settings", "p. 35"]),
        ("LAC", 1, &[], &["LAC", "factory settings"]),
        ("LAC", 0, &[("LAC", 1)], &["LAC", "factory settings"]),
    ];
    refuses(SetUp::ForTheBus, &cases).await;
    takes(SetUp::Factory, &[("LAC", 1, &[])]).await;
}

/// BBV51701 p. 35, 36, 39 to 52.
#[tokio::test(start_paused = true)]
async fn a_choice_that_the_access_level_does_not_have_is_refused() {
    let cases: [Refused<'_>; 9] = [
        ("Fr1", 160, &[], &["Fr1 UPdt with LAC L1", "p. 35"]),
        ("Fr1", 164, &[("LAC", 1)], &["Fr1 Mdb with LAC L2"]),
        ("Fr2", 167, &[], &["Fr2 nEt with LAC L1"]),
        ("bLC", 2, &[], &["bLC r2 with LAC L1", "p. 35, 47"]),
        ("rFC", 187, &[("LAC", 1)], &["rFC C111 with LAC L2", "p. 36"]),
        ("EtF", 173, &[], &["EtF Cd13 with LAC L1", "p. 39 to 52"]),
        ("rPS", 175, &[("LAC", 1)], &["rPS Cd15 with LAC L2"]),
        ("LC2", 131, &[], &["LC2 LI3 with LAC L1"]),
        ("LAF", 131, &[], &["LAF LI3 with LAC L1"]),
    ];
    refuses(SetUp::Factory, &cases).await;
    takes(
        SetUp::Factory,
        &[("rPS", 132, &[]), ("Fr1", 160, &[("LAC", 1), ("SA2", 0), ("PS4", 0), ("PS2", 0)])],
    )
    .await;
    takes(SetUp::ForTheBus, &[("rPS", 175, &[]), ("bLC", 2, &[])]).await;
}

/// "Resolution 32767 points = 600 Hz if bit 9 of CMI = 1" (BBV51701 p. 16, 17, 19, 21, 25): 1638 points are 29.994 Hz.
#[tokio::test(start_paused = true)]
async fn at_high_resolution_a_reference_and_an_output_are_shown_as_the_drive_counts_them() {
    let mut bench = Bench::of(Family::ATV312, SetUp::ForTheBus);
    let machine = bench.machine.clone();
    let Source::OnLine(one) = &mut bench.source else { panic!("it is on a line") };
    let rows = one.drive.capabilities().rows;
    for (cmi, hertz, rpm) in [(0x0000, "163.8 Hz", "1638 rpm"), (0x0200, "29.99 Hz", "29.99 Hz")] {
        assert!(machine.poke(8_504, cmi));
        for (code, shown) in [
            ("rFr", hertz),
            ("LFr", hertz),
            ("LFR1", hertz),
            ("LFR2", hertz),
            ("RFRD", rpm),
            ("LFRD", rpm),
            ("LFD1", rpm),
            ("LFD2", rpm),
            ("FrH", "163.8 Hz"),
            ("FRHD", "1638 rpm"),
        ] {
            let row = in_units(&mut *one.drive, Row::find(rows, code).unwrap()).await.unwrap();
            assert_eq!(row.show(1_638), shown, "{code} with CMI {cmi:04X}h");
            let view = json!(ParameterView::read(one.drive.capabilities(), &row, 1_638));
            let number = shown.split(' ').next().and_then(|number| number.parse::<f64>().ok());
            assert_eq!(view["value"].as_f64(), number, "{code}");
        }
    }
}
