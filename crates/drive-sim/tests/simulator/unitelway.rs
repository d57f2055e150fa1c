//! UNI-TELWAY as the card of the Altivar 58 speaks it: the link, and the UNI-TE requests.

use std::time::Duration;

use drive_core::{SerialSettings, serial::CharacterFormat};
use drive_sim::{
    ALWAYS, Exception, Fault, HeaderForm, LinkHabits, Protocol, SimLine, SimSlave, Unacknowledged, Wiring,
    models::atv58::Atv58,
};
use tokio::io::{AsyncWriteExt, DuplexStream};

use crate::support::{ACC, CMD, KEEP, OUT, REF, Small, ask};

const PATIENCE: Duration = Duration::from_millis(500);
const ACK: u8 = 0x06;
const NAK: u8 = 0x15;
const EOT: u8 = 0x04;

struct Master {
    line: SimLine,
    port: DuplexStream,
}

impl Master {
    fn new(addresses: impl IntoIterator<Item = u8>) -> Self {
        let settings = SerialSettings::new(19_200, CharacterFormat::F8O1).unwrap();
        let line = SimLine::new(Wiring { protocol: Protocol::UniTelway, ..Wiring::rtu(settings) });
        for address in addresses {
            line.add(address, Small::new()).unwrap();
        }
        let port = line.in_memory();
        Self { line, port }
    }

    fn slave(&self, address: u8) -> SimSlave {
        self.line.slave(address).unwrap()
    }

    async fn send(&mut self, bytes: &[u8]) -> Vec<u8> {
        ask(&mut self.port, bytes, PATIENCE).await.unwrap_or_default()
    }

    async fn poll(&mut self, address: u8) -> Vec<u8> {
        self.send(&[0x10, 0x05, address]).await
    }

    /// A whole exchange with the simplified header: request, acknowledgement, poll, answer, acknowledgement.
    async fn exchange(&mut self, address: u8, request: &[u8]) -> Vec<u8> {
        assert_eq!(self.send(&frame(address, &[&[0], request].concat())).await, [ACK]);
        let answer = self.poll(address).await;
        self.port.write_all(&[ACK]).await.unwrap();
        let message = unframe(address, &answer);
        assert_eq!(message[0], 0, "the header comes back");
        message[1..].to_vec()
    }
}

fn sum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}

fn doubled(bytes: &[u8]) -> Vec<u8> {
    bytes.iter().flat_map(|byte| std::iter::repeat_n(*byte, if *byte == 0x10 { 2 } else { 1 })).collect()
}

fn frame(address: u8, data: &[u8]) -> Vec<u8> {
    let mut frame = vec![0x10, 0x02, address];
    frame.extend(doubled(&[u8::try_from(data.len()).unwrap()]));
    frame.extend(doubled(data));
    frame.push(sum(&frame));
    frame
}

/// The data of a frame whose form and BCC are right.
fn unframe(address: u8, frame_: &[u8]) -> Vec<u8> {
    let mut data = Vec::new();
    let mut rest = frame_[4..frame_.len() - 1].iter();
    if frame_[3] == 0x10 {
        assert_eq!(rest.next(), Some(&0x10));
    }
    while let Some(byte) = rest.next() {
        data.push(*byte);
        if *byte == 0x10 {
            assert_eq!(rest.next(), Some(&0x10));
        }
    }
    assert_eq!(frame(address, &data), frame_);
    data
}

#[tokio::test(start_paused = true)]
async fn frames_are_as_the_test_vectors_print_them() {
    let mut master = Master::new([1]);
    // Mirror of 10h 04h: the 10h is sent twice.
    let request = [0x10, 0x02, 0x01, 0x05, 0x00, 0xFA, 0x01, 0x10, 0x10, 0x04, 0x37];
    assert_eq!(master.send(&request).await, [ACK]);
    assert_eq!(master.poll(1).await, [0x10, 0x02, 0x01, 0x04, 0x00, 0xFB, 0x10, 0x10, 0x04, 0x36]);
    master.port.write_all(&[ACK]).await.unwrap();
    // Mirror of 05h.
    assert_eq!(master.send(&frame(1, &[0x00, 0xFA, 0x00, 0x05])).await, [ACK]);
    assert_eq!(master.poll(1).await, [0x10, 0x02, 0x01, 0x03, 0x00, 0xFB, 0x05, 0x16]);
    // Mirror of 00h with the network header.
    assert_eq!(master.send(&frame(1, &[0x20, 0, 0xFE, 0, 0, 0, 0xFA, 0, 0])).await, [ACK]);
    let answer = [0x10, 0x02, 0x01, 0x08, 0x20, 0x00, 0xFE, 0x00, 0x00, 0x00, 0xFB, 0x00, 0x34];
    assert_eq!(master.poll(1).await, answer);
    // Error counters, after they were reset.
    assert_eq!(master.send(&frame(1, &[0x20, 0, 0xFE, 0, 0, 0, 0xA4, 0])).await, [ACK]);
    assert_eq!(master.send(&frame(1, &[0x20, 0, 0xFE, 0, 0, 0, 0xA2, 0])).await, [ACK]);
    let mut counters = vec![0x10, 0x02, 0x01, 0x0F, 0x20, 0x00, 0xFE, 0x00, 0x00, 0x00, 0xD2];
    counters.extend([0x00; 8]);
    counters.push(0x12);
    assert_eq!(master.poll(1).await, counters);
}

