//! What is kept of a drive as numbers: [`Quantity`], one row each, with its unit, its steps, and what is no change yet.

use std::{collections::BTreeSet, fmt};

use drive_core::{
    Capabilities, Control, Frequency, Measurements, Motion, Setpoint, State, Status,
    registers::{Form, Space, Unit},
};
use drive_fleet::Snapshot;
use drived_plant::plant::past::{IsView, PointView};

use crate::column::Point;

/// Which of a drive's two sets holds a quantity: each is read at its own times, and grows old at its own age.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Set {
    /// The fast one.
    Status,
    /// The slow one.
    Measurements,
}

impl Set {
    pub const ALL: [Self; 2] = [Self::Status, Self::Measurements];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Status => "status",
            Self::Measurements => "measurements",
        }
    }
}

/// A quantity by its number, which is the same in every file: those of the [table](TABLE), and one for each word that a drive sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Quantity(pub u32);

/// The number of the first quantity of the slow set.
const MEASURED: u32 = 10;
/// The first number of a word; the word's address is added to it.
const WORDS: u32 = 0x1_0000;
/// Likewise of a word that is a number by the manual, such as a measured current: it moves all the time.
const NUMBERS: u32 = 0x2_0000;

/// How a quantity is counted.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// As the API names it, with its unit.
    pub name: &'static str,
    /// Counts of one unit.
    pub per: i64,
    /// A value that has moved by no more counts than this since it was kept is not kept again.
    pub deadband: i64,
    /// The words of its counts, where it is no number.
    pub words: &'static [&'static str],
}

const fn row(name: &'static str, per: i64, deadband: i64) -> Row {
    Row { name, per, deadband, words: &[] }
}

const fn words(name: &'static str, words: &'static [&'static str]) -> Row {
    Row { name, per: 1, deadband: 0, words }
}

/// The quantities, each by its place. **A place is written in files: new ones come at the end.**
pub const TABLE: &[Row] = &[
    words("state", STATES),
    row("output_frequency_hz", 100, 5),
    row("setpoint_hz", 100, 0),
    row("current_a", 10, 0),
    row("current_percent", 100, 50),
    row("reference_hz", 100, 5),
    words("control", CONTROLS),
    words("motion", MOTIONS),
    words("warning", FLAGS),
    row("fault_code", 1, 0),
    row("speed_rpm", 1, 2),
    row("output_voltage_v", 10, 10),
    row("output_voltage_percent", 100, 50),
    row("line_voltage_v", 10, 10),
    row("dc_bus_voltage_v", 10, 10),
    row("dc_bus_voltage_percent", 100, 50),
    row("torque_percent", 100, 50),
    row("power_percent", 100, 50),
    row("input_power_kw", 100, 2),
    row("output_power_kw", 100, 2),
    row("drive_thermal_percent", 100, 50),
    row("motor_thermal_percent", 100, 50),
    row("drive_load_percent", 100, 50),
    row("motor_load_percent", 100, 50),
    row("input_energy_counts", 1, 0),
    row("output_energy_counts", 1, 0),
    row("running_time_h", 3_600, 360),
    row("powered_time_h", 3_600, 360),
    row("inputs", 1, 0),
    row("outputs", 1, 0),
];

const STATES: &[&str] = &[
    "not ready",
    "disabled",
    "ready",
    "running",
    "stopping",
    "quick stop",
    "fault reaction",
    "fault",
    "unknown",
];
const CONTROLS: &[&str] = &["bus", "terminals", "panel", "local", "other bus"];
const MOTIONS: &[&str] =
    &["driven", "braking", "held by injection", "output off, the shaft may coast", "at rest", "not known"];
const FLAGS: &[&str] = &["no", "yes"];

const fn state(state: State) -> i64 {
    match state {
        State::NotReady => 0,
        State::Disabled => 1,
        State::Ready => 2,
        State::Running => 3,
        State::Stopping => 4,
        State::QuickStop => 5,
        State::FaultReaction => 6,
        State::Fault => 7,
        State::Unknown => 8,
    }
}

const fn control(control: Control) -> i64 {
    match control {
        Control::Bus => 0,
        Control::Terminals => 1,
        Control::Panel => 2,
        Control::Local => 3,
        Control::OtherBus => 4,
    }
}

const fn motion(motion: Motion) -> i64 {
    match motion {
        Motion::Driven => 0,
        Motion::Braking => 1,
        Motion::Held => 2,
        Motion::Coasting => 3,
        Motion::AtRest => 4,
        _ => 5,
    }
}

impl Quantity {
    pub const STATE: Self = Self(0);
    pub const OUTPUT_FREQUENCY: Self = Self(1);
    pub const SETPOINT: Self = Self(2);
    pub const CURRENT: Self = Self(3);
    pub const CONTROL: Self = Self(6);
    pub const WARNING: Self = Self(8);
    pub const FAULT_CODE: Self = Self(9);
    pub const DC_BUS_VOLTAGE: Self = Self(14);
    pub const TORQUE: Self = Self(16);
    pub const INPUT_POWER: Self = Self(18);
    pub const OUTPUT_POWER: Self = Self(19);
    pub const DRIVE_THERMAL: Self = Self(20);
    pub const MOTOR_THERMAL: Self = Self(21);
    pub const INPUT_ENERGY: Self = Self(24);
    pub const OUTPUT_ENERGY: Self = Self(25);
    pub const RUNNING_TIME: Self = Self(26);
    pub const INPUTS: Self = Self(28);

    /// The count of the state in which a motor runs.
    pub const RUNNING: i64 = state(State::Running);

    /// The word at an address.
    #[must_use]
    pub const fn word(address: u16) -> Self {
        Self(WORDS + address as u32)
    }

    /// The word at an address that is a number by the manual.
    #[must_use]
    pub const fn number(address: u16) -> Self {
        Self(NUMBERS + address as u32)
    }

    /// Whether it is kept at each of its changes for as long as the records are: state, words of bits, inputs.
    #[must_use]
    pub fn is_kept_by_changes(self) -> bool {
        !self.is_number() && self.0 < NUMBERS
    }

    /// How it is counted; `None`: it is a word.
    #[must_use]
    pub fn row(self) -> Option<&'static Row> {
        TABLE.get(usize::try_from(self.0).ok()?)
    }

    /// The quantity of a name, as [`Display`](fmt::Display) gives it.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        if let Some(address) = name.strip_prefix("word_") {
            return address.parse().ok().map(Self::word);
        }
        if let Some(address) = name.strip_prefix("number_") {
            return address.parse().ok().map(Self::number);
        }
        let place = TABLE.iter().position(|row| row.name == name)?;
        u32::try_from(place).ok().map(Self)
    }

    /// How far it may move before it is kept again.
    #[must_use]
    pub fn deadband(self) -> i64 {
        self.row().map_or(0, |row| row.deadband)
    }

    /// Counts of one unit.
    #[must_use]
    pub fn per(self) -> i64 {
        self.row().map_or(1, |row| row.per)
    }

    /// A count in the quantity's unit.
    #[must_use]
    pub fn value(self, count: f64) -> f64 {
        count / self.per() as f64
    }

    /// A count as a person reads it.
    #[must_use]
    pub fn text(self, count: i64) -> String {
        let Some(row) = self.row() else { return format!("{count:04X}h") };
        if let Some(word) = usize::try_from(count).ok().and_then(|place| row.words.get(place)) {
            return (*word).to_owned();
        }
        let places = match row.per {
            1 => 0,
            10 => 1,
            100 => 2,
            _ => 3,
        };
        format!("{:.places$}", self.value(count as f64))
    }

    /// A point as the API tells it.
    #[must_use]
    pub fn point(self, point: Point) -> PointView {
        let is = |count: i64| match self.is_number() {
            true => IsView::Number(self.value(count as f64)),
            false => IsView::Word(self.text(count)),
        };
        PointView { time_unix_ms: point.at, is: point.count.map(is) }
    }

    /// Whether its counts stand for words or bits, so that a mean of them means nothing.
    #[must_use]
    pub fn is_number(self) -> bool {
        self.row().is_some_and(|row| {
            row.words.is_empty() && !matches!(row.name, "fault_code" | "inputs" | "outputs")
        })
    }
}

