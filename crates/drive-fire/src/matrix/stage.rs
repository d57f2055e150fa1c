//! The stage of one cell: the drive, the machine, the cable with a hand on it, and a twin of the machine that hears nothing of us.

use std::{future::ready, io, time::Duration};

use drive_bus::{
    Echo, Endpoint, Line, LineConfig, Protocol, SlaveSettings,
    protocol::{AsciiSettings, UniTelwaySettings},
};
use drive_core::{Drive, Port, SlaveAddress, Terms};
use drive_families::SetUp;
use drive_sim::{Defects, Gateway, Model, SecondMaster, SimLine, SimSlave, Unheard, Wiring};
use drive_testing::contract::Open;

use super::{
    Cell, FarEnd, Fault, Subject, Way,
    judge::{Bench, Judged, Notes},
    tap::Tap,
};

/// Where the drive is.
pub(super) const ADDRESS: u8 = 3;

/// Where a drive is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Site {
    pub(super) subject: Subject,
    pub(super) way: Way,
    pub(super) far_end: FarEnd,
    pub(super) seed: u64,
    /// The process stands still now and then, so that a request may be late.
    pub(super) stalls: bool,
}

impl From<&Cell> for Site {
    fn from(cell: &Cell) -> Self {
        let Cell { subject, way, far_end, .. } = *cell;
        Self {
            subject,
            way,
            far_end,
            seed: cell.number ^ 0x5EED,
            stalls: matches!(cell.fault, Fault::Stall(_)),
        }
    }
}

pub(super) struct Stage {
    pub(super) drive: Box<dyn Drive>,
    pub(super) bench: Bench,
    pub(super) simulated: SimLine,
    pub(super) twin: SimSlave,
    twin_line: SimLine,
    /// Kept, so that the line lives as long as the stage.
    _line: Line,
}

fn machine(site: &Site) -> Box<dyn Model> {
    site.subject.family().machine(SetUp::ForTheBus).expect("each subject has a twin")
}

/// What the gateway of this cell does; of one that is no gateway what any serial server does.
fn habits(site: &Site) -> Gateway {
    let plain = Gateway {
        rtu: site.way == Way::RtuOverTcp,
        attempts: 1,
        wait: Duration::from_millis(300),
        tells: site.way == Way::ModbusTcp,
        ..Gateway::default()
    };
    match site.far_end {
        FarEnd::Serialising => Gateway { attempts: 3, wait: Duration::from_secs(1), tells: true, ..plain },
        FarEnd::Silent => Gateway { attempts: 3, wait: Duration::from_secs(1), tells: false, ..plain },
        FarEnd::Replaying => Gateway { replays: 3, ..plain },
        FarEnd::Doubling => Gateway { doubles_after: Some(Duration::from_millis(30)), ..plain },
        FarEnd::GoesMute => Gateway { mute_after: Some(Duration::from_secs(6)), ..plain },
        _ => plain,
    }
}

