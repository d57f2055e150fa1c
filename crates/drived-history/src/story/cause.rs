//! Why something happened, as far as the facts say so.

use drived_plant::plant::past::{
    Certainty::{Likely, NotKnown, Said, Seen},
    RecordView, SentenceView as Sentence,
};

use super::facts::{Cause, Facts, body};

/// What comes within this time of each other may have one cause.
const TOGETHER_MS: i64 = 5_000;
/// A command may be the cause of what the drive does within this time.
const OBEYED_MS: i64 = 10_000;
/// A silence may be the cause of a trip of the watchdog within this time.
const SILENT_MS: i64 = 90_000;
/// The slow set is read so rarely that what it shows belongs to something within this time.
const BESIDE_MS: i64 = 60_000;

/// Why this happened, the surest first. It is never empty.
pub(super) fn causes(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let mut said = match &*about.what {
        "tripped" => of_trip(facts, about),
        "lost" => of_loss(facts, about),
        "state_changed" => of_change(facts, about),
        "control_taken" => at_the_drive(
            facts,
            about,
            format!("the drive says so: {}", about.text),
            "who it was cannot be seen from the line",
        ),
        "output_blocked" | "reference_taken" | "command_overridden" => at_the_drive(
            facts,
            about,
            format!("the drive's own words show it: {}", about.text),
            "who or what did it at the drive cannot be seen from the line",
        ),
        "stop_unconfirmed" => of_unconfirmed_stop(facts, about),
        "output_departed" => of_departure(facts, about),
        _ if about.kind == "command" => {
            vec![Sentence::of(Seen, format!("it was asked for here: {}", about.text))]
        }
        _ => vec![Sentence::of(Seen, about.text.clone())],
    };
    said.extend(program(facts, about.time_unix_ms));
    said
}

/// What somebody or something did at the drive itself.
fn at_the_drive(facts: &Facts, about: &RecordView, said: String, open: &str) -> Vec<Sentence> {
    let mut all = vec![Sentence::of(Said, said)];
    all.extend(seen_beside(facts, about.time_unix_ms));
    all.push(Sentence::of(NotKnown, open));
    all
}

/// What was seen at the drive and on its line beside something that nobody here asked for: inputs, and frames of others.
fn seen_beside(facts: &Facts, at: i64) -> Vec<Sentence> {
    let mut said = Vec::new();
    for pair in facts.inputs.windows(2) {
        let ((_, before), (seen, now)) = (pair[0], pair[1]);
        if before != now && (at - BESIDE_MS..=at + BESIDE_MS).contains(&seen) {
            let text = format!(
                "its inputs changed from {before:04X}h to {now:04X}h, seen when they were read next ({})",
                bits(before, now)
            );
            said.push(Sentence::of(Seen, text).at(seen));
            let text = "an input of the drive may have done it: what each does is in the drive's settings";
            said.push(Sentence::of(Likely, text));
            break;
        }
    }
    let heard = facts.foreigners.iter().find(|(ended, _)| (at..=at + BESIDE_MS).contains(ended));
    if let Some((ended, frames)) = heard {
        let text = format!("its line heard {frames} frames of somebody else in the minute until then");
        said.push(Sentence::of(Seen, text).at(*ended));
        said.push(Sentence::of(
            Likely,
            "another master speaks on the line: it may have written to the drive",
        ));
    }
    let finding = facts.records.iter().find(|found| {
        found.what == "line_finding"
            && found.line == facts.line
            && (found.time_unix_ms - at).abs() <= 5 * BESIDE_MS
    });
    if let Some(finding) = finding {
        said.push(
            Sentence::of(Seen, format!("what was found of its line: {}", finding.text))
                .at(finding.time_unix_ms),
        );
    }
    said
}

/// Which bits changed, in words.
fn bits(before: i64, now: i64) -> String {
    let changed = (0..16).filter(|bit| (before ^ now) >> bit & 1 == 1);
    let told = changed.map(|bit| format!("bit {bit} is {} now", now >> bit & 1));
    told.collect::<Vec<_>>().join(", ")
}

