//! A port that is being scanned: no reload opens a line there meanwhile, for two who ask on one line destroy each other's questions.

use std::sync::PoisonError;

use drive_bus::Endpoint;
use drived_file::{Config, is_one_wire};
use drived_words::failure::Failure;

use super::{Reloader, blocking, changes::changes};

/// A port that is a scan's until this is dropped.
pub(in crate::run) struct Claim(Reloader);

impl Drop for Claim {
    fn drop(&mut self) {
        *self.0.0.scanned.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

impl Reloader {
    /// No line is opened there until the claim is dropped. Whoever claims looks at the lines that are there behind it: a reload under way
    /// sees the claim, or is seen. One scan at a time: a second claim would end the first.
    pub(in crate::run) fn claim(&self, endpoint: Endpoint) -> Claim {
        *self.0.scanned.lock().unwrap_or_else(PoisonError::into_inner) = Some(endpoint);
        Claim(self.clone())
    }

    /// Two who ask on one line destroy each other's questions: a line whose port is being scanned is not opened.
    pub(super) async fn leaves_the_scan(&self, config: &Config, new: &Config) -> Result<(), Failure> {
        let scanned = self.0.scanned.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let Some(scanned) = scanned else { return Ok(()) };
        let changes = changes(config, new);
        let opened = new.lines.iter().filter(|part| changes.iter().any(|change| change.opens(&part.name)));
        let opened: Vec<_> = opened.map(|part| (part.name.clone(), part.config.endpoint.clone())).collect();
        // A name of a server may have to be looked up.
        let is_there = move || Ok(opened.into_iter().find(|(_, endpoint)| is_one_wire(endpoint, &scanned)));
        match blocking(is_there).await? {
            Some((line, _)) => Err(Failure::Input(format!(
                "the port of line {line:?} is being scanned: wait for it, or give the scan up"
            ))),
            None => Ok(()),
        }
    }
}
