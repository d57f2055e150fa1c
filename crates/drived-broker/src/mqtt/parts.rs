//! A drive in parts, one for each of its topics, and which of them are news.

use drive_core::Row;
use serde_json::{Map, Value, json};
use tokio::time::Instant;

use drived_plant::plant::views::DriveView;
use drived_words::json::unix;

/// The topics of the parts.
pub(super) const TOPICS: [&str; 4] = ["state", "measurements", "fault", "about"];
/// What a drive is, which is no matter of the moment: the last of them.
pub(super) const ABOUT: usize = 3;
/// The slow values.
pub(super) const MEASUREMENTS: usize = 1;

/// What of a drive is told in [`ABOUT`].
const OF_ABOUT: [&str; 10] =
    ["id", "short_name", "slot", "line", "slave", "family", "not_known", "commanders", "limits", "identity"];
/// The verdict on an identity, which is one of the moment: it stays with the state, which ends with the daemon.
const VERDICT: &str = "check";

/// What changes as time goes by and with each poll: it is no news by itself.
const ALWAYS_NEW: [&str; 4] = ["age_ms", "time_unix_ms", "polls", "answered"];

/// By its unit, how far a value may move and mean the same: a step or two of the drives' resolution, and what a motor at a steady load
/// shows from one reading to the next.
const DEADBANDS: [(&str, f64); 7] =
    [("_hz", 0.05), ("_a", 0.1), ("_percent", 0.5), ("_v", 1.0), ("_rpm", 2.0), ("_kw", 0.02), ("_h", 0.1)];

/// A drive as it is told, by the order of [`TOPICS`].
pub(super) fn parts_of(view: &DriveView) -> [Value; 4] {
    let now = Value::from(unix(Instant::now()));
    let object = |value| match value {
        Some(Value::Object(object)) => object,
        _ => Map::new(),
    };
    let mut state = object(serde_json::to_value(view).ok());
    let measurements = object(state.remove("measurements"));
    let fault = state.remove("fault");
    let present = Value::from(fault.is_some());
    let mut fault = object(fault);
    fault.insert("present".to_owned(), present);
    fault.insert("quality".to_owned(), state["status"]["quality"].clone());
    let taken = OF_ABOUT.into_iter().filter_map(|key| Some((key.to_owned(), state.remove(key)?)));
    let mut about: Map<String, Value> = taken.collect();
    let check = about.get_mut("identity").and_then(|identity| identity.as_object_mut()?.remove(VERDICT));
    state.extend(check.map(|check| ("identity".to_owned(), json!({ VERDICT: check }))));
    [state, measurements, fault, about].map(|mut part| {
        part.insert("time_unix_ms".to_owned(), now.clone());
        Value::Object(part)
    })
}

/// How a part is, beside how it was told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum News {
    Nothing,
    /// Values have moved, none by more than its deadband.
    Little,
    Something,
}

/// What has changed in the part of this place since it was told. `rows`: the registers of the drive's family.
pub(super) fn news(place: usize, before: &Value, now: &Value, rows: &[Row]) -> News {
    let (Value::Object(before), Value::Object(now)) = (before, now) else { return News::Something };
    let bands = |key: &str| place == MEASUREMENTS || place == 0 && key == "status";
    of_objects(before, now, rows, &bands)
}

fn of_objects(
    before: &Map<String, Value>,
    now: &Map<String, Value>,
    rows: &[Row],
    bands: &dyn Fn(&str) -> bool,
) -> News {
    let keys = before.keys().chain(now.keys().filter(|key| !before.contains_key(*key)));
    let of = |key: &String| match (before.get(key), now.get(key)) {
        _ if ALWAYS_NEW.contains(&key.as_str()) => News::Nothing,
        (Some(before), Some(now)) => of_values(key, before, now, rows, bands(key)),
        _ => News::Something,
    };
    keys.map(of).max().unwrap_or(News::Nothing)
}

