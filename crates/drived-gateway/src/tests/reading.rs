//! Reads, refusals, and clients that misbehave.

use std::time::Duration;

use drive_bus::exchange::mbap;
use tokio::{
    io::AsyncWriteExt as _,
    time::{Instant, timeout},
};

use super::{ETA, Peer, plant, read, take_up};

#[tokio::test(start_paused = true)]
async fn a_read_is_answered_with_what_the_drive_holds() {
    let (plant, desk) = plant(2, |_| {}).await;
    let mut peer = Peer::of(&desk);
    let held = plant.machines[1].peek(ETA).unwrap();
    let [high, low] = held.to_be_bytes();
    assert_eq!(peer.ask(2, &read(ETA, 1)).await, [0x03, 2, high, low]);
    let identification = peer.ask(2, &[0x2B, 0x0E, 0x01, 0x00]).await;
    assert_eq!(identification[..2], [0x2B, 0x0E], "{identification:02X?}");
    assert!(identification.windows(12).any(|window| window == b"TELEMECANIQU"), "{identification:02X?}");
}

/// Each exception in the case that it is for.
#[tokio::test(start_paused = true)]
async fn what_cannot_be_answered_is_refused_by_the_code_that_says_why() {
    let (plant, desk) = plant(2, |config| config.mapped_only = true).await;
    let mut peer = Peer::of(&desk);
    assert_eq!(peer.ask(3, &read(ETA, 1)).await, [0x83, 0x0A], "nobody is behind unit 3");
    assert_eq!(peer.ask(0, &read(ETA, 1)).await, [0x83, 0x0A], "nor behind 0 and 255 unless told");
    assert_eq!(peer.ask(255, &read(ETA, 1)).await, [0x83, 0x0A]);
    assert_eq!(peer.ask(1, &[0x01, 0, 0, 0, 1]).await, [0x81, 0x01], "coils");
    assert_eq!(peer.ask(1, &read(1, 1)).await, [0x83, 0x02], "not in the map");
    assert_eq!(peer.ask(1, &read(ETA, 126)).await, [0x83, 0x03], "more words than a frame has");
    assert_eq!(peer.ask(1, &[0x06, 0x21, 0x35, 0, 0]).await, [0x86, 0x01], "a gateway that only reads");
    plant.machines[1].mute();
    assert_eq!(peer.ask(2, &read(ETA, 1)).await, [0x83, 0x0B], "the slave does not answer");
    assert_eq!(peer.ask(1, &read(ETA, 1)).await[..2], [0x03, 2], "and the next is answered as before");
}

#[tokio::test(start_paused = true)]
async fn a_slave_that_does_not_answer_may_be_told_by_silence() {
    let (plant, desk) = plant(2, |config| config.silent = true).await;
    let mut peer = Peer::of(&desk);
    plant.machines[1].mute();
    peer.send(2, &read(ETA, 1)).await;
    let next = peer.send(1, &read(ETA, 1)).await;
    let (answered, _) = peer.answer().await;
    assert_eq!(answered, next);
}

#[tokio::test(start_paused = true)]
async fn a_line_that_is_gone_is_told_by_0a_and_one_without_room_by_06() {
    let (plant, desk) = plant(1, |config| config.patience = Duration::from_millis(300)).await;
    // Eight that want something else each, of a drive that takes 90 ms: three have it within their patience.
    plant.machines[0].set_turnaround(Some(Duration::from_millis(90)));
    let mut peers: Vec<Peer> = (0..8).map(|_| Peer::of(&desk)).collect();
    for (peer, count) in peers.iter_mut().zip(1..) {
        peer.send(1, &read(ETA, count)).await;
    }
    let mut refused = 0;
    for peer in &mut peers {
        refused += usize::from(peer.answer().await.1 == [0x83, 0x06]);
    }
    assert!((4..8).contains(&refused), "{refused}");
    let mut peer = Peer::of(&desk);
    let (name, line) = plant.plant.fleet().lines().remove(0);
    assert_eq!(&*name, "north");
    line.close().await;
    tokio::time::sleep(Duration::from_secs(10)).await;
    assert_eq!(peer.ask(1, &read(ETA, 1)).await, [0x83, 0x0A]);
}

#[tokio::test(start_paused = true)]
async fn one_request_is_carried_out_eight_wait_and_the_next_is_refused_at_once() {
    let (plant, desk) = plant(1, |_| {}).await;
    plant.machines[0].mute();
    let mut peer = Peer::of(&desk);
    // Until its slave counts as off-line each takes its time.
    let mut all = Vec::new();
    for count in 1..=10 {
        all.push(peer.send(1, &read(ETA, count)).await);
    }
    let (refused, pdu) = peer.answer().await;
    assert_eq!((refused, pdu), (all[9], vec![0x83, 0x06]));
    for transaction in &all[..9] {
        let (answered, pdu) = peer.answer().await;
        assert_eq!(answered, *transaction, "in their order");
        assert!([0x06, 0x0B].contains(&pdu[1]), "{pdu:02X?}");
    }
}

