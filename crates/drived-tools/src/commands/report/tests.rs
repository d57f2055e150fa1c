//! Reports of simulated lines in virtual time. What is expected stands in the manuals or was set at the simulator.

use std::{collections::BTreeSet, time::Duration};

use chrono::Local;
use drive_bus::{
    Line, LineConfig,
    evidence::{Alike, Certainty, Defect, Finding},
};
use drive_core::{
    Identity, SlaveAddress,
    serial::{CharacterFormat, SerialSettings},
};
use drive_families::{Family, SetUp, simulated};
use drive_fleet::{IdentityCheck, Periods, WatchdogCheck, view::FindingFigures};
use drive_sim::{SimLine, SimSlave, Wiring};

use super::{
    gather::Gathered,
    own::{LINE, Own},
    page::{Page, Parties},
};
use crate::commands::param::diff::Cell;
use drived_config::config::LinePart;
use drived_plant::plant::views::{FindingView, LineLink};
use drived_words::drive_spec::DriveName;

/// The functions that write (Modbus Application Protocol V1.1b3, section 6).
const WRITES: [u8; 6] = [0x05, 0x06, 0x0F, 0x10, 0x16, 0x17];

/// The five families at addresses 1 to 5 of one line.
struct Bench {
    line: SimLine,
    machines: Vec<(DriveName, SimSlave)>,
}

impl Bench {
    fn new() -> Self {
        let settings = SerialSettings::new(19_200, CharacterFormat::F8N1).unwrap();
        let line = SimLine::new(Wiring::rtu(settings));
        let machines = Family::BUILT_IN.into_iter().zip(1..).map(|(family, slave)| {
            let machine = line.add_boxed(slave, simulated::model(family, SetUp::Factory).unwrap()).unwrap();
            (DriveName { family, slave: SlaveAddress::try_from(slave).unwrap() }, machine)
        });
        let machines = machines.collect();
        Self { line, machines }
    }

    fn machine(&self, family: Family) -> &SimSlave {
        &self.machines.iter().find(|(name, _)| name.family == family).unwrap().1
    }

    async fn read(&self, with_parameters: bool) -> Gathered {
        let settings = SerialSettings::new(19_200, CharacterFormat::F8N1).unwrap();
        let names: Vec<DriveName> = self.machines.iter().map(|(name, _)| *name).collect();
        let config = LineConfig::stream(settings);
        let part = LinePart::watched(LINE, config, &names, &simulated::options(), Periods::default());
        let line = Line::over(self.line.in_memory(), part.config.clone());
        let own = Own::over(line, &part, Duration::from_secs(10)).await.unwrap();
        Gathered::read(&own.way, &[], with_parameters).await.unwrap()
    }
}

fn html(gathered: &Gathered) -> String {
    let notes = ["order <4711> & \"more\"".to_owned()];
    let written = Local::now().fixed_offset();
    Page {
        title: "Hall 3",
        notes: &notes,
        parties: Parties { customer: Some("Mill & Sons"), technician: Some("A. Turner") },
        before: None,
        source: super::THE_LINE,
        written,
        gathered,
    }
    .html()
    .into_string()
}

/// The chapter of a drive, without its tags: its texts, one a line.
fn chapter(html: &str, name: &str) -> String {
    let begin = html.find(&format!("<h3>{name}</h3>")).unwrap_or_else(|| panic!("{name} has no chapter"));
    let end = html[begin..].find("</section>").unwrap() + begin;
    texts(&html[begin..end])
}

/// Without the marks of what is the program's own: a sentence goes on behind it.
fn unmarked(html: &str) -> String {
    let mut parts = html.split("<span class=\"own\">");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |text, part| text + &part.replacen("</span>", "", 1))
}

fn texts(html: &str) -> String {
    let mut text = String::new();
    let html = unmarked(html);
    for part in html.split('<') {
        let (_, said) = part.split_once('>').unwrap_or(("", part));
        text.push_str(said.trim());
        text.push('\n');
    }
    text
}

#[tokio::test(start_paused = true)]
async fn a_report_of_five_families_with_one_tripped_and_one_dead_says_so_and_writes_to_none() {
    let bench = Bench::new();
    // BBV51701, LFT: 9 is OCF.
    bench.machine(Family::ATV312).trip(9);
    bench.machine(Family::ATV28).mute();
    let gathered = bench.read(true).await;
    let html = html(&gathered);
    for (name, machine) in &bench.machines {
        for function in WRITES {
            assert_eq!(machine.requests(function), 0, "{name}: function {function}");
        }
        let chapter = chapter(&html, &name.to_string());
        assert!(chapter.contains(name.family.capabilities().name), "{chapter}");
    }
    assert_eq!(bench.line.violations(), []);
    let tripped = chapter(&html, "atv312@4");
    assert!(tripped.contains("Tripped: 9 OCF: ") && tripped.contains("What to do: "), "{tripped}");
    assert!(!tripped.contains("No fault is present"), "{tripped}");
    let dead = chapter(&html, "atv28@2");
    assert!(dead.contains("not read: the drive did not answer"), "{dead}");
    assert!(!dead.contains("No fault is present") && !dead.contains("\nNone.\n"), "{dead}");
    let attention =
        texts(&html[html.find("What needs attention").unwrap()..html.find("at a glance").unwrap()]);
    assert!(attention.contains("\ndoes not answer\n: "), "{attention}");
    assert!(attention.contains("\ntripped\n: 9 OCF"), "{attention}");
    assert_eq!(gathered.silent(), ["atv28@2"]);
}