fn of_departure(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let mut said = vec![Sentence::of(Seen, about.text.clone()), nobody_asked(facts, about.time_unix_ms)];
    said.extend(seen_beside(facts, about.time_unix_ms));
    said.push(Sentence::of(
        NotKnown,
        "a limit of current or torque, the mains, its settings, or somebody else's reference: which, the line does not show",
    ));
    said
}

/// That nobody here asked for something, where that is known.
fn nobody_asked(facts: &Facts, at: i64) -> Sentence {
    match facts.missing(at - OBEYED_MS, at) {
        None => Sentence::of(Seen, "nobody here asked for it"),
        Some(why) => Sentence::of(
            NotKnown,
            format!("whether somebody here asked for it is not known: no command is recorded, and {why}"),
        ),
    }
}

fn of_trip(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let at = about.time_unix_ms;
    // What the drive said of it was read a moment later.
    let explained = facts.explained(about);
    let faults = [Some(about), explained].into_iter().flatten().filter_map(|found| body(found).fault);
    let (by_watchdog, is_found) = faults.fold((false, false), |(by_watchdog, is_found), fault| {
        (by_watchdog || fault.by_watchdog, is_found || fault.found)
    });
    let text = facts.in_words(about);
    let mut said = vec![match text.contains(": ") {
        true => Sentence::of(Said, format!("the drive itself says what it tripped by: {text}")),
        false => Sentence::of(NotKnown, "that it tripped the drive shows; by what was not read from it"),
    }];
    if let Some(kept) = facts.own_record(about) {
        said.push(Sentence::of(Said, kept.text.clone()));
    }
    if is_found {
        let text = "it was found tripped when it was seen again: when that happened is not known";
        said.push(Sentence::of(NotKnown, text));
    }
    if by_watchdog {
        said.extend(of_silence(facts, at));
    } else {
        said.push(Sentence::of(NotKnown, "what brought it there (load, mains, wiring, setting) the line does not show; the values before it are below"));
    }
    let (tripped, lost) =
        (facts.elsewhere("tripped", at, TOGETHER_MS), facts.elsewhere("lost", at, TOGETHER_MS));
    // Those whose watchdog acted share the line, and what became of that is told above.
    if !by_watchdog && (!tripped.is_empty() || !lost.is_empty()) {
        let mut parts = Vec::new();
        if !tripped.is_empty() {
            parts.push(format!("{} tripped", names(&tripped)));
        }
        if !lost.is_empty() {
            parts.push(format!("{} fell silent", names(&lost)));
        }
        let text = format!(
            "{} within {} s of it: one cause outside of this drive, such as the mains, is likely",
            parts.join(" and "),
            TOGETHER_MS / 1_000
        );
        said.push(Sentence::of(Likely, text));
    }
    if let Some(asked) = asked_before(facts, about, &["start", "setpoint", "stop"]) {
        said.push(
            Sentence::of(Seen, format!("shortly before it somebody had asked: {}", asked.text))
                .at(asked.time_unix_ms),
        );
    }
    let departed = facts.records.iter().rev().find(|found| {
        found.what == "output_departed"
            && facts.is_of_drive(found)
            && (at - SILENT_MS..=at).contains(&found.time_unix_ms)
    });
    if let Some(departed) = departed {
        said.push(Sentence::of(Seen, format!("before it, its {}", departed.text)).at(departed.time_unix_ms));
    }
    said
}

