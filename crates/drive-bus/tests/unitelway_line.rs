//! A line that speaks UNI-TELWAY: what its callers get, and how long a stop waits. `unitelway.rs` has the exchange machine
//! below it.

#![cfg(feature = "unitelway")]

mod support;

use std::time::Duration;

use bytes::Bytes;
use drive_bus::{
    Line, LineConfig, Protocol,
    protocol::UniTelwaySettings,
    unite::{SpecificCommand, SpecificReport, UniTeError},
};
use drive_core::{Class, Port, PortError, Terms};
use drive_unitelway::{data_frame, poll};
use support::{
    MS, calls,
    unitelway::{ACK, EOT, NAK, READ, WRITE, WRITTEN, serial},
};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};

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

    /// Mirrors the number that it is asked to; the request that follows.
    async fn mirrors(&mut self) -> Vec<u8> {
        let mark = self.hears().await;
        assert_eq!(mark[10..12], [0xFA, 7], "{mark:02X?}");
        self.says(ACK).await;
        assert_eq!(self.hears().await, *poll(1));
        self.says(&reply(&[&[0xFB], &mark[12..16]].concat())).await;
        assert_eq!(self.hears().await, ACK);
        self.hears().await
    }

    /// Mirrors a number and acknowledges the request that follows.
    async fn takes_request(&mut self) -> Vec<u8> {
        let request = self.mirrors().await;
        self.says(ACK).await;
        request
    }

    async fn gives_reply(&mut self, unite: &[u8]) {
        assert_eq!(self.hears().await, *poll(1));
        self.says(&reply(unite)).await;
        assert_eq!(self.hears().await, ACK);
        assert_eq!(self.hears().await, *poll(1));
        self.says(EOT).await;
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
    let terms = Terms::of(Class::Command).within(Duration::from_secs(9));
    let call = calls(line.slave(1).with_terms(terms.edge()), WRITE);
    peer.mirrors().await;
    let lost = PortError::from_modbus(call.await.unwrap().unwrap_err());
    assert_eq!(lost, PortError::OutcomeUnknown("no answer"));

    // A level is sent again, after the late window and once the slave holds nothing any more.
    let call = calls(line.slave(1).with_terms(terms), WRITE);
    let first = peer.mirrors().await;
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
    assert_eq!(line.stats().slaves[&1].link, Some(counters));
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
    let read = calls(line.slave(1), READ);
    let request = peer.mirrors().await;
    let called = tokio::time::Instant::now();
    let stopped = calls(line.slave(2).with_terms(Terms::of(Class::Stop)), WRITE);
    // Slow words, and our acknowledgement of the reply is not heard.
    tokio::time::sleep(90 * MS).await;
    peer.says(ACK).await;
    for _ in 0..2 {
        assert_eq!(peer.hears().await, *poll(1));
        tokio::time::sleep(90 * MS).await;
        peer.says(&reply(&[0x34, 1, 2])).await;
        assert_eq!(peer.hears().await, ACK);
    }
    let sent = peer.hears().await;
    assert_eq!(sent[..3], [0x10, 0x02, 2], "the stop itself, behind {request:02X?}");
    assert!(called.elapsed() <= bound, "{:?} of {bound:?}", called.elapsed());
    stopped.abort();
    // The read has its answer all the same.
    assert_eq!(peer.hears().await, *poll(1));
    peer.says(EOT).await;
    assert!(read.await.unwrap().is_ok());
}

#[tokio::test(start_paused = true)]
async fn while_one_slave_is_not_ready_the_others_are_served() {
    let (line, mut peer) = line(|config| config);
    let waiting = calls(line.slave(1), READ);
    peer.takes_request().await;
    let read = calls(line.slave(2), READ);
    assert_eq!(peer.hears().await, *poll(1));
    peer.says(EOT).await;
    assert_eq!(peer.hears().await[..3], [0x10, 0x02, 2], "the other one's turn");
    assert_eq!(peer.hears().await, *poll(1), "the other one is dead, and this one is asked again");
    peer.says(EOT).await;
    peer.gives_reply(&[0x34, 6, 0]).await;
    assert!(waiting.await.unwrap().is_ok());
    read.abort();
}

#[tokio::test(start_paused = true)]
async fn a_stop_goes_at_once_to_a_slave_that_owes_a_reply_and_is_sent_again_behind_a_number() {
    let (line, mut peer) = line(|config| config);
    let read = calls(line.slave(1), READ);
    peer.takes_request().await;
    assert_eq!(peer.hears().await, *poll(1));
    let stop = calls(line.slave(1).with_terms(Terms::of(Class::Stop)), WRITE);
    tokio::time::sleep(MS).await;
    peer.says(EOT).await;
    let written = peer.hears().await;
    assert_eq!(written, *reply(&[0x14, 7, 0x90, 1, 6, 0]));
    peer.says(ACK).await;
    // What comes first is the answer to the read.
    assert_eq!(peer.hears().await, *poll(1));
    peer.says(&reply(&[0x34, 1, 2])).await;
    assert_eq!(peer.hears().await, ACK);
    peer.gives_reply(&[0xFE]).await;
    assert_eq!(peer.takes_request().await, written);
    peer.gives_reply(&[0xFE]).await;
    assert_eq!(stop.await.unwrap().unwrap(), Ok(WRITTEN));
    read.abort();
}

#[tokio::test(start_paused = true)]
async fn a_slave_that_does_nothing_but_refuse_is_busy_and_then_off_line() {
    let (line, mut peer) = line(|config| config);
    let read = calls(line.slave(1), READ);
    let mut frames = 0;
    while !read.is_finished() {
        let heard = tokio::time::timeout(200 * MS, peer.hears()).await;
        match heard {
            Ok(heard) if heard[1] == 0x02 => {
                frames += 1;
                peer.says(NAK).await;
            }
            Ok(_) => peer.says(EOT).await,
            Err(_) => {}
        }
    }
    let refused = PortError::from_modbus(read.await.unwrap().unwrap_err());
    assert!(matches!(refused, PortError::Busy(_)), "{refused}");
    assert!((15..100).contains(&frames), "{frames} frames in three seconds");
    let stats = &line.stats().slaves[&1];
    assert_eq!((stats.outcomes.busy, stats.outcomes.damaged, stats.offline), (3, 0, true));
}
