//! A simulated Altivar 58 with the card VW3-A58303 (VVDED397054).
//!
//! The drive's own manual is not public. The card is simulated as its manual says: functions, limits, sub-codes of
//! function 08 (they are the slave's), the words that it names, the watch for messages. What lies behind is the chart
//! of DRIVECOM with the words where the Altivar 28 has them, which nobody has confirmed; any drive of the field may
//! differ. Bits of the control word above the chart have no effect but bit 11, reverse.

use std::time::Duration;

use drive_atv58::{
    ROWS,
    registers::{
        ACC, CMD, W250, W251, W253, W401, W450, W451, W453, W454, W455, W456, W457, W458, W459, W483,
    },
};

use super::drivecom::{CommandBits, Drivecom, LinkWatch, Reaction, Settings, Stop, word};
use crate::{
    Bank, Cast, Exception, Model, Nameplate, Observation, Panel, Protocol, Ramp, Ramps, Rules, Surroundings,
    UniTe,
};

/// What is around it.
const SURROUNDINGS: Surroundings =
    Surroundings { family: "atv58", trips: &[], rows: ROWS, ..Surroundings::NONE };

const RULES: Rules = Rules {
    read_holding: 63,
    read_input: 63,
    write_single: true,
    write_multiple: 60,
    diagnostics: &[0x00, 0x01, 0x03, 0x04, 0x0A, 0x0B, 0x0C, 0x0D, 0x0E, 0x0F, 0x10, 0x11, 0x12],
    event_counter: true,
    broadcast: &[0x06, 0x10],
    turnaround: Duration::from_millis(5),
};

/// The card's watch for messages on the bus (p. 24/48).
const MESSAGE_WATCH: Duration = Duration::from_secs(10);
/// The same in Modbus ASCII (note on the lamps, p. 24/48).
const MESSAGE_WATCH_ASCII: Duration = Duration::from_secs(1);
/// The card's answers to UNI-TE (p. 11–13). That the reference FRH of request F2h is W401, and that its report shows the
/// status and current words of the Altivar 28, nobody has confirmed.
const UNITE: UniTe = UniTe {
    product: [0x18, 0x58, 0x21],
    name: "ATV58U18N4",
    command: [CMD.address(), W401.address(), ACC.address(), W253.address()],
    report: [W401.address(), W458.address(), W483.address(), W453.address()],
};
/// The fault bit of the link. Which one it is on a real drive is not public.
const LINK_FAULT: u16 = 5;
/// Nominal current in tenths of an ampere: an ATV58HU18N4's order of size.
const NOMINAL_CURRENT: u16 = 23;
/// Line voltage in tenths of a volt.
const LINE_VOLTAGE: u16 = 4_000;
/// Nominal frequency in hundredths of a hertz.
const NOMINAL_FREQUENCY: u32 = 5_000;
/// High speed and ramps in the words' own counts.
const FACTORY: &[(u16, u16)] =
    &[(W250.address(), 500), (W251.address(), 0), (ACC.address(), 30), (W253.address(), 30)];

/// A simulated Altivar 58.
#[derive(Debug, Clone)]
pub struct Atv58 {
    bank: Bank,
    drive: Drivecom,
    protocol: Protocol,
}

impl Atv58 {
    /// A drive from the factory, with a light motor of its own size.
    #[must_use]
    pub fn new() -> Self {
        let mut bank = Bank::new(ROWS);
        for &(address, value) in FACTORY {
            bank.set_factory(address, value);
        }
        let protocol = Protocol::default();
        let drive = Drivecom::new(Nameplate::light(u32::from(NOMINAL_CURRENT)), settings(&bank, protocol));
        Self { bank, drive, protocol }
    }

