//! A small drive and a plain master, for tests of the line itself.

use std::time::Duration;

use crc::{CRC_16_MODBUS, Crc};
use drive_core::{FaultEntry, registers};
use drive_sim::{
    Act, Bank, Block, Cast, Exception, Model, Motor, Nameplate, Observation, Panel, Ramp, Ramps, Rules,
    Surroundings, Switch, UniTe, Watchdog,
};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};

/// How long the small drive waits before it answers.
pub(crate) const TURNAROUND: Duration = Duration::from_millis(5);
/// The small drive's communication watchdog.
pub(crate) const TIMEOUT: Duration = Duration::from_secs(3);
/// The code that its watchdog trips with.
pub(crate) const LINK_LOST: u16 = 5;
/// From standstill to 50 Hz and back.
pub(crate) const RAMP: Duration = Duration::from_secs(2);

registers! {
    /// Command, reference, output frequency, and a parameter.
    pub(crate) const ROWS;

    CMD: ReadWrite(1, "CMD", "1 runs", Volatile, Unit::BITS, Range::Within(0, 1), Factory::None, Manual, "test");
    REF: ReadWrite(2, "REF", "reference", Volatile, Unit::scaled("Hz", 2), Range::Within(0, 5_000), Factory::None, Manual, "test");
    OUT: Read(3, "OUT", "output frequency", Volatile, Unit::scaled("Hz", 2), Range::Any, Factory::None, Manual, "test");
    KEEP: ReadWrite(4, "EEP", "kept", Eeprom, Unit::COUNT, Range::Any, Factory::Value(7), Manual, "test");
    HOME: ReadWrite(5, "ADD", "address, if not 0", Eeprom, Unit::COUNT, Range::Any, Factory::Value(0), Manual, "test");
    ACC: ReadWrite(252, "ACC", "unused", Volatile, Unit::COUNT, Range::Within(0, 1_000), Factory::None, Manual, "test");
}

const RULES: Rules = Rules {
    read_holding: 8,
    read_input: 0,
    write_single: true,
    write_multiple: 4,
    diagnostics: &[0x00, 0x01, 0x03, 0x04, 0x0A, 0x0B, 0x0C, 0x0D, 0x0E, 0x0F],
    event_counter: true,
    broadcast: &[0x06, 0x10],
    turnaround: TURNAROUND,
};

/// An input that takes control away, one that gives the reference, and a switch that says what a trip does.
const SURROUNDINGS: Surroundings = Surroundings {
    family: "small",
    terminals: &["LOC"],
    analog_inputs: &["AI1"],
    switches: &[Switch {
        name: "trip",
        readings: &["coasts", "ramps"],
        question: "how a trip stops the motor",
    }],
    trips: &[FaultEntry::new(LINK_LOST, "SLF", "link lost", "look at the cable")],
    rows: ROWS,
};

/// A drive with four registers.
pub(crate) struct Small {
    bank: Bank,
    motor: Motor,
    watchdog: Watchdog,
    trip: Option<u16>,
    local: bool,
    ramps_at_trip: bool,
}

impl Small {
    pub(crate) fn new() -> Self {
        Self {
            bank: Bank::new(ROWS),
            motor: Motor::new(Nameplate::light(20)),
            watchdog: Watchdog::new(Some(TIMEOUT)),
            trip: None,
            local: false,
            ramps_at_trip: false,
        }
    }

    fn obey(&mut self) {
        let ramp = Ramp { full_scale: 5_000, time: RAMP };
        if self.bank.value(CMD.address()) == 1 && self.trip.is_none() && !self.local {
            let ramps = Ramps { acceleration: ramp, deceleration: ramp };
            self.motor.run(i32::from(self.bank.value(REF.address())), ramps);
        } else {
            self.motor.ramp_to_rest(ramp);
        }
    }
}

impl Model for Small {
    fn rules(&self) -> &Rules {
        &RULES
    }

    fn read(&mut self, address: u16) -> Result<u16, Exception> {
        let frequency = u16::try_from(self.motor.output_frequency()).unwrap_or(0);
        self.bank.set(OUT.address(), frequency);
        self.bank.read(address)
    }

    fn write(&mut self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        self.bank.write(address, value, !self.motor.is_fed())?;
        self.obey();
        Ok(())
    }

    fn check_read(&self, block: Block) -> Result<(), Exception> {
        if block.first == 100 { Err(Exception::FAILURE) } else { Ok(()) }
    }

