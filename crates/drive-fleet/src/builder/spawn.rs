//! The task of a drive is started, with all that leads to it.

use std::{
    collections::BTreeMap,
    sync::{Arc, RwLock},
};

use drive_core::StopMode;
use tokio::{
    sync::{mpsc, watch},
    time::Instant,
};

use super::Member;
use crate::{
    event::Teller,
    handle::Entry,
    line_entry::LineEntry,
    place::Place,
    row::Row,
    runs::Keeper,
    supervisor::Supervisor,
    task::{Desk, Task},
};

/// How many orders of one drive may be on their way to its task.
const MAILBOX: usize = 32;

pub(super) fn spawn(member: Member, events: &Teller, line: Arc<LineEntry>) -> Arc<Entry> {
    let Member { settings, drive, .. } = member;
    let (slave, capabilities) = (drive.slave(), drive.capabilities());
    let broadcasts = StopMode::ALL
        .into_iter()
        .filter_map(|mode| drive.broadcast_stop(mode).map(|write| (mode, write)))
        .collect();
    let now = Instant::now();
    let (watchdog, communication_fault) = (drive.watchdog_capability(), capabilities.communication_fault);
    let supervisor = Supervisor::new(now, settings.clone(), watchdog, communication_fault);
    let name = supervisor.name();
    let (messages, message_box) = mpsc::channel(MAILBOX);
    // Unbounded, because a stop must never be refused for want of room: each entry is a caller that waits.
    let (urgent, urgent_box) = mpsc::unbounded_channel();
    let (snapshots, snapshot) = watch::channel(Arc::new(supervisor.snapshot(now)));
    let (exit, exited) = watch::channel(None);
    let place = Place::of(&line.name, &line.line.config().endpoint, capabilities.key, slave);
    let keeper =
        Keeper::new(Arc::clone(&name), place.clone(), events.runs.clone(), settings.run_before.clone());
    let answers = line.line.slave(slave.number());
    let settings = Arc::new(settings);
    let desk = Desk {
        supervisor,
        place: place.clone(),
        events: events.clone(),
        snapshots,
        exit,
        callers: BTreeMap::new(),
        askers: BTreeMap::new(),
        settings: Some(Arc::clone(&settings)),
        round: None,
    };
    let [turns, starts] = [&line.turns, &line.starts].map(Row::of);
    tokio::spawn(
        Task { drive, desk, messages: message_box, urgent: urgent_box, turns, starts, keeper, answers }.run(),
    );
    Arc::new(Entry {
        name,
        place,
        line,
        slave,
        capabilities,
        watchdog,
        settings: Arc::new(RwLock::new(settings)),
        broadcasts,
        messages,
        urgent,
        calls: Arc::default(),
        snapshots: snapshot.into(),
        exit: exited,
        removed: Arc::default(),
    })
}