    /// A register that the drive computes; `None` for one that is kept.
    fn computed(&self, address: u16) -> Option<u16> {
        let motor = self.drive.motor();
        Some(match address {
            _ if address == W450.address() => word(self.drive.target().abs() / 10),
            _ if address == W451.address() => word(motor.output_frequency() / 10),
            _ if address == W453.address() => u16::try_from(motor.current()).unwrap_or(u16::MAX),
            _ if address == W454.address() => LINE_VOLTAGE,
            _ if address == W455.address() || address == W456.address() => motor.thermal_state(),
            _ if address == W457.address() => self.drive.faults().next().map_or(0, |fault| fault.code),
            _ if address == W458.address() => self.drive.eta(),
            _ if address == W459.address() => self.drive.eti(),
            _ if address == W483.address() => {
                self.drive.present_fault().map_or(0, |bit| 1_u16.checked_shl(u32::from(bit)).unwrap_or(0))
            }
            _ => return None,
        })
    }

    fn act(&mut self, address: u16, value: u16) {
        if address == CMD.address() {
            self.drive.command(value);
        } else if address == W401.address() {
            self.drive.reference(i32::from(value.cast_signed()) * 10);
        } else {
            self.drive.set_settings(settings(&self.bank, self.protocol));
        }
    }
}

impl Default for Atv58 {
    fn default() -> Self {
        Self::new()
    }
}

impl Model for Atv58 {
    fn surroundings(&self) -> &'static Surroundings {
        &SURROUNDINGS
    }

    fn rules(&self) -> &Rules {
        &RULES
    }

    fn read(&mut self, address: u16) -> Result<u16, Exception> {
        let kept = self.bank.read(address)?;
        Ok(self.computed(address).unwrap_or(kept))
    }

    fn write(&mut self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        let stopped = !self.drive.motor().is_fed();
        self.bank.write(address, value, stopped)?;
        self.act(address, value);
        Ok(())
    }

    fn check_word(&self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        Ok(self.bank.check(address, value, !self.drive.motor().is_fed())?)
    }

    fn advance(&mut self, elapsed: Duration) {
        self.drive.advance(elapsed);
    }

    fn power(&mut self, on: bool) {
        if !on {
            return self.drive.power(false);
        }
        self.bank.power_cycle();
        self.drive.set_settings(settings(&self.bank, self.protocol));
        self.drive.power(true);
    }

    /// The code is the number of the bit of W483, 0 to 15.
    fn trip(&mut self, code: u16) {
        self.drive.trip(code, Reaction::Freewheel, false);
    }

    fn set_load(&mut self, percent: u16) {
        self.drive.set_load(percent);
    }

    fn panel(&mut self, action: Panel) {
        self.drive.panel(action);
    }

    fn observe(&self) -> Observation {
        self.drive.observe(self.bank.eeprom_writes())
    }

    fn frame_seen(&mut self, _: Cast) {
        self.drive.frame_seen();
    }

    fn join(&mut self, _: u8, protocol: Protocol) {
        self.protocol = protocol;
        self.drive.set_settings(settings(&self.bank, protocol));
    }

    fn unite(&self) -> Option<UniTe> {
        Some(UNITE)
    }

    fn peek(&self, address: u16) -> Option<u16> {
        self.bank.peek(address).map(|kept| self.computed(address).unwrap_or(kept))
    }

    fn poke(&mut self, address: u16, value: u16) -> bool {
        let kept = self.computed(address).is_none() && self.bank.set(address, value);
        if kept {
            self.drive.set_settings(settings(&self.bank, self.protocol));
        }
        kept
    }
}