#[tokio::test(start_paused = true)]
async fn equal_reads_of_many_clients_are_one_exchange() {
    let (plant, desk) = plant(1, |_| {}).await;
    let mut peers: Vec<Peer> = (0..8).map(|_| Peer::of(&desk)).collect();
    for peer in &mut peers {
        peer.send(1, &read(ETA, 3)).await;
    }
    for peer in &mut peers {
        assert_eq!(peer.answer().await.1[..2], [0x03, 6]);
    }
    assert_eq!(desk.counters.joined(), 7);
    drop(plant);
}

/// Clients ask without a pause, each something else: one alone has what the daemon leaves of the line, as eight have together; of these
/// nobody is served more often than another; and the daemon asks its drives as often as it has planned.
#[tokio::test(start_paused = true)]
async fn one_client_or_eight_have_all_that_the_daemon_leaves_of_a_line_in_turn_and_its_polls_are_not_late() {
    for clients in [1, 8_u8] {
        // Eight wait for each other longer than the usual patience.
        let (plant, desk) = plant(8, |config| config.patience = Duration::from_secs(5)).await;
        let polls = || {
            let counters = plant.plant.fleet().drives().into_iter().map(|drive| drive.snapshot().counters);
            counters.fold((0, 0), |(polls, missed), of| (polls + of.polls, missed + of.missed))
        };
        let before = polls();
        let end = Instant::now() + Duration::from_secs(60);
        let ask_on = |client: u8| {
            let mut peer = Peer::of(&desk);
            async move {
                let (mut answered, mut unit) = (0_u32, client);
                while Instant::now() < end {
                    let pdu = peer.ask(unit, &read(ETA, 7)).await;
                    answered += u32::from(pdu[0] == 0x03);
                    unit = unit % 8 + 1;
                }
                answered
            }
        };
        let tasks: Vec<_> = (1..=clients).map(|client| tokio::spawn(ask_on(client))).collect();
        let mut answered = Vec::new();
        for task in tasks {
            answered.push(task.await.unwrap());
        }
        let (least, most) = (*answered.iter().min().unwrap(), *answered.iter().max().unwrap());
        assert!(most - least <= 1 + least / 100, "{answered:?}");
        // 8 and 19 characters of 11 bits at 19200 bit/s, 3.5 of silence, and 10 ms of the drive: 27.5 ms.
        let plan = plant.plant.fleet().plan("north").unwrap().utilisation_ppm as f64 / 1e6;
        let used = f64::from(answered.iter().sum::<u32>()) * 0.0275 / 60.0;
        assert!(used + plan >= 0.98, "{clients}: {answered:?}, {used} and {plan}");
        // A full line has its turns where the clients' tasks come round: two polls in a hundred may find their second over.
        let (polls, missed) = (polls().0 - before.0, polls().1 - before.1);
        assert!(missed * 50 <= polls, "{clients}: {missed} of {polls} polls were missed");
    }
}

#[tokio::test(start_paused = true)]
async fn a_dead_drive_holds_up_nobody_for_longer_than_its_timeouts() {
    let (plant, desk) = plant(3, |_| {}).await;
    plant.machines[2].mute();
    let mut dead = Peer::of(&desk);
    let asks_on = tokio::spawn(async move {
        loop {
            assert_eq!(dead.ask(3, &read(ETA, 1)).await, [0x83, 0x0B]);
        }
    });
    let mut peer = Peer::of(&desk);
    for _ in 0..100 {
        let asked = Instant::now();
        assert_eq!(peer.ask(1, &read(ETA, 1)).await[..2], [0x03, 2]);
        assert!(asked.elapsed() < Duration::from_millis(900), "{:?}", asked.elapsed());
        tokio::time::sleep(Duration::from_millis(300)).await;
    }
    asks_on.abort();
}

