//! Several hands at the drives of one line: what they order waits for what others have ordered, and meanwhile somebody stops, withdraws, forbids,
//! takes a drive out or ends everything. Each run command that is written is held against who still waits for it and may have it.

use std::{
    sync::{Arc, Mutex},
    time::Duration,
};

use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Frequency, SerialSettings, StopMode};
use drive_fleet::{
    Act, Commanders, DriveHandle, DriveSettings, ExitAction, Fleet, FleetBuilder, FrequencyLimits, Group,
    GroupFailure, GroupStart, Left, Outcome, Ticket, Until,
};
use drive_sim::{SimLine, Wiring};
use tokio::time::{Instant, sleep};

use super::{
    LONGEST, Ordered, locked,
    puppet::Puppet,
    truth::{Given, LIMIT, Rule, Truth},
};
use crate::fuzz::Source;

/// Orders and events of one life, at the most.
const STEPS: usize = 40;
const LINE: &str = "line";
/// Who commands.
const HANDS: [&str; 3] = ["anna", "boris", "carla"];
/// How long a policy may take.
const ENDED_WITHIN: Duration = Duration::from_secs(60);

pub(in crate::fuzz) fn execute(source: Source) -> Result<(), String> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
    runtime.map_err(|error| error.to_string())?.block_on(live(source))
}

/// A drive, and what is true of it.
#[derive(Clone)]
struct Place {
    number: u8,
    truth: Arc<Mutex<Truth>>,
}

impl Place {
    fn name(&self) -> String {
        format!("puppet {}", self.number)
    }

    /// As its owner has it now.
    fn settings(&self) -> DriveSettings {
        let Rule { nobody_but, limit } = locked(&self.truth).rule;
        DriveSettings {
            control: true,
            commanders: nobody_but.map_or(Commanders::Anyone, |one| Commanders::Only(vec![one.to_owned()])),
            limits: FrequencyLimits { high: Some(limit), ..FrequencyLimits::default() },
            ..DriveSettings::watched(self.name())
        }
    }

    fn join(&self, builder: FleetBuilder, left: Left) -> FleetBuilder {
        let truth = Arc::clone(&self.truth);
        let settings = self.settings().after(left);
        builder.drive(LINE, self.number, settings, |_, slave| Box::new(Puppet::new(truth, slave)))
    }

    /// It is ordered now.
    fn given(&self, ordered: Ordered, by: &'static str, setpoint: Option<Frequency>, of_group: bool) {
        locked(&self.truth).given(Given { ordered, at: Instant::now(), by, setpoint, of_group });
    }

    /// What the end of it, or of all, has done is told.
    fn ended(&self, action: &ExitAction) {
        let mut truth = locked(&self.truth);
        truth.note(format!("ended: {action}"));
        if truth.runs() && !action.is_alarm() {
            truth.object("it runs, and its end is told as if it did not");
        }
    }
}

/// Who lives.
struct Hands {
    fleet: Fleet,
    places: Vec<Place>,
    source: Source,
}