/// Ramps in tenths of a second (A for W252, p. 20/44), speeds in tenths of a hertz.
fn settings(bank: &Bank, protocol: Protocol) -> Settings {
    let ramp = |address| Ramp {
        full_scale: NOMINAL_FREQUENCY,
        time: Duration::from_millis(u64::from(bank.value(address)) * 100),
    };
    let deceleration = ramp(W253.address());
    let watch = match protocol {
        Protocol::Ascii => MESSAGE_WATCH_ASCII,
        Protocol::Rtu | Protocol::UniTelway => MESSAGE_WATCH,
    };
    Settings {
        starts_enabled: false,
        bus_commands: true,
        bus_reference: true,
        bits: CommandBits { stop: 0, injection: 0, fast_stop: 0, ..CommandBits::BASIC },
        ramps: Ramps { acceleration: ramp(ACC.address()), deceleration },
        fast_stop: Ramp { time: deceleration.time / 4, ..deceleration },
        stop: Stop::Ramp,
        injection_current: 0,
        injection_time: Duration::ZERO,
        low_speed: u32::from(bank.value(W251.address())) * 10,
        high_speed: u32::from(bank.value(W250.address())) * 10,
        link: LinkWatch { timeout: Some(watch), reaction: Reaction::Freewheel, code: LINK_FAULT },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    fn write(drive: &mut Atv58, address: u16, value: u16) {
        drive.write(address, value, Cast::Unicast).unwrap();
    }

    fn running() -> Atv58 {
        let mut drive = Atv58::new();
        // The manual's own sample, 6 to W400 and 500 to W401, and the chart's way on.
        for (address, value) in [(400, 6), (401, 500), (400, 7), (400, 15)] {
            write(&mut drive, address, value);
        }
        drive.advance(3 * SECOND);
        drive
    }

    #[test]
    fn shutdown_is_the_first_rung_and_the_reference_of_the_sample_is_fifty_hertz() {
        let mut drive = Atv58::new();
        assert_eq!(drive.read(458), Ok(0x0240));
        write(&mut drive, 400, 6);
        assert_eq!(drive.read(458), Ok(0x0221));
        drive = running();
        assert_eq!(drive.observe().output_frequency, 5_000);
        write(&mut drive, 400, 0x080F);
        drive.advance(6 * SECOND);
        assert_eq!(drive.observe().output_frequency, -5_000);
    }

    #[test]
    fn the_acceleration_of_the_sample_is_78_9_seconds() {
        let mut drive = Atv58::new();
        write(&mut drive, 252, 0x0315);
        for (address, value) in [(401, 500), (400, 6), (400, 15)] {
            write(&mut drive, address, value);
        }
        drive.advance(Duration::from_millis(78_899));
        assert_ne!(drive.observe().output_frequency, 5_000);
        drive.advance(Duration::from_millis(1));
        assert_eq!(drive.observe().output_frequency, 5_000);
    }

    #[test]
    fn a_trip_sets_its_bit_of_the_fault_register_until_it_is_reset() {
        let mut drive = running();
        drive.trip(2);
        assert_eq!((drive.read(483), drive.observe().trip), (Ok(0x0004), Some(2)));
        write(&mut drive, 400, 0x80);
        assert_eq!((drive.read(483), drive.observe().trip), (Ok(0), None));
    }

    #[test]
    fn ten_seconds_without_a_message_are_a_fault() {
        let mut drive = running();
        drive.frame_seen(Cast::Unicast);
        drive.advance(10 * SECOND - Duration::from_nanos(1));
        assert_eq!(drive.observe().trip, None);
        drive.advance(Duration::from_nanos(1));
        assert_eq!(drive.observe().trip, Some(LINK_FAULT));
    }

    #[test]
    fn in_ascii_one_second_without_a_message_is_a_fault() {
        let mut drive = Atv58::new();
        drive.join(1, Protocol::Ascii);
        drive.frame_seen(Cast::Unicast);
        drive.advance(SECOND - Duration::from_nanos(1));
        assert_eq!(drive.observe().trip, None);
        drive.advance(Duration::from_nanos(1));
        assert_eq!(drive.observe().trip, Some(LINK_FAULT));
    }

    #[test]
    fn what_the_drive_produces_is_not_written_and_what_it_does_not_have_is_not_read() {
        let mut drive = running();
        for address in [458, 463, 483] {
            assert_eq!(drive.write(address, 0, Cast::Unicast), Err(Exception::ILLEGAL_ADDRESS));
        }
        for address in [0, 249, 403, 461, 3201] {
            assert_eq!(drive.read(address), Err(Exception::ILLEGAL_ADDRESS));
        }
        for address in (250..=253).chain(463..=466) {
            assert!(drive.read(address).is_ok());
        }
    }
}