impl Quantity {
    /// Whether it is one of the slow set, which is read more rarely than the state.
    #[must_use]
    pub const fn is_measured(self) -> bool {
        self.0 >= MEASURED && self.0 < MEASURED + 20
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.row() {
            Some(row) => f.pad(row.name),
            None if self.0 >= NUMBERS => write!(f, "number_{}", self.0 - NUMBERS),
            None => write!(f, "word_{}", self.0.saturating_sub(WORDS)),
        }
    }
}

/// The addresses of a family's registers that are numbers.
#[must_use]
pub fn numbers(capabilities: &Capabilities) -> BTreeSet<u16> {
    let is_number = |row: &&drive_core::Row| {
        row.space == Space::HoldingRegister
            && matches!(row.unit.form, Form::Number | Form::SignNotPrinted)
            && row.unit != Unit::COUNT
            && row.range.choices().is_empty()
    };
    capabilities.rows.iter().filter(is_number).map(|row| row.address).collect()
}

/// What a status shows, with the setpoint that the fleet knows beside it; `numbers` says which of its words
/// are numbers.
#[must_use]
pub fn of_status(status: &Status, snapshot: &Snapshot, numbers: &BTreeSet<u16>) -> Vec<(Quantity, i64)> {
    let hertz = |frequency: Frequency| i64::from(frequency.centihertz());
    let setpoint = match snapshot.setpoint {
        Some(Setpoint::Frequency(frequency)) => Some(hertz(frequency)),
        _ => None,
    };
    let known = [
        Some(state(status.state)),
        status.output_frequency.map(hertz),
        setpoint,
        status.current.map(|current| i64::from(current.deciamperes())),
        status.current_share.map(|share| i64::from(share.hundredths())),
        status.reference.map(hertz),
        status.control.map(control),
        Some(motion(status.motion)),
        status.warning.map(i64::from),
        status.fault_code.map(i64::from),
    ];
    let words = status.raw.iter().map(|word| match numbers.contains(&word.address) {
        true => (Quantity::number(word.address), i64::from(word.value)),
        false => (Quantity::word(word.address), i64::from(word.value)),
    });
    numbered(0, known).chain(words).collect()
}