async fn live(mut source: Source) -> Result<(), String> {
    let serial = SerialSettings::MODBUS_DEFAULT;
    let line = Line::over(SimLine::new(Wiring::rtu(serial)).in_memory(), LineConfig::stream(serial));
    let places: Vec<Place> = (1..=source.u8(2..=6))
        .map(|number| {
            let truth = Truth::new(Source::seeded(source.u64(..)), true);
            Place { number, truth: Arc::new(Mutex::new(truth)) }
        })
        .collect();
    let builder = Fleet::builder().whatever_the_plan().line(LINE, line);
    let builder = places.iter().fold(builder, |builder, place| place.join(builder, Left::default()));
    let fleet = builder.start().map_err(|error| error.to_string())?;
    // Most have said what they are by then.
    sleep(Duration::from_millis(source.u16(..4_000).into())).await;
    let mut hands = Hands { fleet, places, source };
    for _ in 0..hands.source.usize(1..=STEPS) {
        hands.act();
        // Most come close behind each other.
        let wait = u64::from(hands.source.u16(..));
        sleep(Duration::from_millis(if wait % 4 == 0 { wait % 6_000 } else { wait % 400 })).await;
    }
    let Hands { fleet, places, mut source } = hands;
    if source.bool() {
        places.iter().for_each(|place| locked(&place.truth).becomes_calm());
        sleep(LONGEST).await;
        places.iter().for_each(|place| locked(&place.truth).judge_the_end());
    }
    places.iter().for_each(leaves);
    for (name, action) in fleet.shutdown(ENDED_WITHIN).await {
        places.iter().filter(|place| *place.name() == *name).for_each(|place| place.ended(&action));
    }
    sleep(LONGEST).await;
    let against = places.iter().find_map(|place| {
        let mut truth = locked(&place.truth);
        let is_told = truth.pending.is_empty();
        is_told.then_some(()).ok_or_else(|| truth.object("a command is never told")).ok();
        let against = truth.against.take()?;
        Some(format!("{against}: {} of {}: {}", place.name(), places.len(), truth.story.join(", ")))
    });
    against.map_or(Ok(()), Err)
}

/// Nothing of it is started from now on.
fn leaves(place: &Place) {
    let mut truth = locked(&place.truth);
    truth.note("leaves");
    truth.leaving.get_or_insert_with(Instant::now);
}

impl Hands {
    fn act(&mut self) {
        let source = &mut self.source;
        let by = HANDS[source.usize(..HANDS.len())];
        let place = self.places[source.usize(..self.places.len())].clone();
        let frequency = Frequency::from_hertz(source.u16(10..50));
        let direction = if source.u8(..5) == 1 { Direction::Reverse } else { Direction::Forward };
        let drive = self.fleet.drive(&place.name()).map(|drive| drive.commanded_by(Act::of(by)));
        match (source.u8(..24), drive) {
            (0..=4, Some(drive)) => self.start(&place, &drive, by, direction, frequency),
            (6, Some(drive)) => {
                place.given(Ordered::Stop, by, None, false);
                let (given, stop) = (Instant::now(), drive.stop(StopMode::Ramp));
                drop(tokio::spawn(async move {
                    let outcome = stop.finished().await;
                    locked(&place.truth).told(Ordered::Stop, given, &outcome);
                }));
            }
            (7 | 8, Some(drive)) => {
                place.given(Ordered::Setpoint(frequency), by, None, false);
                self.hear(&place, drive.set_setpoint(frequency), Ordered::Setpoint(frequency));
            }
            (5 | 9..=11, _) => {
                let setpoint = Some(frequency).filter(|_| self.source.bool());
                self.start_several(by, direction, setpoint);
            }
            (12, _) => self.stop_all(by),
            (13..=15, Some(_)) => {
                let nobody_but = HANDS.get(self.source.usize(..9)).copied();
                let limit = [LIMIT, LIMIT, Frequency::from_hertz(20)][self.source.usize(..3)];
                locked(&place.truth).ruled(Rule { nobody_but, limit });
                drop(self.fleet.reconfigure(place.settings()));
            }
            (16, Some(drive)) => self.take_out(place, &drive),
            (17, Some(drive)) => {
                locked(&place.truth).resets_ordered += 1;
                place.given(Ordered::Other, by, None, false);
                self.hear(&place, drive.reset_faults(), Ordered::Other);
            }
            (18, _) => locked(&place.truth).happens(self.source.u8(8..=12)),
            (19, _) => locked(&place.truth).happens(14),
            (_, _) => {}
        }
    }

    fn start(
        &mut self,
        place: &Place,
        drive: &DriveHandle,
        by: &'static str,
        direction: Direction,
        frequency: Frequency,
    ) {
        let setpoint = Some(frequency).filter(|_| self.source.u8(..3) > 0);
        place.given(Ordered::Start(direction), by, setpoint, false);
        let ticket = match setpoint {
            Some(setpoint) => drive.start_at(direction, setpoint),
            None => drive.start(direction),
        };
        self.hear(place, ticket, Ordered::Start(direction));
    }

