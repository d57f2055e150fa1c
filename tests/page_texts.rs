//! The page tells the faults of the manuals, and why a drive refuses, in French too.

use std::{path::Path, time::Duration};

use drive_bus::evidence::{Alike, Certainty, Defect, Finding};
use drive_core::{Control, FaultEntry, Refusal};
use drive_fleet::{ConcernKind, LimitProblem, Refused, alarms::AlarmKind};

#[test]
fn every_fault_and_alarm_of_every_family_has_its_french_text_on_the_page() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/drived-http/src/page/web/faults_fr.js");
    let french = std::fs::read_to_string(path).expect("it is read").replace("\\'", "'");
    let tables: [&[FaultEntry]; 8] = [
        drive_atv21::FAULTS,
        drive_atv21::ALARMS,
        drive_atv28::FAULTS,
        drive_atv28::WARNINGS,
        drive_atv312::FAULTS,
        drive_atv312::WARNINGS,
        drive_3g3ev::FAULTS,
        drive_3g3ev::WARNINGS,
    ];
    for entry in tables.concat() {
        for text in [entry.meaning, entry.remedy] {
            assert!(french.contains(&format!("  '{text}': '")), "{}: {text}", entry.mnemonic);
        }
    }
}

#[test]
fn what_troubles_and_what_to_do_about_it_stands_in_french_on_the_page() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/drived-http/src/page/web/");
    let read = |file: &str| std::fs::read_to_string(format!("{root}{file}")).expect("it is read");
    let (texts, sentences) =
        (read("texts.js").replace("\\'", "'"), read("sentences_fr.js").replace("\\'", "'"));
    for kind in ConcernKind::ALL {
        assert!(texts.contains(&format!("  concern_{}: ['{}', '", kind.word(), kind.words())), "{kind:?}");
    }
    let told = ConcernKind::ALL.iter().map(|kind| kind.remedy());
    for remedy in told.chain(AlarmKind::all().map(AlarmKind::remedy)) {
        assert!(sentences.contains(&format!("  '{remedy}': '")), "{remedy}");
    }
}

/// The texts in quotes that stand in a source, without its comments and its tests.
fn quoted(source: &str) -> impl Iterator<Item = &str> {
    let code = source.split("#[cfg(test)]").next().unwrap_or_default();
    let lines = code.lines().map(str::trim_start).filter(|line| !line.starts_with("//"));
    lines.flat_map(|line| line.split('"').skip(1).step_by(2)).filter(|text| text.contains(' '))
}

/// Every source below a folder.
fn sources(folder: &Path) -> Vec<String> {
    let files = std::fs::read_dir(folder).expect("it is a folder");
    files
        .map(|file| file.expect("it is listed").path())
        .flat_map(|path| match path.is_dir() {
            true => sources(&path),
            false => vec![std::fs::read_to_string(&path).expect("it is read")],
        })
        .collect()
}

#[test]
fn why_a_drive_refuses_and_what_to_do_stands_in_french_on_the_page() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/");
    let read = |path: &str| std::fs::read_to_string(format!("{root}{path}")).expect("it is read");
    let french = read("drived-http/src/page/web/sentences_fr.js").replace("\\'", "'");
    let mut sentences: Vec<String> = Vec::new();
    for family in ["atv21", "atv28", "atv58", "atv312", "3g3ev"] {
        for source in sources(format!("{root}drive-{family}/src").as_ref()) {
            for before in ["by: \"", "remedy: \"", "Refusal::Settings("] {
                let texts = source.split(before).skip(1).filter_map(|rest| {
                    let rest = rest.trim_start().trim_start_matches('"');
                    rest.split_once('"').map(|(text, _)| text.to_owned())
                });
                sentences.extend(texts.filter(|text| !text.is_empty() && !text.contains('\n')));
            }
        }
    }
    let of_the_fleet = read("drive-fleet/src/supervisor/shown.rs");
    let of_profiles = sources(format!("{root}drive-profile/src/drive").as_ref());
    for source in of_profiles.into_iter().chain([of_the_fleet]) {
        // What stands over two lines is one sentence.
        let source = source.replace("\\\n     ", "");
        for before in ["by: \"", "remedy: \"", "Refusal::Settings(", "Refusal::OnlyAStartShows("] {
            sentences.extend(source.split(before).skip(1).filter_map(|rest| {
                let rest = rest.trim_start();
                let rest = if before.ends_with('"') { rest } else { rest.strip_prefix('"')? };
                rest.split_once('"').map(|(text, _)| text.to_owned())
            }));
        }
    }
    // Those that stand in tables of pairs.
    let in_pairs = read("drive-atv21/src/control.rs");
    // Its macro puts texts together that begin or end with a blank, for the inputs by name.
    let whole =
        |text: &&str| !text.starts_with([' ', ',']) && !text.ends_with(' ') && !text.starts_with("input ");
    sentences.extend(quoted(&in_pairs).filter(whole).map(str::to_owned));
    let refused = [
        Refused::ReadOnly,
        Refused::NotConnected,
        Refused::Stale,
        Refused::IdentityChanged,
        Refused::IdentityUnchecked,
        Refused::NotTheShown(None),
        Refused::WatchdogUnverified,
        Refused::StopPending,
        Refused::Stopped,
        Refused::Superseded,
        Refused::Withdrawn,
        Refused::QueueFull,
        Refused::Removed,
        Refused::ShutDown,
        Refused::Limit(LimitProblem::NotInHertz),
        Refused::Limit(LimitProblem::UnknownSetpoint),
    ];
    sentences.extend(refused.iter().map(ToString::to_string));
    let controls = [Control::Bus, Control::Terminals, Control::Panel, Control::Local, Control::OtherBus];
    let mut refusals: Vec<Refusal> = controls.map(Refusal::NotInControl).to_vec();
    refusals.extend([Refusal::Tripped, Refusal::DirectionForbidden, Refusal::NothingToSave]);
    refusals.extend([Refusal::EepromLife, Refusal::MotorRunning, Refusal::Exchanged]);
    sentences.extend(refusals.iter().map(ToString::to_string));
    assert!(sentences.len() > 70, "only {} sentences were found", sentences.len());
    let missing: Vec<String> =
        sentences.into_iter().filter(|sentence| !french.contains(&format!("  '{sentence}': '"))).collect();
    assert!(missing.is_empty(), "no French for: {missing:#?}");
}

