//! Writes that would move a motor, and those that would not.

use std::{net::IpAddr, sync::Arc, time::Duration};

use drive_core::{Direction, Frequency, StopMode};
use drive_fleet::{EventKind, Received};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    time::{Instant, sleep, timeout},
};

use super::{ETA, Peer, plant, read};
use crate::{
    clients::Course,
    config::{GatewayConfig, Units},
    desk::Desk,
    framing::Frame,
};
use drived_doors::{
    Caller, Rights, Role,
    audit::Audit,
    crowd::{Crowd, Limits},
};
use drived_plant::plant::{
    commands::{Action, LIFETIME, Lifetime, Request, Target},
    testing::TestPlant,
};

/// CMD, LFr and CMI: BBV51701 p. 19 and 20. ACC: p. 37. COL: p. 53.
pub(super) const CMD: u16 = 8_501;
pub(super) const LFR: u16 = 8_502;
const CMI: u16 = 8_504;
const ACC: u16 = 9_001;
const COL: u16 = 7_011;

pub(super) fn write(register: u16, word: u16) -> Vec<u8> {
    [&[0x06][..], &register.to_be_bytes(), &word.to_be_bytes()].concat()
}

pub(super) fn write_two(register: u16, words: [u16; 2]) -> Vec<u8> {
    let [one, other] = words.map(u16::to_be_bytes);
    [&[0x10][..], &register.to_be_bytes(), &[0, 2, 4], &one, &other].concat()
}

pub(super) async fn operated(drives: u8, change: impl FnOnce(&mut GatewayConfig)) -> (TestPlant, Arc<Desk>) {
    plant(drives, |config| {
        config.rights = Role::Operate.rights();
        config.patience = Duration::from_secs(3);
        change(config);
    })
    .await
}

/// What ETA shows under the mask of the chart, 006Fh (p. 10).
pub(super) async fn state<S: AsyncRead + AsyncWrite + Unpin>(peer: &mut Peer<S>, unit: u8) -> u16 {
    match peer.ask(unit, &read(ETA, 1)).await[..] {
        [0x03, 2, high, low] => u16::from_be_bytes([high, low]) & 0x006F,
        ref refused => panic!("{refused:02X?}"),
    }
}

/// As a SCADA does it by the manual (p. 12): disable voltage, shut down, switch on, each once the drive shows it.
pub(super) async fn climb<S: AsyncRead + AsyncWrite + Unpin>(peer: &mut Peer<S>, unit: u8) {
    for (word, shown) in [(0x0000, 0x0040), (0x0006, 0x0021), (0x0007, 0x0023)] {
        assert_eq!(peer.ask(unit, &write(CMD, word)).await, write(CMD, word));
        assert_eq!(state(peer, unit).await, shown, "after {word:04X}h");
    }
}

#[tokio::test(start_paused = true)]
async fn a_scada_that_walks_the_ladder_sees_each_step_and_its_motor_runs_and_stops() {
    let (plant, desk) = operated(1, |_| {}).await;
    let mut peer = Peer::of(&desk);
    climb(&mut peer, 1).await;
    assert_eq!(peer.ask(1, &write(LFR, 300)).await, write(LFR, 300));
    assert!(!plant.machines[0].observe().running);
    assert_eq!(peer.ask(1, &write(CMD, 0x000F)).await, write(CMD, 0x000F));
    assert!(plant.machines[0].observe().running);
    assert_eq!(state(&mut peer, 1).await, 0x0027);
    sleep(Duration::from_secs(10)).await;
    // The word again, as one who writes cyclically does: it is confirmed, and changes nothing.
    assert_eq!(peer.ask(1, &write(CMD, 0x000F)).await, write(CMD, 0x000F));
    let drive = plant.plant.fleet().drive("pump 1").unwrap();
    assert!(drive.snapshot().started_here(), "so that the policies of the exit hold for it");
    assert_eq!(peer.ask(1, &write(CMD, 0x0007)).await, write(CMD, 0x0007));
    sleep(Duration::from_secs(10)).await;
    assert!(!plant.machines[0].observe().running);
}

/// "It is not possible, therefore, to execute a run command immediately after a Quick stop", and it is after a fast stop (BBV51701 p. 11).
#[tokio::test(start_paused = true)]
async fn no_run_command_starts_a_motor_behind_a_quick_stop_before_its_voltage_was_disabled() {
    let (plant, desk) = operated(1, |_| {}).await;
    let mut peer = Peer::of(&desk);
    climb(&mut peer, 1).await;
    for stop in [0x0002, 0x400F] {
        assert_eq!(peer.ask(1, &write_two(CMD, [0x000F, 300])).await[0], 0x10);
        sleep(Duration::from_secs(10)).await;
        assert!(plant.machines[0].observe().running);
        assert_eq!(peer.ask(1, &write(CMD, stop)).await, write(CMD, stop));
        sleep(Duration::from_secs(10)).await;
        assert!(!plant.machines[0].observe().running, "{stop:04X}h");
        if stop == 0x0002 {
            for word in [0x000F, 0x0006, 0x0007, 0x000F] {
                let answer = peer.ask(1, &write(CMD, word)).await;
                assert_eq!(answer[0] == 0x86, word == 0x000F, "{word:04X}h: {answer:02X?}");
                assert!(!plant.machines[0].observe().running, "{word:04X}h");
            }
            climb(&mut peer, 1).await;
        }
    }
    assert_eq!(peer.ask(1, &write(CMD, 0x000F)).await, write(CMD, 0x000F));
}

