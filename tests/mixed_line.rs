//! Families of every mix share one line, each with its own turnaround: the silences, the pauses and the classes hold.

use std::time::Duration;

use drive_bus::{Line, LineConfig, SlaveSettings};
use drive_core::{Drive, SerialSettings, SlaveAddress, StopMode, serial::CharacterFormat};
use drive_families::Family;
use drive_sim::{SimLine, SimSlave, Wiring};
use drive_testing::witness::Witnesses;
use support::{attended::Attended, drives};
use tokio::{
    task::JoinSet,
    time::{Instant, sleep},
};

/// The one format that all five families have.
const SETTINGS: CharacterFormat = CharacterFormat::F8N1;
/// From the last bit of a request to the first of its answer, for every machine here.
const ANSWERS_AFTER: Duration = Duration::from_millis(7);

#[tokio::test(start_paused = true)]
async fn every_mix_of_families_keeps_the_silences_of_the_line_and_the_pauses_of_each_slave() {
    for mix in mixes() {
        let (plant, mut witnesses) = (Plant::of(&mix), Witnesses::default());
        let polls = plant.poll_everything(&mut witnesses);
        sleep(Duration::from_secs(4)).await;
        drop(polls);

        assert_eq!(plant.simulated.violations(), [], "{mix:?}");
        for member in &plant.members {
            let shortest = member.shortest_pause(plant.settings()).expect("it was polled again and again");
            let needed = member.family.capabilities().turnaround;
            assert!(
                shortest >= needed,
                "{} in {mix:?}: {shortest:?} is shorter than {needed:?}",
                member.family
            );
        }
    }
}

#[tokio::test(start_paused = true)]
async fn in_every_mix_a_stop_is_the_next_but_one_frame_on_a_line_full_of_polls() {
    for mix in mixes() {
        let (mut plant, mut witnesses) = (Plant::of(&mix), Witnesses::default());
        let polls = plant.poll_everything(&mut witnesses);
        for index in 0..plant.members.len() {
            let family = plant.members[index].family;
            let mut drive = plant.another_hold_of(index);
            drive.status().await.unwrap_or_else(|error| panic!("{family} in {mix:?}: {error}"));
            // Somewhere in the middle of whatever is under way.
            sleep(Duration::from_millis(311)).await;
            let called = Instant::now();
            drive.stop(StopMode::Ramp).await.unwrap_or_else(|error| panic!("{family} in {mix:?}: {error}"));

            let write = plant.members[index].first_write_since(called).expect("the stop was sent");
            let before =
                plant.members.iter().map(|member| member.taken_between(called, write)).sum::<usize>();
            assert!(before <= 1, "{family} in {mix:?}: {before} frames went before the stop");
            assert!(write - called <= plant.line.worst_case_stop(), "{family} in {mix:?}");
        }
        drop(polls);
        plant.members.clear();
    }
}

/// Every choice of at least one family.
fn mixes() -> impl Iterator<Item = Vec<Family>> {
    (1_u8..1 << Family::BUILT_IN.len()).map(|choice| {
        let chosen = |(number, family): (usize, Family)| (choice & (1_u8 << number) != 0).then_some(family);
        Family::BUILT_IN.into_iter().enumerate().filter_map(chosen).collect()
    })
}

/// Two drives of each family of a mix on one line.
struct Plant {
    simulated: SimLine,
    line: Line,
    members: Vec<Member>,
}

struct Member {
    family: Family,
    address: u8,
    machine: SimSlave,
}

impl Plant {
    fn of(mix: &[Family]) -> Self {
        let settings = SerialSettings::new(19_200, SETTINGS).expect("it is a speed");
        let simulated = SimLine::new(Wiring::rtu(settings));
        let mut config = LineConfig::stream(settings);
        let mut members = Vec::new();
        for (address, family) in (1_u8..).zip(mix.iter().chain(mix)) {
            let machine =
                simulated.add_boxed(address, drives::machine(*family)).expect("the address is free");
            machine.set_turnaround(Some(ANSWERS_AFTER));
            let turnaround = family.capabilities().turnaround;
            config = config.slave(address, SlaveSettings { turnaround, ..SlaveSettings::default() });
            members.push(Member { family: *family, address, machine });
        }
        let line = Line::over(simulated.in_memory(), config);
        Self { simulated, line, members }
    }

    const fn settings(&self) -> SerialSettings {
        self.simulated.wiring().settings
    }

    /// Polls every drive as fast as the line allows, until the tasks are dropped.
    fn poll_everything(&self, witnesses: &mut Witnesses) -> JoinSet<()> {
        let mut polls = JoinSet::new();
        for index in 0..self.members.len() {
            let drive = self.another_hold_of(index);
            let mut drive = Attended::new(drive, &self.members[index].machine, witnesses);
            polls.spawn(async move {
                loop {
                    drive.status().await.expect("it answers");
                }
            });
        }
        polls
    }

    fn another_hold_of(&self, index: usize) -> Box<dyn Drive> {
        let Member { family, address, .. } = self.members[index];
        let slave = SlaveAddress::try_from(address).expect("it is one");
        drives::drive(family, self.line.slave(address), slave)
    }
}

impl Member {
    /// The shortest time that the master left between an answer of this slave and its next request to it.
    fn shortest_pause(&self, settings: SerialSettings) -> Option<Duration> {
        let received = self.machine.received();
        let pauses = received.windows(2).map(|pair| {
            let answered = pair[0].at + ANSWERS_AFTER + settings.characters(answer_characters(&pair[0].pdu));
            let asked_again = pair[1].at - settings.characters(pair[1].pdu.len() + 3);
            asked_again - answered
        });
        pauses.min()
    }

    /// When the last bit of the first write since `since` was on the line.
    fn first_write_since(&self, since: Instant) -> Option<Instant> {
        let written = |pdu: &[u8]| matches!(pdu.first(), Some(0x06 | 0x10));
        let received = self.machine.received();
        received.iter().find(|request| request.at > since && written(&request.pdu)).map(|request| request.at)
    }

    fn taken_between(&self, from: Instant, to: Instant) -> usize {
        self.machine.received().iter().filter(|request| from < request.at && request.at < to).count()
    }
}

/// Characters of the answer to a request that is carried out, address and check included.
fn answer_characters(pdu: &[u8]) -> usize {
    match pdu {
        [0x03 | 0x04, _, _, high, low] => 5 + 2 * usize::from(u16::from_be_bytes([*high, *low])),
        _ => 8,
    }
}
