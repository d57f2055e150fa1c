//! What was noticed of a line: what was heard while nothing was asked, and every question with what came of it. Times
//! count from the beginning.

use std::{collections::BTreeSet, time::Duration};

use drive_bus::{
    LineConfig,
    evidence::Finding,
    listen::{Heard, Role},
};
use drive_core::serial::SerialSettings;

use drived_words::drive_spec::DriveName;

/// Everything that was noticed.
#[derive(Debug, Clone)]
pub(super) struct Observations {
    pub(super) config: LineConfig,
    pub(super) adapter: Adapter,
    /// Who should be there; empty where nobody has said so.
    pub(super) expected: Vec<DriveName>,
    /// The addresses that were looked at.
    pub(super) addresses: Vec<u8>,
    pub(super) listened: Listened,
    /// What was heard at other speeds and formats, where what was heard at the given one made no sense.
    pub(super) elsewhere: Vec<(SerialSettings, Listened)>,
    pub(super) asked: Vec<Asked>,
    /// The words of the settings by which drives wait before they answer.
    pub(super) own_waits: Vec<(u8, u16)>,
    /// The drives that stood tripped, by their last status.
    pub(super) tripped: BTreeSet<u8>,
    /// Slaves whose answers came after the time of their question, how often.
    pub(super) overdue: Vec<(u8, u64)>,
    /// Whether a question could not be sent because the line was never quiet.
    pub(super) never_quiet: bool,
    /// What the line itself has found wrong.
    pub(super) findings: Vec<Finding>,
    /// Why it ended before its time, if it did.
    pub(super) cut_short: Option<String>,
    /// How long it all took.
    pub(super) took: Duration,
}

/// What the system tells of the adapter.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Adapter {
    pub(super) driver: Option<String>,
    /// How long it holds back what it has received, by its latency timer.
    pub(super) latency: Option<Duration>,
}

/// What was heard while nothing was asked.
#[derive(Debug, Clone, Default)]
pub(super) struct Listened {
    pub(super) time: Duration,
    pub(super) heard: Vec<Heard>,
}

impl Listened {
    /// Intact frames.
    pub(super) fn frames(&self) -> impl Iterator<Item = &Heard> {
        self.heard.iter().filter(|heard| heard.role != Role::Damaged)
    }

    /// Bytes that make no frame.
    pub(super) fn noise(&self) -> impl Iterator<Item = u8> + Clone {
        let damaged = self.heard.iter().filter(|heard| heard.role == Role::Damaged);
        damaged.flat_map(|heard| heard.bytes.iter().copied())
    }
}

/// One question to one slave.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Asked {
    pub(super) slave: u8,
    /// When it was given to the port, and when it was over.
    pub(super) began: Duration,
    pub(super) ended: Duration,
    /// How long it was since this slave's last answer, and since anything was on the line.
    pub(super) since_own: Option<Duration>,
    pub(super) quiet: Option<Duration>,
    pub(super) request: Vec<u8>,
    /// What came, without the adapter's echo.
    pub(super) heard: Vec<u8>,
    pub(super) echoed: bool,
    pub(super) ending: Ending,
    /// From the end of the question to the first character of the answer, where there was one.
    pub(super) after: Duration,
    /// The longest pause inside of it.
    pub(super) pause: Duration,
    /// The drives whose motors were running, by their last status; `None` before anybody was asked for it.
    pub(super) running: Option<BTreeSet<u8>>,
    /// Intact frames that came before it and that nobody had asked for, since the last question.
    pub(super) strays_before: u64,
    /// Whether it was asked after a pause of a length left to chance, and not as soon as the line allows.
    pub(super) dithered: bool,
}

/// How a question ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ending {
    Answered,
    /// With an exception, which is an answer too.
    Refused,
    Silent,
    /// Something came that makes no answer.
    Damaged,
    /// Intact frames, of which none is the answer, or two that differ.
    Wrong,
}

impl Asked {
    pub(super) const fn is_good(&self) -> bool {
        matches!(self.ending, Ending::Answered | Ending::Refused)
    }

    pub(super) fn ran_beside(&self, other: u8) -> bool {
        self.running.as_ref().is_some_and(|running| running.contains(&other))
    }

    pub(super) const fn is_garbled(&self) -> bool {
        matches!(self.ending, Ending::Damaged | Ending::Wrong)
    }
}

/// What the questions to one slave brought.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Figures {
    pub(super) slave: u8,
    pub(super) asked: usize,
    pub(super) answered: usize,
    pub(super) silent: usize,
    pub(super) damaged: usize,
    /// Answers that came after what is usually waited for them.
    pub(super) late: usize,
    /// Intact frames of it that nobody had asked for.
    pub(super) stray: u64,
    /// The answer times, the shortest first.
    pub(super) times: Vec<Duration>,
}

impl Figures {
    /// The time that so many of a hundred answers do not exceed.
    pub(super) fn quantile(&self, percent: usize) -> Option<Duration> {
        let last = self.times.len().checked_sub(1)?;
        self.times.get((self.times.len() * percent).div_ceil(100).saturating_sub(1).min(last)).copied()
    }

    /// Whether it has ever answered.
    pub(super) const fn is_there(&self) -> bool {
        self.answered > 0
    }

    /// Questions without an intact answer.
    pub(super) const fn bad(&self) -> usize {
        self.asked - self.answered
    }
}

impl Observations {
    /// The slaves that have answered, or tried to.
    pub(super) fn figures(&self) -> Vec<Figures> {
        let slaves: BTreeSet<u8> = self.asked.iter().map(|asked| asked.slave).collect();
        slaves.into_iter().map(|slave| self.figures_of(slave)).collect()
    }

    fn figures_of(&self, slave: u8) -> Figures {
        let mut figures = Figures { slave, ..Figures::default() };
        let mut last = None;
        for asked in &self.asked {
            if last == Some(slave) {
                figures.stray += asked.strays_before;
            }
            last = Some(asked.slave);
            if asked.slave != slave {
                continue;
            }
            figures.asked += 1;
            match asked.ending {
                Ending::Answered | Ending::Refused => {
                    figures.answered += 1;
                    figures.late += usize::from(asked.after > self.config.response_timeout);
                    figures.times.push(asked.after);
                }
                Ending::Silent => figures.silent += 1,
                Ending::Damaged | Ending::Wrong => figures.damaged += 1,
            }
        }
        let overdue = self.overdue.iter().find(|(of, _)| *of == slave).map_or(0, |(_, count)| *count);
        figures.late += usize::try_from(overdue).unwrap_or(usize::MAX);
        figures.times.sort_unstable();
        figures
    }

    pub(super) fn of(&self, slave: u8) -> impl Iterator<Item = &Asked> + Clone {
        self.asked.iter().filter(move |asked| asked.slave == slave)
    }

    /// What a slave is called: as it was named, else by its address.
    pub(super) fn name(&self, slave: u8) -> String {
        let named = self.expected.iter().find(|name| name.slave.number() == slave);
        named.map_or_else(|| format!("address {slave}"), ToString::to_string)
    }

    /// Several of them.
    pub(super) fn names(&self, slaves: &[u8]) -> String {
        let names: Vec<String> = slaves.iter().map(|slave| self.name(*slave)).collect();
        match &names[..] {
            [one] => one.clone(),
            [several @ .., last] => format!("{} and {last}", several.join(", ")),
            [] => String::new(),
        }
    }
}
