//! Orders whose line is lost in their midst: an error that says that nothing was written is one of an order that has written nothing,
//! what a start has moved turns its way, and has a lease.

use drive_core::Direction;

use super::{CALLS, Complaint, OTHER, SETPOINT, SETTLED, Stage};
use crate::{
    contract::Contract,
    recorder::{Habit, Heard},
};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    Start,
    /// Of a motor that turned the other way before it was stopped.
    StartBehindReverse,
    StartTheOtherWay,
    Setpoint,
    Reset,
    Release,
}

const ORDERS: [Order; 6] = [
    Order::Start,
    Order::StartBehindReverse,
    Order::StartTheOtherWay,
    Order::Setpoint,
    Order::Reset,
    Order::Release,
];

impl Contract {
    pub(super) async fn knows_what_it_has_written(&self) -> Vec<Complaint> {
        let mut complaints = Vec::new();
        for order in ORDERS {
            for habit in [Habit::LosesAnswersFrom, Habit::LosesRequestsFrom] {
                for number in 0..CALLS {
                    let mut stage = self.stage("an error says whether anything was written before it").await;
                    let calls = self.break_off(&mut stage, order, habit(number)).await;
                    complaints.append(&mut stage.complaints);
                    if calls <= number {
                        break;
                    }
                }
            }
        }
        complaints
    }

    /// Gives an order whose line is lost in its midst, judges its error, and gives how many calls there were.
    async fn break_off(&self, stage: &mut Stage, order: Order, habit: Habit) -> usize {
        match (order, self.trip) {
            (Order::StartTheOtherWay, _) if stage.run().await.is_none() => return 0,
            (Order::StartTheOtherWay, _) => {}
            (Order::StartBehindReverse, _) => {
                let _ = stage.rig.drive.set_setpoint(SETPOINT.into()).await;
                let _ = stage.rig.drive.start(Direction::Reverse).await;
                stage.live(SETTLED).await;
                stage.stop_at_last().await;
            }
            (Order::Reset, Some(trip)) => {
                stage.rig.machine.trip(trip);
                let _ = stage.rig.drive.status().await;
            }
            _ => {
                let _ = stage.rig.drive.set_setpoint(SETPOINT.into()).await;
            }
        }
        stage.witness.from_now_on(habit);
        let drive = &mut stage.rig.drive;
        let ended = match order {
            Order::Start | Order::StartBehindReverse => drive.start(Direction::Forward).await.map(drop),
            Order::StartTheOtherWay => drive.start(Direction::Reverse).await.map(drop),
            Order::Setpoint => drive.set_setpoint(OTHER.into()).await,
            Order::Reset => drive.reset_faults().await.map(drop),
            Order::Release => drive.release().await.map(drop),
        };
        let heard = stage.witness.heard();
        let arrived = match habit {
            Habit::LosesRequestsFrom(first) => heard.get(..first).unwrap_or(&heard),
            _ => &heard,
        };
        stage.live(SETTLED).await;
        // The words that lead up to a run command are no order, as long as nothing turns by them.
        let control = self.control.map(|control| control.register);
        let is_start = matches!(order, Order::Start | Order::StartBehindReverse);
        let leads_up = is_start && stage.rests();
        let is_order = |heard: &&Heard| heard.writes() && !(leads_up && heard.register == control);
        if let Err(error) = &ended
            && error.has_written_nothing()
            && let Some(written) = arrived.iter().find(is_order)
        {
            stage.blame(format!("{order:?}, {habit:?}: nothing was written ({error}), and {written:?} was"));
        }
        let seen = stage.seen();
        if is_start && seen.output_frequency < 0 {
            stage
                .blame(format!("{order:?}, {habit:?}: a start forward turns the motor in reverse: {seen:?}"));
        }
        if is_start && seen.running && stage.rig.drive.lease().is_none() {
            stage
                .blame(format!("{order:?}, {habit:?}: the motor runs by it, and no lease stands: {ended:?}"));
        }
        stage.stop_at_last().await;
        heard.len()
    }
}