#[tokio::test(start_paused = true)]
async fn only_who_is_polled_speaks_and_who_has_nothing_says_so() {
    let mut master = Master::new([1, 2, 3]);
    assert_eq!(master.send(&frame(2, &[0x00, 0xFA, 0x00, 0x2A])).await, [ACK]);
    assert_eq!(master.poll(1).await, [EOT]);
    assert_eq!(unframe(2, &master.poll(2).await), [0x00, 0xFB, 0x2A]);
    master.port.write_all(&[ACK]).await.unwrap();
    assert_eq!(master.poll(2).await, [EOT]);
    assert_eq!(master.poll(3).await, [EOT]);
    assert!(master.poll(4).await.is_empty(), "nobody there");
    master.slave(3).mute();
    assert!(master.poll(3).await.is_empty());
}

#[tokio::test(start_paused = true)]
async fn an_answer_that_is_refused_or_not_acknowledged_is_sent_at_the_next_poll() {
    let mut master = Master::new([1]);
    assert_eq!(master.send(&frame(1, &[0x00, 0xFA, 0x00, 0x2A])).await, [ACK]);
    let answer = master.poll(1).await;
    assert!(master.send(&[NAK]).await.is_empty());
    assert_eq!(master.poll(1).await, answer);
    assert_eq!(master.poll(1).await, answer, "nothing was said to it");
    master.port.write_all(&[ACK]).await.unwrap();
    assert_eq!(master.poll(1).await, [EOT]);
    let mut damaged = frame(1, &[0x00, 0xFA, 0x00, 0x2A]);
    *damaged.last_mut().unwrap() ^= 1;
    assert_eq!(master.send(&damaged).await, [NAK]);
    // Not acknowledged, refused by the master, and refused by the slave.
    assert_eq!(master.exchange(1, &[0xA2, 0]).await, [0xD2, 1, 0, 1, 0, 0, 0, 1, 0]);
}

#[tokio::test(start_paused = true)]
async fn words_and_objects_are_the_registers() {
    let mut master = Master::new([1]);
    let slave = master.slave(1);
    assert_eq!(master.exchange(1, &[0x14, 7, 4, 0, 0x34, 0x12]).await, [0xFE]);
    assert_eq!(slave.peek(KEEP.address()), Some(0x1234));
    assert_eq!(master.exchange(1, &[0x04, 7, 4, 0]).await, [0x34, 0x34, 0x12]);
    let written = master.exchange(1, &[0x37, 7, 0x68, 7, 1, 0, 2, 0, 1, 0, 0xE8, 3]).await;
    assert_eq!(written, [0xFE]);
    assert_eq!((slave.peek(CMD.address()), slave.peek(REF.address())), (Some(1), Some(1_000)));
    // Word 5 does not exist: read as 0.
    let read = master.exchange(1, &[0x36, 7, 0x68, 7, 4, 0, 2, 0]).await;
    assert_eq!(read, [0x66, 7, 0x34, 0x12, 0, 0]);
}

