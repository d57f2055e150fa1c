//! What a long reading has read when it was cut, so that it goes on from there: [`KeptReadings`].

use std::time::Duration;

use tokio::time::Instant;

use crate::identity::Identity;

/// For how long a reading of a job that was cut is as good as a new one. Its age is told all the same.
const KEPT_FOR: Duration = Duration::from_secs(30);
/// How many readings are kept at the most.
const MOST: usize = 64;

#[derive(Debug, Clone)]
struct Reading {
    job: u8,
    first: u16,
    words: Vec<u16>,
    at: Instant,
}

/// The readings of class [`Background`](crate::Class::Background) of long jobs that may be cut, such as the slow set of a drive that
/// needs sixteen exchanges on a line with more urgent things to do. **A job that is begun again does not read anew what it has
/// read already**: with each turn that lets one exchange end it comes further, and of `n` exchanges it ends within `n` turns.
#[derive(Debug, Clone, Default)]
pub struct KeptReadings {
    job: Option<u8>,
    readings: Vec<Reading>,
    /// What the drive said of itself, or the exception by which it refused to: of which job, and when it was asked.
    named: Option<(u8, Result<Identity, u8>, Instant)>,
}

impl KeptReadings {
    /// The readings that follow are those of this job, which goes on where it was cut.
    pub const fn begin(&mut self, job: u8) {
        self.job = Some(job);
    }

    /// The readings that follow are kept for nobody.
    pub const fn pause(&mut self) {
        self.job = None;
    }

    /// The job has ended: what it has read is read anew the next time.
    pub fn end(&mut self, job: u8) {
        self.job = None;
        self.readings.retain(|reading| reading.job != job);
        self.named.take_if(|(of, ..)| *of == job);
    }

    /// The drive may be another, or was switched off and on: nothing that was read counts.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// What the job that goes on has read at these registers, and when it was asked for.
    pub(crate) fn of(&self, now: Instant, first: u16, count: u16) -> Option<(Vec<u16>, Instant)> {
        let job = self.job?;
        let is_it = |reading: &&Reading| {
            (reading.job, reading.first, reading.words.len()) == (job, first, usize::from(count))
                && now.saturating_duration_since(reading.at) <= KEPT_FOR
        };
        self.readings.iter().find(is_it).map(|reading| (reading.words.clone(), reading.at))
    }

    /// What the drive has said of itself to the job that goes on, or the exception by which it refused, and when it was asked.
    pub(crate) fn named(&self, now: Instant) -> Option<(Result<Identity, u8>, Instant)> {
        let (job, told, at) = self.named.as_ref()?;
        let is_it = self.job == Some(*job) && now.saturating_duration_since(*at) <= KEPT_FOR;
        is_it.then(|| (told.clone(), *at))
    }

    /// The drive has told the job what it is, or refused it: a gateway that does not pass the function on takes its time for that.
    pub(crate) fn keep_named(&mut self, told: &Result<Identity, u8>, at: Instant) {
        self.named = self.job.map(|job| (job, told.clone(), at));
    }

    /// The job has read this.
    pub(crate) fn keep(&mut self, first: u16, words: &[u16], at: Instant) {
        let Some(job) = self.job else { return };
        self.readings
            .retain(|reading| (reading.job, reading.first, reading.words.len()) != (job, first, words.len()));
        if self.readings.len() < MOST {
            self.readings.push(Reading { job, first, words: words.to_vec(), at });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_job_that_was_cut_goes_on_with_what_it_has_and_one_that_ended_begins_anew() {
        let (mut kept, now) = (KeptReadings::default(), Instant::now());
        // The answers come later: what counts is when they were asked for.
        tokio::time::advance(Duration::from_secs(5)).await;
        kept.keep(1, &[7], now);
        assert_eq!(kept.of(now, 1, 1), None, "of no job nothing is kept");
        kept.begin(1);
        kept.keep(1, &[7, 8], now);
        kept.pause();
        assert_eq!(kept.of(now, 1, 2), None);
        kept.begin(2);
        assert_eq!(kept.of(now, 1, 2), None, "it is another job's");
        kept.begin(1);
        assert_eq!(kept.of(now, 1, 2), Some((vec![7, 8], now)));
        assert_eq!(kept.of(now, 1, 1), None, "it is another question");
        let later = now + KEPT_FOR + Duration::from_millis(1);
        assert_eq!(kept.of(later, 1, 2), None, "it is too old");
        kept.end(1);
        kept.begin(1);
        assert_eq!(kept.of(now, 1, 2), None);
        for register in 0..200 {
            kept.keep(register, &[1], now);
        }
        assert_eq!(kept.readings.len(), MOST);
        kept.forget();
        kept.begin(1);
        assert_eq!(kept.of(now, 0, 1), None, "the drive may be another");
    }
}