fn of_values(key: &str, before: &Value, now: &Value, rows: &[Row], has_bands: bool) -> News {
    match (before, now) {
        (Value::Object(before), Value::Object(now)) => of_objects(before, now, rows, &|_| has_bands),
        (Value::Array(before), Value::Array(now)) if key == "raw" && before.len() == now.len() => before
            .iter()
            .zip(now)
            .map(|(before, now)| of_words(before, now, rows))
            .max()
            .unwrap_or(News::Nothing),
        (Value::Array(before), Value::Array(now)) if before.len() == now.len() => {
            let each =
                before.iter().zip(now).map(|(before, now)| of_values(key, before, now, rows, has_bands));
            each.max().unwrap_or(News::Nothing)
        }
        _ if before == now => News::Nothing,
        (Value::Number(before), Value::Number(now)) if has_bands => {
            let band = DEADBANDS.iter().find(|(unit, _)| key.ends_with(unit)).map_or(0.0, |(_, band)| *band);
            let (before, now) = (before.as_f64().unwrap_or_default(), now.as_f64().unwrap_or_default());
            // That a value is 0, or no longer, means something whatever it was.
            let is_zero = (before == 0.0) != (now == 0.0);
            // Hundredths have no exact form.
            let is_little = (before - now).abs() < band + 1e-6 && band > 0.0 && !is_zero;
            if is_little { News::Little } else { News::Something }
        }
        _ => News::Something,
    }
}

/// A word with a unit is told as a value beside it; of one without a unit each bit counts.
fn of_words(before: &Value, now: &Value, rows: &[Row]) -> News {
    let is_value = |row: &Row| !row.unit.symbol.is_empty();
    let row = rows.iter().find(|row| now["address"] == row.address && now["code"] == row.code);
    match before == now {
        true => News::Nothing,
        false if before["address"] == now["address"] && row.is_some_and(is_value) => News::Little,
        false => News::Something,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use drive_families::Family;

    fn rows() -> &'static [Row] {
        Family::ATV312.capabilities().rows
    }

    #[test]
    fn a_value_that_moves_by_less_than_it_means_is_little_and_zero_is_always_something() {
        let of = |before: f64, now: f64| {
            let state = |hertz: f64| json!({"status": {"output_frequency_hz": hertz, "age_ms": hertz}});
            news(0, &state(before), &state(now), rows())
        };
        assert_eq!(of(30.0, 30.0), News::Nothing);
        assert_eq!((of(30.0, 30.05), of(30.0, 30.06)), (News::Little, News::Something));
        assert_eq!((of(0.03, 0.0), of(0.0, 0.01)), (News::Something, News::Something));
        let of = |key: &str, before: f64, now: f64| {
            news(MEASUREMENTS, &json!({key: before}), &json!({key: now}), rows())
        };
        assert_eq!(
            (of("line_voltage_v", 400.0, 401.0), of("line_voltage_v", 400.0, 401.5)),
            (News::Little, News::Something)
        );
        assert_eq!(
            of("input_energy_counts", 7.0, 8.0),
            News::Something,
            "what has no unit here has no deadband"
        );
    }

    #[test]
    fn what_somebody_has_set_is_told_whatever_it_moves_by() {
        let state = |hertz: f64| json!({"setpoint": {"frequency_hz": hertz}});
        assert_eq!(news(0, &state(30.0), &state(30.01), rows()), News::Something);
        let about = |hertz: f64| json!({"limits": {"high_hz": hertz}});
        assert_eq!(news(ABOUT, &about(50.0), &about(50.01), rows()), News::Something);
    }

    #[test]
    fn of_a_word_that_has_bits_each_counts_and_one_that_is_a_value_has_that_beside_it() {
        // BBV51701: ETA 3201 is the status word; RFR 3202 the output frequency in 0.1 Hz.
        let word = |address: u16, value: u16| {
            let code = rows().iter().find(|row| row.address == address).map(|row| row.code);
            json!({"status": {"raw": [{"address": address, "code": code, "value": value}]}})
        };
        assert_eq!(news(0, &word(3_201, 0x0637), &word(3_201, 0x0233), rows()), News::Something);
        assert_eq!(news(0, &word(3_202, 300), &word(3_202, 301), rows()), News::Little);
    }
}