impl Stage {
    /// The drive at this site is made by `open`.
    pub(super) fn new(site: &Site, open: &Open) -> Self {
        let settings = site.subject.family().capabilities().factory;
        let spoken = match site.way {
            Way::Ascii => drive_sim::Protocol::Ascii,
            Way::UniTelway => drive_sim::Protocol::UniTelway,
            _ => drive_sim::Protocol::Rtu,
        };
        let wiring =
            Wiring { protocol: spoken, unpaced: site.far_end == FarEnd::Fast, ..Wiring::rtu(settings) };
        let simulated = SimLine::new(wiring);
        let watched = simulated.add_boxed(ADDRESS, machine(site)).expect("the address is free");
        let twin_line = SimLine::new(wiring);
        let twin = twin_line.add_boxed(ADDRESS, machine(site)).expect("the address is free");
        if site.far_end == FarEnd::Twins {
            simulated.add_beside(ADDRESS, machine(site)).expect("it is an address");
        }
        if site.far_end.has_second_master() {
            let row = site.subject.family().capabilities().rows.iter().find(|row| row.access.is_readable());
            let [high, low] = row.map_or(0, |row| row.address).to_be_bytes();
            let second = SecondMaster {
                requests: vec![(ADDRESS, vec![3, high, low, 0, 1])],
                every: Duration::from_millis(330),
                unheard: match site.far_end {
                    FarEnd::MasterHeardInAnswers => Some(Unheard::Requests),
                    FarEnd::MasterHeardInQuestions => Some(Unheard::Answers),
                    _ => None,
                },
            };
            simulated.set_defects(Defects { second_master: Some(second), ..Defects::default() });
        }
        let tap = Tap::new(site.way, site.seed, site.far_end == FarEnd::Caching);
        let config = LineConfig { slaves: [(ADDRESS, pause(site))].into(), ..config(site) };
        let line = if site.way.is_network() {
            let (far, tap) = (simulated.behind(habits(site)), tap.clone());
            let connect = move || ready(tap.before(far.connect()).ok_or_else(refused));
            Line::over_reopened(connect, config)
        } else {
            let (simulated, tap) = (simulated.clone(), tap.clone());
            let connect = move || ready(tap.before(simulated.in_memory()).ok_or_else(refused));
            Line::over_reopened(connect, config)
        };
        let notes = Notes::default();
        let holds_back = site.way.is_network() || site.stalls;
        let bench = Bench { tap, machine: watched, notes, way: site.way, holds_back };
        let port = Judged { line: line.slave(ADDRESS), bench: bench.clone(), terms: Terms::default() };
        let slave = SlaveAddress::try_from(ADDRESS).expect("it is one");
        let drive = open(Box::new(port) as Box<dyn Port>, slave);
        Self { drive, bench, simulated, twin, twin_line, _line: line }
    }

    /// Something happens around the drive, and around its twin.
    pub(super) fn happens(&self, deed: &str) {
        Around::of(self).happens(deed);
    }
}

/// What is around both machines, for who makes something happen while the drive is busy.
pub(super) struct Around([(SimLine, String); 2]);

impl Around {
    pub(super) fn of(stage: &Stage) -> Self {
        let named = |line: &SimLine, machine: &SimSlave| (line.clone(), machine.name());
        Self([named(&stage.simulated, &stage.bench.machine), named(&stage.twin_line, &stage.twin)])
    }

    pub(super) fn happens(&self, deed: &str) {
        for (line, machine) in &self.0 {
            // What a model does not take does not happen to it, nor to its twin.
            let _ = line.control(&format!("{machine} {deed}"));
        }
    }
}

fn refused() -> io::Error {
    io::ErrorKind::ConnectionRefused.into()
}

fn pause(site: &Site) -> SlaveSettings {
    SlaveSettings { turnaround: site.subject.family().capabilities().turnaround, ..SlaveSettings::default() }
}

fn config(site: &Site) -> LineConfig {
    let settings = site.subject.family().capabilities().factory;
    match site.way {
        // As over a network, on a stream: there is no descriptor in virtual time.
        Way::RtuOverTcp => {
            LineConfig { endpoint: Endpoint::Stream, ..LineConfig::rtu_over_tcp("far-end:4001", settings) }
        }
        Way::ModbusTcp => LineConfig { endpoint: Endpoint::Stream, ..LineConfig::modbus_tcp("far-end:502") },
        way => {
            let protocol = match way {
                Way::Ascii => Protocol::Ascii(AsciiSettings::default()),
                Way::UniTelway => Protocol::UniTelway(UniTelwaySettings::default()),
                _ => Protocol::Rtu,
            };
            // As a serial port has them.
            let serial = LineConfig {
                protocol,
                double_window: Duration::from_millis(50),
                ..LineConfig::stream(settings)
            };
            match (way, site.far_end) {
                (Way::UniTelway, _) => serial,
                (_, FarEnd::Fast) => LineConfig { echo: Echo::Auto, ..serial },
                _ => LineConfig { echo: Echo::Auto, far_end_paces: Some(true), ..serial },
            }
        }
    }
}