    fn other(&mut self, request: &[u8]) -> Result<Vec<u8>, Exception> {
        match request {
            [0x64, data @ ..] => Ok([&[0x64, 0xAA], data].concat()),
            [0x2B, 0x0E, code, 0] => Ok(drive_sim::identification(*code, 1, &["Maker", "Small"])),
            _ => Err(Exception::ILLEGAL_FUNCTION),
        }
    }

    fn unite(&self) -> Option<UniTe> {
        Some(UniTe {
            product: [0x18, 0x58, 0x21],
            name: "Small",
            command: [CMD.address(), REF.address(), ACC.address(), KEEP.address()],
            report: [REF.address(), OUT.address(), KEEP.address(), ACC.address()],
        })
    }

    fn frame_seen(&mut self, _: Cast) {
        self.watchdog.feed();
    }

    fn advance(&mut self, elapsed: Duration) {
        let first = self.watchdog.remaining().map_or(elapsed, |remaining| remaining.min(elapsed));
        self.motor.advance(first);
        if self.watchdog.advance(first) {
            self.trip(LINK_LOST);
        }
        self.motor.advance(elapsed - first);
    }

    fn power(&mut self, on: bool) {
        if !on {
            return self.motor.freewheel();
        }
        *self = Self { bank: self.bank.clone(), ..Self::new() };
        self.bank.power_cycle();
    }

    fn trip(&mut self, code: u16) {
        self.trip = Some(code);
        if !self.ramps_at_trip {
            self.motor.freewheel();
        }
        self.obey();
    }

    fn set_load(&mut self, percent: u16) {
        self.motor.set_load(percent);
    }

    fn panel(&mut self, action: Panel) {
        self.local = action == Panel::TakeControl;
        self.obey();
    }

    fn surroundings(&self) -> &'static Surroundings {
        &SURROUNDINGS
    }

    fn world(&mut self, act: Act) {
        match act {
            Act::Terminal(_, closed) => self.local = closed,
            Act::Analog(_, level) => {
                self.bank.set(REF.address(), u16::try_from(level.hundredths() / 2).unwrap_or(0));
            }
            Act::MotorSupply(true) => {}
            Act::MotorSupply(false) => self.motor.freewheel(),
            Act::Reading(_, reading) => self.ramps_at_trip = reading == "ramps",
        }
        self.obey();
    }

    fn own_address(&self) -> Option<u8> {
        u8::try_from(self.bank.value(HOME.address())).ok().filter(|address| *address != 0)
    }

    fn check_word(&self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        Ok(self.bank.check(address, value, true)?)
    }

    fn observe(&self) -> Observation {
        Observation {
            running: self.motor.is_fed(),
            output_frequency: self.motor.output_frequency(),
            shaft_frequency: self.motor.shaft_frequency(),
            setpoint: i32::from(self.bank.value(REF.address())),
            current: self.motor.current(),
            trip: self.trip,
            local: self.local,
            eeprom_writes: self.bank.eeprom_writes(),
        }
    }

    fn peek(&self, address: u16) -> Option<u16> {
        self.bank.peek(address)
    }

    fn poke(&mut self, address: u16, value: u16) -> bool {
        self.bank.set(address, value)
    }
}

/// A frame with its CRC.
pub(crate) fn frame(body: &[u8]) -> Vec<u8> {
    let crc = Crc::<u16>::new(&CRC_16_MODBUS).checksum(body);
    [body, &crc.to_le_bytes()].concat()
}

/// Reads `quantity` words of a slave.
pub(crate) fn read(slave: u8, first: u16, quantity: u16) -> Vec<u8> {
    let [[a, b], [c, d]] = [first, quantity].map(u16::to_be_bytes);
    frame(&[slave, 0x03, a, b, c, d])
}

/// Writes one word of a slave.
pub(crate) fn write(slave: u8, address: u16, value: u16) -> Vec<u8> {
    let [[a, b], [c, d]] = [address, value].map(u16::to_be_bytes);
    frame(&[slave, 0x06, a, b, c, d])
}

/// Sends a request and takes what comes within a time, as one piece.
pub(crate) async fn ask(
    port: &mut (impl AsyncRead + AsyncWrite + Unpin),
    request: &[u8],
    timeout: Duration,
) -> Option<Vec<u8>> {
    port.write_all(request).await.unwrap();
    hear(port, timeout).await
}

/// Takes what comes next within a time, as one piece.
pub(crate) async fn hear(port: &mut (impl AsyncRead + Unpin), timeout: Duration) -> Option<Vec<u8>> {
    let mut buffer = vec![0; 1_024];
    let count = tokio::time::timeout(timeout, port.read(&mut buffer)).await.ok()?.unwrap();
    buffer.truncate(count);
    Some(buffer)
}