/// The lock is the drive's, and no client's: neither another address, nor another gateway, nor one that a reload has opened anew gets past it.
#[tokio::test(start_paused = true)]
async fn a_quick_stop_by_one_client_locks_the_drive_for_every_client_of_every_gateway() {
    let (plant, desk) = operated(1, |_| {}).await;
    let mut peer = Peer::of(&desk);
    climb(&mut peer, 1).await;
    assert_eq!(peer.ask(1, &write_two(CMD, [0x000F, 300])).await[0], 0x10);
    sleep(Duration::from_secs(10)).await;
    let config = GatewayConfig { name: "other".to_owned(), ..desk.config.clone() };
    let names = super::names(&plant);
    let second = Desk::new(&Course::default(), config, plant.plant.clone(), Audit::default(), names);
    let mut others = [
        Peer::at(&desk, "127.0.0.2".parse().unwrap()),
        Peer::of(&second),
        Peer::at(&second, "127.0.0.2".parse().unwrap()),
    ];
    assert_eq!(peer.ask(1, &write(CMD, 0x0002)).await, write(CMD, 0x0002));
    sleep(Duration::from_secs(10)).await;
    for other in &mut others {
        for word in [0x0006, 0x0007, 0x000F] {
            let answer = other.ask(1, &write(CMD, word)).await;
            assert_eq!(answer == [0x86, 0x04], word == 0x000F, "{word:04X}h: {answer:02X?}");
            assert!(!plant.machines[0].observe().running, "{word:04X}h");
        }
    }
    // Whoever disables the voltage ends it for all.
    climb(&mut others[0], 1).await;
    let [_, third, _] = &mut others;
    assert_eq!(third.ask(1, &write(CMD, 0x0007)).await, write(CMD, 0x0007));
    assert_eq!(third.ask(1, &write(CMD, 0x000F)).await, write(CMD, 0x000F));
    assert!(plant.machines[0].observe().running);
}

/// "Quick stop active" is left by 0000h alone (BBV51701 p. 10, transition 12): a shutdown, which lets a motor coast else, does not touch it.
#[tokio::test(start_paused = true)]
async fn no_step_of_the_ladder_lets_a_motor_coast_out_of_its_quick_stop() {
    let (plant, desk) = operated(1, |_| {}).await;
    let mut peer = Peer::of(&desk);
    climb(&mut peer, 1).await;
    assert_eq!(peer.ask(1, &write_two(CMD, [0x000F, 500])).await[0], 0x10);
    sleep(Duration::from_secs(20)).await;
    assert_eq!(peer.ask(1, &write(CMD, 0x0002)).await, write(CMD, 0x0002));
    for word in [0x0006, 0x0007, 0x100F] {
        assert!(plant.machines[0].observe().output_frequency > 0, "{word:04X}h comes on its way down");
        assert_eq!(peer.ask(1, &write(CMD, word)).await, write(CMD, word));
        assert!(plant.machines[0].observe().output_frequency > 0, "{word:04X}h has cut the output");
    }
    assert_eq!(peer.ask(1, &write(CMD, 0x000F)).await, [0x86, 0x04]);
    sleep(Duration::from_secs(10)).await;
    assert!(!plant.machines[0].observe().running);
}

#[tokio::test(start_paused = true)]
async fn setpoint_and_run_command_in_one_write_are_one_order() {
    let (plant, desk) = operated(1, |_| {}).await;
    let mut peer = Peer::of(&desk);
    let run = write_two(CMD, [0x000F, 250]);
    assert_eq!(peer.ask(1, &run).await, [0x90, 0x04], "no word without run has come yet");
    assert_eq!(peer.ask(1, &write(CMD, 0x0006)).await, write(CMD, 0x0006));
    assert_eq!(peer.ask(1, &run).await[..5], run[..5]);
    sleep(Duration::from_secs(10)).await;
    assert_eq!(plant.machines[0].observe().output_frequency, 2_500);
    let stop = write_two(CMD, [0x0007, 200]);
    assert_eq!(peer.ask(1, &stop).await, [0x90, 0x04], "a setpoint while the motor comes down");
    sleep(Duration::from_secs(10)).await;
    assert!(!plant.machines[0].observe().running, "the stop was carried out all the same");
    assert_eq!(peer.ask(1, &stop).await[..5], stop[..5], "and at standstill both are");
    assert_eq!(plant.machines[0].peek(LFR), Some(200));
}

