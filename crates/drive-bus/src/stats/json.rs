//! What a line has counted, as JSON: times in whole nanoseconds, so that it reads back as it was; histograms by the ends of their
//! buckets, so that others than this crate can read them.

use std::{collections::BTreeMap, time::Duration};

use drive_core::Class;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use super::{
    BOUNDS, ClassStats, Histogram, Spread,
    histogram::{OCTAVES, SUB, count_at, end_of, nanos},
};

/// A histogram as it is written.
#[derive(Serialize, Deserialize)]
struct HistogramForm {
    count: u64,
    sum_ns: u64,
    min_ns: u64,
    max_ns: u64,
    /// Where each bucket ends in which there is something, and how many are in it.
    up_to_ns: Vec<(u64, u32)>,
}

impl Serialize for Histogram {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let filled = self.buckets().filter(|(_, count)| *count > 0);
        let up_to_ns = filled.map(|(end, count)| (nanos(end), count)).collect();
        let (count, sum_ns, min_ns, max_ns) = (self.count, self.sum, nanos(self.min()), self.max);
        HistogramForm { count, sum_ns, min_ns, max_ns, up_to_ns }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Histogram {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let HistogramForm { count, sum_ns, min_ns, max_ns, up_to_ns } =
            HistogramForm::deserialize(deserializer)?;
        let mut histogram = Self::new();
        for (end, times) in up_to_ns {
            let end = Duration::from_nanos(end);
            let bucket = (0..SUB * OCTAVES).find(|bucket| end_of(*bucket) == end);
            let bucket = bucket.ok_or_else(|| de::Error::custom(format!("no bucket ends at {end:?}")))?;
            histogram.count_in(bucket, times);
        }
        let counted: u64 = histogram.buckets.iter().copied().map(u64::from).sum();
        // A bucket that is full counts no more.
        if count < counted || (count > 0) != (counted > 0) || min_ns > max_ns {
            return Err(de::Error::custom("a histogram whose numbers contradict each other"));
        }
        if count > 0 {
            (histogram.count, histogram.sum, histogram.min, histogram.max) = (count, sum_ns, min_ns, max_ns);
        }
        Ok(histogram)
    }
}

/// A spread as it is written.
#[derive(Serialize, Deserialize)]
struct SpreadForm {
    /// One for each of [`BOUNDS`] and one for what is longer, without zeros at the end.
    counts: Vec<u32>,
    sum_ns: u64,
}

impl Serialize for Spread {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        SpreadForm { counts: self.counts.to_vec(), sum_ns: self.sum }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Spread {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let SpreadForm { counts, sum_ns } = SpreadForm::deserialize(deserializer)?;
        if counts.len() > BOUNDS.len() + 1 {
            return Err(de::Error::invalid_length(
                counts.len(),
                &"a count for each bound and one more at the most",
            ));
        }
        let mut spread = Self { counts: Box::default(), sum: sum_ns };
        for (at, &times) in counts.iter().enumerate().filter(|(_, times)| **times > 0) {
            count_at(&mut spread.counts, at, times);
        }
        Ok(spread)
    }
}

/// The classes by their names.
pub(super) mod classes {
    use super::{BTreeMap, Class, ClassStats, Deserialize, Deserializer, Serialize, Serializer};

    pub(in super::super) fn serialize<S: Serializer>(
        classes: &[ClassStats; 5],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        Class::ALL.iter().zip(classes).collect::<BTreeMap<_, _>>().serialize(serializer)
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<[ClassStats; 5], D::Error> {
        let mut classes = BTreeMap::<Class, ClassStats>::deserialize(deserializer)?;
        Ok(Class::ALL.map(|class| classes.remove(&class).unwrap_or_default()))
    }
}

/// The counters of a link.
#[cfg(feature = "unitelway")]
pub(super) mod link {
    use drive_unitelway::LinkCounters;

    use super::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Form {
        sent_not_acknowledged: u16,
        sent_refused: u16,
        received_not_acknowledged: u16,
        received_refused: u16,
    }

