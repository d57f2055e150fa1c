//! The frames of a running capture that belong to freeze-frames: those of the line of a drive that tripped, around that. [`Around`] is pure.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use drive_bus::capture::{Captured, Dissector, Heard, LastFrames};
use drived_face::Plant;
use tokio::time::{Instant, MissedTickBehavior, interval};

use crate::{clocks::Clocks, record::LineFrames, write::inbox::Inbox};

/// From so long before what has a freeze-frame,
const BEFORE: Duration = Duration::from_secs(60);
/// to so long after.
const AFTER: Duration = Duration::from_secs(30);
/// What comes after it is handed on in parts of this length: a kill loses no more.
const PART: Duration = Duration::from_secs(10);
/// So many frames and bytes are kept in a part.
const FRAMES: usize = 16_384;
const BYTES: usize = 1 << 20;
/// Of all lines together so many frames wait to be a part.
const FRAMES_OF_ALL: usize = 4 * FRAMES;
/// Between two looks: a line keeps its last frames for longer.
const LOOK: Duration = Duration::from_secs(1);
/// What no freeze-frame wants any more is given up this long after it was heard.
const FORGOTTEN: Duration = Duration::from_secs(90);

/// Which lines have something whose frames are wanted, and when it was. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub(crate) struct Wanted(Arc<Mutex<BTreeMap<String, Instant>>>);

impl Wanted {
    /// Something that has a freeze-frame happened now at a drive of this line.
    pub(crate) fn note(&self, line: &str) {
        self.lock(|wanted| wanted.insert(line.to_owned(), Instant::now()));
    }

    fn take(&self) -> BTreeMap<String, Instant> {
        self.lock(std::mem::take)
    }

    fn lock<T>(&self, work: impl FnOnce(&mut BTreeMap<String, Instant>) -> T) -> T {
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Takes from the captures of lines what belongs to freeze-frames, and waits for nobody.
pub(crate) async fn follow(plant: Plant, inbox: Inbox, clocks: Clocks, wanted: Wanted) {
    let mut followed: BTreeMap<String, Around> = BTreeMap::new();
    let mut looks = interval(LOOK);
    looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        let now = looks.tick().await;
        for (line, at) in wanted.take() {
            followed.entry(line).or_default().event(at);
        }
        let lines = plant.fleet().lines();
        followed.retain(|name, _| lines.iter().any(|(line, _)| **line == **name));
        let mut room = FRAMES_OF_ALL.saturating_sub(followed.values().map(Around::waiting).sum());
        for (name, line) in lines {
            let wanting = followed.get_mut(&*name).and_then(|around| Some((around.since()?, around)));
            let Some((since, around)) = wanting else {
                line.forget_frames(now.checked_sub(FORGOTTEN).unwrap_or(now));
                continue;
            };
            let waiting = around.waiting();
            around.take(line.last_frames(since), room);
            room = room.saturating_sub(around.waiting().saturating_sub(waiting));
            if let Some(part) = around.part(now) {
                inbox.frames(part.of_line(name, Dissector::of(&line.config()), clocks));
            }
        }
    }
}

/// What is wanted of the captures of one line.
#[derive(Debug, Default)]
struct Around {
    /// The time that is wanted: nothing before the first event.
    wanted: Option<(Instant, Instant)>,
    /// The last frame that was taken, of any time.
    last: Option<(Instant, u64)>,
    part: Part,
}

/// Some of it, on its way to the file.
#[derive(Debug, Default)]
struct Part {
    frames: Vec<Captured>,
    bytes: usize,
    /// When the first and the last were heard.
    heard: Option<(Instant, Instant)>,
    left_out: u64,
    is_cut: bool,
}

impl Around {
    /// Something happened now whose frames are wanted.
    fn event(&mut self, at: Instant) {
        let from = at.checked_sub(BEFORE).unwrap_or(at);
        let until = at + AFTER;
        self.wanted = Some(self.wanted.map_or((from, until), |(since, _)| (since, until)));
    }