#[tokio::test(start_paused = true)]
async fn what_differs_from_factory_stands_there_in_its_unit_and_what_cannot_be_judged_apart() {
    let bench = Bench::new();
    // BBV51701 p. 39: ACC, 3.0 s from the factory, in tenths.
    assert!(bench.machine(Family::ATV312).poke(9_001, 125));
    let html = html(&bench.read(true).await);
    let chapter = chapter(&html, "atv312@4");
    let ramp = chapter.split_once("\nACC\n").map(|(_, row)| row.lines().take(6).collect::<Vec<_>>()).unwrap();
    assert_eq!((ramp[3], ramp[5]), ("12.5 s", "3.0 s"), "{ramp:?}");
    let (judged, unjudged) = chapter.split_once("that cannot be judged").unwrap();
    // p. 30: the nominal current depends on the drive's rating, so no number is printed.
    assert!(unjudged.contains("\nnCr\n") && !judged.contains("\nnCr\n"), "{chapter}");
    assert!(unjudged.contains("the manual has a rule") || unjudged.contains("prints no factory setting"));
}

#[tokio::test(start_paused = true)]
async fn what_was_not_asked_for_is_said_to_be_left_out_and_never_looks_like_no_difference() {
    let bench = Bench::new();
    let gathered = bench.read(false).await;
    let html = html(&gathered);
    for (name, _) in &bench.machines {
        let chapter = chapter(&html, &name.to_string());
        assert!(chapter.contains("not read: left out, as was asked"), "{chapter}");
        assert!(!chapter.contains("\nNone.\n"), "{chapter}");
    }
}

#[tokio::test(start_paused = true)]
async fn answer_times_are_those_of_the_simulator_and_each_slave_has_its_picture() {
    let bench = Bench::new();
    for (_, machine) in &bench.machines {
        machine.set_turnaround(Some(Duration::from_millis(25)));
    }
    bench.machine(Family::ATV21).mute();
    let gathered = bench.read(false).await;
    let line = gathered.lines[0].as_ref().unwrap();
    for slave in line.line.slaves.iter().filter(|slave| slave.slave != 1) {
        let half = slave.answer_ms.unwrap().p50;
        assert!((25.0..28.2).contains(&half), "{slave:?}");
    }
    let html = html(&gathered);
    let answers = &html[html.find("How long answers took").unwrap()..html.find("Errors by kind").unwrap()];
    assert_eq!((answers.matches("<svg").count(), answers.matches("has not answered").count()), (4, 1));
    assert!(
        answers.contains(">20</text>") && answers.contains(">50</text>"),
        "the axis is labelled: {answers}"
    );
    let errors = &html[html.find("Errors by kind").unwrap()..html.find("Availability").unwrap()];
    assert!(errors.contains("class=\"no_answer\""), "{errors}");
    let texts = texts(&html[html.find("Plan against measured").unwrap()..html.find("How long").unwrap()]);
    // Modbus over serial line V1.02, 2.5.1.1: 3.5 characters of 10 bits at 19200 bit/s.
    assert!(texts.contains("1.82 ms are needed"), "{texts}");
    assert!(texts.contains("\nno stop was sent\n"), "{texts}");
}

