//! The table of routes: what the router serves and what the document describes, in one place, so that they are the same.

use axum::{
    handler::Handler,
    http::Method,
    routing::{MethodFilter, MethodRouter, on},
};
use drive_core::Faults;
use drive_fleet::alarms::AlarmView;
use schemars::{JsonSchema, Schema, SchemaGenerator};

use super::{
    alarms::{self, Acknowledge, Done, Shelve, Unshelve},
    capture, command, demo, health,
    parameter::{self, NewValue},
    past, read, reload,
    selected::Selected,
    setup::{self, SetupChanges, SetupView},
    stream,
};
use drived_doors::{
    LINKS, LOGIN, LOGOUT, LoginBody, MadeLink, MadeToken, NewLink, NewToken, RemovedToken, Rotation,
    SessionView, TOKENS, TokensView,
};
use drived_plant::plant::{
    Plant,
    alarms::AlarmsView,
    commands::{Accept, NewSetpoint, Release, Reset, Save, Start, Stop},
    history::{CurvesView, HistoryView},
    parameters::{ParameterView, WrittenView},
    past::{
        DayView, FrameView, KeptView, LineMinutesView, MomentView, PastParameterView, RecordsView, StepsView,
        StoryView, ValuesView,
    },
    recent::RecentView,
    views::{CommandView, DriveView, LineDetailView, LineView, SettingsView, StateView},
};

/// How the schema of a type is made.
pub(super) type Describe = fn(&mut SchemaGenerator) -> Schema;

/// One method at one address.
pub(super) struct Route {
    pub(super) path: &'static str,
    pub(super) method: Method,
    /// Whether it stops: then the doors let it pass where they let nothing else.
    pub(super) stops: bool,
    /// `None`: it is served by somebody else, at the doors or beside the plant.
    pub(super) handler: Option<MethodRouter<Plant>>,
    /// What it is for.
    pub(super) about: &'static str,
    /// What may stand behind a question mark.
    pub(super) query: Vec<Parameter>,
    pub(super) body: Option<Describe>,
    pub(super) answers: Vec<Answer>,
    /// The statuses of its problem documents.
    pub(super) problems: Vec<u16>,
}

/// What may be said in the address.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parameter {
    pub(super) name: &'static str,
    pub(super) about: &'static str,
    pub(super) kind: &'static str,
}

/// What is answered when nothing is wrong.
pub(super) struct Answer {
    pub(super) status: u16,
    pub(super) about: &'static str,
    pub(super) content: &'static str,
    pub(super) describe: Option<Describe>,
}

const JSON: &str = "application/json";
const WAIT: Parameter = Parameter {
    name: "wait",
    about: "how long the outcome is waited for: 0 to 30s, 2s unless it is said",
    kind: "string",
};
const PCAPNG: Answer =
    Answer { status: 200, about: "a pcapng file", content: "application/x-pcapng", describe: None };
const SECONDS: Parameter =
    Parameter { name: "seconds", about: "how long: 1 to 600, 10 unless it is said", kind: "integer" };
const DRY_RUN: Parameter =
    Parameter { name: "dry_run", about: "only say what would change", kind: "boolean" };
const SINCE: Parameter =
    Parameter { name: "since", about: "the revision that the reader has", kind: "integer" };
const SINCE_TIME: Parameter = Parameter {
    name: "since_unix_ms",
    about: "the time of the last sample that the reader has: what came later is told",
    kind: "integer",
};

impl Route {
    fn new<H, T>(method: Method, path: &'static str, handler: H, about: &'static str) -> Self
    where
        H: Handler<T, Plant>,
        T: 'static,
    {
        let filter = MethodFilter::try_from(method.clone()).unwrap_or(MethodFilter::GET);
        Self { handler: Some(on(filter, handler)), ..Self::elsewhere(method, path, about) }
    }

    /// One that is described here and served elsewhere.
    fn elsewhere(method: Method, path: &'static str, about: &'static str) -> Self {
        let (query, answers) = (Vec::new(), Vec::new());
        let problems = vec![400, 401, 403];
        Self { path, method, stops: false, handler: None, about, query, body: None, answers, problems }
    }

