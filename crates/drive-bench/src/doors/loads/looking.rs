//! Somebody on the control socket who looks at the drives all the time a load is there: how old what is told of them is, and whether a
//! setpoint falls.

#![expect(clippy::disallowed_methods, reason = "there is no runtime here")]

use std::{
    collections::BTreeMap,
    io::{Read as _, Write as _},
    os::unix::net::UnixStream,
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::Duration,
};

use serde_json::Value;

use super::Got;
use crate::{
    doors::PATIENCE,
    report::{Unit, quantile},
};

const LOOK: Duration = Duration::from_millis(500);

/// What was seen.
#[derive(Debug, Default)]
pub(in crate::doors) struct Looking {
    ages: Vec<Duration>,
    not_good: u64,
    setpoints: BTreeMap<String, f64>,
    fell: u64,
    in_vain: u64,
}

impl Looking {
    /// Looks until it is over.
    pub(in crate::doors) fn at(socket: &Path, over: &AtomicBool) -> Self {
        let mut seen = Self::default();
        while !over.load(Ordering::Relaxed) {
            match drives(socket) {
                Ok(drives) => drives.iter().for_each(|drive| seen.look(drive)),
                Err(_) => seen.in_vain += 1,
            }
            thread::sleep(LOOK);
        }
        seen
    }

    fn look(&mut self, drive: &Value) {
        let at = |pointer| drive.pointer(pointer);
        self.not_good += u64::from(at("/status/quality").and_then(Value::as_str) != Some("good"));
        self.ages.extend(at("/status/age_ms").and_then(Value::as_u64).map(Duration::from_millis));
        let name = at("/name").and_then(Value::as_str);
        if let Some((name, setpoint)) = name.zip(at("/setpoint/frequency_hz").and_then(Value::as_f64)) {
            let before = self.setpoints.insert(name.to_owned(), setpoint);
            self.fell += u64::from(before.is_some_and(|before| before > setpoint));
        }
    }

    /// As rows, ages by the period that the drives at rest have.
    pub(in crate::doors) fn got(mut self, period: Duration) -> Vec<Got> {
        let looks = self.ages.len();
        let mut age = |name: &str, per_mille| {
            let age = quantile(&mut self.ages, per_mille).as_secs_f64() / period.as_secs_f64();
            Got::new(format!("age of a status by its period, of {looks}: {name}"), Unit::Times, age)
        };
        let mut got = vec![age("p50", 500), age("p99", 990), age("the oldest", 1_000)];
        got.push(Got::new("statuses that are missing or too old", Unit::Count, self.not_good as f64));
        got.push(Got::new("setpoints that fell", Unit::Count, self.fell as f64));
        for (name, hertz) in self.setpoints {
            got.push(Got::new(
                format!("the setpoint of {name} at last, in tenths of a hertz"),
                Unit::Count,
                hertz * 10.0,
            ));
        }
        got.push(Got::new("looks in vain", Unit::Count, self.in_vain as f64));
        got
    }
}

fn drives(socket: &Path) -> std::io::Result<Vec<Value>> {
    let mut stream = UnixStream::connect(socket)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.write_all(b"GET /api/v1/drives HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    let body = answer.split_once("\r\n\r\n").map_or("", |(_, body)| body);
    serde_json::from_str(body).map_err(std::io::Error::other)
}