/// Why a drive heard nothing for so long that its watchdog acted.
fn of_silence(facts: &Facts, at: i64) -> Vec<Sentence> {
    let within = |found: &&RecordView| (at - SILENT_MS..=at).contains(&found.time_unix_ms);
    let own = facts
        .records
        .iter()
        .filter(within)
        .find(|found| found.what == "lost" && found.drive.as_deref() == Some(&*facts.drive));
    match own {
        Some(lost) => {
            let mut said = vec![
                Sentence::of(Seen, format!("it had not answered before: {}", lost.text))
                    .at(lost.time_unix_ms),
            ];
            said.extend(of_loss(facts, lost));
            said
        }
        None => vec![match facts.missing(at - SILENT_MS, at).filter(|why| why.starts_with("this program")) {
            Some(why) => Sentence::of(Likely, format!("{why}, so that nobody here spoke to it")),
            None => Sentence::of(
                NotKnown,
                "why it heard no message for so long is not known: nothing of it was seen from here",
            ),
        }],
    }
}

fn of_loss(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let at = about.time_unix_ms;
    let away = facts.records.iter().find(|found| {
        let is_near = (found.time_unix_ms - at).abs() <= 4 * TOGETHER_MS;
        is_near
            && found.kind == "alarm"
            && found.line == facts.line
            && found.drive.is_none()
            && matches!(&*found.what, "unacknowledged" | "acknowledged" | "shelved")
            && body_of_alarm(found).as_deref() == Some("line_away")
    });
    if let Some(away) = away {
        return vec![
            Sentence::of(Seen, format!("the port of the line was away: {}", away.text)).at(away.time_unix_ms),
            Sentence::of(NotKnown, "who unplugged it, or what broke, the program cannot see"),
        ];
    }
    let neighbours = facts.neighbours();
    let lost = facts.elsewhere("lost", at, 2 * TOGETHER_MS);
    let (on_line, elsewhere): (Vec<&RecordView>, Vec<&RecordView>) =
        lost.into_iter().partition(|found| found.line == facts.line);
    if !elsewhere.is_empty() {
        return vec![
            Sentence::of(
                Seen,
                format!("{} fell silent with it, on other lines too", names_of([&on_line, &elsewhere])),
            ),
            Sentence::of(
                Likely,
                "what they share across the lines is the likely cause: the mains, the supply of the adapters, or this computer; which of them is not known",
            ),
        ];
    }
    if let Some(why) =
        facts.missing(at - 2 * TOGETHER_MS, at + 2 * TOGETHER_MS).filter(|_| on_line.is_empty())
    {
        return vec![Sentence::of(
            NotKnown,
            format!("whether others fell silent with it is not known: {why}"),
        )];
    }
    match on_line.len() {
        0 => {
            let others = match neighbours.is_empty() {
                // A drive to which nothing happened has no record: that nobody else is there is not known.
                true => "nothing is recorded of another drive of its line around then".to_owned(),
                false => format!(
                    "no other drive of its line is recorded as lost within {} s of it",
                    2 * TOGETHER_MS / 1_000
                ),
            };
            vec![
                Sentence::of(Seen, others),
                Sentence::of(
                    NotKnown,
                    "its supply, its branch of the cable, its address or its settings: which, the line does not show",
                ),
            ]
        }
        _ => vec![
            Sentence::of(Seen, format!("{} of its line fell silent with it", names(&on_line))),
            Sentence::of(
                Likely,
                "what they share is the likely cause: the cable, its adapter, or the supply of these drives; which of them is not known",
            ),
        ],
    }
}

fn of_change(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    match body(about).cause {
        Some(Cause::Command { commander, door }) => {
            let door = door.map(|door| format!(" through {door}")).unwrap_or_default();
            let mut said = vec![Sentence::of(Seen, format!("{commander} asked for it{door}"))];
            said.extend(
                asked_before(facts, about, &["start", "stop", "release", "reset"])
                    .map(|asked| Sentence::of(Seen, asked.text.clone()).at(asked.time_unix_ms)),
            );
            said
        }
        Some(Cause::Policy { policy }) => {
            let policy = policy.replace('_', " ");
            vec![Sentence::of(Seen, format!("this program did it by itself, by its policy: {policy}"))]
        }
        Some(Cause::Found) => vec![Sentence::of(
            NotKnown,
            "it was found so when the drive was seen again: when and why it changed is not known",
        )],
        Some(Cause::Drive) | None => {
            let mut said = Vec::new();
            match asked_before(facts, about, &["stop", "release"]) {
                Some(asked) => said.push(
                    Sentence::of(Likely, format!("a command of here came shortly before: {}", asked.text))
                        .at(asked.time_unix_ms),
                ),
                None => said.push(nobody_asked(facts, about.time_unix_ms)),
            }
            said.extend(seen_beside(facts, about.time_unix_ms));
            said.push(Sentence::of(
                NotKnown,
                "its terminals, its panel, another master or the drive itself: which of them it was is not known, but for what its words show below",
            ));
            said
        }
    }
}