fn stop_of_all(arrived: Instant) -> (Caller, Request) {
    let caller = Caller::new("page", "page", Rights::ALL);
    let (target, action, lifetime) =
        (Target::All, Action::Stop(StopMode::Ramp.into()), Duration::from_secs(1));
    (
        caller,
        Request { id: None, target, action, expects: None, lifetime: Lifetime::Usual(lifetime), arrived },
    )
}

#[tokio::test(start_paused = true)]
async fn a_word_without_run_of_before_a_stop_by_somebody_else_lets_nothing_start_behind_it() {
    let (plant, desk) = operated(1, |_| {}).await;
    let mut peer = Peer::of(&desk);
    climb(&mut peer, 1).await;
    assert_eq!(peer.ask(1, &write(LFR, 300)).await, write(LFR, 300));
    sleep(Duration::from_secs(1)).await;
    let (caller, request) = stop_of_all(Instant::now());
    plant.plant.command(&caller, request, Duration::from_secs(30)).await.unwrap();
    sleep(Duration::from_secs(1)).await;
    let run = write(CMD, 0x000F);
    assert_eq!(peer.ask(1, &run).await, [0x86, 0x04]);
    assert!(!plant.machines[0].observe().running);
    climb(&mut peer, 1).await;
    assert_eq!(peer.ask(1, &run).await, run, "a word without run behind the stop makes it a new one");
}

/// A run command that somebody writes cyclically is no wish to start again.
#[tokio::test(start_paused = true)]
async fn a_run_command_that_goes_on_restarts_nothing_after_a_stop_a_trip_or_on_another_connection() {
    let (plant, desk) = operated(1, |_| {}).await;
    let mut peer = Peer::of(&desk);
    let run = write(CMD, 0x000F);
    let refused = [0x86, 0x04];
    assert_eq!(peer.ask(1, &run).await, refused, "as after a restart of this program");
    climb(&mut peer, 1).await;
    assert_eq!(peer.ask(1, &write(LFR, 300)).await, write(LFR, 300));
    assert_eq!(peer.ask(1, &run).await, run);
    let (caller, request) = stop_of_all(Instant::now());
    plant.plant.command(&caller, request, Duration::from_secs(30)).await.unwrap();
    for _ in 0..10 {
        sleep(Duration::from_secs(1)).await;
        assert_eq!(peer.ask(1, &run).await, refused);
        assert_eq!(Peer::of(&desk).ask(1, &run).await, refused);
    }
    assert!(!plant.machines[0].observe().running);
    climb(&mut peer, 1).await;
    assert_eq!(peer.ask(1, &run).await, run, "a word without run makes it a new one");
    plant.machines[0].trip(9);
    sleep(Duration::from_secs(2)).await;
    assert_eq!(peer.ask(1, &run).await, refused);
    assert_eq!(peer.ask(1, &write(CMD, 0x0080)).await, write(CMD, 0x0080), "the fault is reset");
    assert_eq!(state(&mut peer, 1).await, 0x0040);
    assert!(!plant.machines[0].observe().running);
}

/// Nothing is acknowledged that is not carried out.
#[tokio::test(start_paused = true)]
async fn what_a_rule_forbids_is_refused_by_04_and_nothing_is_written() {
    let (plant, desk) = operated(1, |_| {}).await;
    let mut peer = Peer::of(&desk);
    let before = plant.machines[0].requests(0x06) + plant.machines[0].requests(0x10);
    for (pdu, why) in [
        (write(CMD, 0x001F), "a run command with a reserved bit"),
        (write(CMD, 0x800F), "with one that acts as it was assigned"),
        (write(LFR, 0xFED4), "a negative reference turns the direction round"),
        (write(CMI, 0x0002), "CMI bit 1 saves to the EEPROM"),
        (write(ACC, 100), "a parameter, and raw_writes is not set"),
        (write(400, 0x000F), "CMD by its address of the Altivar 28"),
        (write_two(LFR, [300, 0]), "a setpoint beside the PI reference"),
    ] {
        assert_eq!(peer.ask(1, &pdu).await, [pdu[0] | 0x80, 0x04], "{why}");
    }
    let after = plant.machines[0].requests(0x06) + plant.machines[0].requests(0x10);
    assert_eq!(after, before);
    let setpoint = peer.ask(1, &write(LFR, 9_000)).await;
    assert_eq!(setpoint, [0x86, 0x04], "above HSP");
}

#[tokio::test(start_paused = true)]
async fn parameters_are_written_where_allowed_and_never_by_an_address_that_is_not_in_the_list() {
    let (plant, desk) = operated(1, |config| config.raw_writes = true).await;
    let mut peer = Peer::of(&desk);
    assert_eq!(peer.ask(1, &write(ACC, 77)).await, write(ACC, 77));
    assert_eq!(plant.machines[0].peek(ACC), Some(77));
    assert_eq!(peer.ask(1, &write(400, 0x000F)).await, [0x86, 0x02]);
    assert_eq!(peer.ask(1, &write(CMI, 0x0002)).await, [0x86, 0x04]);
}

