//! Why a drive fell silent, and why it heard nothing.

use drived_plant::plant::past::{
    Certainty::{Likely, NotKnown, Said, Seen},
    RecordView, SentenceView as Sentence,
};

use super::{
    super::{
        body::body,
        facts::{Facts, begins, is_silent, lasting},
    },
    back::{Back, SILENT_TOGETHER_MS, Shows},
    evidence::{BESIDE_MS, SILENT_MS, TOGETHER_MS, names},
};

/// Why a drive heard nothing for so long that its watchdog acted.
pub(super) fn of_silence(facts: &Facts, at: i64) -> Vec<Sentence> {
    let within = |found: &&RecordView| (at - SILENT_MS..=at).contains(&found.time_unix_ms);
    let own = facts
        .records
        .iter()
        .filter(within)
        .find(|found| found.what == "lost" && found.drive.as_deref() == Some(&*facts.drive));
    match own {
        Some(lost) => {
            let mut said = vec![
                Sentence::of(
                    Seen,
                    format!(
                        "{} before: {}",
                        match is_silent(lost) {
                            true => "nothing had been heard of it",
                            false => "its status had not been read",
                        },
                        lost.text
                    ),
                )
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

pub(super) fn of_loss(facts: &Facts, about: &RecordView) -> Vec<Sentence> {
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
        let mut said = vec![
            Sentence::of(Seen, format!("the port of the line was away: {}", away.text)).at(away.time_unix_ms),
        ];
        said.extend(port_is_back(facts, away, begins(about)));
        said.push(Sentence::of(NotKnown, "who unplugged it, or what broke, the program cannot see"));
        said.extend(Back::behind(facts, about).told());
        return said;
    }
    let began = begins(about);
    let back = Back::behind(facts, about);
    // Nobody was asked: that they answered nothing tells nothing of them.
    if let Some(still) = stood_still(facts, began, at) {
        return [
            Sentence::of(Seen, still.text.clone()).at(still.time_unix_ms),
            Sentence::of(NotKnown, "whether it would have answered meanwhile: nobody asked it"),
        ]
        .into_iter()
        .chain(back.told())
        .collect();
    }
    if about.text.contains(": exception ") {
        let text = "it answered, by exceptions: neither its supply nor its cable was away, and it did not tell its status";
        return [
            Sentence::of(Said, text),
            Sentence::of(NotKnown, "whether it is busy, or another drive than it is set up as"),
        ]
        .into_iter()
        .chain(back.told())
        .collect();
    }
    let mut lost = facts.elsewhere("lost", at, 2 * TOGETHER_MS);
    lost.retain(|other| (begins(other) - began).abs() <= SILENT_TOGETHER_MS);
    let answered = facts.heard_between(began, began + SILENT_TOGETHER_MS);
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
                match back.shows {
                    Shows::Fed(_) => {
                        "what they share across the lines is the likely cause: the supply of the adapters, or this computer; which of them is not known"
                    }
                    _ => {
                        "what they share across the lines is the likely cause: the mains, the supply of the adapters, or this computer; which of them is not known"
                    }
                },
            ),
        ]
        .into_iter()
        .chain(back.told())
        .collect();
    }
    let why = facts.missing(at - 2 * TOGETHER_MS, at + 2 * TOGETHER_MS).or_else(|| {
        let after = facts.ends_soon_after(at).filter(|after| *after <= TOGETHER_MS)?;
        Some(format!("what is kept ends {} behind it", lasting(after)))
    });
    if let Some(why) = why.filter(|_| on_line.is_empty()) {
        let text = format!("whether others fell silent with it is not known: {why}");
        return [Sentence::of(NotKnown, text)].into_iter().chain(back.told()).collect();
    }
    match (damaged(facts, about), on_line.is_empty()) {
        (Some(damaged), _) => damaged.into_iter().chain(back.told()).collect(),
        (None, true) => alone(facts, back),
        (None, false) => on_its_line(&on_line, &answered, back),
    }
}

