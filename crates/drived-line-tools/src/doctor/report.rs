//! What a person reads: in short on the terminal, whole in a file that can be sent to somebody.

use std::{fmt, time::Duration};

use drive_bus::{Endpoint, adapter_latency};
use drive_families::Family;

use super::{
    judge::habits,
    observations::{Asked, Figures, Observations},
    verdict::{Defect, Verdict},
};
use drived_words::{
    line_spec,
    output::{self, Table},
};

/// The damaged frames that a report shows, the last ones.
const SHOWN: usize = 12;

/// Above what a drive from a file does not tell.
const NOT_KNOWN: &str = "What nobody can know of these drives";

/// The bytes of a frame that it shows.
const LONGEST: usize = 24;

/// What was noticed, and what it means.
pub(super) struct Diagnosis<'a> {
    /// When, for a person.
    pub(super) date: String,
    pub(super) verdicts: Vec<Verdict>,
    pub(super) seen: &'a Observations,
}

impl Diagnosis<'_> {
    /// The figures of those that answered or should have, and the verdicts.
    pub(super) fn short(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let figures = self.figures();
        if !figures.is_empty() {
            lines.extend([counts(self.seen, &figures).on_terminal().to_string(), String::new()]);
            if figures.iter().any(Figures::is_there) {
                lines.extend([times(self.seen, &figures).on_terminal().to_string(), String::new()]);
            }
        }
        lines.extend(self.words());
        let unseen = self.not_known();
        if !unseen.is_empty() {
            lines.extend([String::new(), NOT_KNOWN.to_owned()]);
            lines.extend(unseen.into_iter().map(|said| format!("  {said}")));
        }
        lines
    }

    /// What nobody can know of the drives that are named, family by family.
    pub(super) fn not_known(&self) -> Vec<String> {
        let mut families: Vec<_> = self.seen.expected.iter().map(|name| name.family).collect();
        families.dedup();
        let said = |family: Family| family.not_known().iter().map(move |said| format!("{family}: {said}"));
        families.into_iter().flat_map(said).collect()
    }

    /// The verdicts in words.
    fn words(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for verdict in &self.verdicts {
            if !lines.is_empty() {
                lines.push(String::new());
            }
            lines.push(title(verdict.defect).to_owned());
            lines.push(format!("  {}. {}", verdict.finding, verdict.certainty));
            lines.push("  Next:".to_owned());
            lines.extend(
                verdict.next.iter().enumerate().map(|(number, step)| format!("  {}. {step}", number + 1)),
            );
        }
        if self.verdicts.is_empty() {
            lines.push(self.healthy());
        }
        let tripped = self.tripped();
        if !tripped.is_empty() {
            let stand = if tripped.len() == 1 { "stands" } else { "stand" };
            lines.push(format!(
                "{} {stand} TRIPPED, whatever the line does: see faults, and reset what may be",
                tripped.join(", ")
            ));
        }
        if let Some(why) = &self.seen.cut_short {
            lines.push(format!("judged from the first {}: {why}", output::bound(self.seen.took)));
        }
        lines
    }

    /// The drives that stand tripped.
    pub(super) fn tripped(&self) -> Vec<String> {
        self.seen.tripped.iter().map(|slave| self.seen.name(*slave)).collect()
    }

    fn healthy(&self) -> String {
        let figures = self.figures();
        let (asked, good) =
            figures.iter().fold((0, 0), |(asked, good), one| (asked + one.asked, good + one.answered));
        let mut times: Vec<Duration> =
            figures.iter().flat_map(|figures| figures.times.iter().copied()).collect();
        times.sort_unstable();
        let slowest = times.last().copied().unwrap_or_default();
        let ran = self.seen.asked.iter().flat_map(|asked| &asked.running).any(|running| !running.is_empty());
        let running = match (ran, self.seen.expected.is_empty()) {
            (true, _) => "some of it with motors running",
            (false, false) => "with no motor running: do it again while they run",
            (false, true) => "whether motors ran is not known without --drive",
        };
        format!(
            "healthy: {good} of {asked} questions answered by {}, the slowest after {}; {running}",
            output::counted(figures.len(), "drive", "drives"),
            output::milliseconds(slowest)
        )
    }

    /// Of those that should be there or are.
    pub(super) fn figures(&self) -> Vec<Figures> {
        let expected = |slave| self.seen.expected.iter().any(|name| name.slave.number() == slave);
        let mut figures = self.seen.figures();
        figures.retain(|figures| expected(figures.slave) || figures.is_there() || figures.damaged > 0);
        figures
    }
}

