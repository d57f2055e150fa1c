//! Who asks for something: a caller that waits for its outcome, or a policy of the settings.

use std::sync::Arc;

use crate::cause::{Act, Cause, Policy};

/// Names a caller that waits for an outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct CallId(pub(crate) u64);

/// Who asked for something.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Asker {
    /// Somebody who waits for the outcome.
    Caller { id: CallId, act: Arc<Act> },
    /// A policy of the settings.
    Policy(Policy),
}

impl Asker {
    /// The caller that waits.
    pub(super) const fn id(&self) -> Option<CallId> {
        match self {
            Self::Caller { id, .. } => Some(*id),
            Self::Policy(_) => None,
        }
    }

    /// The name of the commander; `None` for a policy.
    pub(super) fn commander(&self) -> Option<&str> {
        match self {
            Self::Caller { act, .. } => Some(&act.commander),
            Self::Policy(_) => None,
        }
    }

    pub(super) fn name(&self) -> Arc<str> {
        match self {
            Self::Caller { act, .. } => Arc::clone(&act.commander),
            Self::Policy(policy) => Arc::from(policy.to_string()),
        }
    }

    pub(super) fn cause(&self) -> Cause {
        match self {
            Self::Caller { act, .. } => Cause::Command(Act::clone(act)),
            Self::Policy(policy) => Cause::policy(*policy),
        }
    }

    /// Whether the drive ends, with the fleet or without it.
    pub(super) const fn is_exit(&self) -> bool {
        matches!(self, Self::Policy(Policy::Exit | Policy::Removal))
    }
}