    /// From when on frames are wanted; `None`: there is no need of any now.
    fn since(&self) -> Option<Instant> {
        let (from, _) = self.wanted?;
        Some(self.last.map_or(from, |(last, _)| last.max(from)))
    }

    fn waiting(&self) -> usize {
        self.part.frames.len()
    }

    /// Takes what the line has kept since then, as far as there is room.
    fn take(&mut self, LastFrames { frames, is_cut }: LastFrames, room: usize) {
        let Some((from, until)) = self.wanted else { return };
        // Later than that nothing gives way that is not missed by its number.
        let goes_on = self.last.is_some_and(|(last, _)| last >= from);
        self.part.is_cut |= is_cut && !goes_on;
        let mut before = self.last.filter(|_| goes_on).map(|(_, number)| number);
        let room = room.saturating_add(self.waiting()).min(FRAMES);
        for Heard { number, at, frame } in frames {
            if at > until || self.last.is_some_and(|last| (at, number) <= last) {
                continue;
            }
            // Numbers begin anew with a line that is opened anew.
            self.part.left_out += before.map_or(0, |before| number.saturating_sub(before + 1));
            (before, self.last) = (Some(number), Some((at, number)));
            self.part.push(at, frame, room);
        }
    }

    /// What is ready for the file: what came before an event at once, what came after it part by part.
    fn part(&mut self, now: Instant) -> Option<Part> {
        let (_, until) = self.wanted?;
        let is_over = now > until;
        let began = self.part.heard.map(|(first, _)| first);
        if is_over {
            self.wanted = None;
        }
        let is_due = is_over || began.is_some_and(|began| now.saturating_duration_since(began) >= PART);
        let part = is_due.then(|| std::mem::take(&mut self.part))?;
        part.heard.is_some().then_some(part)
    }
}

impl Part {
    fn push(&mut self, at: Instant, frame: Captured, room: usize) {
        if self.frames.len() >= room || self.bytes + frame.bytes.len() > BYTES {
            self.left_out += 1;
            return;
        }
        self.bytes += frame.bytes.len();
        self.heard = Some((self.heard.map_or(at, |(first, _)| first), at));
        self.frames.push(frame);
    }

