//! What a driver calls done, measured by the status that it gives for it: one that shows the opposite denies it, whoever wrote the
//! driver.

use drive_core::{
    Command, Control, Direction, Error, Motion, Refusal, Result, Setpoint, SlaveAddress, Status, StopMode,
    Stopped, Verdict,
};

use super::Reply;
use crate::snapshot::NEAR;

impl Reply {
    /// Of a stop: none is taken by a drive that goes on driving its motor.
    pub(crate) fn stopped(slave: SlaveAddress, mode: StopMode, result: Result<Stopped>) -> Self {
        Self::Stopped(result.and_then(|stopped| match stopped.status.motion {
            Motion::Driven => {
                let because = who_runs(&stopped.status);
                Err(not_shown(slave, Command::Stop(mode), stopped.status, because))
            }
            _ => Ok(stopped),
        }))
    }

    /// Of a start: none is in force in a drive that says what keeps its run command from acting, nor in one that has no output and of
    /// which its driver knows no run command of this side, nor in one that follows another reference than was `asked` for. At a reference of
    /// zero nothing turns, and it is in force all the same.
    pub(crate) fn started(
        slave: SlaveAddress,
        direction: Direction,
        asked: Option<Setpoint>,
        result: Result<Status>,
    ) -> Self {
        Self::Ordered(result.and_then(|status| {
            let because = match status.verdict {
                Some(Verdict::NotInForce { because, .. }) => Some(because),
                _ => follows_another(asked, &status),
            };
            match because.is_some() || status.verdict.is_none() && status.is_undriven() {
                true => Err(not_shown(slave, Command::Start(direction), status, because)),
                false => Ok(status),
            }
        }))
    }
}

/// Whether a motor that was started follows another reference than that with which it was: between the two another master may have written
/// one, or the drive have lost its supply and with it the setpoint.
pub(super) fn follows_another(asked: Option<Setpoint>, status: &Status) -> Option<Refusal> {
    const ANOTHER: Refusal = Refusal::Overridden {
        by: "another setpoint than was given",
        remedy: "see who else writes to this drive, and that its reference is that of the bus",
    };
    let Some((Setpoint::Frequency(asked), follows)) = asked.zip(status.reference) else { return None };
    let is_another = follows.centihertz().abs_diff(asked.centihertz()) > NEAR.centihertz();
    crate::mutant!("any-reference-started-at", is_another, false).then_some(ANOTHER)
}

fn not_shown(slave: SlaveAddress, command: Command, status: Status, because: Option<Refusal>) -> Error {
    Error::NotConfirmed { slave, command, status: Box::new(status), because }
}

/// By whose run command a motor is driven that was to be stopped, as far as its status tells.
pub(super) fn who_runs(status: &Status) -> Option<Refusal> {
    match (status.control, status.verdict) {
        (Some(other), _) if other != Control::Bus => Some(Refusal::NotInControl(other)),
        (_, Some(Verdict::NotInForce { because, .. })) => Some(because),
        (_, Some(Verdict::InForce)) => Some(Refusal::Overridden {
            by: "the run command of this program, which stands in the drive behind the stop,",
            remedy: "stop the motor at its panel, its terminals or its supply",
        }),
        (_, None) => Some(Refusal::Overridden {
            by: "a run command that this program has not given",
            remedy: "end it where it is given, such as at another master of the line",
        }),
        (_, Some(_)) => None,
    }
}
