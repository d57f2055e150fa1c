//! Who else asks on this line.

use std::{collections::BTreeMap, time::Duration};

use drive_bus::{
    capture::Dissector,
    listen::{Heard, Role},
};

use super::Case;
use crate::doctor::{
    observations::Observations,
    verdict::{Certainty, Defect, Verdict},
};
use drived_words::{
    explain::{Explainer, Known},
    output,
};

/// What somebody else asks again and again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::doctor) struct Habit {
    pub(in crate::doctor) slave: Option<u8>,
    /// What is asked, in words.
    pub(in crate::doctor) what: String,
    pub(in crate::doctor) times: usize,
    /// From one time to the next, on average.
    pub(in crate::doctor) every: Option<Duration>,
}

/// A second master, if one was heard.
pub(super) fn second(case: &Case<'_>) -> Option<Verdict> {
    let heard = case.seen.listened.frames().count();
    if heard == 0 {
        return None;
    }
    let habits = habits(case.seen);
    let list: Vec<String> = habits.iter().map(Habit::to_string).collect();
    let (finding, certainty) = match habits.len() {
        0 => (
            format!("{heard} answers were heard while we asked nothing, and none of the questions"),
            Certainty::CannotBeToldFrom(
                "a line of four wires, where the questions go on the other pair".to_owned(),
            ),
        ),
        _ => (format!("somebody else asks on this line: {}", list.join("; ")), Certainty::Certain),
    };
    Some(Verdict::new(
        Defect::SecondMaster,
        &[],
        certainty,
        finding,
        &[
            "find the other master (a PLC, a panel, a gateway, a second program on this computer) and end its asking: a Modbus \
             line has one master",
            "or let it ask through drived, which has a gateway for Modbus TCP ([gateway] in its configuration)",
        ],
    ))
}

/// What is asked by requests that were heard.
pub(in crate::doctor) fn habits(seen: &Observations) -> Vec<Habit> {
    let mut kinds: BTreeMap<_, Vec<&Heard>> = BTreeMap::new();
    for frame in seen.listened.frames().filter(|frame| matches!(frame.role, Role::Request | Role::Either)) {
        kinds.entry((frame.slave, frame.bytes.clone())).or_default().push(frame);
    }
    let habit = |((slave, _), heard): (_, Vec<&Heard>)| {
        let (first, last) = (heard.first()?, heard.last()?);
        let mut explainer = Explainer::new(Known::default());
        let what = explainer.explain(Dissector::of(&seen.config), &first.captured()).text;
        let gaps = u32::try_from(heard.len() - 1).ok().filter(|gaps| *gaps > 0);
        let every = gaps.map(|gaps| last.first.saturating_sub(first.first) / gaps);
        Some(Habit { slave, what, times: heard.len(), every })
    };
    kinds.into_iter().filter_map(habit).collect()
}

impl std::fmt::Display for Habit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.slave {
            Some(0) => f.write_str("of all slaves")?,
            Some(slave) => write!(f, "of address {slave}")?,
            None => f.write_str("of nobody in particular")?,
        }
        write!(f, ": {}, {}", self.what, output::counted(self.times, "time", "times"))?;
        match self.every {
            Some(every) => write!(f, ", every {}", output::bound(every)),
            None => Ok(()),
        }
    }
}