    fn of_line(self, line: Arc<str>, dissector: Dissector, clocks: Clocks) -> LineFrames {
        let Self { frames, heard, left_out, is_cut, .. } = self;
        let (first, last) = heard.map_or((0, 0), |(first, last)| (clocks.of(first), clocks.of(last)));
        LineFrames { line, dissector, first_ms: first, last_ms: last, frames, left_out, is_cut }
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use drive_bus::capture::Direction;
    use drived_plant::plant::testing::TestPlant;
    use tokio::sync::watch;

    use super::*;
    use crate::{listen::Listening, write::writer::Health};

    /// A capture of a frame every so often, of which the line keeps all.
    fn heard(from: Instant, every: Duration, numbers: std::ops::Range<u32>) -> LastFrames {
        let heard = |number: u32| Heard {
            number: u64::from(number),
            at: from + every * number,
            frame: Captured {
                at: every * number,
                direction: Direction::Sent,
                bytes: Bytes::copy_from_slice(&number.to_be_bytes()),
            },
        };
        LastFrames { frames: numbers.map(heard).collect(), is_cut: false }
    }

    fn numbers(part: &Part) -> Vec<u32> {
        part.frames.iter().map(|frame| u32::from_be_bytes(frame.bytes[..].try_into().unwrap())).collect()
    }

    const SECOND: Duration = Duration::from_secs(1);

    /// What is kept of a line that keeps all of a capture, looked at every second until this one.
    fn parts(around: &mut Around, begin: Instant, seconds: std::ops::RangeInclusive<u32>) -> Vec<Vec<u32>> {
        let mut parts = Vec::new();
        for second in seconds {
            if let Some(since) = around.since() {
                let mut all = heard(begin, SECOND, 0..second + 1);
                all.frames.retain(|heard| heard.at >= since);
                around.take(all, FRAMES);
                parts.extend(around.part(begin + SECOND * second).map(|part| numbers(&part)));
            }
        }
        parts
    }

    #[test]
    fn of_a_capture_the_minute_before_and_the_half_behind_are_kept_once_each() {
        let (mut around, begin) = (Around::default(), Instant::now());
        assert_eq!(parts(&mut around, begin, 0..=99), [[0; 0]; 0], "nothing happened");
        around.event(begin + SECOND * 100);
        let kept = parts(&mut around, begin, 100..=110);
        assert_eq!(kept[0], (40..=100).collect::<Vec<_>>(), "what was before is handed on at once");
        // A second one shortly behind it prolongs it, and no frame is kept again.
        around.event(begin + SECOND * 110);
        let mut all: Vec<u32> = kept.concat();
        all.extend(parts(&mut around, begin, 111..=150).concat());
        assert_eq!(all, (40..=140).collect::<Vec<_>>());
        assert_eq!(around.since(), None);
        around.event(begin + SECOND * 170);
        let all = parts(&mut around, begin, 170..=210).concat();
        assert_eq!(all, (141..=200).collect::<Vec<_>>());
    }

    #[test]
    fn without_a_capture_nothing_is_kept() {
        let (mut around, begin) = (Around::default(), Instant::now());
        around.event(begin);
        around.take(LastFrames::default(), FRAMES);
        assert!(around.part(begin + SECOND).is_none() && around.part(begin + SECOND * 31).is_none());
        assert_eq!(around.since(), None);
    }

    #[test]
    fn a_flood_stays_within_its_bounds_and_what_was_left_out_is_told() {
        let (mut around, begin) = (Around::default(), Instant::now() + SECOND * 100);
        let flood = heard(begin, Duration::from_micros(10), 0..40_000);
        around.event(begin);
        around.take(LastFrames { is_cut: true, ..flood }, FRAMES);
        assert_eq!((around.waiting(), around.part.left_out, around.part.is_cut), (FRAMES, 23_616, true));
        // What the capture itself or the line had no room for is missed by its number.
        let mut next = heard(begin, Duration::from_micros(10), 40_010..40_020);
        next.frames.remove(5);
        around.take(next, FRAMES);
        let part = around.part(begin + SECOND * 31).unwrap();
        assert_eq!((part.frames.len(), part.left_out), (FRAMES, 23_616 + 10 + 10));
        // Where other lines have taken all the room there is none for this one.
        around.event(begin + SECOND * 40);
        around.take(heard(begin + SECOND * 40, Duration::from_micros(10), 40_020..40_030), 4);
        assert_eq!((around.waiting(), around.part.left_out, around.part.is_cut), (4, 6, false));
    }

    #[tokio::test(start_paused = true)]
    async fn a_drive_that_trips_has_what_a_capture_of_its_line_has_heard_and_nothing_without_one() {
        let (test, inbox) = (TestPlant::of(2).await, Inbox::default());
        let (_health, seen) = watch::channel(Health::Writing);
        let _listening = Listening::start(&test.plant, &inbox, Clocks::begin(), seen);
        test.machines[0].trip(18);
        tokio::time::sleep(SECOND * 100).await;
        let batch = inbox.take(Duration::ZERO);
        assert!(batch.records.iter().any(|record| record.what == "tripped") && batch.frames.is_empty());
        let (_, line) = test.plant.fleet().lines().remove(0);
        let writing = line.capture(std::io::sink()).unwrap();
        let begin = Instant::now();
        // A capture is written by a thread that has another clock than this one.
        while line.last_frames(begin).frames.len() < 10 {
            tokio::time::sleep(SECOND / 10).await;
        }
        test.machines[1].trip(18);
        let mut kept = Vec::new();
        while kept.is_empty() {
            tokio::time::sleep(SECOND / 10).await;
            kept = inbox.take(Duration::ZERO).frames;
        }
        assert_eq!((&*kept[0].line, kept[0].dissector), ("north", Dissector::Rtu));
        assert!(kept[0].frames.len() >= 10 && kept[0].first_ms < kept[0].last_ms);
        line.close().await;
        writing.finished().await.unwrap();
    }
}
