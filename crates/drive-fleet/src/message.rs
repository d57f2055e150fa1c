//! What the task of a drive is told.

use std::{sync::Arc, time::Duration};

use drive_core::{Direction, Setpoint};
use tokio::sync::{oneshot, watch};

use crate::{
    cause::{Act, Policy},
    outcome::{Order, Refused},
    progress::Report,
    round::Round,
    settings::DriveSettings,
    snapshot::Snapshot,
    stop_order::StopOrder,
    supervisor::{CallId, Expiry, Leave, Question, Told},
};

/// What waits its turn.
#[derive(Debug)]
pub(crate) enum Message {
    /// An order.
    Order {
        id: CallId,
        order: Order,
        leave: Option<Leave>,
        /// When it may not be sent any more; `None`: as the settings say.
        expires: Option<Expiry>,
        act: Arc<Act>,
        reply: Report,
    },
    /// A question.
    Question { id: CallId, question: Question, name: Arc<str>, reply: oneshot::Sender<Result<Told, Refused>> },
    /// The question whether a start would be sent now.
    Ask {
        name: Arc<str>,
        direction: Direction,
        setpoint: Option<Setpoint>,
        reply: oneshot::Sender<Result<Leave, Refused>>,
    },
}

/// What waits for nothing.
#[derive(Debug)]
pub(crate) enum Urgent {
    /// A stop.
    Stop {
        id: CallId,
        order: StopOrder,
        act: Arc<Act>,
        /// Until its lack of confirmation is an alarm; `None`: as the settings say.
        patience: Option<Duration>,
        /// Where it is one of several drives that are stopped.
        round: Option<Round>,
        reply: Report,
    },
    /// The ticket of an order was dropped before its outcome was heard.
    Withdraw(CallId),
    /// Other settings.
    Settings(Arc<DriveSettings>),
    /// It is called otherwise: its settings with the name, and where its snapshots are told from now on. Whoever watches it by the old
    /// name sees the end of it.
    Renamed(Arc<DriveSettings>, watch::Sender<Arc<Snapshot>>),
    /// The fleet shuts down, or the drive leaves it: by which policy it ends.
    Exit(Policy, Round),
    /// All that end together have ended: the drive goes on no longer than a stop of it is under way.
    Leave,
    /// The time for shutting down is over.
    ExitTimeOver,
}
