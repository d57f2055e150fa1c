//! Moments as a person says them: `03:12`, `yesterday 03:12`, `2026-11-21 03:12`, `2026-11-21T03:12:00+01:00`, `now`.

use std::fmt::Display;

use chrono::{DateTime, Days, Local, LocalResult, NaiveDateTime, NaiveTime, TimeZone};

/// A moment that somebody has said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Said<Tz: TimeZone> {
    pub at: DateTime<Tz>,
    /// The same time of the day was there once more: in autumn an hour comes twice, and the first is meant unless it is said otherwise.
    pub again: Option<DateTime<Tz>>,
}

/// A text that is no moment.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoMoment {
    #[error(
        "{0:?}: expected 03:12, \"yesterday 03:12\", \"2026-11-21 03:12\", 2026-11-21T03:12:00+01:00 or now"
    )]
    Unread(String),
    #[error("{0} did not exist here: the clocks were put forward over it")]
    LeftOut(NaiveDateTime),
}

/// Reads a moment. A time without a day is the last one that has been.
///
/// # Errors
/// [`NoMoment`]: it is none.
pub fn said<Tz: TimeZone>(text: &str, now: &DateTime<Tz>) -> Result<Said<Tz>, NoMoment> {
    let text = text.trim();
    if let Ok(whole) = DateTime::parse_from_rfc3339(text) {
        return Ok(Said { at: whole.with_timezone(&now.timezone()), again: None });
    }
    if text == "now" {
        return Ok(Said { at: now.clone(), again: None });
    }
    let (mut local, is_time_alone) =
        local(text, now.naive_local()).ok_or_else(|| NoMoment::Unread(text.to_owned()))?;
    let mut times = in_order(now.timezone().from_local_datetime(&local));
    if is_time_alone {
        // In the hour that comes twice the clock shows less than it has shown.
        let has_been = times.0.as_ref().map_or(local <= now.naive_local(), |at| at <= now);
        if !has_been && let Some(yesterday) = local.checked_sub_days(Days::new(1)) {
            local = yesterday;
            times = in_order(now.timezone().from_local_datetime(&local));
        }
        times.1 = times.1.filter(|again| again <= now);
    }
    match times {
        (Some(at), again) => Ok(Said { at, again }),
        (None, _) => Err(NoMoment::LeftOut(local)),
    }
}

/// A moment as a person reads it, in this form. In the hour that comes twice its offset stands behind it: nothing else tells the two apart.
pub fn told<Tz: TimeZone<Offset: Display>>(at: &DateTime<Tz>, form: &str) -> String {
    match in_order(at.timezone().from_local_datetime(&at.naive_local())) {
        (_, None) => at.format(form).to_string(),
        _ => format!("{} {}", at.format(form), at.format("%:z")),
    }
}

/// The same of milliseconds since 1970, in this machine's zone; `None`: they are no moment.
pub fn told_here(unix_ms: i64, form: &str) -> Option<String> {
    DateTime::from_timestamp_millis(unix_ms).map(|at| told(&at.with_timezone(&Local), form))
}

/// When a time of the clock was, and when it was again where it came twice. In which order a zone tells the two is its own.
pub fn in_order<Tz: TimeZone>(
    times: LocalResult<DateTime<Tz>>,
) -> (Option<DateTime<Tz>>, Option<DateTime<Tz>>) {
    match times {
        LocalResult::Single(at) => (Some(at), None),
        LocalResult::Ambiguous(one, other) if one <= other => (Some(one), Some(other)),
        LocalResult::Ambiguous(one, other) => (Some(other), Some(one)),
        LocalResult::None => (None, None),
    }
}

/// The time of the clock that is said, on the day that is said, and whether none is: that it is today then.
fn local(text: &str, now: NaiveDateTime) -> Option<(NaiveDateTime, bool)> {
    let whole = ["%Y-%m-%d %H:%M", "%Y-%m-%d %H:%M:%S%.f", "%Y-%m-%dT%H:%M", "%Y-%m-%dT%H:%M:%S%.f"];
    if let Some(whole) = whole.into_iter().find_map(|form| NaiveDateTime::parse_from_str(text, form).ok()) {
        return Some((whole, false));
    }
    let (day, time) = match text.split_once(char::is_whitespace) {
        Some((day @ ("today" | "yesterday"), time)) => (Some(day), time.trim_start()),
        Some(_) => return None,
        None => (None, text),
    };
    let time =
        ["%H:%M", "%H:%M:%S%.f"].into_iter().find_map(|form| NaiveTime::parse_from_str(time, form).ok())?;
    let today = now.date().and_time(time);
    match day {
        Some("yesterday") => Some((today.checked_sub_days(Days::new(1))?, false)),
        day => Some((today, day.is_none())),
    }
}

#[cfg(test)]
mod tests {
    use chrono::{FixedOffset, NaiveDate, Offset as _};

    use super::*;

    /// Paris in 2026: the clocks go forward on 29 March at 02:00, and back on 25 October at 03:00.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    struct Paris;

    fn at(month: u32, day: u32, hour: u32, minute: u32) -> NaiveDateTime {
        NaiveDate::from_ymd_opt(2026, month, day).unwrap().and_hms_opt(hour, minute, 0).unwrap()
    }

    fn hours(hours: i32) -> FixedOffset {
        FixedOffset::east_opt(hours * 3_600).unwrap()
    }

    impl TimeZone for Paris {
        type Offset = FixedOffset;

        fn from_offset(_: &FixedOffset) -> Self {
            Self
        }

        fn offset_from_local_date(&self, day: &NaiveDate) -> LocalResult<FixedOffset> {
            self.offset_from_local_datetime(&day.and_time(NaiveTime::MIN))
        }