    pub(in super::super) fn serialize<S: Serializer>(
        link: &Option<LinkCounters>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let form = |link: &LinkCounters| Form {
            sent_not_acknowledged: link.sent_not_acknowledged,
            sent_refused: link.sent_refused,
            received_not_acknowledged: link.received_not_acknowledged,
            received_refused: link.received_refused,
        };
        link.as_ref().map(form).serialize(serializer)
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<LinkCounters>, D::Error> {
        let form = Option::<Form>::deserialize(deserializer)?;
        Ok(form.map(|form| LinkCounters {
            sent_not_acknowledged: form.sent_not_acknowledged,
            sent_refused: form.sent_refused,
            received_not_acknowledged: form.received_not_acknowledged,
            received_refused: form.received_refused,
        }))
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, from_value, json, to_value};

    use super::*;
    use crate::stats::{FarEndStats, SecondConnection, SlaveStats, Stats, WaitIs};

    fn histogram(micros: &[u64]) -> Histogram {
        let mut histogram = Histogram::new();
        micros.iter().for_each(|micros| histogram.record(Duration::from_micros(*micros)));
        histogram
    }

    /// Everything that a line can have counted.
    fn stats() -> Stats {
        let mut exchanges = Spread::default();
        [7, 21, 21, 2_000].iter().for_each(|millis| exchanges.record(Duration::from_millis(*millis)));
        let slave = SlaveStats {
            sent: 12,
            late: 1,
            offline: true,
            next_probe: Some(Duration::from_nanos(500_000_001)),
            response_timeout: Duration::from_micros(52_500),
            #[cfg(feature = "unitelway")]
            link: Some(drive_unitelway::LinkCounters { sent_refused: 3, ..Default::default() }),
            response: histogram(&[1, 8_100, 8_150, 12_000, 70_000_000]),
            exchanges,
            ..SlaveStats::default()
        };
        let mut stats = Stats { away: Some("unplugged".to_owned()), queued: 4, ..Stats::default() };
        stats.elapsed = Duration::from_secs(86_400) + Duration::from_nanos(7);
        stats.class_mut(Class::Stop).wait = histogram(&[300]);
        stats.class_mut(Class::KeepAlive).sent = 9;
        stats.slaves.insert(247, slave);
        stats.far_end = Some(FarEndStats {
            owed: 1,
            at_once: 1,
            no_more: true,
            wait: Duration::from_secs(3),
            wait_is: WaitIs::Seen,
            in_vain: 17,
            second: SecondConnection::GivenUp("it was refused"),
            stops_over_second: 2,
        });
        stats
    }

    #[test]
    fn what_a_line_has_counted_reads_back_as_it_was() {
        let stats = stats();
        let written = to_value(&stats).unwrap();
        assert_eq!(from_value::<Stats>(written.clone()).unwrap(), stats);
        assert_eq!(written["elapsed_ns"], json!(86_400_000_000_007_u64));
        assert_eq!(written["classes"]["keep_alive"]["sent"], 9);
        assert_eq!(written["far_end"]["second"], json!({"given_up": "it was refused"}));
        // 300 µs are in the bucket from 288 to 320 µs: an eighth of the octave from 256 µs on is 32.
        assert_eq!(written["classes"]["stop"]["wait"]["up_to_ns"], json!([[320_000, 1]]));
        // 7 ms are not longer than 8, 21 ms than 25, and 2 s are longer than all.
        let counts = [0, 1, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 1];
        assert_eq!(written["slaves"]["247"]["exchanges"]["counts"], json!(counts));
    }

    #[test]
    fn what_a_later_version_adds_or_an_earlier_had_not_is_no_error() {
        let read: Stats = from_value(json!({"foreign": 3, "of_tomorrow": {}})).unwrap();
        assert_eq!(read, Stats { foreign: 3, ..Stats::default() });
    }

    #[test]
    fn a_histogram_that_cannot_be_is_refused() {
        let good = to_value(histogram(&[300])).unwrap();
        assert!(from_value::<Histogram>(good.clone()).is_ok());
        let with = |key: &str, value: Value| {
            let mut bad = good.clone();
            bad[key] = value;
            bad
        };
        for (bad, says) in [
            (with("up_to_ns", json!([[320_001, 1]])), "no bucket ends at"),
            (with("up_to_ns", json!([])), "contradict"),
            (with("count", json!(0)), "contradict"),
            (with("min_ns", json!(300_001)), "contradict"),
            (with("count", json!(-1)), "invalid value"),
        ] {
            let error = from_value::<Histogram>(bad).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
        let long = json!({"counts": vec![0; 16], "sum_ns": 0});
        assert!(from_value::<Spread>(long).unwrap_err().to_string().contains("invalid length 16"));
    }
}
