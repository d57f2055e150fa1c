//! Doors for the SCADA that speaks Modbus TCP: it shares the lines by their schedules.
//!
//! A gateway answers each request once, under its transaction and unit. Reads go over the line behind what the daemon has to
//! do, within a [share](share::Share) of it. Nothing that a client does or leaves undone holds up a line or another client.

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

mod client;
mod clients;
pub mod config;
pub mod counters;
mod desk;
mod face;
mod framing;
mod kept;
mod pdu;
mod share;
#[cfg(test)]
mod tests;
pub mod virtual_unit;

use std::{sync::Arc, time::Duration};

use tokio::{
    net::{TcpListener, TcpStream},
    sync::watch,
    task::JoinHandle,
    time::{Instant, sleep},
};

pub use self::face::{All, FACE};
use self::{clients::Course, config::GatewayConfig, counters::Ended, desk::Desk};
use drived_doors::{
    TRIED_AGAIN,
    crowd::{Crowd, Limits},
    listen,
};
use drived_face::Surroundings;

/// The open gateways of a daemon.
struct Gateways {
    /// Becomes true when nobody is let in any more and every connection ends.
    end: watch::Sender<bool>,
    desks: Vec<Arc<Desk>>,
    /// One for each desk, which lets its clients in.
    doors: Vec<JoinHandle<()>>,
}

impl Gateways {
    /// Opens the gateways of a configuration. An address that is taken, or not there yet, is tried again and again.
    fn open(gateways: &[GatewayConfig], around: &Surroundings) -> Self {
        let (end, ended) = watch::channel(false);
        let Surroundings { plant, audit, names, .. } = around;
        let course = Course::default();
        let desk = |config: &GatewayConfig| {
            Desk::new(&course, config.clone(), plant.clone(), audit.clone(), names.clone())
        };
        let desks: Vec<_> = gateways.iter().map(desk).collect();
        // Before anybody is heard by one of them.
        plant.watched().set_doors(&gateways.iter().map(desk::watched).collect::<Vec<_>>());
        let open = |desk: Arc<Desk>| {
            let mut ended = ended.clone();
            if desk.config.virtual_unit.is_some() {
                tokio::spawn(desk.outcomes.clone().follow(plant.fleet().events()));
            }
            tokio::spawn(async move {
                let listener = tokio::select! {
                    listener = listen(desk.config.listen) => listener,
                    _ = ended.changed() => return,
                };
                tracing::info!("gateway {} is at {}", desk.config.name, desk.config.listen);
                accept_all(&listener, &desk, ended).await;
            })
        };
        let doors = desks.iter().cloned().map(open).collect();
        Self { end, desks, doors }
    }
}

/// Accepts clients until the end, and serves each on a task of its own. When the system has no room for one more, such as
/// no file descriptor, it is tried again a little later.
async fn accept_all(listener: &TcpListener, desk: &Arc<Desk>, mut ended: watch::Receiver<bool>) {
    let places = Crowd::new(Limits::of_gateway(desk.config.clients));
    let (name, mut failed) = (&desk.config.name, 0_u64);
    loop {
        let (stream, peer) = tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((stream, peer)) => (stream, peer.ip().to_canonical()),
                Err(error) => {
                    failed += 1;
                    if failed.is_power_of_two() {
                        tracing::warn!("gateway {name} cannot accept a connection, {failed} in all: {error}");
                    }
                    if drive_fleet::mutant!("gateway-ends-without-descriptors", false, true) {
                        return;
                    }
                    sleep(TRIED_AGAIN).await;
                    continue;
                }
            },
            _ = ended.changed() => return,
        };
        let allow = &desk.config.allow;
        let place = match allow.is_empty() || allow.iter().any(|network| network.has(peer)) {
            true => places.enter(Some(peer), Instant::now()).ok_or(Ended::Full),
            false => Err(Ended::NotAllowed),
        };
        let place = match place {
            Ok(place) => place,
            Err(why) => {
                let count = desk.counters.end(why);
                if count.is_power_of_two() {
                    let why = why.name();
                    tracing::warn!("gateway {name}: {peer} was turned away ({why}), {count} of these in all");
                }
                continue;
            }
        };
        hurry(&stream);
        let by = desk.clients.open(peer);
        let (desk, mut ended) = (Arc::clone(desk), ended.clone());
        tokio::spawn(async move {
            let _present = desk.counters.enter();
            tokio::select! {
                () = client::serve(stream, by, Arc::clone(&desk), &place) => {}
                // Somebody who speaks needs the place of one who does not.
                () = place.wanted() => drop(desk.counters.end(Ended::Idle)),
                _ = ended.changed() => {}
            }
        });
    }
}

/// An answer is written at once, and a far end that is gone is noticed. A connection that refuses is gone already.
fn hurry(stream: &TcpStream) {
    let _ = stream.set_nodelay(true);
    let alive = socket2::TcpKeepalive::new().with_time(Duration::from_secs(30));
    let _ = socket2::SockRef::from(stream).set_tcp_keepalive(&alive);
}