/// The whole report.
impl fmt::Display for Diagnosis<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seen, .. } = self;
        writeln!(f, "Report of a line, by drived {}, {}", env!("CARGO_PKG_VERSION"), self.date)?;
        writeln!(f)?;
        writeln!(f, "Line      {}", line_spec::describe(&seen.config))?;
        writeln!(f, "Silence   {}", output::milliseconds(seen.config.silence()))?;
        writeln!(f, "Adapter   {}", adapter(seen))?;
        let drives = match seen.expected.len() {
            0 => format!(
                "not said; {} were asked",
                output::counted(seen.addresses.len(), "address", "addresses")
            ),
            _ => seen.expected.iter().map(ToString::to_string).collect::<Vec<_>>().join(" "),
        };
        writeln!(f, "Drives    {drives}")?;
        writeln!(
            f,
            "Done      listened for {}, asked {} questions, {} in all; nothing was written",
            output::bound(seen.listened.time),
            seen.asked.len(),
            output::bound(seen.took)
        )?;
        section(f, "Verdicts")?;
        lines(f, &self.words())?;
        let unseen = self.not_known();
        if !unseen.is_empty() {
            section(f, NOT_KNOWN)?;
            lines(f, &unseen)?;
        }
        let figures = self.figures();
        if !figures.is_empty() {
            section(f, "Questions")?;
            writeln!(f, "{}", counts(seen, &figures))?;
        }
        if figures.iter().any(Figures::is_there) {
            section(f, "From the end of a question to its answer")?;
            writeln!(f, "{}", times(seen, &figures))?;
        }
        section(f, "Heard while nothing was asked")?;
        writeln!(
            f,
            "{} intact frames, {} bytes that make none",
            seen.listened.frames().count(),
            seen.listened.noise().count()
        )?;
        for habit in habits(seen) {
            writeln!(f, "a question {habit}")?;
        }
        for (serial, heard) in &seen.elsewhere {
            let frames = heard.frames().count();
            writeln!(
                f,
                "at {serial}: {frames} intact frames, {} bytes that make none",
                heard.noise().count()
            )?;
        }
        section(f, "The last damaged frames")?;
        let damaged: Vec<&Asked> = seen.asked.iter().filter(|asked| asked.is_garbled()).collect();
        if damaged.is_empty() {
            return writeln!(f, "none");
        }
        for asked in damaged.iter().rev().take(SHOWN).rev() {
            let at = asked.began.as_millis();
            writeln!(f, "{}.{:03} s  {}", at / 1_000, at % 1_000, seen.name(asked.slave))?;
            writeln!(f, "  asked  {}", hex(&asked.request))?;
            writeln!(f, "  heard  {}", hex(&asked.heard))?;
        }
        Ok(())
    }
}

fn section(f: &mut fmt::Formatter<'_>, title: &str) -> fmt::Result {
    writeln!(f, "\n{title}\n{}", "-".repeat(title.chars().count()))
}

/// Lines of a report are no longer than those of a mail.
fn lines(f: &mut fmt::Formatter<'_>, texts: &[String]) -> fmt::Result {
    texts.iter().flat_map(|text| output::hanging(text, 76)).try_for_each(|line| writeln!(f, "{line}"))
}