    /// What becomes of an order is told to the judge when it is told, or that its asker has gone.
    fn hear(&mut self, place: &Place, ticket: Ticket, ordered: Ordered) {
        let waits = u64::from(self.source.u16(..2_000));
        let waits = Duration::from_millis(if self.source.u8(..4) == 1 { waits } else { 3_600_000 });
        let (given, truth) = (Instant::now(), Arc::clone(&place.truth));
        drop(tokio::spawn(async move {
            let outcome = tokio::time::timeout(waits, ticket.finished()).await;
            match outcome {
                Ok(outcome) => locked(&truth).told(ordered, given, &outcome),
                Err(_) => {
                    locked(&truth).is_dropped(ordered, given);
                    ticket.withdraw();
                }
            }
        }));
    }

    /// Those of whom it is not known that they are being taken out.
    fn group(&mut self, by: &'static str) -> (Vec<Place>, Group) {
        let all = self.fleet.drives();
        let members: Vec<DriveHandle> = all.into_iter().filter(|_| self.source.u8(..3) > 0).collect();
        let is_member = |place: &&Place| members.iter().any(|member| **member.name() == *place.name());
        let places = self.places.iter().filter(is_member).cloned().collect();
        (places, self.fleet.group_of(members).commanded_by(Act::of(by)))
    }

    fn start_several(&mut self, by: &'static str, direction: Direction, setpoint: Option<Frequency>) {
        let (places, group) = self.group(by);
        let (given, ordered) = (Instant::now(), Ordered::Start(direction));
        places.iter().for_each(|place| place.given(ordered, by, setpoint, true));
        let setpoint = setpoint.map(Into::into);
        let start = GroupStart { direction, setpoint, spacing: Duration::ZERO, until: Until::InForce };
        let ticket = group.start(start);
        drop(tokio::spawn(async move {
            let outcomes = match ticket.finished().await {
                Ok(outcomes) => outcomes,
                Err(GroupFailure::NotReady(refused)) => {
                    refused.into_iter().map(|(name, refused)| (name, Outcome::Refused(refused))).collect()
                }
                Err(GroupFailure::Failed { outcomes, .. } | GroupFailure::Abandoned(outcomes)) => outcomes,
            };
            for place in places {
                let outcome = outcomes.iter().find(|(name, _)| **name == *place.name());
                let mut truth = locked(&place.truth);
                match outcome {
                    Some((_, outcome)) => truth.told(ordered, given, outcome),
                    // Another one did not start: it was never begun, or is stopped again.
                    None => truth.is_dropped(ordered, given),
                }
            }
        }));
    }

    fn stop_all(&mut self, by: &'static str) {
        let (places, group) = self.group(by);
        places.iter().for_each(|place| place.given(Ordered::Stop, by, None, true));
        let (given, stops) = (Instant::now(), group.stop(StopMode::Ramp));
        for (name, stop) in stops.each() {
            let Some(place) = places.iter().find(|place| *place.name() == **name).cloned() else { continue };
            let stop = stop.clone();
            drop(tokio::spawn(async move {
                let outcome = stop.finished().await;
                locked(&place.truth).told(Ordered::Stop, given, &outcome);
            }));
        }
    }

    /// It is taken out, and comes again.
    fn take_out(&mut self, place: Place, drive: &DriveHandle) {
        let (fleet, drive) = (self.fleet.clone(), drive.clone());
        let again = Duration::from_millis(self.source.u16(..).into()) / 8;
        leaves(&place);
        let removed = fleet.remove(&[&place.name()], ENDED_WITHIN);
        drop(tokio::spawn(async move {
            for (_, action) in removed.await {
                place.ended(&action);
            }
            sleep(again).await;
            {
                let mut truth = locked(&place.truth);
                truth.note("joins");
                (truth.leaving, truth.lease) = (None, None);
            }
            // Nobody joins what is about to end.
            drop(fleet.extend(|builder| place.join(builder, drive.left()).whatever_the_plan()));
        }));
    }
}
