//! What was, where a history is kept.

use drived_plant::plant::past::{
    DayView, FrameView, KeptView, LineMinutesView, MomentView, PastParameterView, RecordsView, StepsView,
    StoryView, ValuesView,
};

use super::PCAPNG;
use crate::api::{
    past,
    route::{Parameter, Route},
};

/// What was, where a history is kept.
pub(super) fn pasts() -> Vec<Route> {
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