fn adapter(seen: &Observations) -> String {
    let driver = seen.adapter.driver.as_deref().unwrap_or("its driver is not known");
    let latency = match (seen.adapter.latency, &seen.config.endpoint) {
        (Some(latency), _) => format!("latency timer {}", output::bound(latency)),
        (None, Endpoint::Serial(path)) if adapter_latency(path).is_none() => "no latency timer".to_owned(),
        (None, _) => "no serial port of this computer".to_owned(),
    };
    let echo = seen.asked.iter().filter(|asked| asked.echoed).count();
    let echo = if echo * 2 > seen.asked.len() { ", echoes what is sent" } else { "" };
    format!("{driver}, {latency}{echo}")
}

fn counts(seen: &Observations, figures: &[Figures]) -> Table {
    let mut table =
        Table::new(["drive", "asked", "good", "silent", "damaged", "late", "stray"]).with_numbers_from(1);
    for one in figures {
        table.row([
            seen.name(one.slave),
            one.asked.to_string(),
            one.answered.to_string(),
            one.silent.to_string(),
            one.damaged.to_string(),
            one.late.to_string(),
            one.stray.to_string(),
        ]);
    }
    table
}

fn times(seen: &Observations, figures: &[Figures]) -> Table {
    let mut table =
        Table::new(["answers after", "shortest", "median", "p99", "longest"]).with_numbers_from(1);
    for one in figures.iter().filter(|one| one.is_there()) {
        let time = |percent| output::or_dash(one.quantile(percent).map(output::milliseconds));
        table.row([seen.name(one.slave), time(0), time(50), time(99), time(100)]);
    }
    table
}

fn hex(bytes: &[u8]) -> String {
    let words: Vec<String> = bytes.iter().take(LONGEST).map(|byte| format!("{byte:02X}")).collect();
    match bytes.len() {
        0 => "nothing".to_owned(),
        count if count > LONGEST => format!("{} … ({count} bytes)", words.join(" ")),
        _ => words.join(" "),
    }
}

/// A defect as a heading.
const fn title(defect: Defect) -> &'static str {
    match defect {
        Defect::NeverQuiet => "THE LINE IS NEVER QUIET",
        Defect::NothingHeard => "NOTHING IS HEARD",
        Defect::OnlyOurEcho => "ONLY OUR OWN ECHO",
        Defect::Polarity => "A AND B SWAPPED",
        Defect::WrongFraming => "WRONG SPEED OR FORMAT",
        Defect::SecondMaster => "A SECOND MASTER",
        Defect::TwoAtOneAddress => "TWO DRIVES AT ONE ADDRESS",
        Defect::Interference => "INTERFERENCE BY A MOTOR",
        Defect::DamagedAtOneAddress => "ONE DRIVE'S CONNECTION IS BAD",
        Defect::NoAnswer => "NO ANSWER FROM A DRIVE",
        Defect::NeedsPause => "THE PAUSE IS TOO SHORT FOR A DRIVE",
        Defect::AdapterHoldsBack => "THE ADAPTER HOLDS ANSWERS BACK",
        Defect::AnswersInPieces => "ANSWERS COME IN PIECES",
        Defect::LateAnswers => "LATE ANSWERS",
        Defect::SlowDrive => "A SLOW DRIVE",
        Defect::Noise => "NOISE",
        Defect::Interrupted => "NOTHING COMES FOR SOME TIME",
        Defect::FarEndFaster => "THE FAR END IS FASTER THAN ITS SPEED",
        Defect::FirstByteCut => "ANSWERS LACK THEIR FIRST BYTE",
        Defect::LastByteCut => "ANSWERS LACK THEIR LAST BYTE",
        Defect::BytesBehind => "BYTES BEHIND EACH ANSWER",
        Defect::OneAnswerBehind => "ANSWERS COME WITH THE NEXT QUESTION",
        Defect::RefusesAll => "EVERYTHING IS REFUSED",
        Defect::NumberZero => "ANSWERS WITHOUT THEIR TRANSACTION NUMBER",
        Defect::FellSilent => "IT FELL SILENT",
        Defect::LinkTimeout => "ACKNOWLEDGEMENTS COME TOO LATE",
    }
}