#[tokio::test(start_paused = true)]
async fn hostile_names_are_shown_as_they_are_written_and_do_nothing() {
    let bench = Bench::new();
    let mut gathered = bench.read(false).await;
    let name = "<script>alert(1)</script>\"><img src=x onerror=alert(2)>";
    for drive in &mut gathered.drives {
        let known = &mut drive.view.snapshot;
        known.name = name.into();
        known.error = Some(name.to_owned());
        let identity = Identity { model: Some(name.to_owned()), ..Identity::default() };
        known.identity = IdentityCheck::Same(identity.into());
        known.watchdog = WatchdogCheck::Broken(name.to_owned());
        drive.faults = Err(name.to_owned());
        let settings = &mut drive.settings.as_mut().unwrap().settings;
        settings.commanders = drive_fleet::Commanders::Only(vec![name.to_owned()]);
    }
    let line = gathered.lines[0].as_mut().unwrap();
    line.line.name = name.to_owned();
    line.line.slaves[0].drive = Some(name.to_owned());
    line.line.error = Some(name.to_owned());
    line.line.link = LineLink::Away;
    let event = serde_json::json!([{"kind": "event", "revision": 1, "time_unix_ms": 1, "drive": name,
        "event": "lost", "silent_for_ms": 1, "order": 1, "cause": {"by": "drive"}, "alarm": true, "text": name}]);
    gathered.events = Ok(serde_json::from_value(event).unwrap());
    let notes = [name.to_owned()];
    let written = Local::now().fixed_offset();
    let (parties, before) = (Parties { customer: Some(name), technician: None }, None);
    let page =
        Page { title: name, notes: &notes, parties, before, source: name, written, gathered: &gathered };
    let html = page.html().into_string();
    assert!(html.matches("&lt;script&gt;").count() > 10, "it is shown");
    for tag in ["<script", "<img", "onerror=alert(2)>\"", "http://", "https://", "url(", "@import"] {
        assert!(!html.contains(tag), "{tag}");
    }
    // Inside a tag nothing of it stands but between quotes.
    let tags = html.split('<').filter_map(|part| Some(part.split_once('>')?.0));
    let bare = tags.flat_map(|tag| tag.split('"').step_by(2).collect::<Vec<_>>());
    assert!(bare.into_iter().all(|outside| !outside.contains("onerror")));
}

/// Two days of a drive, as the API tells them.
fn days() -> Vec<drived_plant::plant::past::DayView> {
    let day = |day: &str, running_ms: u64, trips: serde_json::Value| {
        serde_json::json!({
            "drive": "pump", "day": day, "start_unix_ms": 0, "known": 0.5, "running_ms": running_ms, "starts": 3, "trips": trips,
            "above_limits_ms": 60_000, "warning_ms": 0, "greatest_current_a": 7.25,
            "energy": { "amount": 1.25, "from": "summed" },
        })
    };
    let all = [
        day("2026-11-22", 7_200_000, serde_json::json!({ "9 OCF: overcurrent": 2 })),
        day(
            "2026-11-23",
            3_600_000,
            serde_json::json!({ "9 OCF: overcurrent": 1, "16 OHF: drive overheating": 1 }),
        ),
    ];
    serde_json::from_value(all.into()).unwrap()
}

#[tokio::test(start_paused = true)]
async fn what_the_history_kept_of_the_last_days_is_told_of_each_drive_and_nothing_where_none_is_kept() {
    let bench = Bench::new();
    let mut gathered = bench.read(false).await;
    assert!(!html(&gathered).contains("The last thirty days"), "the line alone keeps no history");
    gathered.drives[0].past = Some(Ok(days()));
    let told = chapter(&html(&gathered), gathered.drives[0].name());
    for expected in [
        "3 h",
        "6",
        "2.5 kWh summed up from its power",
        "50 %",
        "7.2 A",
        "3 × 9 OCF: ",
        "overcurrent",
        "1 × 16 OHF: ",
    ] {
        assert!(told.contains(expected), "{expected}: {told}");
    }
    gathered.drives[0].past = Some(Err("the disk is full".to_owned()));
    assert!(chapter(&html(&gathered), gathered.drives[0].name()).contains("not read: the disk is full"));
}

/// What a line may find wrong with itself, as the API tells it.
fn found_wrong() -> Vec<FindingView> {
    let found = |finding: &Finding, told_from: Option<&str>| {
        let mut told = serde_json::json!({
            "defect": finding.defect.name(), "slave": finding.slave, "cannot_be_told_from": told_from,
            "text": finding.to_string(), "next": finding.next(),
        });
        let figures = serde_json::to_value(FindingFigures::from(finding)).unwrap();
        told.as_object_mut().unwrap().extend(figures.as_object().unwrap().clone());
        serde_json::from_value(told).unwrap()
    };
    let finding = |slave, defect, share, certainty| Finding { slave: Some(slave), defect, share, certainty };
    let two = Certainty::CannotBeToldFrom(Alike::OldAnswers);
    vec![
        found(&finding(9, Defect::RefusesAll(2), (5, 5), Certainty::Certain), None),
        found(&finding(1, Defect::TwoAtOneAddress, (4, 7), two), Some(&Alike::OldAnswers.to_string())),
    ]
}