#[tokio::test(start_paused = true)]
async fn what_the_card_does_not_permit_is_refused() {
    let mut master = Master::new([1]);
    let refused: [&[u8]; 12] = [
        &[0x00, 7, 0, 0],
        &[0x0F, 8],
        &[0x0F],
        &[0x14, 7, 3, 0, 1, 0],
        &[0x14, 7, 9, 0, 1, 0],
        &[0x36, 7, 0x68, 7, 1, 0, 9, 0],
        &[0x36, 7, 0x68, 8, 1, 0, 1, 0],
        &[0x36, 7, 0x68, 7, 1, 0, 0, 0],
        &[0x37, 7, 0x68, 7, 1, 0, 2, 0, 1, 0],
        &[0x37, 7, 0x68, 7, 2, 0, 2, 0, 1, 0, 1, 0],
        &[0xF2, 0, 0, 0, 1, 0],
        &[0xF2, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0, 0],
    ];
    for request in refused {
        assert_eq!(master.exchange(1, request).await, [0xFD], "{request:02X?}");
    }
    master.slave(1).refuse_next(Exception::FAILURE);
    assert_eq!(master.exchange(1, &[0xFA, 0, 1]).await, [0xFD]);
    // Word 9 does not exist, but word 4 before it is written.
    assert_eq!(master.exchange(1, &[0x37, 7, 0x68, 7, 4, 0, 2, 0, 5, 0, 6, 0]).await, [0xFE]);
    assert_eq!(master.exchange(1, &[0x0F, 7]).await, b"\x3F\x18\x58\x21\x05Small");
}

#[tokio::test(start_paused = true)]
async fn the_specific_request_orders_and_reports_in_one_exchange() {
    let mut master = Master::new([1]);
    let answer = master.exchange(1, &[0xF2, 0, 0, 0, 1, 0, 0x88, 0x13, 30, 0, 40, 0]).await;
    assert_eq!(answer, [0xF2, 0x30, 0, 0x88, 0x13, 0, 0, 40, 0, 30, 0]);
    let slave = master.slave(1);
    slave.wait_until(|seen| seen.output_frequency == 5_000).await;
    assert_eq!((slave.peek(ACC.address()), slave.peek(KEEP.address())), (Some(30), Some(40)));
    let read = master.exchange(1, &[0x04, 0, OUT.address().to_le_bytes()[0], 0]).await;
    assert_eq!(read, [0x34, 0x88, 0x13]);
}

#[tokio::test(start_paused = true)]
async fn an_altivar_58_climbs_its_chart_and_says_who_it_is() {
    let mut master = Master::new([]);
    let slave = master.line.add(5, Atv58::new()).unwrap();
    assert_eq!(master.exchange(5, &[0x0F, 7]).await, b"\x3F\x18\x58\x21\x0AATV58U18N4");
    // Reference 500 (50.0 Hz), ACC and DEC 10 (1 s): shut down, switch on, enable operation.
    for (word, eta) in [(0x06, [0x21, 0x02]), (0x07, [0x23, 0x02]), (0x0F, [0x27, 0x02])] {
        let answer = master.exchange(5, &[0xF2, 0, 0, 0, word, 0, 0xF4, 1, 10, 0, 10, 0]).await;
        assert_eq!(answer[..7], [&[0xF2, 0x30, 0, 0xF4, 1][..], &eta].concat());
    }
    slave.wait_until(|seen| seen.output_frequency == 5_000).await;
    // The manual's example reads W250 to W253 (p. 12): nine bytes, the words one byte further on.
    let read = master.exchange(5, &[0x36, 7, 0x68, 7, 0xFA, 0, 4, 0]).await;
    assert_eq!(read, [0x66, 7, 0xF4, 1, 0, 0, 10, 0, 10, 0]);
    // The status word is the drive's own.
    assert_eq!(master.exchange(5, &[0x14, 7, 0xCA, 1, 0, 0]).await, [0xFD]);
}

#[tokio::test(start_paused = true)]
async fn a_held_answer_is_sent_at_a_poll_after_its_release() {
    let mut master = Master::new([1]);
    let slave = master.slave(1);
    slave.hold_next_answer();
    assert_eq!(master.send(&frame(1, &[0x00, 0xFA, 0x00, 0x2A])).await, [ACK]);
    assert_eq!(master.poll(1).await, [EOT]);
    slave.release();
    tokio::time::sleep(Duration::from_millis(1)).await;
    assert_eq!(unframe(1, &master.poll(1).await), [0x00, 0xFB, 0x2A]);
}

#[tokio::test(start_paused = true)]
async fn a_broken_frame_is_left_at_the_next_good_one() {
    let mut master = Master::new([1]);
    let good = frame(1, &[0x00, 0xFA, 0x00, 0x10]);
    for broken in
        [&[0x10, 0x02, 0x01][..], &[0x10, 0x02, 0x01, 0x05, 0x00], &[0x10, 0x07], &[0x10, 0x02, 1, 0x10, 9]]
    {
        master.port.write_all(broken).await.unwrap();
        tokio::time::sleep(Duration::from_millis(200)).await;
        assert_eq!(master.send(&good).await, [ACK], "after a pause, {broken:02X?}");
    }
    // Without a pause a lone DLE inside the data begins the next frame.
    let cut_short = [&[0x10, 0x02, 0x01, 0x09, 0x00][..], &good].concat();
    assert_eq!(master.send(&cut_short).await, [ACK]);
    assert_eq!(master.line.stats().bad_frames, 5);
}

