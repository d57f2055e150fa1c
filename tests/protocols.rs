//! The other protocols of the Altivar 58's card against the simulated card: several slaves, faults, and the request that
//! commands and reports at once.

use std::time::Duration;

use drive_bus::{
    Line, LineConfig, Protocol, Slave,
    protocol::{AsciiSettings, UniTelwaySettings},
    unite::{SpecificCommand, UniTeError},
};
use drive_core::{
    Class, Direction, Frequency, PortError, Row, SerialSettings, SlaveAddress, StopMode, Terms,
};
use drive_families::Family;
use drive_sim::{
    ALWAYS, Delivery, Exception, Fault, Faults, SimLine, SimSlave, Wiring, models::atv58::Atv58,
};
use drive_testing::{rig::ADDRESS, witness::Witnesses};
use support::{attended::Attended, contracts::contract};
use tokio_modbus::{Request, Response, client::Client};

/// W252, ACC: a word that keeps what is written to it.
const KEPT: u16 = 252;
/// Enough for every retry.
const LIFETIME: Duration = Duration::from_secs(20);

fn unitelway() -> Protocol {
    Protocol::UniTelway(UniTelwaySettings::default())
}

fn ascii() -> Protocol {
    Protocol::Ascii(AsciiSettings::default())
}

/// Altivars 58 at these addresses, and the line to them.
fn line(protocol: Protocol, addresses: &[u8], delivery: Delivery) -> (SimLine, Line) {
    let settings: SerialSettings = Family::ATV58.capabilities().factory;
    let spoken = match protocol {
        Protocol::Ascii(_) => drive_sim::Protocol::Ascii,
        Protocol::UniTelway(_) => drive_sim::Protocol::UniTelway,
        _ => drive_sim::Protocol::Rtu,
    };
    let simulated = SimLine::new(Wiring { protocol: spoken, delivery, ..Wiring::rtu(settings) });
    for &address in addresses {
        simulated.add(address, Atv58::new()).expect("the address is free");
    }
    let config = LineConfig { protocol, ..LineConfig::stream(settings) };
    let line = Line::over(simulated.in_memory(), config);
    (simulated, line)
}

fn machine(simulated: &SimLine, address: u8) -> SimSlave {
    simulated.slave(address).expect("it is there")
}

async fn read(slave: &mut Slave) -> Result<u16, PortError> {
    match slave.call(Request::ReadHoldingRegisters(KEPT, 1)).await {
        Ok(Ok(Response::ReadHoldingRegisters(words))) => Ok(words[0]),
        Ok(other) => panic!("{other:?}"),
        Err(error) => Err(PortError::from_modbus(error)),
    }
}

async fn write(slave: &mut Slave, word: u16) -> Result<(), PortError> {
    match slave.call(Request::WriteSingleRegister(KEPT, word)).await {
        Ok(Ok(Response::WriteSingleRegister(KEPT, confirmed))) if confirmed == word => Ok(()),
        Ok(other) => panic!("{other:?}"),
        Err(error) => Err(PortError::from_modbus(error)),
    }
}

fn bytes_of(requests: &[drive_sim::Received], code: u8) -> usize {
    requests.iter().filter(|request| request.pdu.first() == Some(&code)).count()
}

#[tokio::test(start_paused = true)]
async fn two_drives_on_one_uni_telway_line_turn_at_their_own_speeds() {
    for delivery in [Delivery::Whole, Delivery::Pieces(1)] {
        let (simulated, line) = line(unitelway(), &[3, 16], delivery);
        let (mut drives, mut witnesses) = (Vec::new(), Witnesses::default());
        for (address, hertz) in [(3, 20), (16, 35)] {
            let slave = SlaveAddress::try_from(address).expect("it is one");
            let drive = Family::ATV58.open(line.slave(address), slave);
            let mut drive = Attended::new(drive, &machine(&simulated, address), &mut witnesses);
            drive
                .drive
                .set_setpoint(Frequency::from_hertz(hertz).into())
                .await
                .expect("it takes the setpoint");
            drive.drive.start(Direction::Forward).await.expect("it starts");
            drives.push((drive, Frequency::from_hertz(hertz)));
        }
        for (drive, reference) in &mut drives {
            while drive.status().await.expect("it answers").output_frequency != Some(*reference) {
                tokio::time::sleep(Duration::from_millis(50)).await;
            }
        }
        let (first, second) = (machine(&simulated, 3).observe(), machine(&simulated, 16).observe());
        assert_eq!((first.output_frequency, second.output_frequency), (2_000, 3_500));
        drives[1].0.drive.stop(StopMode::Freewheel).await.expect("it stops");
        assert!(machine(&simulated, 3).observe().running && !machine(&simulated, 16).observe().running);
        assert_eq!(simulated.violations(), []);
        let stats = line.stats();
        assert_eq!(stats.slaves.values().map(|slave| slave.outcomes.timeouts).sum::<u64>(), 0);
    }
}