    fn get<H, T>(path: &'static str, handler: H, about: &'static str) -> Self
    where
        H: Handler<T, Plant>,
        T: 'static,
    {
        let route = Self::new(Method::GET, path, handler, about);
        if path.contains('{') { route.or_problem(404) } else { route }
    }

    /// A command: its body in JSON, and an answer for each outcome.
    fn command<H, T, B: JsonSchema>(path: &'static str, handler: H, about: &'static str) -> Self
    where
        H: Handler<T, Plant>,
        T: 'static,
    {
        let mut route = Self::new(Method::POST, path, handler, about)
            .answers::<CommandView>(200, "it is confirmed")
            .answers::<CommandView>(202, "it is not settled yet; Location says where it will be told");
        route.query.push(WAIT);
        route.body = Some(SchemaGenerator::subschema_for::<B>);
        route.problems.extend([404, 409, 410, 413, 415, 422, 504]);
        route
    }

    /// A command that stops.
    fn stop<H, T, B: JsonSchema>(path: &'static str, handler: H, about: &'static str) -> Self
    where
        H: Handler<T, Plant>,
        T: 'static,
    {
        Self { stops: true, ..Self::command::<H, T, B>(path, handler, about) }
    }

    fn write<H, T>(path: &'static str, handler: H, about: &'static str) -> Self
    where
        H: Handler<T, Plant>,
        T: 'static,
    {
        let route = Self::new(Method::PUT, path, handler, about);
        let mut route = route.answers::<WrittenView>(200, "it holds the value");
        route.body = Some(SchemaGenerator::subschema_for::<NewValue>);
        route.problems.extend([404, 409, 413, 415, 422, 504]);
        route
    }

    /// Something that is done with an alarm, at once.
    fn of_alarm<H, T, B: JsonSchema>(path: &'static str, handler: H, about: &'static str) -> Self
    where
        H: Handler<T, Plant>,
        T: 'static,
    {
        let mut route = Self::new(Method::POST, path, handler, about)
            .answers::<AlarmView>(200, "the alarm as it is since; what was done before changes nothing");
        route.body = Some(SchemaGenerator::subschema_for::<B>);
        route.problems.extend([404, 409, 413, 415, 422]);
        route
    }

    /// Something that is done at once and has nothing to say.
    fn deed<H, T, B: JsonSchema>(path: &'static str, handler: H, about: &'static str) -> Self
    where
        H: Handler<T, Plant>,
        T: 'static,
    {
        let done = Answer { status: 204, about: "it is done", content: "", describe: None };
        let mut route = Self::new(Method::POST, path, handler, about).answer(done);
        route.body = Some(SchemaGenerator::subschema_for::<B>);
        route.problems.extend([404, 413, 415, 422]);
        route
    }

    fn answers<A: JsonSchema>(self, status: u16, about: &'static str) -> Self {
        self.answer(Answer {
            status,
            about,
            content: JSON,
            describe: Some(SchemaGenerator::subschema_for::<A>),
        })
    }

    fn answer(mut self, answer: Answer) -> Self {
        self.answers.push(answer);
        self
    }

    fn or_problem(mut self, status: u16) -> Self {
        self.problems.push(status);
        self
    }

    fn with_query(mut self, parameter: Parameter) -> Self {
        self.query.push(parameter);
        self
    }
}

/// What a demonstration has besides.
pub(super) fn demo_routes() -> Vec<Route> {
    vec![
        Route::deed::<_, _, demo::Trip>("/api/v1/demo/trip", demo::trip, "Trips a simulated drive"),
        Route::deed::<_, _, demo::Cable>("/api/v1/demo/cable", demo::cable, "Pulls or plugs in a cable"),
    ]
}