/// That a port which was away was there again: a drive of its line was heard.
fn port_is_back(facts: &Facts, away: &RecordView, since: i64) -> Option<Sentence> {
    let mut later =
        facts.records.iter().filter(|found| found.number > away.number && found.line == facts.line);
    let heard =
        later.find(|found| matches!(&*found.what, "connected" | "other_family" | "identity_changed"))?;
    let after = lasting(heard.time_unix_ms - since);
    let text = format!(
        "it was there again {after} after that drive was read last: {} was heard",
        heard.drive.as_deref()?
    );
    Some(Sentence::of(Seen, text).at(heard.time_unix_ms))
}

/// What is told of a drive of which nothing that could be used was heard, because what it answered was damaged.
fn damaged(facts: &Facts, about: &RecordView) -> Option<Vec<Sentence>> {
    let words = ["was damaged", "does not fit the request"];
    words.iter().any(|words| about.text.contains(words)).then_some(())?;
    let mut said = vec![Sentence::of(Seen, "it was heard: what came of its answers was damaged")];
    let began = begins(about);
    let errors = facts.records.iter().find(|found| {
        found.what == "line_errors"
            && found.line == facts.line
            && (began..=began + BESIDE_MS).contains(&found.time_unix_ms)
    });
    if let Some(errors) = errors {
        said.push(Sentence::of(Seen, format!("on its line {}", errors.text)).at(errors.time_unix_ms));
    }
    said.push(Sentence::of(
        Likely,
        "what spoils answers on a line: its cable, its ends, its shield, or somebody who speaks at the same time",
    ));
    said.push(Sentence::of(
        NotKnown,
        "whether it is the whole line or its branch: a drive of which more is asked is lost first",
    ));
    Some(said)
}

/// Of a drive that fell silent alone.
fn alone(facts: &Facts, back: Back) -> Vec<Sentence> {
    let others = match facts.neighbours().is_empty() {
        // A drive to which nothing happened has no record: that nobody else is there is not known.
        true => "nothing is recorded of another drive of its line around then".to_owned(),
        false => format!(
            "no other drive of its line is recorded as fallen silent within {} s of it",
            SILENT_TOGETHER_MS / 1_000
        ),
    };
    let mut said = vec![Sentence::of(Seen, others)];
    let open = match back.shows {
        Shows::Fed(_) => Some(Sentence::of(
            Likely,
            "its own branch of the cable, or what it is plugged in by: its address and its settings are those of before, for it is heard by them again",
        )),
        Shows::Unfed(_) | Shows::Another(_) | Shows::Reset(_) => None,
        Shows::Nothing => Some(Sentence::of(
            NotKnown,
            "its supply, its branch of the cable, its address or its settings: which, the line does not show",
        )),
    };
    said.extend(back.told());
    said.extend(open);
    said
}

/// Of a drive that fell silent with others of its line, while these answered.
fn on_its_line(with_it: &[&RecordView], answered: &[&str], back: Back) -> Vec<Sentence> {
    let mut said = vec![Sentence::of(Seen, format!("{} of its line fell silent with it", names(with_it)))];
    let shared = match (answered.is_empty(), &back.shows) {
        (true, Shows::Fed(_)) => {
            "what they share is the likely cause: the cable or its adapter; which of them is not known"
        }
        (true, Shows::Unfed(_)) => "what they share is the likely cause: their supply",
        (true, _) => {
            "what they share is the likely cause: the cable, its adapter, or the supply of these drives; which of them is not known"
        }
        (false, Shows::Fed(_)) => {
            "what only they share is the likely cause, such as their part of the cable; that they fell silent together may be chance"
        }
        (false, Shows::Unfed(_)) => {
            "what only they share is the likely cause, such as their supply; that they fell silent together may be chance"
        }
        (false, _) => {
            "what only they share is the likely cause, such as their supply or their part of the cable; that they fell silent together may be chance"
        }
    };
    if !answered.is_empty() {
        let text = format!("{} of its line answered meanwhile", answered.join(", "));
        said.push(Sentence::of(Seen, text));
    }
    said.push(Sentence::of(Likely, shared));
    said.extend(back.told());
    said
}

/// That this program itself stood still for most of a silence.
pub(super) fn stood_still(facts: &Facts, from: i64, to: i64) -> Option<&RecordView> {
    facts.records.iter().find(|found| {
        let since = body(found).since_unix_ms.unwrap_or(found.time_unix_ms);
        let shared = found.time_unix_ms.min(to) - since.max(from);
        found.what == "stood_still" && shared * 2 >= to - from
    })
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