        fn offset_from_local_datetime(&self, local: &NaiveDateTime) -> LocalResult<FixedOffset> {
            let (winter, summer) = (hours(1), hours(2));
            match *local {
                local if local < at(3, 29, 2, 0) || local >= at(10, 25, 3, 0) => LocalResult::Single(winter),
                local if local < at(3, 29, 3, 0) => LocalResult::None,
                local if local < at(10, 25, 2, 0) => LocalResult::Single(summer),
                _ => LocalResult::Ambiguous(summer, winter),
            }
        }

        fn offset_from_utc_date(&self, day: &NaiveDate) -> FixedOffset {
            self.offset_from_utc_datetime(&day.and_time(NaiveTime::MIN))
        }

        fn offset_from_utc_datetime(&self, utc: &NaiveDateTime) -> FixedOffset {
            let is_summer = *utc >= at(3, 29, 1, 0) && *utc < at(10, 25, 1, 0);
            hours(if is_summer { 2 } else { 1 })
        }
    }

    fn read(text: &str, now: NaiveDateTime) -> Result<(String, Option<String>), NoMoment> {
        let now = Paris.from_local_datetime(&now).earliest().unwrap();
        said(text, &now).map(|said| (said.at.to_rfc3339(), said.again.map(|again| again.to_rfc3339())))
    }

    #[test]
    fn a_moment_is_read_as_a_person_says_it() {
        let now = at(11, 21, 9, 0);
        for (text, expected) in [
            ("03:12", "2026-11-21T03:12:00+01:00"),
            ("23:10:05", "2026-11-20T23:10:05+01:00"),
            ("yesterday 03:12", "2026-11-20T03:12:00+01:00"),
            ("today 23:00", "2026-11-21T23:00:00+01:00"),
            ("2026-07-01 03:12", "2026-07-01T03:12:00+02:00"),
            ("2026-07-01T03:12", "2026-07-01T03:12:00+02:00"),
            ("2026-11-21T03:12:00Z", "2026-11-21T04:12:00+01:00"),
            ("now", "2026-11-21T09:00:00+01:00"),
        ] {
            assert_eq!(read(text, now), Ok((expected.to_owned(), None)), "{text}");
        }
        for text in ["soon", "tomorrow 03:12", "25:00", "2026-13-01 03:12", ""] {
            assert_eq!(read(text, now), Err(NoMoment::Unread(text.to_owned())));
        }
    }

    #[test]
    fn in_the_hour_that_comes_twice_the_last_one_that_has_been_is_today_also_where_the_clock_shows_less() {
        let now = |offset: i32, minute: u32| {
            let local = hours(offset).from_local_datetime(&at(10, 25, 2, minute)).unwrap();
            local.with_timezone(&Paris)
        };
        let told = |text: &str, now: &DateTime<Paris>| {
            let said = said(text, now).unwrap();
            (said.at.to_rfc3339(), said.again.map(|again| again.to_rfc3339()))
        };
        let [first, second, yesterday] =
            ["2026-10-25T02:59:00+02:00", "2026-10-25T02:59:00+01:00", "2026-10-24T02:59:00+02:00"]
                .map(str::to_owned);
        // Two minutes ago; it is once more in 58 minutes.
        assert_eq!(told("02:59", &now(1, 1)), (first.clone(), None));
        assert_eq!(told("02:59", &now(1, 59)), (first.clone(), Some(second.clone())));
        assert_eq!(told("02:59", &now(2, 58)), (yesterday, None));
        assert_eq!(told("2026-10-25 02:59", &now(1, 1)), (first, Some(second)));
    }

    /// The zone of the machine tells the second of the two first, in Europe as in America.
    #[test]
    fn of_the_hour_that_comes_twice_the_earlier_one_is_the_first_whichever_its_zone_tells_first() {
        let local = at(10, 25, 2, 30);
        let [summer, winter] = [hours(2), hours(1)].map(|of| of.from_local_datetime(&local).unwrap());
        for both in [LocalResult::Ambiguous(summer, winter), LocalResult::Ambiguous(winter, summer)] {
            assert_eq!(in_order(both), (Some(summer), Some(winter)));
        }
    }

    #[test]
    fn a_moment_of_the_hour_that_comes_twice_is_told_with_what_tells_the_two_apart() {
        let at = |offset: i32, hour: u32, minute: u32| {
            let local = hours(offset).from_local_datetime(&at(10, 25, hour, minute)).unwrap();
            told(&local.with_timezone(&Paris), "%H:%M:%S")
        };
        let times = [at(2, 1, 59), at(2, 2, 0), at(2, 2, 59), at(1, 2, 0), at(1, 2, 59), at(1, 3, 0)];
        let [twice, again] = ["+02:00", "+01:00"];
        assert_eq!(
            times,
            [
                "01:59:00".to_owned(),
                format!("02:00:00 {twice}"),
                format!("02:59:00 {twice}"),
                format!("02:00:00 {again}"),
                format!("02:59:00 {again}"),
                "03:00:00".to_owned(),
            ]
        );
    }

    #[test]
    fn the_hour_that_comes_twice_is_told_and_the_one_that_is_left_out_refused() {
        let (first, again) = ("2026-10-25T02:30:00+02:00".to_owned(), "2026-10-25T02:30:00+01:00".to_owned());
        assert_eq!(read("2026-10-25 02:30", at(11, 1, 9, 0)), Ok((first, Some(again))));
        assert_eq!(read("2026-03-29 02:30", at(11, 1, 9, 0)), Err(NoMoment::LeftOut(at(3, 29, 2, 30))));
        assert_eq!(Paris.offset_from_utc_datetime(&at(7, 1, 0, 0)).fix(), hours(2));
    }
}