/// What the doors serve themselves.
pub(super) fn door_routes() -> Vec<Route> {
    let post = |path, about| {
        let mut route =
            Route::elsewhere(Method::POST, path, about).answers::<SessionView>(200, "who the caller is now");
        route.problems.extend([413, 415]);
        route
    };
    let mut login = post(
        LOGIN,
        "Begins a session by a token, or by a code that is good once; the answer sets its cookie",
    )
    .or_problem(422)
    .or_problem(429)
    .or_problem(503);
    login.body = Some(SchemaGenerator::subschema_for::<LoginBody>);
    let on_socket = |mut route: Route| {
        route.problems.extend([404, 413, 415, 422, 503]);
        route
    };
    let mut new = on_socket(
        Route::elsewhere(Method::POST, TOKENS, "Makes a token, over the control socket")
            .answers::<MadeToken>(200, "what it is, told this once"),
    );
    new.body = Some(SchemaGenerator::subschema_for::<NewToken>);
    let mut link = on_socket(
        Route::elsewhere(
            Method::POST,
            LINKS,
            "Makes a link by which a browser begins a session, over the control socket",
        )
        .answers::<MadeLink>(200, "the link, told this once"),
    );
    link.body = Some(SchemaGenerator::subschema_for::<NewLink>);
    let removed = "/api/v1/tokens/{name}";
    let mut other = on_socket(
        Route::elsewhere(
            Method::PUT,
            removed,
            "Replaces a token by another of its name, over the control socket",
        )
        .answers::<MadeToken>(200, "the other one, told this once"),
    );
    other.body = Some(SchemaGenerator::subschema_for::<Rotation>);
    vec![
        login,
        other,
        post(LOGOUT, "Ends the session of the cookie"),
        on_socket(
            Route::elsewhere(Method::GET, TOKENS, "All tokens, over the control socket")
                .answers::<TokensView>(200, "their names and roles"),
        ),
        new,
        link,
        on_socket(
            Route::elsewhere(Method::DELETE, removed, "Removes a token, over the control socket")
                .answers::<RemovedToken>(200, "it is no more"),
        ),
    ]
}

/// What a program with a configuration has besides.
pub(super) fn reload_routes() -> Vec<Route> {
    let mut route =
        Route::elsewhere(Method::POST, reload::PATH, "Reads the configuration again, for engineers")
            .answers::<reload::Changes>(200, "what was done, or would be")
            .with_query(DRY_RUN);
    route.problems.extend([413, 415, 422, 500]);
    vec![route]
}

/// How drives come into a program with a configuration.
pub(super) fn setup_routes() -> Vec<Route> {
    fn post<B: JsonSchema, A: JsonSchema>(
        path: &'static str,
        about: &'static str,
        told: &'static str,
    ) -> Route {
        let mut route = Route::elsewhere(Method::POST, path, about).answers::<A>(200, told);
        route.body = Some(SchemaGenerator::subschema_for::<B>);
        route.problems.extend([413, 415, 422, 500]);
        route
    }
    let view = "ports, families, the scan that is under way or was last, and the drives that were added";
    let done = "what was done, a sentence each";
    vec![
        Route::elsewhere(Method::GET, setup::PATH, "How the first hour stands")
            .answers::<SetupView>(200, view),
        post::<setup::ScanWanted, SetupView>(
            setup::SCAN,
            "Begins to scan a port; nothing is written by it",
            view,
        ),
        post::<setup::Cancel, SetupView>(setup::CANCEL, "Gives up the scan that is under way", view),
        post::<setup::DrivesWanted, SetupChanges>(
            setup::DRIVES,
            "Takes drives up, to be watched, and writes them down",
            done,
        ),
        post::<setup::ControlWanted, SetupChanges>(
            setup::CONTROL,
            "Has commands taken for a drive that was added, or not any more",
            done,
        ),
    ]
}