#[tokio::test(start_paused = true)]
async fn who_sends_nothing_half_a_frame_or_garbage_or_reads_nothing_is_put_out() {
    let (_plant, desk) = plant(1, |_| {}).await;
    let ended_after = async |bytes: &[u8]| {
        let mut peer = Peer::of(&desk);
        peer.stream.write_all(bytes).await.unwrap();
        let begun = Instant::now();
        assert!(peer.is_ended().await);
        begun.elapsed().as_secs()
    };
    assert_eq!(ended_after(&[]).await, 60, "idle");
    assert_eq!(ended_after(&[0, 1, 0, 0, 0]).await, 5, "half a header");
    assert_eq!(ended_after(&[0, 1, 0, 0, 0, 6, 1, 3]).await, 5, "half a frame");
    assert_eq!(ended_after(&[0, 1, 0, 1, 0, 6, 1]).await, 0, "another protocol");
    assert_eq!(ended_after(&[0xFF; 2_048]).await, 0, "garbage");
    // It asks on and on and takes no answer.
    let mut peer = Peer::of(&desk);
    let flood = async {
        loop {
            if peer.stream.write_all(&mbap::frame(1, 1, &read(ETA, 1))).await.is_err() {
                return;
            }
        }
    };
    timeout(Duration::from_secs(60), flood).await.expect("it is put out");
    let ended: Vec<(&str, u64)> =
        desk.counters.counts().ended.into_iter().map(|(why, count)| (why.name(), count)).collect();
    assert_eq!(ended, [("idle", 1), ("half_open", 2), ("malformed", 2), ("slow_reader", 1)]);
}

#[tokio::test(start_paused = true)]
async fn who_closes_his_side_after_his_request_gets_its_answer() {
    let (_plant, desk) = plant(1, |_| {}).await;
    let mut peer = Peer::of(&desk);
    peer.send(1, &read(ETA, 1)).await;
    peer.stream.shutdown().await.unwrap();
    assert_eq!(peer.answer().await.1[..2], [0x03, 2]);
    assert!(peer.is_ended().await);
}

#[tokio::test(start_paused = true)]
async fn what_was_read_lately_is_told_again_where_allowed_and_never_after_a_write() {
    let (plant, desk) = plant(1, |config| {
        config.max_age = Duration::from_millis(500);
        config.rights = drived_doors::Role::Operate.rights();
    })
    .await;
    let mut peer = Peer::of(&desk);
    let first = peer.ask(1, &read(ETA, 4)).await;
    assert_eq!(peer.ask(1, &read(ETA, 4)).await, first);
    assert_eq!(peer.ask(1, &read(ETA + 1, 2)).await[2..], first[4..8], "a part of it");
    assert_eq!(desk.counters.kept(), 2);
    assert_eq!(peer.ask(1, &[0x06, 0x21, 0x35, 0, 0]).await[0], 0x06);
    peer.ask(1, &read(ETA, 4)).await;
    tokio::time::sleep(Duration::from_millis(500)).await;
    peer.ask(1, &read(ETA, 4)).await;
    assert_eq!(desk.counters.kept(), 2);
    drop(plant);
}

