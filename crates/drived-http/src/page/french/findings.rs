//! What a line finds wrong with itself, in the page's French: the page's own table, read as it is served.

use std::{collections::HashMap, sync::LazyLock};

use drived_plant::plant::views::FindingView;

/// A finding in French.
#[derive(Debug, PartialEq, Eq)]
pub struct FindingFr {
    /// What it is, with its figures.
    pub text: String,
    /// From what it cannot be told; `None` where it is certain.
    pub alike: Option<String>,
    /// What to do next, in the order of the English.
    pub next: Vec<&'static str>,
}

/// A finding as the daemon tells it in English; `None` where the page does not know its kind.
pub fn finding(finding: &FindingView) -> Option<FindingFr> {
    let figures = &finding.figures;
    let kind = TABLE.kinds.get(finding.defect.as_str())?;
    let refuser = match figures.code {
        Some(0x0A | 0x0B) => "_gateway",
        Some(0x05 | 0x06) => "_busy",
        _ => "",
    };
    let next = TABLE.kinds.get(format!("{}{refuser}", finding.defect).as_str()).unwrap_or(kind);
    let says = match figures {
        _ if figures.part == figures.of && kind.says_all.is_some() => kind.says_all,
        _ if figures.every_ms.is_some() && kind.says_every.is_some() => kind.says_every,
        _ => kind.says,
    };
    let mut text = says?.to_owned();
    let exception = figures.code.map(|code| {
        let meaning = TABLE.exceptions.get(&code).copied().unwrap_or("que la spécification ne nomme pas");
        format!("{code:02X}h ({meaning})")
    });
    let every = figures.every_ms.map(|every| format!("{:.1}", every as f64 / 1_000.0).replace('.', ","));
    for (name, value) in [
        ("${part}", Some(figures.part.to_string())),
        ("${of}", Some(figures.of.to_string())),
        ("${exception}", exception),
        ("${every}", every),
        ("${silent}", figures.silent_ms.map(|silent| (silent / 1_000).to_string())),
    ] {
        text = text.replace(name, value.as_deref().unwrap_or("–"));
    }
    let alike = figures.alike.as_deref().and_then(|alike| TABLE.alike.get(alike));
    let alike = alike.map(|alike| format!("un maître ne peut pas le distinguer {alike}"));
    Some(FindingFr { text, alike, next: next.next.clone() })
}

/// What `findings_fr.js` holds.
#[derive(Debug, Default)]
struct Table {
    exceptions: HashMap<u8, &'static str>,
    alike: HashMap<&'static str, &'static str>,
    kinds: HashMap<&'static str, Kind>,
}

#[derive(Debug, Default)]
struct Kind {
    says: Option<&'static str>,
    says_all: Option<&'static str>,
    says_every: Option<&'static str>,
    next: Vec<&'static str>,
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    let mut table = Table::default();
    // Lists with a name, before the kinds that name them.
    let mut lists: HashMap<&str, Vec<&str>> = HashMap::new();
    let (mut block, mut name) = ("", "");
    for line in include_str!("../web/findings_fr.js").lines() {
        if let Some(begun) = line.strip_prefix("const ") {
            block = begun.split_once(' ').map_or("", |(block, _)| block);
        } else if line.starts_with('}') || line.starts_with(']') {
            block = "";
        }
        let said = line.trim();
        let sentence = said.strip_prefix('\'').and_then(|said| said.strip_suffix("',"));
        match (block, said.split_once(": ")) {
            ("EXCEPTIONS" | "ALIKE", Some((key, value))) => {
                let Some(value) = value.strip_prefix('\'').and_then(|value| value.strip_suffix("',")) else {
                    continue;
                };
                match key.parse() {
                    Ok(code) => _ = table.exceptions.insert(code, value),
                    Err(_) => _ = table.alike.insert(key, value),
                }
            }
            ("KINDS", Some((key, "{"))) => name = key,
            ("KINDS", parts) => {
                let kind = table.kinds.entry(name).or_default();
                match (parts, sentence) {
                    (_, Some(sentence)) => kind.next.push(sentence),
                    (Some(("next", value)), _) => match value.strip_prefix("['") {
                        Some(one) => kind.next.extend(one.strip_suffix("'],")),
                        None => {
                            kind.next.extend(lists.get(value.trim_end_matches(',')).into_iter().flatten());
                        }
                    },
                    (Some((key, value)), _) => {
                        let text = value.split('`').nth(1);
                        match key {
                            "says" => kind.says = text,
                            "says_all" => kind.says_all = text,
                            "says_every" => kind.says_every = text,
                            _ => {}
                        }
                    }
                    (None, None) => {}
                }
            }
            ("", _) => {}
            (list, _) => lists.entry(list).or_default().extend(sentence),
        }
    }
    table
});

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use drive_bus::evidence::{Alike, Certainty, Defect, Finding};

    use super::*;

    fn told(defect: Defect, share: (u32, u32), certainty: Certainty) -> FindingView {
        let finding = Finding { defect, slave: Some(3), share, certainty };
        FindingView {
            defect: defect.name().to_owned(),
            slave: finding.slave,
            drive: None,
            figures: (&finding).into(),
            cannot_be_told_from: None,
            text: finding.to_string(),
            next: finding.next().iter().map(|next| (*next).to_owned()).collect(),
        }
    }

    #[test]
    fn every_finding_has_its_french_with_its_figures_and_as_many_things_to_do() {
        let every = Duration::from_millis(400);
        let others = [
            Defect::FarEndFaster,
            Defect::FirstByteCut,
            Defect::LastByteCut,
            Defect::BytesBehind,
            Defect::OneAnswerBehind,
            Defect::TwoAtOneAddress,
            Defect::AnswersTwice,
            Defect::SecondMaster(None),
            Defect::SecondMaster(Some(every)),
            Defect::NumberZero,
            Defect::FellSilent(Duration::from_secs(9)),
            Defect::LinkTimeout,
        ];
        let refused = (1..=12).map(Defect::RefusesAll);
        for defect in others.into_iter().chain(refused) {
            for share in [(4, 7), (7, 7)] {
                let told = told(defect, share, Certainty::Certain);
                let french = finding(&told).unwrap_or_else(|| panic!("{told:?}"));
                assert!(!french.text.contains(['$', '–']), "{french:?}");
                assert_eq!(french.next.len(), told.next.len(), "{told:?}: {french:?}");
                assert!(french.next.iter().all(|next| !next.is_empty()) && !french.next.is_empty());
                assert_eq!(french.alike, None);
            }
        }
        let alike = told(Defect::TwoAtOneAddress, (4, 7), Certainty::CannotBeToldFrom(Alike::OldAnswers));
        assert_eq!(
            finding(&alike).unwrap().alike.as_deref(),
            Some("un maître ne peut pas le distinguer d’un intermédiaire qui redonne d’anciennes réponses")
        );
    }

    #[test]
    fn the_figures_stand_in_the_sentence_as_in_that_of_the_page() {
        let french = |defect, share| finding(&told(defect, share, Certainty::Certain)).unwrap().text;
        assert_eq!(
            french(Defect::RefusesAll(2), (5, 5)),
            "les 5 questions ont toutes eu pour réponse l’exception 02h (il n’a pas ce registre), aucune n’a eu de valeur"
        );
        assert_eq!(
            french(Defect::SecondMaster(Some(Duration::from_millis(400))), (6, 0)),
            "quelqu’un d’autre interroge sur cette ligne : 6 requêtes entendues, une toutes les 0,4 s"
        );
    }
}
