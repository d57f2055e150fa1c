//! What is commanded, written and done with alarms.

use drived_plant::plant::commands::{Accept, NewSetpoint, Release, Reset, Save, Start, Stop};

use crate::api::{
    alarms::{self, Acknowledge, Done, Shelve, Unshelve},
    command, parameter,
    route::Route,
    selected::Selected,
};

pub(super) fn commands() -> Vec<Route> {
    vec![
        Route::command::<_, _, Start>(
            "/api/v1/drives/{name}/start",
            command::to_drive::<Start>,
            "Starts a motor",
        ),
        Route::stop::<_, _, Stop>("/api/v1/drives/{name}/stop", command::stop_drive, "Stops a motor"),
        Route::command::<_, _, NewSetpoint>(
            "/api/v1/drives/{name}/setpoint",
            command::to_drive::<NewSetpoint>,
            "Changes the setpoint of a drive",
        ),
        Route::command::<_, _, Reset>(
            "/api/v1/drives/{name}/reset",
            command::to_drive::<Reset>,
            "Resets the present fault of a drive",
        ),
        Route::command::<_, _, Release>(
            "/api/v1/drives/{name}/release",
            command::to_drive::<Release>,
            "Gives control of a drive back to its panel or terminals",
        ),
        Route::command::<_, _, Start>(
            "/api/v1/groups/{name}/start",
            command::to_group::<Start>,
            "Starts every drive of a group, or none",
        ),
        Route::stop::<_, _, Stop>(
            "/api/v1/groups/{name}/stop",
            command::stop_group,
            "Stops every drive of a group",
        ),
        Route::command::<_, _, NewSetpoint>(
            "/api/v1/groups/{name}/setpoint",
            command::to_group::<NewSetpoint>,
            "Changes the setpoint of every drive of a group",
        ),
        Route::command::<_, _, Reset>(
            "/api/v1/groups/{name}/reset",
            command::to_group::<Reset>,
            "Resets the present faults of a group",
        ),
        Route::command::<_, _, Release>(
            "/api/v1/groups/{name}/release",
            command::to_group::<Release>,
            "Gives control of a group back to panels or terminals",
        ),
        Route::command::<_, _, Selected<Start>>(
            "/api/v1/selected/start",
            command::to_selected::<Start>,
            "Starts the drives that are named, each by itself",
        ),
        Route::stop::<_, _, Selected<Stop>>(
            "/api/v1/selected/stop",
            command::stop_selected,
            "Stops the drives that are named",
        ),
        Route::command::<_, _, Selected<NewSetpoint>>(
            "/api/v1/selected/setpoint",
            command::to_selected::<NewSetpoint>,
            "Changes the setpoint of the drives that are named",
        ),
        Route::command::<_, _, Selected<Reset>>(
            "/api/v1/selected/reset",
            command::to_selected::<Reset>,
            "Resets the present faults of the drives that are named",
        ),
        Route::command::<_, _, Selected<Release>>(
            "/api/v1/selected/release",
            command::to_selected::<Release>,
            "Gives control of the drives that are named back to panels or terminals",
        ),
        Route::command::<_, _, Save>(
            "/api/v1/drives/{name}/save",
            command::to_drive::<Save>,
            "Saves the parameters of a drive to its EEPROM",
        ),
        Route::command::<_, _, Accept>(
            "/api/v1/drives/{name}/accept",
            command::to_drive::<Accept>,
            "Accepts a drive that says it is another than before",
        ),
        Route::write(
            "/api/v1/drives/{name}/parameters/{register}",
            parameter::write,
            "Writes a register, unless it holds the value, and reads it back",
        ),
        Route::of_alarm::<_, _, Acknowledge>(
            "/api/v1/alarms/{id}/acknowledge",
            alarms::acknowledge,
            "Takes note of an alarm",
        ),
        Route::of_alarm::<_, _, Shelve>(
            "/api/v1/alarms/{id}/shelve",
            alarms::shelve,
            "Puts an alarm aside for a time; none about a motor that moves or may",
        ),
        Route::of_alarm::<_, _, Unshelve>(
            "/api/v1/alarms/{id}/unshelve",
            alarms::unshelve,
            "Takes an alarm back from where it was put aside",
        ),
        Route::of_alarm::<_, _, Done>(
            "/api/v1/alarms/{id}/done",
            alarms::done,
            "Says that what an alarm of maintenance, or of what a run has left, asks for was done",
        ),
        Route::stop::<_, _, Stop>("/api/v1/stop", command::stop_all, "Stops every drive"),
    ]
}
