//! Which drive it is: what it says, held against what is remembered and the family that it is set up as.

use std::{borrow::Cow, sync::Arc};

use drive_core::{Identity, Recognised, Result};
use tokio::time::Instant;

use super::{AGAIN, Checks};
use crate::{
    event::EventKind, outcome::Refused, shown_identity::ShownIdentity, snapshot::IdentityCheck,
    supervisor::Job,
};

impl Checks {
    pub(crate) const fn identity(&self) -> &IdentityCheck {
        &self.identity
    }

    /// What the drive said it was, last.
    pub(crate) fn remembered(&self) -> Option<Identity> {
        self.remembered.as_deref().cloned()
    }

    /// The question which drive it is, if it is due.
    pub(crate) fn identity_job(&self, now: Instant) -> Option<Job> {
        let due = self.identity == IdentityCheck::Unchecked && self.identity_at.is_some_and(|at| at <= now);
        due.then_some(Job::Identify)
    }

    /// What the drive says of itself, where it does.
    pub(crate) fn says(&self) -> Option<String> {
        match &self.identity {
            IdentityCheck::Same(identity) => Some(identity.to_string()),
            _ => None,
        }
    }

    /// It is known which drive it is: what was tried on it in vain is not tried again.
    fn known(&mut self) {
        let tried = self.in_vain_before.as_ref();
        self.in_vain |=
            tried.is_some_and(|tried| Some(tried.contract) == self.contract && tried.identity == self.says());
    }

    /// Why nothing is written to what answers, where it is not known to be the drive that is meant.
    pub(crate) fn stranger(&self) -> Option<Refused> {
        match &self.identity {
            IdentityCheck::Same(_) | IdentityCheck::CannotSay => None,
            IdentityCheck::Unchecked => Some(Refused::IdentityUnchecked),
            IdentityCheck::Changed { .. } => Some(Refused::IdentityChanged),
            IdentityCheck::OtherFamily { it_is, .. } => Some(Refused::OtherFamily(it_is.clone())),
        }
    }

    /// Whether what answers is known to be another drive than the one that is meant, or one of another family.
    pub(crate) const fn is_another(&self) -> bool {
        matches!(self.identity, IdentityCheck::Changed { .. } | IdentityCheck::OtherFamily { .. })
    }

    pub(crate) fn handle_identity(
        &mut self,
        now: Instant,
        result: Result<(Identity, Recognised)>,
    ) -> Option<EventKind> {
        let found = match result {
            Ok((identity, Recognised::NotMine { it_is })) => {
                // What was found was another drive's: nothing of it is put back here.
                (self.found, self.written, self.inherited) = (None, false, None);
                let found = Arc::new(identity);
                let it_is = Cow::Borrowed(it_is);
                self.identity =
                    IdentityCheck::OtherFamily { it_is: it_is.clone(), found: Arc::clone(&found) };
                return Some(EventKind::OtherFamily { it_is, found });
            }
            Ok((identity, _)) => Arc::new(identity),
            Err(error) if error.is_speechless() => {
                self.identity = IdentityCheck::CannotSay;
                self.known();
                return None;
            }
            Err(_) => {
                self.identity_at = Some(now + AGAIN);
                return None;
            }
        };
        match &self.remembered {
            Some(remembered) if *remembered != found => {
                let remembered = Arc::clone(remembered);
                (self.found, self.written, self.inherited) = (None, false, None);
                (self.in_vain, self.refusals) = (false, 0);
                self.identity =
                    IdentityCheck::Changed { remembered: Arc::clone(&remembered), found: Arc::clone(&found) };
                Some(EventKind::IdentityChanged { remembered, found })
            }
            _ => {
                self.remembered = Some(Arc::clone(&found));
                self.identity = IdentityCheck::Same(Arc::clone(&found));
                self.known();
                Some(EventKind::Identified(found))
            }
        }
    }

    /// Why the drive that somebody was shown is not accepted; `None`: it is the one that answers.
    pub(crate) fn refuses_to_accept(&self, shown: ShownIdentity) -> Option<Refused> {
        match &self.identity {
            IdentityCheck::Changed { found, .. } | IdentityCheck::Same(found) => {
                (!shown.is(found)).then(|| Refused::NotTheShown(Some(Arc::clone(found))))
            }
            IdentityCheck::CannotSay => Some(Refused::NotTheShown(None)),
            IdentityCheck::Unchecked | IdentityCheck::OtherFamily { .. } => self.stranger(),
        }
    }

    /// Takes what the drive says it is for right.
    pub(crate) fn accept_identity(&mut self) {
        if let IdentityCheck::Changed { found, .. } = &self.identity {
            let found = Arc::clone(found);
            self.remembered = Some(Arc::clone(&found));
            self.identity = IdentityCheck::Same(found);
        }
    }
}
