//! Who stands beside the machines of a line, and hears what is told of their drives.

use std::{
    collections::VecDeque,
    sync::atomic::Ordering,
    time::{Duration, Instant},
};

use super::{
    Hour, Started,
    judge::{self, Said},
    simulator::Look,
    site::{DRIVES, Drive, LINES},
};

/// From one look to the next.
const EVERY: Duration = Duration::from_millis(200);
/// So many looks and answers are remembered: whatever may be told as fresh lies among them, also behind a long stop.
const KEPT: usize = 120;

/// A drive that is attended.
struct Attended<'a> {
    drive: &'a Drive,
    started: &'a Started,
    looks: Vec<Look>,
    /// What was told and is not judged yet, with how many looks came before.
    said: VecDeque<(Said, bool)>,
    /// The last two that were told, and the look before each.
    last: VecDeque<(Said, Look)>,
    misses: u64,
    /// How often it had been started at the last look, where it was not to run by then.
    stood: Option<u64>,
}

/// Until the end.
pub(super) fn attend(hour: &Hour, line: usize) {
    let of_line = DRIVES.iter().zip(&hour.started).filter(|(drive, _)| drive.line == line);
    let mut attended: Vec<_> = of_line.map(|(drive, started)| Attended::new(drive, started)).collect();
    while hour.goes_on() {
        for one in &mut attended {
            one.look(hour);
        }
        let is_starting = |one: &Attended<'_>| one.started.is_starting.load(Ordering::SeqCst);
        let were_starting: Vec<bool> = attended.iter().map(is_starting).collect();
        let asked = Instant::now();
        let answer = hour.site.ask("GET", "/api/v1/drives", None);
        let told = Instant::now();
        if let Some(all) = answer.ok().and_then(|(_, all)| Some(all.as_array()?.clone())) {
            for (one, was_starting) in attended.iter_mut().zip(were_starting) {
                let drive = all.iter().find(|drive| drive["name"] == one.drive.name);
                if let Some(mut said) = drive.and_then(|drive| Said::read(asked, told, drive)) {
                    said.is_owned |= was_starting || is_starting(one);
                    one.hear(said);
                }
            }
        } else {
            hour.count(format!("looks of {} that were not answered", LINES[line].0));
        }
        hour.wait(EVERY);
    }
}

impl<'a> Attended<'a> {
    fn new(drive: &'a Drive, started: &'a Started) -> Self {
        let (looks, said, last) = (Vec::new(), VecDeque::new(), VecDeque::new());
        Self { drive, started, looks, said, last, misses: 0, stood: None }
    }

    fn look(&mut self, hour: &Hour) {
        let may_run = self.started.may_run.load(Ordering::SeqCst);
        let times = self.started.times.load(Ordering::SeqCst);
        let Some(look) = hour.site.lines[self.drive.line].look(self.drive.machine) else { return };
        // It was not to run before the look, and nobody has started it by now.
        let stands = !may_run
            && !self.started.may_run.load(Ordering::SeqCst)
            && self.started.times.load(Ordering::SeqCst) == times;
        if stands && self.stood == Some(times) {
            // Its stop has said already whether its shaft coasts.
            hour.judge(self.drive.name, judge::stands(&look.seen, true));
        }
        self.stood = stands.then_some(times);
        if self.looks.len() >= KEPT {
            self.looks.remove(0);
        }
        self.looks.push(look);
        self.judge(hour);
    }

    fn hear(&mut self, said: Said) {
        let missed = std::mem::replace(&mut self.misses, said.misses) < said.misses;
        if let Some(before) = self.looks.last() {
            self.last.push_back((said.clone(), *before));
        }
        self.said.push_back((said, missed));
        if self.said.len() > KEPT {
            self.said.pop_front();
        }
    }

    fn judge(&mut self, hour: &Hour) {
        let Some(behind) = self.looks.last() else { return };
        if let [(first, before), (second, between)] = self.last.make_contiguous() {
            let held = judge::is_owned([first, second], [before, between, behind]);
            hour.judge(self.drive.name, held);
            self.last.pop_front();
        }
        while let Some((said, missed)) = self.said.pop_front() {
            if said.told > behind.asked {
                self.said.push_front((said, missed));
                break;
            }
            match judge::around(&said, missed, &self.looks) {
                Some(around) => {
                    hour.count(if said.is_good { "statuses told as good" } else { "statuses told as old" });
                    hour.judge(self.drive.name, judge::status(&said, around));
                }
                None => hour.count("statuses that nobody can judge"),
            }
        }
    }
}