/// What the ladder of profiles says to whoever commands a drive.
#[test]
fn what_a_file_cannot_tell_of_a_drive_stands_in_french_on_the_page() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/");
    let read = |path: &str| std::fs::read_to_string(format!("{root}{path}")).expect("it is read");
    let french = read("drived-http/src/page/web/sentences_fr.js").replace("\\'", "'");
    let ladder = read("drive-profile/src/ladder.rs");
    let said = ladder.split("self.warn(").skip(1).filter_map(|rest| {
        let rest = rest.trim_start().trim_start_matches("&format!(").trim_start_matches('"');
        rest.split_once('"').map(|(text, _)| text)
    });
    let whose = ["who commands it", "who gives its reference"];
    let mut sentences: Vec<String> =
        said.flat_map(|text| whose.map(|whose| text.replace("{what}", whose))).collect();
    // And what the shipped ones come to say by it.
    sentences.extend(
        drive_profile::shipped::all()
            .iter()
            .flat_map(|profile| profile.not_known().map(str::to_owned).collect::<Vec<_>>()),
    );
    sentences.sort();
    sentences.dedup();
    assert!(sentences.len() >= 13, "only {sentences:#?} were found");
    let missing: Vec<String> =
        sentences.into_iter().filter(|sentence| !french.contains(&format!("  '{sentence}': '"))).collect();
    assert!(missing.is_empty(), "no French for: {missing:#?}");
}

/// One finding of every kind, and what each of those kinds is told by besides its share.
fn findings() -> Vec<Finding> {
    let every = Some(Duration::from_millis(4_500));
    let kinds = [
        Defect::FarEndFaster,
        Defect::FirstByteCut,
        Defect::LastByteCut,
        Defect::BytesBehind,
        Defect::OneAnswerBehind,
        Defect::RefusesAll(0x02),
        Defect::RefusesAll(0x06),
        Defect::RefusesAll(0x0B),
        Defect::TwoAtOneAddress,
        Defect::AnswersTwice,
        Defect::SecondMaster(every),
        Defect::NumberZero,
        Defect::FellSilent(Duration::from_secs(9)),
        Defect::LinkTimeout,
    ];
    let of = |defect| Finding { defect, slave: None, share: (3, 4), certainty: Certainty::Certain };
    kinds.map(of).to_vec()
}

#[test]
fn what_a_line_finds_has_its_french_on_the_page_by_its_kind_with_as_many_steps() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/drived-http/src/page/web/findings_fr.js");
    let french = std::fs::read_to_string(path).expect("it is read");
    let block = |name: &str| {
        let from = french.split(&format!("\n  {name}: {{\n")).nth(1)?;
        from.split("\n  },").next()
    };
    let steps = |block: &str| match block.split("next: ").nth(1).expect("it has steps") {
        "TWO," => french.split("const TWO = [").nth(1).map_or(0, |two| {
            two.lines().take_while(|line| *line != "];").filter(|line| line.starts_with("  '")).count()
        }),
        steps => steps.matches("',\n").count() + steps.matches("']").count(),
    };
    for finding in findings() {
        let name = finding.defect.name();
        let kind = block(name).unwrap_or_else(|| panic!("{name} has no French"));
        assert!(kind.contains("says: "), "{name}");
        let of_code = match finding.defect {
            Defect::RefusesAll(0x0A | 0x0B) => block("refuses_all_gateway").expect("it is there"),
            Defect::RefusesAll(0x05 | 0x06) => block("refuses_all_busy").expect("it is there"),
            _ => kind,
        };
        assert_eq!(steps(of_code), finding.next().len(), "{name}");
    }
    for alike in
        [Alike::SpeedTooLow, Alike::NeverReplies, Alike::OldAnswers, Alike::DamagedCable, Alike::Twins]
    {
        assert!(french.contains(&format!("\n  {}: '", alike.name())), "{alike}");
    }
}