/// What the slow set shows.
#[must_use]
pub fn of_measurements(measured: &Measurements) -> Vec<(Quantity, i64)> {
    let percent = |share: drive_core::Percent| i64::from(share.hundredths());
    let volts = |voltage: drive_core::Voltage| i64::from(voltage.decivolts());
    let power = |power: drive_core::Power| i64::from(power.decawatts());
    let seconds = |time: std::time::Duration| i64::try_from(time.as_secs()).unwrap_or(i64::MAX);
    let known = [
        measured.speed.map(|speed| i64::from(speed.rpm())),
        measured.output_voltage.map(volts),
        measured.output_voltage_share.map(percent),
        measured.line_voltage.map(volts),
        measured.dc_bus_voltage.map(volts),
        measured.dc_bus_voltage_share.map(percent),
        measured.torque.map(percent),
        measured.power_share.map(percent),
        measured.input_power.map(power),
        measured.output_power.map(power),
        measured.drive_thermal.map(percent),
        measured.motor_thermal.map(percent),
        measured.drive_load.map(percent),
        measured.motor_load.map(percent),
        measured.input_energy.map(i64::from),
        measured.output_energy.map(i64::from),
        measured.running_time.map(seconds),
        measured.powered_time.map(seconds),
        measured.inputs.map(i64::from),
        measured.outputs.map(i64::from),
    ];
    numbered(MEASURED, known).collect()
}

/// Those that are known, with their numbers from the first on.
fn numbered<const N: usize>(first: u32, known: [Option<i64>; N]) -> impl Iterator<Item = (Quantity, i64)> {
    (first..).zip(known).filter_map(|(number, count)| Some((Quantity(number), count?)))
}

#[cfg(test)]
mod tests {
    use std::str::FromStr as _;

    use super::*;

    #[test]
    fn the_words_of_the_file_are_those_that_the_fleet_says() {
        for (place, name) in (0..).zip(STATES) {
            assert_eq!(state(State::from_str(name).unwrap()), place, "{name}");
        }
        for (place, name) in (0..).zip(CONTROLS) {
            assert_eq!(control(Control::from_str(name).unwrap()), place, "{name}");
        }
        for (place, name) in (0..).zip(MOTIONS) {
            assert_eq!(motion(Motion::from_str(name).unwrap()), place, "{name}");
        }
    }

    #[test]
    fn every_quantity_is_found_by_its_name() {
        for number in 0..u32::try_from(TABLE.len()).unwrap() {
            let quantity = Quantity(number);
            assert_eq!(Quantity::named(&quantity.to_string()), Some(quantity));
        }
        assert_eq!(Quantity::named("word_3201"), Some(Quantity::word(3_201)));
        assert_eq!(Quantity::named("number_8604"), Some(Quantity::number(8_604)));
        assert_eq!(Quantity::number(8_604).to_string(), "number_8604");
        assert!(Quantity::STATE.is_kept_by_changes() && Quantity::word(3_201).is_kept_by_changes());
        assert!(!Quantity::number(8_604).is_kept_by_changes() && !Quantity::CURRENT.is_kept_by_changes());
        assert_eq!(Quantity::named("speed"), None);
        for (quantity, name) in [
            (Quantity::STATE, "state"),
            (Quantity::OUTPUT_FREQUENCY, "output_frequency_hz"),
            (Quantity::SETPOINT, "setpoint_hz"),
            (Quantity::CURRENT, "current_a"),
            (Quantity::FAULT_CODE, "fault_code"),
            (Quantity::DC_BUS_VOLTAGE, "dc_bus_voltage_v"),
            (Quantity::TORQUE, "torque_percent"),
            (Quantity::MOTOR_THERMAL, "motor_thermal_percent"),
            (Quantity::WARNING, "warning"),
            (Quantity::INPUT_POWER, "input_power_kw"),
            (Quantity::OUTPUT_POWER, "output_power_kw"),
            (Quantity::DRIVE_THERMAL, "drive_thermal_percent"),
            (Quantity::INPUT_ENERGY, "input_energy_counts"),
            (Quantity::OUTPUT_ENERGY, "output_energy_counts"),
            (Quantity::RUNNING_TIME, "running_time_h"),
            (Quantity::INPUTS, "inputs"),
        ] {
            assert_eq!(quantity.to_string(), name);
        }
    }

    #[test]
    fn a_count_is_told_in_its_unit() {
        assert_eq!(Quantity::OUTPUT_FREQUENCY.text(2_995), "29.95");
        assert_eq!(Quantity::STATE.text(7), "fault");
        assert_eq!(Quantity::STATE.text(99), "99");
        assert_eq!(Quantity::word(3_201).text(0x0237), "0237h");
    }
}
