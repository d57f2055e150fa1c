//! What is read and written beside orders.

use drive_core::registers::{Access, Confidence, Factory, Range, Row, Space, Unit};

use super::*;

pub(super) const ROW: Row = Row {
    space: Space::HoldingRegister,
    address: 9001,
    code: "ACC",
    name: "acceleration",
    access: Access::ReadWrite,
    storage: Storage::RamUntilSaved,
    unit: Unit::COUNT,
    range: Range::Any,
    factory: Factory::None,
    confidence: Confidence::Manual,
    source: "p. 1",
};

impl Rig {
    fn question(&mut self, question: Question) -> CallId {
        self.next_call += 1;
        let id = CallId(self.next_call);
        self.machine.handle_question(id, "tester", question);
        id
    }

    /// What was told to one who asked.
    fn told(&mut self, id: CallId) -> Option<Result<Told, Refused>> {
        while let Some(output) = self.machine.poll_output() {
            self.outputs.push(output);
        }
        self.outputs.iter().find_map(|output| match output {
            Output::Told(of, told) if *of == id => Some(told.clone()),
            _ => None,
        })
    }
}

#[test]
fn a_parameter_is_written_once_in_its_turn_and_read_back() {
    let mut rig = Rig::ready();
    let write = rig.question(Question::Write(&ROW, 30));
    let read = rig.question(Question::Read(&ROW));
    rig.pass(3_000 * MS);
    let Some(Ok(Told::Written(written))) = rig.told(write) else { panic!("{:?}", rig.outputs) };
    assert!(written.changed);
    assert_eq!(rig.told(read), Some(Ok(Told::Word(30))));
    let asked = rig.drive.log.iter().filter(|job| matches!(job, Job::Ask(_))).count();
    assert_eq!(asked, 2);
}

#[test]
fn of_a_write_that_is_on_its_way_as_its_drive_ends_or_is_lost_nobody_says_that_it_was_not_written() {
    for is_lost in [false, true] {
        let mut rig = Rig::ready();
        let write = rig.question(Question::Write(&ROW, 30));
        while rig.machine.in_flight.is_none_or(|job| !matches!(job, Job::Ask(_))) {
            let Step::Do { job, .. } = rig.next() else {
                rig.machine.grant_turn();
                rig.now += MS;
                continue;
            };
            if !matches!(job, Job::Ask(_)) {
                let reply = rig.drive.answer(job);
                rig.machine.handle_reply(rig.now, reply);
            }
        }
        let waits = rig.question(Question::Write(&ROW, 40));
        match is_lost {
            true => rig.machine.handle_line_lost(rig.now),
            false => rig.machine.handle_exit(rig.now, Policy::Exit),
        };
        rig.drive.failing = Some(PortError::Timeout { after: 500 * MS });
        rig.machine.handle_dropped(rig.now);
        rig.pass(6_000 * MS);
        assert!(matches!(rig.told(waits), Some(Err(_))), "{:?}", rig.told(waits));
        assert_eq!(rig.told(write), None, "it is told as nobody's answer");
        let untold = rig.outputs.iter().any(|output| matches!(output, Output::Untold(id) if *id == write));
        assert!(untold, "{:?}", rig.outputs);
    }
}

#[test]
fn who_does_not_wait_any_more_leaves_his_place() {
    let mut rig = Rig::ready();
    let asked: Vec<CallId> = (0..16).map(|_| rig.question(Question::Read(&ROW))).collect();
    let late = rig.question(Question::Read(&ROW));
    assert_eq!(rig.told(late), Some(Err(Refused::QueueFull)));
    rig.machine.forget_questions(|id| id != asked[15]);
    let next = rig.question(Question::Read(&ROW));
    rig.pass(3_000 * MS);
    assert_eq!((rig.told(asked[15]), rig.told(next)), (Some(Ok(Told::Word(0))), Some(Ok(Told::Word(0)))));
    assert_eq!(rig.told(asked[0]), None);
}

#[test]
fn a_stop_goes_before_every_question() {
    let mut rig = Rig::ready();
    for _ in 0..10 {
        rig.question(Question::Read(&ROW));
    }
    rig.machine.handle_stop(rig.now, Asker::Policy(Policy::OnLoss), StopMode::Ramp.into(), None);
    rig.pass(50 * MS);
    assert!(matches!(rig.drive.log.first(), Some(Job::Stop(_))), "{:?}", rig.drive.log);
}

#[test]
fn a_drive_that_is_only_read_is_not_written_and_one_that_is_lost_is_not_asked() {
    let mut rig = Rig::new(DriveSettings::watched("pump"));
    rig.pass(1_500 * MS);
    let write = rig.question(Question::Write(&ROW, 30));
    assert_eq!(rig.told(write), Some(Err(Refused::ReadOnly)));
    let read = rig.question(Question::Read(&ROW));
    rig.pass(2_000 * MS);
    assert_eq!(rig.told(read), Some(Ok(Told::Word(0))), "what can be read is");
    let waits = rig.question(Question::Read(&ROW));
    rig.drive.failing = Some(PortError::LineDown("gone".into()));
    rig.pass(10_000 * MS);
    assert!(matches!(rig.told(waits), Some(Err(_))));
    let lost = rig.question(Question::Read(&ROW));
    assert_eq!(rig.told(lost), Some(Err(Refused::NotConnected)));
    assert_eq!(rig.drive.register, 0);
}