/// LSP ≤ HSP ≤ tFr (BBV51701 p. 27, 47): from the factory HSP is 50 Hz and tFr 60 Hz. What is refused is refused as a whole.
#[tokio::test(start_paused = true)]
async fn what_the_manual_wants_among_parameters_holds_for_a_client_as_well() {
    const HSP: u16 = 3_104;
    let (plant, desk) = operated(1, |config| (config.raw_writes, config.eeprom_writes) = (true, true)).await;
    let mut peer = Peer::of(&desk);
    assert_eq!(peer.ask(1, &write(HSP, 700)).await, [0x86, 0x04], "above tFr");
    assert_eq!(peer.ask(1, &write_two(HSP, [450, 460])).await, [0x90, 0x04], "LSP, behind it, above HSP");
    assert_eq!(plant.machines[0].peek(HSP), Some(500));
    assert_eq!(peer.ask(1, &write(HSP, 600)).await, write(HSP, 600));
    assert_eq!(plant.machines[0].peek(HSP), Some(600));
}

/// A parameter that may stand in the drive's EEPROM, whatever a client that writes it every second does to that.
#[tokio::test(start_paused = true)]
async fn what_wears_the_eeprom_is_written_only_where_that_is_allowed_by_itself() {
    for allowed in [false, true] {
        let (plant, desk) = operated(1, |config| {
            (config.raw_writes, config.eeprom_writes) = (true, allowed);
        })
        .await;
        // Where it is kept, the manual does not print.
        let before = plant.machines[0].requests(0x06) + plant.machines[0].requests(0x10);
        let answer = Peer::of(&desk).ask(1, &write(COL, 6)).await;
        let written = plant.machines[0].requests(0x06) + plant.machines[0].requests(0x10) > before;
        assert_eq!((answer[0] == 0x06, written), (allowed, allowed), "allowed: {allowed}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_is_only_read_or_another_commanders_is_not_moved() {
    let (_plant, desk) = plant(1, |config| config.rights = Role::Stop.rights()).await;
    let mut peer = Peer::of(&desk);
    assert_eq!(peer.ask(1, &write(CMD, 0x0006)).await, [0x86, 0x04], "this gateway only stops");
    assert_eq!(peer.ask(1, &write(CMD, 0x0000)).await, write(CMD, 0x0000), "and does so");
    let others = TestPlant::with(1, |name| {
        let commanders = drive_fleet::Commanders::Only(vec!["operator".to_owned()]);
        drive_fleet::DriveSettings { commanders, ..drive_fleet::DriveSettings::controlled(name) }
    })
    .await;
    let mut config = super::config();
    config.rights = Role::Operate.rights();
    let desk =
        Desk::new(&Course::default(), config, others.plant.clone(), Default::default(), Default::default());
    let mut peer = Peer::of(&desk);
    assert_eq!(peer.ask(1, &write(CMD, 0x0006)).await, [0x86, 0x04]);
    assert_eq!(peer.ask(1, &write(LFR, 300)).await, [0x86, 0x04]);
    assert_eq!(peer.ask(1, &write(CMD, 0x0000)).await, write(CMD, 0x0000), "anybody may stop it");
}

/// A stop goes ahead of what its own client has asked before, and what waits to start does not start after it.
#[tokio::test(start_paused = true)]
async fn a_stop_waits_for_no_queue_and_no_share_and_no_start_comes_after_it() {
    let (plant, desk) = operated(2, |config| config.share = 1).await;
    let mut peer = Peer::of(&desk);
    climb(&mut peer, 1).await;
    assert_eq!(peer.ask(1, &write(LFR, 300)).await, write(LFR, 300));
    assert_eq!(peer.ask(1, &write(CMD, 0x000F)).await, write(CMD, 0x000F));
    let mut other = Peer::of(&desk);
    // Reads that use up the share of a minute, and those of the client itself.
    for count in 1..=7 {
        other.send(2, &read(ETA, count)).await;
        peer.send(2, &read(ETA + 1, count)).await;
    }
    let stop = peer.send(1, &write(CMD, 0x0007)).await;
    let sent = Instant::now();
    let bound = plant.plant.fleet().lines()[0].1.worst_case_stop();
    while plant.machines[0].peek(CMD) == Some(0x000F) {
        sleep(Duration::from_millis(1)).await;
    }
    assert!(sent.elapsed() <= bound + Duration::from_millis(20), "{:?} of {bound:?}", sent.elapsed());
    let mut answers = Vec::new();
    loop {
        let (transaction, pdu) = timeout(Duration::from_secs(10), peer.answer()).await.unwrap();
        answers.push(transaction);
        if transaction == stop {
            assert_eq!(pdu, write(CMD, 0x0007));
            break;
        }
    }
    assert!(answers.len() < 7, "ahead of reads that were sent before it: {answers:?}");
    sleep(Duration::from_secs(20)).await;
    assert!(!plant.machines[0].observe().running);
}

#[tokio::test(start_paused = true)]
async fn where_all_clients_ask_a_newcomer_finds_a_place_for_a_stop_and_for_nothing_else() {
    let (plant, desk) = operated(1, |_| {}).await;
    let crowd = Crowd::new(Limits::of_gateway(1));
    let enter = |number: u8| {
        let address = IpAddr::from([10, 0, 0, number]);
        let place = crowd.enter(Some(address), Instant::now()).expect("a place for a stop");
        Peer::in_place(&desk, address, place)
    };
    let mut scada = enter(1);
    climb(&mut scada, 1).await;
    assert_eq!(scada.ask(1, &write(CMD, 0x000F)).await, write(CMD, 0x000F));
    assert!(plant.machines[0].observe().running);
    let mut reader = enter(2);
    assert_eq!(reader.ask(1, &read(ETA, 1)).await, [0x83, 0x06]);
    assert!(reader.is_ended().await, "whoever does not stop keeps the place from nobody");
    let mut starter = enter(3);
    assert_eq!(starter.ask(1, &write(LFR, 300)).await, [0x86, 0x06]);
    assert!(starter.is_ended().await);
    let mut panel = enter(4);
    assert_eq!(panel.ask(1, &write(CMD, 0x0000)).await, write(CMD, 0x0000));
    assert!(!plant.machines[0].observe().running);
}

#[tokio::test(start_paused = true)]
async fn a_start_that_waits_in_its_queue_is_not_begun_after_a_stop_of_another_face() {
    let (plant, desk) = operated(1, |config| config.share = 1).await;
    let mut peer = Peer::of(&desk);
    climb(&mut peer, 1).await;
    assert_eq!(peer.ask(1, &write(LFR, 300)).await, write(LFR, 300));
    plant.machines[0].set_turnaround(Some(Duration::from_millis(100)));
    peer.send(1, &read(ETA, 7)).await;
    let start = peer.send(1, &write(CMD, 0x000F)).await;
    sleep(Duration::from_millis(20)).await;
    let (caller, request) = stop_of_all(Instant::now());
    plant.plant.command(&caller, request, Duration::from_secs(30)).await.unwrap();
    let mut pdu = Vec::new();
    while !pdu.starts_with(&[0x86]) {
        let (transaction, answer) = peer.answer().await;
        if transaction == start {
            pdu = answer;
        }
    }
    assert_eq!(pdu, [0x86, 0x04]);
    sleep(Duration::from_secs(5)).await;
    assert!(!plant.machines[0].observe().running);
}

#[tokio::test(start_paused = true)]
async fn a_stop_behind_one_that_another_master_has_undone_is_confirmed_by_what_the_drive_shows_since() {
    let (plant, desk) = operated(1, |_| {}).await;
    let machine = &plant.machines[0];
    let mut peer = Peer::of(&desk);
    climb(&mut peer, 1).await;
    assert_eq!(peer.ask(1, &write(LFR, 300)).await, write(LFR, 300));
    assert_eq!(peer.ask(1, &write(CMD, 0x000F)).await, write(CMD, 0x000F));
    sleep(Duration::from_secs(10)).await;
    // Along its ramp (p. 16), which is undone while the motor comes down.
    assert_eq!(peer.ask(1, &write(CMD, 0x100F)).await, write(CMD, 0x100F));
    machine.written_by_another(CMD, 0x000F).unwrap();
    assert_eq!(peer.ask(1, &write(CMD, 0x100F)).await, write(CMD, 0x100F));
    assert_eq!(machine.peek(CMD), Some(0x100F), "its answer is not that of the first");
}

#[tokio::test(start_paused = true)]
async fn a_start_that_waits_for_others_of_its_line_is_not_begun_for_a_client_that_is_gone() {
    for leaves in [false, true] {
        let (plant, desk) = operated(4, |_| {}).await;
        let mut peer = Peer::of(&desk);
        climb(&mut peer, 4).await;
        assert_eq!(peer.ask(4, &write(LFR, 300)).await, write(LFR, 300));
        let (caller, _) = stop_of_all(Instant::now());
        for drive in &plant.plant.fleet().drives()[..2] {
            let target = Target::Drive(drive.name().to_string());
            let setpoint = Some(Frequency::from_hertz(20).into());
            let action =
                Action::Start { direction: Direction::Forward, setpoint, until: drive_fleet::Until::InForce };
            let arrived = Instant::now();
            let request = Request { id: None, target, action, expects: None, lifetime: LIFETIME, arrived };
            plant.plant.begin(&caller, request).unwrap();
        }
        peer.send(4, &write(CMD, 0x000F)).await;
        sleep(Duration::from_millis(300)).await;
        assert!(plant.machines.iter().all(|machine| !machine.observe().running), "all wait or are begun");
        if leaves {
            drop(peer);
        }
        sleep(Duration::from_secs(10)).await;
        let running = plant.machines.iter().map(|machine| machine.observe().running);
        assert_eq!(running.collect::<Vec<_>>(), [true, true, false, !leaves]);
    }
}

#[tokio::test(start_paused = true)]
async fn unit_0_stops_all_where_allowed_and_nothing_else() {
    let (plant, desk) = operated(2, |config| config.broadcast = true).await;
    let mut peer = Peer::of(&desk);
    for unit in [1, 2] {
        climb(&mut peer, unit).await;
        assert_eq!(peer.ask(unit, &write(LFR, 300)).await, write(LFR, 300));
        assert_eq!(peer.ask(unit, &write(CMD, 0x000F)).await, write(CMD, 0x000F));
    }
    assert_eq!(peer.ask(0, &write(CMD, 0x000F)).await, [0x86, 0x04]);
    assert_eq!(peer.ask(0, &write(LFR, 400)).await, [0x86, 0x04]);
    assert_eq!(peer.ask(0, &read(ETA, 1)).await, [0x83, 0x0A]);
    assert_eq!(peer.ask(0, &write(CMD, 0x0000)).await, write(CMD, 0x0000));
    sleep(Duration::from_secs(5)).await;
    assert!(plant.machines.iter().all(|machine| !machine.observe().running));
}

#[tokio::test(start_paused = true)]
async fn the_motor_of_a_client_that_went_silent_is_stopped_where_told_so() {
    for stops in [false, true] {
        let (plant, _desk, mut peer) = started_by_one_who_is_watched(stops).await;
        for _ in 0..10 {
            sleep(Duration::from_secs(4)).await;
            peer.ask(1, &read(ETA, 1)).await;
        }
        assert!(plant.machines[0].observe().running, "it is heard");
        drop(peer);
        let mut events = plant.plant.fleet().events();
        sleep(Duration::from_secs(15)).await;
        assert_eq!(plant.machines[0].observe().running, !stops);
        if stops {
            // Nobody had asked for it, that client least of all.
            let told = async {
                loop {
                    if let Received::Event(event) = events.recv().await
                        && matches!(event.kind, EventKind::StopConfirmed { .. })
                    {
                        return format!("{:?}", event.cause);
                    }
                }
            };
            let cause = timeout(Duration::from_secs(5), told).await.expect("it is told");
            assert!(cause.contains("this program, by on_client_silence"), "{cause}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_somebody_else_starts_behind_a_stop_is_not_stopped_for_the_silence_of_who_ran_it_before()
{
    let (plant, _desk, peer) = started_by_one_who_is_watched(true).await;
    drop(peer);
    let (caller, request) = stop_of_all(Instant::now());
    plant.plant.command(&caller, request, Duration::from_secs(3)).await.unwrap();
    let setpoint = Some(Frequency::from_hertz(25).into());
    let action =
        Action::Start { direction: Direction::Forward, setpoint, until: drive_fleet::Until::default() };
    let (target, lifetime) = (Target::Drive("pump 1".to_owned()), Duration::from_secs(1));
    let request = Request {
        id: None,
        target,
        action,
        expects: None,
        lifetime: Lifetime::Usual(lifetime),
        arrived: Instant::now(),
    };
    let told = plant.plant.command(&caller, request, Duration::from_secs(3)).await.unwrap();
    assert!(plant.machines[0].observe().running, "{told:?}");
    sleep(Duration::from_secs(60)).await;
    assert!(plant.machines[0].observe().running, "its run is not his");
}

/// A table of units names drives, and a reload may give a name to another motor.
fn by_names(config: &mut GatewayConfig) {
    let units = [1, 2].map(|unit| (unit, format!("pump {unit}")));
    config.units = Units::Table(units.into());
}

#[tokio::test(start_paused = true)]
async fn a_write_that_waits_for_its_turn_goes_to_the_motor_that_its_unit_meant_when_it_came_or_to_none() {
    let (plant, desk) = operated(2, by_names).await;
    let mut peer = Peer::of(&desk);
    for word in [300, 200] {
        peer.send(1, &write(LFR, word)).await;
    }
    // The first is on the line, and the other one behind it.
    sleep(Duration::from_millis(1)).await;
    plant.exchange_names();
    peer.answer().await;
    assert_eq!(peer.answer().await.1, [0x86, 0x04]);
    assert_eq!(plant.machines[1].peek(LFR), Some(0), "it is called so now, and was not meant");
    assert_eq!(peer.ask(1, &write(LFR, 250)).await, write(LFR, 250));
    assert_eq!(plant.machines[1].peek(LFR), Some(250), "who writes now means it");
}

/// In real time: the disk knows no other.
#[tokio::test]
async fn a_write_that_waits_for_the_disk_of_the_audit_log_moves_nothing_of_whoever_has_the_name_by_then() {
    let (plant, desk) = operated(2, by_names).await;
    let folder = drived_config::testing::Folder::new("gateway-audit");
    let audit = Audit::open(&folder.file("audit.jsonl")).unwrap();
    let desk =
        Desk::new(&Course::default(), desk.config.clone(), plant.plant.clone(), audit, super::names(&plant));
    let frame = Frame { transaction: 1, unit: 1, pdu: write(LFR, 300) };
    let client = desk.clients.open("10.0.0.7".parse().unwrap());
    let mut written = std::pin::pin!(desk.answer(&client, desk.look_at(Instant::now(), &frame)));
    let at_once = futures_util::future::poll_immediate(&mut written).await;
    assert_eq!(at_once, None, "it waits for the disk");
    plant.exchange_names();
    let answer = written.await.unwrap();
    assert_eq!(plant.machines[1].peek(LFR), Some(0), "it was not meant");
    // A disk may have been as fast as nobody has seen one yet.
    assert!(answer == [0x86, 0x04] || plant.machines[0].peek(LFR) == Some(300), "{answer:02X?}");
}

/// A motor that runs by a client that has to be heard every five seconds, or is stopped where told so; it goes on asking.
async fn started_by_one_who_is_watched(stops: bool) -> (TestPlant, Arc<Desk>, Peer) {
    let (plant, desk) = operated(1, |config| {
        config.client_timeout = Some(Duration::from_secs(5));
        config.stops_when_silent = stops;
    })
    .await;
    tokio::spawn(plant.plant.clone().follow_watched(|_, _| {}));
    let mut peer = Peer::of(&desk);
    climb(&mut peer, 1).await;
    assert_eq!(peer.ask(1, &write(LFR, 300)).await, write(LFR, 300));
    assert_eq!(peer.ask(1, &write(CMD, 0x000F)).await, write(CMD, 0x000F));
    (plant, desk, peer)
}

/// It asks for half a minute and its motor runs; then it is silent, and the motor is stopped.
async fn is_watched_on(plant: &TestPlant, mut peer: Peer) {
    // Its start was under way for a part of its five seconds, and it was called otherwise for another.
    for _ in 0..9 {
        sleep(Duration::from_millis(3_500)).await;
        peer.ask(1, &read(ETA, 1)).await;
    }
    assert!(plant.machines[0].observe().running, "it is heard");
    sleep(Duration::from_secs(20)).await;
    assert!(!plant.machines[0].observe().running, "it is silent");
}

#[tokio::test(start_paused = true)]
async fn who_has_started_a_drive_is_watched_on_when_the_drive_is_called_otherwise() {
    let (plant, _desk, peer) = started_by_one_who_is_watched(true).await;
    let settings = drive_fleet::DriveSettings::controlled("mixer");
    plant.plant.fleet().rename("pump 1", settings).unwrap();
    // It is looked for between both.
    sleep(Duration::from_millis(600)).await;
    plant.plant.renamed("pump 1", "mixer");
    is_watched_on(&plant, peer).await;
}

#[tokio::test(start_paused = true)]
async fn who_has_started_a_drive_is_watched_on_by_the_gateway_that_stands_where_his_stood_or_is_called_like_it()
 {
    for (name, listen) in [("renamed", "127.0.0.1:0"), ("scada", "127.0.0.1:7")] {
        let (plant, desk, peer) = started_by_one_who_is_watched(true).await;
        drop(peer);
        let config =
            GatewayConfig { name: name.to_owned(), listen: listen.parse().unwrap(), ..desk.config.clone() };
        plant.plant.watched().set_doors(&[crate::desk::watched(&config)]);
        let desk = Desk::new(
            &Course::default(),
            config,
            plant.plant.clone(),
            Default::default(),
            super::names(&plant),
        );
        is_watched_on(&plant, Peer::of(&desk)).await;
    }
}

#[tokio::test(start_paused = true)]
async fn who_has_started_a_drive_by_a_gateway_that_is_gone_is_silent_whatever_he_says_elsewhere() {
    let (plant, desk, _peer) = started_by_one_who_is_watched(true).await;
    let other = GatewayConfig {
        name: "other".to_owned(),
        listen: "127.0.0.1:7".parse().unwrap(),
        client_timeout: None,
        ..desk.config.clone()
    };
    plant.plant.watched().set_doors(&[crate::desk::watched(&other)]);
    let desk =
        Desk::new(&Course::default(), other, plant.plant.clone(), Default::default(), super::names(&plant));
    let mut peer = Peer::of(&desk);
    for _ in 0..5 {
        sleep(Duration::from_secs(4)).await;
        peer.ask(1, &read(ETA, 1)).await;
    }
    assert!(!plant.machines[0].observe().running);
}

#[tokio::test(start_paused = true)]
async fn a_gateway_that_lets_its_clients_be_silent_from_now_on_stops_nothing() {
    let (plant, desk, peer) = started_by_one_who_is_watched(true).await;
    drop(peer);
    let config = GatewayConfig { client_timeout: None, ..desk.config.clone() };
    plant.plant.watched().set_doors(&[crate::desk::watched(&config)]);
    sleep(Duration::from_secs(60)).await;
    assert!(plant.machines[0].observe().running);
}

/// A page that starts the motor again is no client of a gateway, and that one's silence is nothing to it.
#[tokio::test(start_paused = true)]
async fn the_silence_of_who_started_a_motor_stops_no_run_that_somebody_began_long_after() {
    let (plant, _desk, mut peer) = started_by_one_who_is_watched(true).await;
    assert_eq!(peer.ask(1, &write(CMD, 0x0007)).await, write(CMD, 0x0007));
    for _ in 0..20 {
        sleep(Duration::from_secs(4)).await;
        peer.ask(1, &read(ETA, 1)).await;
    }
    let drive = plant.plant.fleet().drive("pump 1").unwrap();
    let begun = drive.run(Direction::Forward, Frequency::from_hertz(20)).await;
    assert!(begun.is_confirmed(), "{begun}");
    drop(peer);
    sleep(Duration::from_secs(30)).await;
    assert!(plant.machines[0].observe().running);
}

/// He has taken the motor over, whichever way it turns since, and is heard by nobody's time-out.
#[tokio::test(start_paused = true)]
async fn the_silence_of_who_started_a_motor_stops_none_that_somebody_else_has_started_again_since() {
    for direction in [Direction::Forward, Direction::Reverse] {
        let (plant, _desk, mut peer) = started_by_one_who_is_watched(true).await;
        sleep(Duration::from_secs(3)).await;
        peer.ask(1, &read(ETA, 1)).await;
        let drive = plant.plant.fleet().drive("pump 1").unwrap().commanded_by("anna");
        let begun = drive.start_at(direction, Frequency::from_hertz(20)).await;
        assert!(begun.is_confirmed(), "{begun}");
        sleep(Duration::from_secs(30)).await;
        assert!(plant.machines[0].observe().running, "{direction}");
    }
}

/// A motor that is turned round takes its ramps for it.
#[tokio::test(start_paused = true)]
async fn the_silence_of_who_started_a_motor_stops_none_that_somebody_else_is_turning_round_meanwhile() {
    let (plant, _desk, _peer) = started_by_one_who_is_watched(true).await;
    sleep(Duration::from_millis(4_000)).await;
    let person = Caller::new("anna", "page", Rights::ALL);
    let setpoint = Some(Frequency::from_hertz(20).into());
    let start = Action::Start { direction: Direction::Reverse, setpoint, until: drive_fleet::Until::InForce };
    let target = Target::Drive("pump 1".to_owned());
    let request = Request {
        id: None,
        target,
        action: start,
        expects: None,
        lifetime: LIFETIME,
        arrived: Instant::now(),
    };
    let told = plant.plant.begin(&person, request).unwrap();
    sleep(Duration::from_secs(40)).await;
    assert_eq!(plant.machines[0].observe().output_frequency, -2_000, "{:?}", told.borrow());
}

/// What was refused has started nothing.
#[tokio::test(start_paused = true)]
async fn the_silence_of_who_started_a_motor_stops_it_behind_a_start_of_somebody_else_that_was_refused() {
    let (plant, _desk, _peer) = started_by_one_who_is_watched(true).await;
    let drive = plant.plant.fleet().drive("pump 1").unwrap().commanded_by("anna");
    let refused = drive.start_at(Direction::Forward, Frequency::from_hertz(400)).await;
    assert!(!refused.is_confirmed(), "{refused}");
    sleep(Duration::from_secs(30)).await;
    assert!(!plant.machines[0].observe().running);
}

#[tokio::test(start_paused = true)]
async fn a_write_to_a_drive_that_does_not_answer_is_told_by_0b() {
    let (plant, desk) = operated(1, |_| {}).await;
    let mut peer = Peer::of(&desk);
    plant.machines[0].mute();
    sleep(Duration::from_secs(10)).await;
    for word in [0x0006, 0x0000] {
        assert_eq!(peer.ask(1, &write(CMD, word)).await, [0x86, 0x0B], "{word:04X}h");
    }
    assert_eq!(peer.ask(1, &write(LFR, 300)).await, [0x86, 0x0B]);
}

#[tokio::test(start_paused = true)]
async fn once_the_daemon_is_about_to_end_a_word_that_stops_is_taken_and_no_other() {
    let (plant, desk) = operated(2, |config| config.raw_writes = true).await;
    let mut peer = Peer::of(&desk);
    climb(&mut peer, 1).await;
    assert_eq!(peer.ask(1, &write(LFR, 300)).await, write(LFR, 300));
    assert_eq!(peer.ask(1, &write(CMD, 0x000F)).await, write(CMD, 0x000F));
    plant.plant.close();
    let before = plant.machines[1].requests(6) + plant.machines[1].requests(16);
    for (register, word) in [(CMD, 0x0006), (CMD, 0x000F), (LFR, 200)] {
        assert_eq!(peer.ask(2, &write(register, word)).await, [0x86, 0x04], "{register} = {word:04X}h");
    }
    assert_eq!(
        plant.machines[1].requests(6) + plant.machines[1].requests(16),
        before,
        "it has heard of nothing"
    );
    assert_eq!(peer.ask(1, &write(CMD, 0x000F)).await, [0x86, 0x04]);
    assert!(plant.machines[0].observe().running, "and who runs is left as it is");
    assert_eq!(state(&mut peer, 1).await, 0x0027, "what is there is told");
    assert_eq!(peer.ask(1, &write(CMD, 0x0007)).await, write(CMD, 0x0007));
    sleep(Duration::from_secs(10)).await;
    assert!(!plant.machines[0].observe().running);
}