#[tokio::test(start_paused = true)]
async fn a_mute_uni_telway_slave_does_not_keep_the_others_waiting() {
    let (simulated, line) = line(unitelway(), &[1, 2], Delivery::Whole);
    machine(&simulated, 1).mute();
    let (mut mute, mut living) = (line.slave(1), line.slave(2));
    while !matches!(read(&mut mute).await, Err(PortError::Offline { .. })) {
        assert_eq!(read(&mut living).await, Ok(30));
    }
    machine(&simulated, 1).unmute();
    while read(&mut mute).await.is_err() {
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    assert_eq!(line.stats().slaves[&2].outcomes.timeouts, 0);
}

/// The manual's own word for it, p. 13/37: no exception of Modbus says it.
#[tokio::test(start_paused = true)]
async fn a_negative_reply_is_told_as_one_and_in_no_word_of_modbus() {
    let (simulated, line) = line(unitelway(), &[1], Delivery::Whole);
    let mut drive = Family::ATV58.open(line.slave(1), SlaveAddress::MIN);
    let row = Row::find(drive_atv58::ROWS, "ACC").expect("it has one");
    drive.read_parameter(row).await.expect("it answers");
    machine(&simulated, 1).refuse_next(Exception::ILLEGAL_VALUE);
    let refused = drive.read_parameter(row).await.expect_err("it refuses");
    assert!(
        refused.to_string().ends_with("negative reply FDh, the drive refuses it and says no reason"),
        "{refused}"
    );
}

#[tokio::test(start_paused = true)]
async fn the_specific_request_climbs_the_chart_and_reports_in_the_same_exchange() {
    let mut rig = contract(Family::ATV58).rig_speaking(unitelway(), Family::ATV58.capabilities().factory);
    let mut unite = rig.line.slave(ADDRESS).unite();
    let identity = unite.identify().await.expect("it says who it is");
    assert_eq!((identity.product, identity.subtype, &*identity.rating), (0x18, 0x58, "ATV58U18N4"));
    unite.mirror(&[0x10, 0x02, 0x10, 0x05]).await.expect("it comes back");
    for (cmd, eta) in [(0x06, 0x0221), (0x07, 0x0223), (0x0F, 0x0227)] {
        let command = SpecificCommand { cmd, frh: 500, acc: 10, dec: 10 };
        let report = unite.command(command).await.expect("it takes the command");
        assert_eq!((report.frh, report.eta, report.flt), (500, eta, 0));
    }
    let status = rig.until_at(Frequency::from_hertz(50)).await;
    assert_eq!(status.direction, Some(Direction::Forward));
    let stop = SpecificCommand { cmd: 0x00, frh: 0, acc: 10, dec: 10 };
    unite.command(stop).await.expect("it takes the command");
    assert!(!rig.machine.observe().running);
    assert_eq!(bytes_of(&rig.machine.received(), 0xF2), 4, "each was carried out once");
    assert_eq!(unite.link_counters().await.expect("it has counters").received_refused, 0);
    assert!(unite.protocol_version().await.is_ok());
}

#[tokio::test(start_paused = true)]
async fn a_command_by_the_specific_request_whose_reply_is_lost_is_unknown_and_carried_out_once() {
    let (simulated, line) = line(unitelway(), &[1], Delivery::Whole);
    let mut unite = line.slave(1).with_terms(Terms::of(Class::Command).edge()).unite();
    unite.identify().await.expect("it says who it is");
    simulated.set_fault(Fault::Lost, ALWAYS);
    let command = SpecificCommand { cmd: 0x80, frh: 0, acc: 10, dec: 10 };
    let lost = unite.command(command).await.unwrap_err();
    assert!(matches!(lost, UniTeError::Port(PortError::OutcomeUnknown(_))), "{lost}");
    simulated.set_fault(Fault::Lost, 0);
    tokio::time::sleep(LIFETIME).await;
    assert_eq!(bytes_of(&machine(&simulated, 1).received(), 0xF2), 1);
    assert_eq!(read(&mut line.slave(1)).await, Ok(10), "and it was carried out");
}

#[tokio::test(start_paused = true)]
async fn under_every_fault_nothing_wrong_is_taken_for_right_in_either_protocol() {
    let faults = [
        Fault::RequestFlipped,
        Fault::RequestLost,
        Fault::Flipped,
        Fault::Lost,
        Fault::Truncated,
        Fault::Noise,
        Fault::Late,
        Fault::Duplicated,
        Fault::Foreign,
        Fault::WrongEcho,
    ];
    for protocol in [ascii(), unitelway()] {
        let (mut right, mut failed) = (0, 0);
        for (seed, fault) in (0..).zip(faults) {
            let (simulated, line) = line(protocol, &[1, 2], Delivery::Pieces(7));
            simulated.set_faults(Faults::seeded(seed).with(fault, 30_000));
            for round in 0_u16..150 {
                for address in [1, 2] {
                    let mut slave =
                        line.slave(address).with_terms(Terms::of(Class::Command).within(LIFETIME));
                    let word = round * 3 + u16::from(address);
                    match write(&mut slave, word).await {
                        Ok(()) => {
                            right += 1;
                            assert_eq!(machine(&simulated, address).peek(KEPT), Some(word), "{fault:?}");
                        }
                        Err(_) => failed += 1,
                    }
                    let kept = machine(&simulated, address).peek(KEPT);
                    match read(&mut slave).await {
                        Ok(word) => {
                            right += 1;
                            assert_eq!(Some(word), kept, "{protocol}, {fault:?}, round {round}");
                        }
                        Err(_) => failed += 1,
                    }
                }
            }
            assert!(simulated.injected(fault) > 0 || fault == Fault::WrongEcho, "{fault:?} never struck");
        }
        assert!(right > 20 * failed, "{protocol}: {right} right, {failed} failed");
    }
}

#[tokio::test(start_paused = true)]
async fn the_last_character_that_the_card_is_told_is_followed_until_it_forgets_it() {
    let mut rig = contract(Family::ATV58).rig_speaking(ascii(), Family::ATV58.capabilities().factory);
    let slave = SlaveAddress::try_from(ADDRESS).expect("it is one");
    let mut card = drive_atv58::Atv58::new(rig.line.slave(ADDRESS), slave);
    card.change_ascii_delimiter(b'!').await.expect("the card has 08/03");
    card.echo(0xA537).await.expect("it hears the new character");
    rig.drive.status().await.expect("through every handle");
    rig.machine.power_cycle();
    rig.until("it is found again", |_| true).await;
}
