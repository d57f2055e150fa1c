//! The alarms beside a reference that keeps the whole story of each and reads its state off that, over random stories.

use proptest::prelude::*;

use super::*;

const DRIVES: [&str; 3] = ["pump 1", "pump 2", "pump 3"];
const KINDS: [AlarmKind; 3] = [TRIPPED, LOST, LOST_RUNNING];
const MINUTE: Duration = Duration::from_secs(60);

/// What happens.
#[derive(Debug, Clone, Copy)]
enum Step {
    /// This is so, or not, as it is seen.
    Seen(usize, usize, bool),
    /// The drive is looked at, and nothing can be seen.
    Unseen(usize),
    Acknowledge(usize, usize),
    Shelve(usize, usize),
    Unshelve(usize, usize),
    /// Seconds pass.
    Wait(u64),
    /// The program is started anew.
    Restart,
}

fn step() -> impl Strategy<Value = Step> {
    let (drive, kind) = (0..DRIVES.len(), 0..KINDS.len());
    prop_oneof![
        4 => (drive.clone(), kind.clone(), any::<bool>()).prop_map(|(drive, kind, is)| Step::Seen(drive, kind, is)),
        1 => drive.clone().prop_map(Step::Unseen),
        2 => (drive.clone(), kind.clone()).prop_map(|(drive, kind)| Step::Acknowledge(drive, kind)),
        1 => (drive.clone(), kind.clone()).prop_map(|(drive, kind)| Step::Shelve(drive, kind)),
        1 => (drive, kind).prop_map(|(drive, kind)| Step::Unshelve(drive, kind)),
        1 => (1..100_u64).prop_map(Step::Wait),
        1 => Just(Step::Restart),
    ]
}

/// What was told of one alarm, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Told {
    Came,
    Left,
    Noted,
    PutAside(u64),
    TakenBack,
}

/// The story of one drive and kind.
#[derive(Debug, Default)]
struct Story(Vec<Told>);

impl Story {
    fn is(&self) -> bool {
        let last = self.0.iter().rev().find(|told| matches!(told, Told::Came | Told::Left));
        last == Some(&Told::Came)
    }

    fn aside_until(&self) -> Option<u64> {
        let last = self.0.iter().rev().find(|told| matches!(told, Told::PutAside(_) | Told::TakenBack));
        match last {
            Some(Told::PutAside(until)) => Some(*until),
            _ => None,
        }
    }

    /// Whether somebody has taken note since it came last, and since it was taken back while it was so.
    fn is_noted(&self) -> bool {
        let mut noted = false;
        for (at, told) in self.0.iter().enumerate() {
            match told {
                Told::Came => noted = false,
                Told::TakenBack if Self(self.0[..at].to_vec()).is() => noted = false,
                Told::Noted => noted = true,
                _ => {}
            }
        }
        noted
    }

    fn comings(&self) -> usize {
        self.0.iter().filter(|told| **told == Told::Came).count()
    }

    /// Reads the state off the story; one that is over has none, and its story begins anew.
    fn state(&mut self, now: u64) -> Option<(AlarmState, usize)> {
        if self.aside_until().is_some_and(|until| until <= now) {
            self.0.push(Told::TakenBack);
        }
        let state = match (self.is(), self.is_noted()) {
            _ if self.comings() == 0 => None,
            _ if self.aside_until().is_some() => Some(AlarmState::Shelved),
            (true, false) => Some(AlarmState::Unacknowledged),
            (true, true) => Some(AlarmState::Acknowledged),
            (false, false) => Some(AlarmState::Returned),
            (false, true) => None,
        };
        if state.is_none() {
            self.0.clear();
        }
        state.map(|state| (state, self.comings()))
    }
}

fn id_of(alarms: &Alarms, drive: usize, kind: usize) -> Option<u64> {
    let is = |alarm: &&Alarm| alarm.drive.as_deref() == Some(DRIVES[drive]) && alarm.kind == KINDS[kind];
    alarms.all().iter().find(is).map(|alarm| alarm.id)
}

proptest! {
    #[test]
    fn every_story_ends_as_its_reading_from_the_beginning_says(steps in prop::collection::vec(step(), 1..60)) {
        let (mut alarms, mut now) = (Alarms::default(), 1_000_000);
        let mut stories: BTreeMap<(usize, usize), Story> = BTreeMap::new();
        let mut is: BTreeMap<(usize, usize), bool> = BTreeMap::new();
        for step in steps {
            now += 1;
            match step {
                Step::Seen(drive, kind, there) => {
                    is.insert((drive, kind), there);
                    let all: Vec<AlarmKind> =
                        (0..KINDS.len()).filter(|kind| is.get(&(drive, *kind)) == Some(&true)).map(|kind| KINDS[kind]).collect();
                    alarms.look(&[look(Some(DRIVES[drive]), Some("north"), &all)], now);
                    for kind in 0..KINDS.len() {
                        let story = stories.entry((drive, kind)).or_default();
                        match (story.is(), is.get(&(drive, kind)) == Some(&true)) {
                            (false, true) => story.0.push(Told::Came),
                            (true, false) => story.0.push(Told::Left),
                            _ => {}
                        }
                    }
                }
                Step::Unseen(drive) => {
                    alarms.look(&[unseen(look(Some(DRIVES[drive]), Some("north"), &[]))], now);
                }
                Step::Acknowledge(drive, kind) => if let Some(id) = id_of(&alarms, drive, kind) {
                    alarms.acknowledge(id, "anna", None, now).unwrap();
                    stories.entry((drive, kind)).or_default().0.push(Told::Noted);
                },
                Step::Shelve(drive, kind) => if let Some(id) = id_of(&alarms, drive, kind) {
                    let shelved = alarms.shelve(id, "anna", "why", MINUTE, now);
                    prop_assert_eq!(shelved.is_err(), KINDS[kind].is_of_motion());
                    if shelved.is_ok() {
                        stories.entry((drive, kind)).or_default().0.push(Told::PutAside(now + 60_000));
                    }
                },
                Step::Unshelve(drive, kind) => if let Some(id) = id_of(&alarms, drive, kind) {
                    let was_aside = alarms.get(id).unwrap().shelved.is_some();
                    alarms.unshelve(id).unwrap();
                    if was_aside {
                        stories.entry((drive, kind)).or_default().0.push(Told::TakenBack);
                    }
                },
                Step::Wait(seconds) => {
                    now += seconds * 1_000;
                    alarms.look(&[], now);
                }
                Step::Restart => {
                    let kept = serde_json::to_string(&alarms).unwrap();
                    let read: Alarms = serde_json::from_str(&kept).unwrap();
                    prop_assert_eq!(&read, &alarms);
                    alarms = read;
                }
            }
            // A look ends what has had its time.
            alarms.look(&[], now);
            for (drive, name) in DRIVES.iter().enumerate() {
                for (at, kind) in KINDS.iter().enumerate() {
                    let told = id_of(&alarms, drive, at).and_then(|id| alarms.get(id));
                    let told = told.map(|alarm| (alarm.state(), alarm.count as usize));
                    let expected = stories.entry((drive, at)).or_default().state(now);
                    prop_assert_eq!(told, expected, "{} {:?}", name, kind);
                }
            }
        }
    }
}
