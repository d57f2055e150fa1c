//! A group is stopped: by a broadcast first where a whole line is meant and takes one, and each drive by itself.

use std::{
    borrow::Cow,
    collections::HashMap,
    sync::Arc,
    task::{Context, Waker},
};

use drive_core::{BroadcastWrite, Class, StopMode, Terms};
use tokio::sync::watch;
use tokio_modbus::{Request, client::Client};

use super::Group;
use crate::{
    group_ticket::GroupStop,
    handle::{DriveHandle, Entry},
    line_entry::LineEntry,
    members::Members,
    round::Round,
    snapshot::Link,
    stop_order::{StopOrder, strength},
};

/// Mute drives that a stop of a line allows for at least.
const MUTE: u32 = 3;

impl Group {
    /// Stops every drive of the group. All of it is on its way when this returns, and goes on whoever drops the ticket.
    ///
    /// On a line whose drives all belong to the group, may all be commanded and all take the same write for this mode,
    /// one broadcast goes out first. Nobody confirms it, so each drive is then stopped by itself, which also verifies it.
    /// It is finished when every drive stands or its time is over; a drive that does not answer is named after the time
    /// that its line's plan gives. Stops that are not confirmed go on being repeated, by each drive's own task.
    ///
    /// No broadcast comes over the stop of a drive that is harder, nor once every drive of the line is being stopped so.
    pub fn stop(&self, order: impl Into<StopOrder>) -> GroupStop {
        self.in_one_act().stop_each(order.into(), true)
    }

    /// Stops those of these drives that may be commanded, by a broadcast first where there can be one and it is wanted. Line by line, and nothing is made here
    /// but what a stop needs: among ten thousand drives the last is stopped no later than it has to be.
    pub(super) fn stop_each(&self, order: StopOrder, by_broadcast: bool) -> GroupStop {
        let standing = self.fleet.members();
        let mut lines = Vec::<OfLine<'_>>::new();
        let mut by_line = HashMap::new();
        let mut read_only = Vec::new();
        let mut count = 0;
        for member in &self.members {
            if !member.entry.settings().control {
                read_only.push(Arc::clone(member.name()));
                continue;
            }
            let line = &member.entry.line;
            let number = *by_line.entry(Arc::as_ptr(line)).or_insert_with(|| {
                lines.push(OfLine { line, members: Vec::new() });
                lines.len() - 1
            });
            if let Some(of_line) = lines.get_mut(number) {
                of_line.members.push((count, member));
                count += 1;
            }
        }
        let (mut broadcasts, round) = (Vec::new(), Round::begin());
        let mut each = Vec::with_capacity(count);
        for of_line in &mut lines {
            // It is first on the line, and no start of before can come behind the stops of each.
            let line = of_line.line;
            if let Some(write) = of_line.common_write(&standing, order.mode).filter(|_| by_broadcast) {
                broadcasts.push((Arc::clone(&line.name), self.broadcast(line, write)));
            }
            // Those that are seen to turn, then those of which nobody knows: whoever stands needs no word before they have theirs.
            of_line.members.sort_by_cached_key(|(_, member)| Urgency::of(member));
            let members = &of_line.members;
            let is_silent = |(_, member): &&(usize, &DriveHandle)| Urgency::of(member) == Urgency::Unseen;
            let silent = members.iter().filter(is_silent).count();
            let silent = u32::try_from(silent).unwrap_or(u32::MAX);
            let patience = line.plan().stop_all(MUTE.max(silent)) + line.line.worst_case_stop();
            for (number, member) in members {
                let stop = member.stop_within(order, Some(patience), Some(round.part()));
                each.push((*number, Arc::clone(member.name()), stop));
            }
        }
        drop(round);
        // As the group has them.
        each.sort_unstable_by_key(|(number, ..)| *number);
        let each = each.into_iter().map(|(_, name, stop)| (name, stop)).collect();
        GroupStop::new(each, read_only, broadcasts)
    }

    /// Sends a broadcast, which has its place on the line when this returns; whether it went out is told when it is known.
    fn broadcast(&self, line: &Arc<LineEntry>, write: BroadcastWrite) -> watch::Receiver<Option<bool>> {
        let (told, sent) = watch::channel(None);
        let line = Arc::clone(line);
        let mut sending = Box::pin(async move {
            told.send_replace(Some(send(&line, write).await));
        });
        // A call is submitted by its first poll. Whoever is woken polls it again, so that nothing is lost by a waker that
        // wakes nobody.
        let mut context = Context::from_waker(Waker::noop());
        if sending.as_mut().poll(&mut context).is_pending() {
            self.fleet.inner.runtime.spawn(sending);
        }
        sent
    }
}

/// In which order the drives of a line are stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Urgency {
    Turns,
    Unseen,
    Stands,
}

impl Urgency {
    fn of(member: &DriveHandle) -> Self {
        let snapshot = member.entry.snapshots.now();
        match &snapshot.status {
            Some(status) if snapshot.link == Link::Connected && status.value.is_undriven() => Self::Stands,
            Some(_) if snapshot.link == Link::Connected => Self::Turns,
            _ => Self::Unseen,
        }
    }
}

/// Those of a group that are on one line and may be commanded, each with its place among all that may.
struct OfLine<'a> {
    line: &'a Arc<LineEntry>,
    members: Vec<(usize, &'a DriveHandle)>,
}

impl OfLine<'_> {
    /// The write that stops every drive of the line, if it means a stop to all of them and all are meant.
    fn common_write(&self, standing: &Members, mode: StopMode) -> Option<BroadcastWrite> {
        let on_line = || standing.on_line(&self.line.name);
        let is_meant =
            |entry: &Arc<Entry>| self.members.iter().any(|(_, member)| Arc::ptr_eq(&member.entry, entry));
        let write = |entry: &Arc<Entry>| {
            let write = entry.broadcasts.iter().find(|(stop, _)| *stop == mode).map(|(_, write)| *write);
            write.filter(|_| entry.settings().control && is_meant(entry))
        };
        let first = write(on_line().next()?)?;
        let is_common = on_line().all(|entry| write(entry) == Some(first));
        let under_way = |entry: &Arc<Entry>| entry.snapshots.now().stop.map(|stop| strength(stop.mode));
        let (all, any) = on_line().map(under_way).fold((true, false), |(all, any), stop| {
            (all && stop >= Some(strength(mode)), any || stop > Some(strength(mode)))
        });
        (is_common && !all && !any).then_some(first)
    }
}

/// Sends a broadcast; whether it went out.
async fn send(line: &LineEntry, write: BroadcastWrite) -> bool {
    let request = match write.function {
        0x10 => Request::WriteMultipleRegisters(write.register, Cow::Owned(vec![write.value])),
        _ => Request::WriteSingleRegister(write.register, write.value),
    };
    let mut all = line.line.broadcast().with_terms(Terms::of(Class::Stop));
    all.call(request).await.is_ok_and(|answer| answer.is_ok())
}