/// Read as a SCADA reads it that knows nothing but the head.
#[tokio::test(start_paused = true)]
async fn the_virtual_unit_has_all_drives_in_one_read_and_marks_what_is_old() {
    let (plant, desk) = plant(31, |config| {
        config.virtual_unit = Some(247);
        config.rights = drived_doors::Role::Operate.rights();
        config.patience = Duration::from_secs(3);
    })
    .await;
    tokio::spawn(desk.outcomes.clone().follow(plant.plant.fleet().events()));
    let mut peer = Peer::of(&desk);
    let ask = async |peer: &mut Peer, address: u16, count: u16| -> Vec<u16> {
        let pdu = peer.ask(247, &read(address, count)).await;
        assert_eq!(usize::from(pdu[1]), pdu.len() - 2, "{pdu:02X?}");
        pdu[2..].chunks(2).map(|word| u16::from_be_bytes([word[0], word[1]])).collect()
    };
    let head = ask(&mut peer, 0, 16).await;
    assert_eq!(head[..4], [0x4452, 0x4956, 1, 31]);
    let [overview, stride, details, detail] = head[4..8] else { panic!("{head:?}") };
    for word in [0x0000, 0x0006, 0x0007] {
        let [high, low] = u16::to_be_bytes(word);
        assert_eq!(peer.ask(2, &[0x06, 0x21, 0x35, high, low]).await[0], 0x06);
    }
    // CMD = Fh and LFr = 300 in one write: 30 Hz.
    let run = [0x10, 0x21, 0x35, 0, 2, 4, 0, 0x0F, 1, 44];
    assert_eq!(peer.ask(2, &run).await[0], 0x10);
    plant.machines[4].mute();
    tokio::time::sleep(Duration::from_secs(20)).await;
    let exchanges = plant.machines[1].all_requests();
    let all = ask(&mut peer, overview, 31 * stride).await;
    assert_eq!(plant.machines[1].all_requests(), exchanges, "without the line");
    let of = |drive: usize| &all[drive * usize::from(stride)..(drive + 1) * usize::from(stride)];
    let [flags, frequency, current, age] = *of(1) else { panic!("{all:?}") };
    assert_eq!(flags & 0x000F, 4, "running");
    assert_eq!(flags >> 4 & 0x0007, 0b101, "forward, connected");
    assert_eq!(flags >> 8 & 0x0003, 2, "good");
    assert_eq!(flags >> 13 & 1, 1, "started by the daemon");
    assert_eq!([flags, of(4)[0]].map(|flags| flags >> 14 & 1), [0, 1], "what is lost troubles somebody");
    assert_eq!(frequency, 3_000);
    assert!(current < 1_000 && age < 30, "{current} {age}");
    assert_eq!(of(4)[0] >> 8 & 0x0003, 1, "the mute one is old");
    assert_eq!(of(4)[1..3], [0xFFFF; 2]);
    assert!(of(4)[3] > 100, "{:?}", of(4));
    let second = ask(&mut peer, details + detail, detail).await;
    assert_eq!(second[9], 3_000, "the setpoint");
    assert_eq!(second[10..12], [1, 1], "the last command: a start, confirmed");
    assert_eq!(second[15], 2, "its slave");
    assert_eq!(peer.ask(247, &read(overview + 31 * stride, 1)).await, [0x83, 0x02]);
    assert_eq!(peer.ask(247, &[0x06, 0, 0, 0, 0]).await, [0x86, 0x01], "nothing is written there");
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_leaves_moves_nobody_in_the_virtual_unit_and_its_place_is_never_anothers() {
    let (plant, desk) = plant(4, |config| config.virtual_unit = Some(247)).await;
    tokio::time::sleep(Duration::from_secs(3)).await;
    let mut peer = Peer::of(&desk);
    let mut all = async || -> Vec<u16> {
        let head = peer.ask(247, &read(0, 9)).await;
        let details = peer.ask(247, &read(2_000, 4 * 16)).await;
        let words = head[2..].chunks(2).chain(details[2..].chunks(2));
        words.map(|word| u16::from_be_bytes([word[0], word[1]])).collect()
    };
    let slave = |words: &[u16], place: usize| words[9 + place * 16 + 15];
    let quality = |words: &[u16], place: usize| words[9 + place * 16 + 2];
    let before = all().await;
    assert_eq!((0..4).map(|place| slave(&before, place)).collect::<Vec<_>>(), [1, 2, 3, 4]);
    let fleet = plant.plant.fleet();
    let first = fleet.drives()[0].name().to_string();
    let _ = fleet.remove(&[&first], Duration::from_secs(1)).await;
    take_up(&desk, &plant);
    let after = all().await;
    assert_eq!((0..4).map(|place| slave(&after, place)).collect::<Vec<_>>(), [0, 2, 3, 4]);
    assert_eq!((quality(&after, 0), quality(&after, 1)), (0, 2), "nothing is told of who is gone");
    assert_eq!(after[9 + 4..9 + 8], [0, 0xFFFF, 0xFFFF, 0xFFFF]);
    assert_eq!(after[3], 4, "as many places as before");
    assert_ne!(after[8], before[8], "the revision tells that somebody has left");
}

/// A client whose side takes nothing any more, as after a reset that only its writes have noticed.
struct Deaf(tokio::io::DuplexStream);

impl tokio::io::AsyncRead for Deaf {
    fn poll_read(
        mut self: std::pin::Pin<&mut Self>,
        context: &mut std::task::Context<'_>,
        buffer: &mut tokio::io::ReadBuf<'_>,
    ) -> std::task::Poll<std::io::Result<()>> {
        std::pin::Pin::new(&mut self.0).poll_read(context, buffer)
    }
}

impl tokio::io::AsyncWrite for Deaf {
    fn poll_write(
        self: std::pin::Pin<&mut Self>,
        _: &mut std::task::Context<'_>,
        _: &[u8],
    ) -> std::task::Poll<std::io::Result<usize>> {
        std::task::Poll::Ready(Err(std::io::ErrorKind::BrokenPipe.into()))
    }

    fn poll_flush(
        self: std::pin::Pin<&mut Self>,
        _: &mut std::task::Context<'_>,
    ) -> std::task::Poll<std::io::Result<()>> {
        std::task::Poll::Ready(Ok(()))
    }

    fn poll_shutdown(
        self: std::pin::Pin<&mut Self>,
        _: &mut std::task::Context<'_>,
    ) -> std::task::Poll<std::io::Result<()>> {
        std::task::Poll::Ready(Ok(()))
    }
}

#[tokio::test(start_paused = true)]
async fn the_task_of_a_client_that_takes_no_answer_any_more_ends_without_a_panic() {
    let (_plant, desk) = plant(1, |_| ()).await;
    let (mut near, theirs) = tokio::io::duplex(4_096);
    let address = "127.0.0.1".parse().unwrap();
    let by = desk.clients.open(address);
    let served = tokio::spawn(async move {
        super::client::serve(Deaf(theirs), by, desk, &super::place(address)).await;
    });
    near.write_all(&mbap::frame(1, 1, &read(ETA, 1))).await.unwrap();
    served.await.unwrap();
}
