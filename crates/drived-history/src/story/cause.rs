//! Why something happened, as far as the facts say so.

use drived_plant::plant::past::{
    Certainty::{Likely, NotKnown, Said, Seen},
    RecordView, SentenceView as Sentence,
};

use super::{
    facts::{Cause, Facts, begins, body},
    lasting,
};

/// What comes within this time of each other may have one cause.
const TOGETHER_MS: i64 = 5_000;
/// Drives that fell silent within this time of each other may have done so together: so much the polls and their repetitions lie apart.
const SILENT_TOGETHER_MS: i64 = 3_000;
/// What was asked for so shortly before something was seen may have come behind it: a drive is looked at from poll to poll.
const ONE_POLL_MS: i64 = 5_000;
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
        "fault_cleared" => of_change(facts, about),
        "control_taken" => at_the_drive(
            facts,
            about,
            Sentence::of(Said, format!("the drive says so: {}", about.text)),
            "who it was cannot be seen from the line",
        ),
        // That the motor follows another reference than the one that was given the drive shows, and not which one does it.
        "reference_taken" if about.text.contains("another reference") => at_the_drive(
            facts,
            about,
            Sentence::of(Likely, format!("the drive's own words speak for it: {}", about.text)),
            "a reference or a limit that was changed at the drive, or by another master: which, and who did it, cannot be seen from the line for certain",
        ),
        "output_blocked" | "reference_taken" | "command_overridden" | "run_not_adopted" => at_the_drive(
            facts,
            about,
            Sentence::of(Said, format!("the drive's own words show it: {}", about.text)),
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

/// That nothing happened, or that nobody knows.
pub(super) fn of_nothing(facts: &Facts, at: i64) -> Vec<Sentence> {
    let mut said = match facts.gap_at(at) {
        Some((start, end)) => vec![
            Sentence::of(
                NotKnown,
                format!("whether something happened then is not known: for {} from this moment on no value of it is known", lasting(end - start)),
            )
            .at(start),
        ],
        None if at < facts.from || at > facts.to => {
            vec![Sentence::of(NotKnown, "the history does not reach to that moment")]
        }
        None => vec![Sentence::of(Seen, "nothing happened to it then that is recorded").at(at)],
    };
    said.extend(program(facts, at));
    said
}

/// What somebody or something did at the drive itself.
fn at_the_drive(facts: &Facts, about: &RecordView, said: Sentence, open: &str) -> Vec<Sentence> {
    let mut all = vec![said];
    all.extend(lost_before(facts, about.time_unix_ms));
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
        said.push(found_within(facts, at, "it was found tripped when it was seen again"));
    }
    if by_watchdog {
        said.extend(of_silence(facts, at));
    } else {
        if is_found {
            said.extend(lost_before(facts, at));
        }
        said.push(Sentence::of(NotKnown, "what brought it there (load, mains, wiring, setting) the line does not show; the values before it are below"));
    }
    let (mut tripped, mut lost) =
        (facts.elsewhere("tripped", at, TOGETHER_MS), facts.elsewhere("lost", at, TOGETHER_MS));
    // Of what nobody saw happening nobody knows that it was together.
    let was_found = |found: &&RecordView| body(found).fault.is_some_and(|fault| fault.found);
    let found_too: Vec<&RecordView> =
        tripped.extract_if(.., |other| is_found || was_found(&&**other)).collect();
    if is_found {
        lost.clear();
    }
    if is_found && !found_too.is_empty() {
        let text = format!("found tripped too: {}; whether at the same time is not known", names(&found_too));
        said.push(Sentence::of(NotKnown, text));
    }
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
        said.push(in_order(facts, about, asked));
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

/// Something that was found, and within which time it happened.
fn found_within(facts: &Facts, at: i64, what: &str) -> Sentence {
    match facts.gap_before(at) {
        Some((start, end)) => Sentence::of(
            NotKnown,
            format!(
                "{what}: when that happened is not known, but that it was within the {} from this moment on, in which nothing of it is known",
                lasting(end - start)
            ),
        )
        .at(start),
        None => Sentence::of(NotKnown, format!("{what}: when that happened is not known")),
    }
}

/// That it had not answered until it was seen again.
fn lost_before(facts: &Facts, at: i64) -> Option<Sentence> {
    let (start, end) = facts.gap_before(at)?;
    let lost = facts.records.iter().rev().find(|found| {
        found.what == "lost"
            && found.drive.as_deref() == Some(&*facts.drive)
            && (start - TOGETHER_MS..=end).contains(&found.time_unix_ms)
    })?;
    let text = format!("it had not answered before, for {}: {}", lasting(end - start), lost.text);
    Some(Sentence::of(Seen, text).at(lost.time_unix_ms))
}

/// What was asked for before a trip was seen: whether it was before the trip is known only where the drive was seen between them.
fn in_order(facts: &Facts, about: &RecordView, asked: &RecordView) -> Sentence {
    let between = |found: &RecordView| {
        found.kind == "event"
            && found.drive.as_deref() == Some(&*facts.drive)
            && matches!(&*found.what, "state_changed" | "stop_confirmed")
            && found.time_unix_ms > asked.time_unix_ms
            && found.time_unix_ms < about.time_unix_ms
    };
    let was_seen = facts.records.iter().any(between);
    let is_long = about.time_unix_ms - asked.time_unix_ms > ONE_POLL_MS;
    let said = match was_seen || is_long {
        true => Sentence::of(Seen, format!("shortly before it somebody had asked: {}", asked.text)),
        false => Sentence::of(
            NotKnown,
            format!(
                "at about the same time somebody asked, and which of the two came first is not known, for the drive is looked at from poll to poll: {}",
                asked.text
            ),
        ),
    };
    said.at(asked.time_unix_ms)
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
        None => vec![match facts
            .missing(facts.gap_before(at).map_or(i64::MIN, |(start, _)| start).max(at - SILENT_MS), at)
            .filter(|why| why.starts_with("this program"))
        {
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
            && body_of_alarm(found).is_some_and(|alarm| alarm.is_port_away())
    });
    if let Some(away) = away {
        return vec![
            Sentence::of(Seen, format!("the port of the line was away: {}", away.text)).at(away.time_unix_ms),
            Sentence::of(NotKnown, "who unplugged it, or what broke, the program cannot see"),
        ];
    }
    let neighbours = facts.neighbours();
    let began = begins(about);
    let mut lost = facts.elsewhere("lost", at, 2 * TOGETHER_MS);
    lost.retain(|other| (begins(other) - began).abs() <= SILENT_TOGETHER_MS);
    let answered = facts.heard_between(began, began + SILENT_TOGETHER_MS);
    let back = facts.records.iter().filter(|found| {
        facts.is_of_drive(found)
            && found.number > about.number
            && matches!(&*found.what, "command_overridden" | "run_not_adopted")
    });
    // What takes a run command away while a drive is silent is its supply, or somebody who writes to a drive that does not answer here.
    let lost_its_run = back.map(|found| found.time_unix_ms).find(|back| {
        facts.gap_before(*back).is_some_and(|(start, _)| (start - began).abs() <= SILENT_TOGETHER_MS)
    });
    let supply = lost_its_run.map(|back| {
        Sentence::of(Likely, "when it was seen again its run command was gone, as it is behind a loss of supply: its supply was away").at(back)
    });
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
                    SILENT_TOGETHER_MS / 1_000
                ),
            };
            let mut said = vec![Sentence::of(Seen, others)];
            said.extend(supply);
            said.push(Sentence::of(
                NotKnown,
                "its supply, its branch of the cable, its address or its settings: which, the line does not show",
            ));
            said
        }
        _ => {
            let mut said =
                vec![Sentence::of(Seen, format!("{} of its line fell silent with it", names(&on_line)))];
            let shared = match answered.is_empty() {
                true => {
                    "what they share is the likely cause: the cable, its adapter, or the supply of these drives; which of them is not known"
                }
                false => {
                    "what only they share is the likely cause, such as their supply or their part of the cable; that they fell silent together may be chance"
                }
            };
            if !answered.is_empty() {
                let text = format!("{} of its line answered meanwhile", answered.join(", "));
                said.push(Sentence::of(Seen, text));
            }
            said.push(Sentence::of(Likely, shared));
            said.extend(supply);
            said
        }
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
        Some(Cause::Found) => {
            let at = about.time_unix_ms;
            let mut said = vec![found_within(facts, at, "it was found so when the drive was seen again")];
            said.extend(lost_before(facts, at));
            said
        }
        Some(Cause::Drive) | None => {
            let (mut said, at) = (Vec::new(), about.time_unix_ms);
            let changed = body(about);
            let begins_to_run = changed.to.as_deref() == Some("running");
            let actions: &[&str] = match &*about.what {
                "fault_cleared" => &["reset"],
                _ if begins_to_run => &["start"],
                _ => &["stop", "release"],
            };
            match asked_before(facts, about, actions) {
                Some(asked) => said.push(
                    Sentence::of(Likely, format!("a command of here came shortly before: {}", asked.text))
                        .at(asked.time_unix_ms),
                ),
                None => said.push(nobody_asked(facts, about.time_unix_ms)),
            }
            // A drive says with the same status who commands it.
            match facts.control_at(at + 1) {
                Some("bus") if begins_to_run => said.push(Sentence::of(
                    Likely,
                    "it says that a bus commands it: another master has started it",
                )),
                Some(control) if control != "bus" => {
                    said.push(Sentence::of(Said, format!("it says that it is commanded by: {control}")));
                }
                _ => {}
            }
            said.extend(seen_beside(facts, at));
            let who = match &*about.what {
                "fault_cleared" => {
                    "its panel, its terminals, another master or the drive itself cleared it: which of them is not known"
                }
                _ if begins_to_run => {
                    "another master, its panel, its terminals or the drive itself started it: which of them is not known for certain"
                }
                _ => {
                    "its terminals, its panel, another master or the drive itself: which of them it was is not known, but for what its words show below"
                }
            };
            said.push(Sentence::of(NotKnown, who));
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

/// An alarm as far as it is looked at here.
#[derive(serde::Deserialize)]
struct Alarm {
    kind: String,
    #[serde(default)]
    detail: Option<String>,
}

impl Alarm {
    /// Whether a port was away. A line on which nothing is heard is opened anew, and told as away as long: the cable may be, and the port there.
    fn is_port_away(&self) -> bool {
        let is_silence = |detail: &String| detail.starts_with("nothing was heard");
        self.kind == "line_away" && !self.detail.as_ref().is_some_and(is_silence)
    }
}

fn body_of_alarm(found: &RecordView) -> Option<Alarm> {
    serde_json::from_str(found.body.as_ref()?.get()).ok()
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
