//! The same for programs.

use std::time::SystemTime;

use drive_core::Status;
use serde::Serialize;

use super::{Reading, summary::Summary};
use drived_words::json::{self, microseconds, milliseconds};

#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum Object<'a> {
    Status {
        time_unix_ms: u64,
        drive: String,
        #[serde(flatten)]
        status: &'a Status,
    },
    Error {
        time_unix_ms: u64,
        drive: String,
        error: String,
    },
    Summary(SummaryObject),
}

#[derive(Serialize)]
struct SummaryObject {
    drives: Vec<DriveObject>,
    line: LineObject,
}

#[derive(Serialize)]
struct DriveObject {
    drive: String,
    good: u64,
    timeouts: u64,
    damaged: u64,
    wrong: u64,
    late: u64,
    exceptions: u64,
    response_p50_us: u64,
    response_p99_us: u64,
}

#[derive(Serialize)]
struct LineObject {
    elapsed_ms: u64,
    sweeps: u64,
    sweeps_per_1000_s: u64,
    utilisation_ppm: u32,
    foreign_frames: u64,
    noise_bytes: u64,
    stop_within_us: u64,
    silences: u64,
    shortest_silence_us: u64,
    needed_silence_us: u64,
}

pub(super) fn reading(reading: &Reading) -> String {
    let time_unix_ms = milliseconds(reading.at.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default());
    let drive = reading.name.to_string();
    json::line(&match &reading.outcome {
        Ok(status) => Object::Status { time_unix_ms, drive, status },
        Err(error) => Object::Error { time_unix_ms, drive, error: error.to_string() },
    })
}

pub(super) fn summary(summary: &Summary) -> String {
    let drives = summary.drives.iter().map(|(name, stats)| DriveObject {
        drive: name.to_string(),
        good: stats.outcomes.answered,
        timeouts: stats.outcomes.timeouts,
        damaged: stats.outcomes.damaged,
        wrong: stats.outcomes.mismatches,
        late: stats.late,
        exceptions: stats.outcomes.exceptions,
        response_p50_us: microseconds(stats.response.quantile(500)),
        response_p99_us: microseconds(stats.response.quantile(990)),
    });
    let line = LineObject {
        elapsed_ms: milliseconds(summary.elapsed),
        sweeps: summary.sweeps,
        sweeps_per_1000_s: summary.sweeps_per_1000_s(),
        utilisation_ppm: summary.utilisation_ppm,
        foreign_frames: summary.strange.0,
        noise_bytes: summary.strange.1,
        stop_within_us: microseconds(summary.stop_within),
        silences: summary.silences,
        shortest_silence_us: microseconds(summary.shortest_silence),
        needed_silence_us: summary.needed.as_ref().map_or(0, |(silence, _)| microseconds(*silence)),
    };
    json::line(&Object::Summary(SummaryObject { drives: drives.collect(), line }))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use drive_core::{Control, Error, Exchange, Frequency, PortError, RawWord, State};

    use super::*;
    use drived_words::drive_spec::DriveSpec;

    fn of(outcome: Result<Status, Error>) -> String {
        let name = "atv312@7".parse::<DriveSpec>().unwrap().single().unwrap();
        reading(&Reading { name, at: SystemTime::UNIX_EPOCH + Duration::from_millis(5), outcome })
    }

    #[test]
    fn a_status_is_one_object_without_what_the_drive_does_not_tell() {
        let status = Status {
            state: State::Running,
            output_frequency: Some(Frequency::from_hertz(30)),
            control: Some(Control::Bus),
            raw: vec![RawWord { address: 3201, code: "ETA", value: 0x0627 }],
            ..Status::default()
        };
        assert_eq!(
            of(Ok(status)),
            r#"{"kind":"status","time_unix_ms":5,"drive":"atv312@7","state":"running","output_frequency_hz":30.0,"control":"bus","raw":[{"address":3201,"code":"ETA","value":1575}]}"#
        );
    }

    #[test]
    fn a_poll_without_an_answer_is_an_object_with_its_reason() {
        let slave = "atv312@7".parse::<DriveSpec>().unwrap().single().unwrap().slave;
        let error = Error::Port {
            slave,
            exchange: Exchange { function: 3, register: Some(3201) },
            problem: PortError::Timeout { after: Duration::from_millis(500) },
        };
        assert_eq!(
            of(Err(error)),
            r#"{"kind":"error","time_unix_ms":5,"drive":"atv312@7","error":"slave 7, reading register 3201 (0C81h): no answer within 500 ms"}"#
        );
    }
}