/// What was, where a history is kept.
fn pasts() -> Vec<Route> {
    let from = Parameter { name: "from_unix_ms", about: "from when", kind: "integer" };
    let to = Parameter { name: "to_unix_ms", about: "until when, itself included", kind: "integer" };
    let of_past = |route: Route| route.or_problem(404).or_problem(503);
    let with_time = |route: Route| of_past(route.with_query(from).with_query(to));
    let parameter = |name, about, kind| Parameter { name, about, kind };
    let drives = parameter("drive", "of this drive, again for each; of all unless one is named", "string");
    let at = parameter("at_unix_ms", "when, to the second; a whole minute is that minute", "integer");
    vec![
        of_past(
            Route::get("/api/v1/history/kept", past::about, "What the history keeps, and since when")
                .answers::<KeptView>(200, "the names of its drives and values, its beginning, its size"),
        ),
        with_time(
            Route::get("/api/v1/history/curves", past::curves, "Values of several drives in steps")
                .with_query(drives)
                .with_query(parameter("value", "which, again for each, such as current_a", "string"))
                .with_query(parameter("every_ms", "how long a step is", "integer"))
                .answers::<StepsView>(200, "least, mean, greatest and the share known, step by step"),
        ),
        of_past(
            Route::get("/api/v1/history/moment", past::moment, "Every drive and line at a moment")
                .with_query(at)
                .answers::<MomentView>(200, "what was known then"),
        ),
        with_time(
            Route::get("/api/v1/history/lines", past::lines, "What was counted of the lines, by minutes")
                .answers::<LineMinutesView>(200, "minutes; next_from_unix_ms says where to ask on"),
        ),
        with_time(
            Route::get("/api/v1/history/days", past::days, "What each drive did, day by day")
                .with_query(drives)
                .answers::<Vec<DayView>>(200, "hours, starts, trips, energy, warnings, thermal states"),
        ),
        with_time(
            Route::get("/api/v1/drives/{name}/frames", past::frames, "Freeze-frames of a drive")
                .answers::<Vec<FrameView>>(200, "what was known around each trip and unconfirmed stop"),
        ),
        of_past(
            Route::get(
                "/api/v1/drives/{name}/frames/capture",
                past::capture_of_frame,
                "What captures have heard of its line around a freeze-frame",
            )
            .with_query(parameter("at_unix_ms", "the at_unix_ms of the freeze-frame", "integer"))
            .answer(PCAPNG),
        ),
        of_past(
            Route::get(
                "/api/v1/drives/{name}/parameters/past",
                past::parameters,
                "Every value of the settings of a drive that was ever read",
            )
            .answers::<Vec<PastParameterView>>(200, "by address, the newest last"),
        ),
        with_time(
            Route::get("/api/v1/drives/{name}/past", past::values, "A value of a drive between two moments")
                .with_query(parameter("value", "which, such as output_frequency_hz", "string"))
                .with_query(parameter(
                    "every_ms",
                    "in steps of this length; as it was read unless it is said",
                    "integer",
                ))
                .answers::<ValuesView>(
                    200,
                    "what is known, with its gaps; next_from_unix_ms says where to ask on",
                ),
        ),
        Route::get("/api/v1/drives/{name}/why", past::why, "What happened to a drive at a moment, in words")
            .with_query(at)
            .answers::<StoryView>(200, "what came first, what followed, who did what, and what is not known")
            .or_problem(404)
            .or_problem(503),
        with_time(
            Route::get("/api/v1/history/records", past::records, "What happened between two moments")
                .with_query(parameter("drive", "of one drive, and what is of none alone", "string"))
                .with_query(parameter("line", "of one line", "string"))
                .with_query(parameter("kind", "event, command, alarm, notice or history", "string"))
                .with_query(parameter("what", "in one word, such as tripped", "string"))
                .with_query(parameter("only_alarms", "only what somebody had to see to", "boolean"))
                .with_query(parameter(
                    "after",
                    "only what stands behind the record of this number",
                    "integer",
                ))
                .with_query(parameter(
                    "before",
                    "only what stands before the record of this number, the newest first",
                    "integer",
                ))
                .with_query(parameter("limit", "so many at the most, 20000", "integer"))
                .answers::<RecordsView>(200, "next_after or next_before says where to ask on"),
        ),
    ]
}

/// All of them.
pub(super) fn routes() -> Vec<Route> {
    let mut routes = reads();
    routes.extend(pasts());
    routes.extend(commands());
    routes
}

fn reads() -> Vec<Route> {
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

fn commands() -> Vec<Route> {
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
