//! What is read as it is now: drives, lines, alarms, commands, and what happens.

use drive_core::Faults;
use drived_plant::plant::{
    alarms::AlarmsView,
    history::{CurvesView, HistoryView},
    parameters::ParameterView,
    recent::RecentView,
    views::{CommandView, DriveView, LineDetailView, LineView, SettingsView, StateView},
};

use super::PCAPNG;
use crate::api::{
    alarms, capture, command, health, parameter, read,
    route::{Answer, Parameter, Route, WAIT},
    stream,
};

const SECONDS: Parameter =
    Parameter { name: "seconds", about: "how long: 1 to 600, 10 unless it is said", kind: "integer" };
const SINCE: Parameter =
    Parameter { name: "since", about: "the revision that the reader has", kind: "integer" };
const SINCE_TIME: Parameter = Parameter {
    name: "since_unix_ms",
    about: "the time of the last sample that the reader has: what came later is told",
    kind: "integer",
};

pub(super) fn reads() -> Vec<Route> {
    let events = Answer {
        status: 200,
        about: "server-sent events: `drive`, `line`, `command`, `event`, `alarm`, `tick`, and `reset` when the state must be read anew",
        content: "text/event-stream",
        describe: None,
    };
    vec![
        Route::get("/api/v1/state", read::state, "Everything at one moment")
            .answers::<StateView>(200, "the state"),
        Route::get("/api/v1/drives", read::drives, "All drives").answers::<Vec<DriveView>>(200, "the drives"),
        Route::get("/api/v1/drives/{name}", read::drive, "One drive").answers::<DriveView>(200, "the drive"),
        Route::get("/api/v1/drives/{name}/settings", read::settings, "What the program was told of a drive")
            .answers::<SettingsView>(
            200,
            "its periods, times, limits, alarms and policies, and what the plan makes of them",
        ),
        Route::get("/api/v1/drives/{name}/history", read::history, "The last ten minutes of a drive")
            .with_query(SINCE_TIME)
            .answers::<HistoryView>(200, "the history"),
        Route::get(
            "/api/v1/curves",
            read::curves,
            "The frequencies of all drives in the last ten minutes, in a few steps",
        )
        .answers::<CurvesView>(200, "a small curve of each drive"),
        Route::get("/api/v1/drives/{name}/faults", parameter::faults, "What a drive says of its faults")
            .answers::<Faults>(200, "the present faults, the alarms and the history")
            .or_problem(409)
            .or_problem(504),
        Route::get("/api/v1/drives/{name}/parameters", parameter::parameters, "The registers of a drive")
            .with_query(WAIT)
            .answers::<Vec<ParameterView>>(200, "every register, with what could be read in time"),
        Route::get(
            "/api/v1/drives/{name}/parameters/{register}",
            parameter::parameter,
            "One register, read now",
        )
        .answers::<ParameterView>(200, "the register")
        .or_problem(409)
        .or_problem(504),
        Route::get("/api/v1/lines/{name}/capture", capture::capture, "What is on the line from now on")
            .with_query(SECONDS)
            .answer(PCAPNG)
            .or_problem(503),
        Route::get("/api/v1/lines", read::lines, "All lines").answers::<Vec<LineView>>(200, "the lines"),
        Route::get(
            "/api/v1/lines/{name}",
            read::line,
            "One line: its plan, what was measured on it, and what was on it lately",
        )
        .answers::<LineDetailView>(200, "the line, its plan, the measured and its last 100 exchanges"),
        Route::get(
            "/api/v1/alarms",
            alarms::alarms,
            "What troubles the plant, until it is over and acknowledged",
        )
        .answers::<AlarmsView>(200, "the alarms, in the order in which they came first"),
        Route::get("/api/v1/commands/{id}", command::command, "What became of a command")
            .with_query(WAIT)
            .answers::<CommandView>(200, "the command, whatever its outcome"),
        Route::get("/api/v1/events", stream::events, "What happens, as it happens")
            .with_query(SINCE)
            .answer(events),
        Route::get("/api/v1/events/recent", read::recent, "What has happened lately")
            .answers::<Vec<RecentView>>(200, "the last 500 commands and events, the newest last"),
        Route::get("/healthz", health::lives, "Whether the program lives")
            .answers::<health::Health>(200, "it does"),
        Route::get("/readyz", health::ready, "Whether every line makes progress")
            .answers::<health::Health>(200, "they do")
            .or_problem(503),
    ]
}
