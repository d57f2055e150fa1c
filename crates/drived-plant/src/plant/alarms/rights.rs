//! Who may do something about an alarm: whoever may operate its drive; of lines and of the program whoever may operate all.

use drive_fleet::alarms::Alarm;

use super::AlarmRejected;
use drived_config::{config::Group, rights::Caller};

pub(super) fn may(caller: &Caller, alarm: &Alarm, groups: &[Group]) -> Result<(), AlarmRejected> {
    if !caller.rights.operate {
        return Err(AlarmRejected::NoRight(caller.name.clone()));
    }
    let is_in_scope = match &alarm.drive {
        Some(drive) => caller.may_command(drive, groups),
        None => caller.scope.is_none(),
    };
    match is_in_scope {
        true => Ok(()),
        false => Err(AlarmRejected::OutOfScope { caller: caller.name.clone(), of: alarm.of() }),
    }
}