#[tokio::test(start_paused = true)]
async fn an_acknowledgement_can_be_lost_too() {
    let mut master = Master::new([1]);
    master.line.set_fault(Fault::Lost, ALWAYS);
    assert!(master.send(&frame(1, &[0, 0x14, 7, 4, 0, 9, 0])).await.is_empty());
    master.line.set_fault(Fault::Lost, 0);
    assert_eq!(master.slave(1).peek(KEEP.address()), Some(9), "the write was carried out");
    assert_eq!(unframe(1, &master.poll(1).await), [0, 0xFE]);
}

/// A slave with these habits that has said the reply to mirror 1, which nobody acknowledged.
async fn unacknowledged(unacknowledged: Unacknowledged) -> Master {
    let mut master = Master::new([1]);
    master.slave(1).set_link_habits(LinkHabits { unacknowledged, ..LinkHabits::default() });
    assert_eq!(master.send(&frame(1, &[0, 0xFA, 0, 1])).await, [ACK]);
    assert_eq!(unframe(1, &master.poll(1).await), [0, 0xFB, 1]);
    master
}

#[tokio::test(start_paused = true)]
async fn what_becomes_of_a_reply_that_nobody_acknowledges_is_a_switch() {
    let mut repeats = unacknowledged(Unacknowledged::Repeats).await;
    assert_eq!(unframe(1, &repeats.poll(1).await), [0, 0xFB, 1]);
    assert_eq!(repeats.exchange(1, &[0xFA, 0, 2]).await, [0xFB, 2], "in its place");

    let mut forgets = unacknowledged(Unacknowledged::Forgets).await;
    assert_eq!(forgets.poll(1).await, [EOT]);

    let mut queues = unacknowledged(Unacknowledged::Queues).await;
    assert_eq!(queues.exchange(1, &[0xFA, 0, 2]).await, [0xFB, 1], "the earlier one first");
    assert_eq!(unframe(1, &queues.poll(1).await), [0, 0xFB, 2]);

    let mut refuses = unacknowledged(Unacknowledged::Refuses).await;
    assert_eq!(refuses.send(&frame(1, &[0, 0xFA, 0, 2])).await, [NAK]);
    refuses.poll(1).await;
    refuses.port.write_all(&[ACK]).await.unwrap();
    assert_eq!(refuses.exchange(1, &[0xFA, 0, 2]).await, [0xFB, 2]);
}

#[tokio::test(start_paused = true)]
async fn a_slave_that_works_longer_says_nothing_or_that_it_has_nothing_to_say() {
    for silent in [false, true] {
        let mut master = Master::new([1]);
        let works_for = Duration::from_secs(2);
        master.slave(1).set_link_habits(LinkHabits { silent, works_for, ..LinkHabits::default() });
        assert_eq!(master.send(&frame(1, &[0, 0xFA, 0, 1])).await, [ACK]);
        assert_eq!(master.poll(1).await, if silent { vec![] } else { vec![EOT] });
        tokio::time::sleep(works_for).await;
        assert_eq!(unframe(1, &master.poll(1).await), [0, 0xFB, 1]);
    }
}

#[tokio::test(start_paused = true)]
async fn a_busy_slave_and_one_that_takes_another_header_refuse_and_a_slow_one_acknowledges_late() {
    let mut master = Master::new([1]);
    let request = frame(1, &[0, 0xFA, 0, 1]);
    master.slave(1).keep_busy(Duration::from_secs(1));
    assert_eq!(master.send(&request).await, [NAK]);
    tokio::time::sleep(Duration::from_secs(1)).await;
    assert_eq!(master.send(&request).await, [ACK]);
    for (header, word) in [(HeaderForm::Standard, NAK), (HeaderForm::Simplified, ACK)] {
        master.slave(1).set_link_habits(LinkHabits { header, ..LinkHabits::default() });
        assert_eq!(master.send(&request).await, [word]);
    }
    let late = Some(Duration::from_millis(600));
    master.slave(1).set_link_habits(LinkHabits { acknowledges_after: late, ..LinkHabits::default() });
    assert!(master.send(&request).await.is_empty(), "it takes longer than we wait");
}