fn of_unconfirmed_stop(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
    let mut said = Vec::new();
    if let Some(asked) = asked_before(facts, about, &["stop"]) {
        said.push(
            Sentence::of(Seen, format!("the stop was asked for here: {}", asked.text)).at(asked.time_unix_ms),
        );
    }
    said.push(Sentence::of(Seen, format!("the drive did not show that it had stopped: {}", about.text)));
    let is_lost = facts.records.iter().any(|found| {
        found.what == "lost"
            && facts.is_of_drive(found)
            && (found.time_unix_ms - about.time_unix_ms).abs() <= SILENT_MS
    });
    said.push(match is_lost {
        true => Sentence::of(
            NotKnown,
            "it did not answer at that time: whether its motor turned nobody here knows",
        ),
        false => {
            Sentence::of(NotKnown, "it answered, and why it did not stop its words do not say for certain")
        }
    });
    said
}

/// What the program itself has to do with it: it was not there, or its clock was set.
fn program(facts: &Facts, at: i64) -> Vec<Sentence> {
    let is_near = |found: &&RecordView| {
        found.kind == "history" && (at - SILENT_MS..=at + TOGETHER_MS).contains(&found.time_unix_ms)
    };
    facts
        .records
        .iter()
        .filter(is_near)
        .filter(|found| {
            matches!(&*found.what, "began" | "began_after_kill" | "ended" | "hole" | "clock_stepped")
        })
        .map(|found| Sentence::of(Seen, found.text.clone()).at(found.time_unix_ms))
        .collect()
}

/// The last command to the drive shortly before something, of these actions.
fn asked_before<'a>(facts: &'a Facts, about: &RecordView, actions: &[&str]) -> Option<&'a RecordView> {
    let at = about.time_unix_ms;
    facts.records.iter().rev().find(|found| {
        found.kind == "command"
            && actions.contains(&&*found.what)
            && facts.is_of_drive(found)
            && (at - OBEYED_MS..=at).contains(&found.time_unix_ms)
            && was_sent(facts, found)
    })
}

/// Whether a command was, or may have been, on the wire: one that was refused moved nothing.
fn was_sent(facts: &Facts, found: &RecordView) -> bool {
    let outcome = facts.of_several(found).map(|one| one.outcome).or_else(|| body(found).outcome);
    !matches!(outcome.as_deref(), Some("refused" | "expired" | "superseded" | "nothing"))
}

fn body_of_alarm(found: &RecordView) -> Option<String> {
    #[derive(serde::Deserialize)]
    struct Alarm {
        kind: String,
    }
    let alarm: Alarm = serde_json::from_str(found.body.as_ref()?.get()).ok()?;
    Some(alarm.kind)
}

fn names_of<const N: usize>(found: [&Vec<&RecordView>; N]) -> String {
    names(&found.into_iter().flatten().copied().collect::<Vec<_>>())
}

fn names(found: &[&RecordView]) -> String {
    let mut names: Vec<&str> = found.iter().filter_map(|found| found.drive.as_deref()).collect();
    names.sort_unstable();
    names.dedup();
    match names.len() {
        0..=5 => names.join(", "),
        more => format!("{} and {} more", names[..5].join(", "), more - 5),
    }
}
