//! A line that speaks UNI-TELWAY: what its callers get, and how long a stop waits. `unitelway.rs` has the exchange machine
//! below it.

mod support;

use std::time::Duration;

use bytes::Bytes;
use drive_bus::{
    Line, LineConfig, Protocol,
    exchange::unitelway::{data_frame, poll},
    protocol::UniTelwaySettings,
    unite::{SpecificCommand, SpecificReport, UniTeError},
};
use drive_core::{Class, Port, PortError, Terms};
use support::{
    MS,
    unitelway::{ACK, EOT, NAK, READ, WRITE, WRITTEN, serial},
};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio_modbus::client::Client;

/// A reply of slave 1 with the standard header.
fn reply(unite: &[u8]) -> Bytes {
    data_frame(1, &[&[0x20, 0, 0xFE, 0, 0, 0], unite].concat())
}

/// The far end of a line: slave 1, scripted.
struct Peer(DuplexStream);

impl Peer {
    async fn hears(&mut self) -> Vec<u8> {
        let mut bytes = vec![0; 64];
        let len = self.0.read(&mut bytes).await.unwrap();
        bytes.truncate(len);
        bytes
    }

    async fn says(&mut self, bytes: &[u8]) {
        tokio::time::sleep(5 * MS).await;
        self.0.write_all(bytes).await.unwrap();
    }

    /// Takes the first poll, and acknowledges the request that follows it.
    async fn takes_request(&mut self) -> Vec<u8> {
        assert_eq!(self.hears().await, *poll(1));
        self.says(EOT).await;
        let request = self.hears().await;
        self.says(ACK).await;
        request
    }

    async fn gives_reply(&mut self, unite: &[u8]) {
        assert_eq!(self.hears().await, *poll(1));
        self.says(&reply(unite)).await;
        assert_eq!(self.hears().await, ACK);
    }
}

fn line(change: impl FnOnce(LineConfig) -> LineConfig) -> (Line, Peer) {
    let (ours, theirs) = tokio::io::duplex(1_024);
    let protocol = Protocol::UniTelway(UniTelwaySettings::default());
    let config = LineConfig { protocol, ..LineConfig::stream(serial()) };
    (Line::over(ours, change(config)), Peer(theirs))
}

#[tokio::test(start_paused = true)]
async fn an_edge_whose_acknowledgement_is_lost_has_an_unknown_outcome_and_is_sent_once() {
    let (line, mut peer) = line(|config| config);
    let slave = line.slave(1);
    let mut edge = slave.clone().with_terms(Terms::of(Class::Command).within(Duration::from_secs(9)).edge());
    let call = tokio::spawn(async move { edge.call(WRITE).await });
    assert_eq!(peer.hears().await, *poll(1));
    peer.says(EOT).await;
    peer.hears().await;
    let lost = PortError::from_modbus(call.await.unwrap().unwrap_err());
    assert_eq!(lost, PortError::OutcomeUnknown("no answer"));

    // A level is sent again, after the late window and once the slave holds nothing any more.
    let mut level = slave.with_terms(Terms::of(Class::Command).within(Duration::from_secs(9)));
    let call = tokio::spawn(async move { level.call(WRITE).await });
    assert_eq!(peer.hears().await, *poll(1));
    peer.says(EOT).await;
    let first = peer.hears().await;
    assert_eq!(peer.takes_request().await, first);
    peer.gives_reply(&[0xFE]).await;
    assert_eq!(call.await.unwrap().unwrap(), Ok(WRITTEN));
    assert_eq!(line.stats().slaves[&1].retries, 1);
}

#[tokio::test(start_paused = true)]
async fn the_specific_request_travels_as_a_command_and_brings_what_it_reads_back() {
    let (line, mut peer) = line(|config| config);
    let mut slave = line.slave(1);
    slave.set_terms(Terms::of(Class::Status));
    let command = SpecificCommand { cmd: 0x0F, frh: 500, acc: 30, dec: 40 };
    let mut unite = slave.unite();
    let call = tokio::spawn(async move { unite.command(command).await });
    let expected = reply(&[0xF2, 7, 0, 0, 0x0F, 0, 0xF4, 1, 30, 0, 40, 0]);
    assert_eq!(peer.takes_request().await, *expected);
    peer.gives_reply(&[0xF2, 0x30, 0, 0xF4, 1, 0x27, 2, 0, 0, 23, 0]).await;
    let report = SpecificReport { frh: 500, eta: 0x0227, flt: 0, lcr: 23 };
    assert_eq!(call.await.unwrap(), Ok(report));
    let stats = line.stats();
    assert_eq!((stats.class(Class::Command).sent, stats.class(Class::Status).sent), (1, 0));
}