#[tokio::test(start_paused = true)]
async fn the_words_of_a_report_are_french_and_none_is_missing() {
    let bench = Bench::new();
    bench.machine(Family::ATV312).trip(9);
    bench.machine(Family::ATV28).mute();
    let mut gathered = bench.read(true).await;
    gathered.drives[0].past = Some(Ok(days()));
    gathered.drives[1].past = Some(Ok(Vec::new()));
    gathered.lines[0].as_mut().unwrap().line.findings = found_wrong();
    let found = super::french::found(gathered.lines.iter().flatten());
    let english = html(&gathered);
    let others = of_others(&gathered);
    let missing = super::french::untranslated(&english, &found);
    let missing: BTreeSet<_> =
        missing.iter().filter(|text| is_prose(text) && !others.contains(*text)).collect();
    assert!(missing.is_empty(), "{missing:#?}");
    let french = super::french::translated(&english, &found);
    for text in [
        "lang=\"fr\"",
        "Les variateurs en un coup d’œil",
        "Déclenché\u{a0}: ",
        "technicien",
        "Mill &amp; Sons",
        "lieu et date",
        "l’exception 02h (il n’a pas ce registre), aucune n’a eu de valeur",
        "un maître ne peut pas le distinguer d’un intermédiaire qui redonne d’anciennes réponses",
    ] {
        assert!(french.contains(text), "{text}");
    }
    // Nor does a sentence of the program stand in it unmarked: no line of prose is the same in both.
    let french_lines: BTreeSet<_> = texts(&french).lines().map(str::to_owned).collect();
    let said = texts(&english[english.find("<body>").unwrap()..]);
    let same: BTreeSet<_> = said.lines().filter(|line| french_lines.contains(*line)).collect();
    let others = of_others(&gathered);
    let is_others =
        |line: &str| others.contains(line) || line.contains("4711") || line.ends_with(", drived 0.1.0");
    let same: Vec<_> = same.into_iter().filter(|line| is_prose(line) && !is_others(line)).collect();
    assert!(same.is_empty(), "{same:#?}");
    // What was said by others is as it was.
    for text in ["Hall 3", "order &lt;4711&gt;", "ATV312"] {
        assert_eq!(french.matches(text).count(), english.matches(text).count(), "{text}");
    }
}

/// Whether a text has a word that is not a mnemonic.
fn is_prose(text: &str) -> bool {
    text.split(' ').any(|word| word.len() > 2 && word.chars().all(|one| one.is_ascii_lowercase()))
}

/// What stands in a report as the manuals and the drives say it: names of registers and their values, names, the port.
fn of_others(gathered: &Gathered) -> BTreeSet<String> {
    let rows = Family::BUILT_IN.iter().flat_map(|family| family.capabilities().rows);
    let names = rows.map(|row| row.name.to_owned());
    let backups = gathered.drives.iter().filter_map(|drive| Some(&drive.parameters.as_ref().ok()?.held));
    let values = backups.flat_map(|held| {
        held.entries.iter().filter_map(|entry| Some(held.row(entry.row).show(*entry.held.as_ref().ok()?)))
    });
    let compared = gathered.drives.iter().filter_map(|drive| Some(&drive.parameters.as_ref().ok()?.factory));
    let differing = compared.flat_map(|compared| compared.differences.iter().chain(&compared.unjudged));
    let shown = differing.flat_map(|difference| &difference.sides).filter_map(|side| match side {
        Cell::Holds(shown, _) => Some(shown.clone()),
        _ => None,
    });
    let families = Family::BUILT_IN.iter().map(|family| family.capabilities().name.to_owned());
    // The same in both languages.
    let alike = ["bus", "local", "exception", "19200,8N1, rtu"].map(str::to_owned);
    names.chain(values).chain(shown).chain(families).chain(alike).collect()
}

#[tokio::test(start_paused = true)]
async fn what_was_changed_since_a_backup_stands_with_both_values() {
    let bench = Bench::new();
    let before = bench.read(true).await;
    let backups: Vec<_> =
        before.drives.iter().filter_map(|drive| Some(drive.parameters.as_ref().ok()?.held.clone())).collect();
    // ACC, 3.0 s from the factory (BBV52816 p. 12).
    assert!(bench.machine(Family::ATV312).poke(9_001, 45));
    let now = bench.read(true).await;
    let page = Page {
        title: "Hall 3",
        notes: &[],
        parties: Parties::default(),
        before: Some(&backups),
        source: super::THE_LINE,
        written: Local::now().fixed_offset(),
        gathered: &now,
    };
    let html = page.html().into_string();
    let changed = chapter(&html, "atv312@4");
    let since = &changed[changed.find("Changed since the backup").unwrap()..];
    let since = &since[..since.find("Parameters that differ").unwrap()];
    assert!(since.contains("ACC") && since.contains("3.0 s") && since.contains("4.5 s"), "{since}");
    assert!(!since.contains("dEC"), "{since}");
    assert!(chapter(&html, "atv21@1").contains("Nothing was changed."));
    assert!(!html.contains("place and date"), "nobody is to sign");
}