#[tokio::test(start_paused = true)]
async fn a_slave_says_who_it_is_and_what_its_link_has_counted() {
    let (line, mut peer) = line(|config| config);
    let mut unite = line.slave(1).unite();
    let mut same = unite.clone();
    let call = tokio::spawn(async move { same.identify().await });
    assert_eq!(peer.takes_request().await, *reply(&[0x0F, 7]));
    peer.gives_reply(b"\x3F\x18\x58\x21\x0AATV58U18N4").await;
    let identity = call.await.unwrap().unwrap();
    assert_eq!((identity.product, identity.subtype, identity.version), (0x18, 0x58, 0x21));
    assert_eq!(identity.rating, "ATV58U18N4");

    let call = tokio::spawn(async move { unite.link_counters().await });
    assert_eq!(peer.hears().await, *reply(&[0xA2, 7]));
    peer.says(ACK).await;
    peer.gives_reply(&[0xD2, 1, 0, 2, 0, 3, 0, 0xFF, 0x7F]).await;
    let counters = call.await.unwrap().unwrap();
    assert_eq!((counters.sent_not_acknowledged, counters.received_refused), (1, 0x7FFF));
}

#[tokio::test(start_paused = true)]
async fn an_identification_that_is_cut_short_is_no_identification() {
    let (line, mut peer) = line(|config| config);
    let mut unite = line.slave(1).unite();
    let call = tokio::spawn(async move { unite.identify().await });
    peer.takes_request().await;
    peer.gives_reply(b"\x3F\x18\x58\x21\x0AATV58").await;
    assert!(matches!(call.await.unwrap(), Err(UniTeError::Port(PortError::Mismatch(_)))));
}

#[tokio::test(start_paused = true)]
async fn a_line_that_speaks_modbus_sends_no_unite_request() {
    let (ours, _theirs) = tokio::io::duplex(64);
    let line = Line::over(ours, LineConfig::stream(serial()));
    let refused = line.slave(1).unite().identify().await.unwrap_err();
    assert!(matches!(refused, UniTeError::Port(PortError::NotCarried(_))), "{refused}");
    assert_eq!(line.stats().slaves.get(&1).map_or(0, |slave| slave.sent), 0);
}

#[tokio::test(start_paused = true)]
async fn a_stop_waits_no_longer_than_the_line_says_behind_an_exchange_where_everything_goes_wrong() {
    let (line, mut peer) = line(|config| LineConfig { retries: 0, ..config });
    let bound = line.worst_case_stop();
    let (mut slave, mut stop) = (line.slave(1), line.slave(2).with_terms(Terms::of(Class::Stop)));
    let read = tokio::spawn(async move { slave.call(READ).await });
    assert_eq!(peer.hears().await, *poll(1));
    let called = tokio::time::Instant::now();
    let stopped = tokio::spawn(async move { stop.call(WRITE).await });
    // Two leftovers, a refused request, a damaged reply, and nothing at the end.
    for word in [1, 2] {
        peer.says(&reply(&[0x34, word, 0])).await;
        assert_eq!(peer.hears().await, ACK);
        peer.hears().await;
    }
    peer.says(NAK).await;
    peer.hears().await;
    tokio::time::sleep(90 * MS).await;
    peer.says(ACK).await;
    assert_eq!(peer.hears().await, *poll(1));
    tokio::time::sleep(90 * MS).await;
    peer.says(&[0x10, 0x02, 1, 2, 0, 0, 0]).await;
    assert_eq!(peer.hears().await, NAK);
    assert_eq!(peer.hears().await, *poll(1));
    assert_eq!(peer.hears().await, *poll(2), "the stop's exchange begins");
    assert!(called.elapsed() <= bound, "{:?} of {bound:?}", called.elapsed());
    assert!(read.await.unwrap().is_err());
    stopped.abort();
}
