//! The words of the Altivar 21, bit by bit as its manual lists them. Unknown and reserved bits are kept.

use bitflags::bitflags;
use drive_core::{Control, Direction};

bitflags! {
    /// The command word FA00 (Altivar 21 Modbus §8.4, p. 31).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct CommandWord: u16 {
        /// Preset speed, the first of three bits: see [`preset_speed`](Self::preset_speed).
        const PRESET_SPEED_1 = 1 << 0;
        /// Preset speed, the second bit.
        const PRESET_SPEED_2 = 1 << 1;
        /// Preset speed, the third bit.
        const PRESET_SPEED_3 = 1 << 2;
        /// Motor 2 (THR2: PT = 0, F170, F172, F173) instead of motor 1.
        const MOTOR_2 = 1 << 4;
        /// The PID control is off.
        const PID_OFF = 1 << 5;
        /// Ramp 2 (F500, F501) instead of ramp 1 (ACC, DEC).
        const RAMP_2 = 1 << 6;
        /// Forced DC braking, for as long as the bit is set.
        const DC_BRAKING = 1 << 7;
        /// Reverse instead of forward.
        const REVERSE = 1 << 9;
        /// Run.
        const RUN = 1 << 10;
        /// Freewheel stop.
        const FREEWHEEL = 1 << 11;
        /// Emergency stop: the drive trips with fault E. An edge.
        const EMERGENCY_STOP = 1 << 12;
        /// Fault reset. An edge.
        const FAULT_RESET = 1 << 13;
        /// Reference priority: the reference of the bus counts, whatever FMOD says.
        const REFERENCE_PRIORITY = 1 << 14;
        /// Command priority: the commands of the bus count, whatever CMOD says.
        const COMMAND_PRIORITY = 1 << 15;
    }
}

impl CommandWord {
    /// Both priorities: the bus commands the drive, whatever CMOD and FMOD say.
    pub const PRIORITIES: Self = Self::REFERENCE_PRIORITY.union(Self::COMMAND_PRIORITY);
    /// What is chosen, not ordered: preset speed, motor, PID control, ramp. It belongs to a run command and moves
    /// nothing by itself.
    pub const SELECTIONS: Self =
        Self::PRESET_SPEEDS.union(Self::MOTOR_2).union(Self::PID_OFF).union(Self::RAMP_2);
    /// What a stop leaves as the drive holds it: motor, PID control, ramp, and who commands.
    pub(crate) const KEPT: Self =
        Self::MOTOR_2.union(Self::PID_OFF).union(Self::RAMP_2).union(Self::PRIORITIES);
    /// What acts once, when it is set.
    pub(crate) const EDGES: Self = Self::EMERGENCY_STOP.union(Self::FAULT_RESET);
    const PRESET_SPEEDS: Self = Self::PRESET_SPEED_1.union(Self::PRESET_SPEED_2).union(Self::PRESET_SPEED_3);

    /// A run command in this direction.
    #[must_use]
    pub const fn run(direction: Direction) -> Self {
        match direction {
            Direction::Forward => Self::RUN,
            Direction::Reverse => Self::RUN.union(Self::REVERSE),
        }
    }

    /// The number of the preset speed that is chosen, 1 to 7; 0 for none. A preset speed overrides every reference.
    #[must_use]
    pub const fn preset_speed(self) -> u16 {
        self.bits() & Self::PRESET_SPEEDS.bits()
    }
}

bitflags! {
    /// The command word FA20 (Altivar 21 Modbus §8.4, p. 32). Bits 2 to 11 and 13 to 15 must stay 0.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct CommandWord2: u16 {
        /// Sets the energy counters FE76 and FE77 to zero. Works without the command priority; to be cleared
        /// afterwards.
        const ENERGY_RESET = 1 << 1;
        /// Overcurrent stall level 2 (F185) instead of 1 (F601). Works only with the command priority.
        const STALL_LEVEL_2 = 1 << 12;
    }
}

bitflags! {
    /// The status word FD01, and FE01 as it was before the last trip (Altivar 21 Modbus §8.6, p. 34).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct StatusWord: u16 {
        /// The fault relay FL is on.
        const FAULT_RELAY = 1 << 0;
        /// The drive has tripped. The bit is set while it retries and while it retains a trip, too.
        const TRIPPED = 1 << 1;
        /// An alarm is present.
        const ALARM = 1 << 2;
        /// MOFF: undervoltage alarm of the main circuit.
        const UNDERVOLTAGE = 1 << 3;
        /// Motor 2 is selected.
        const MOTOR_2 = 1 << 4;
        /// PID control is forbidden.
        const PID_OFF = 1 << 5;
        /// Ramp 2 is selected.
        const RAMP_2 = 1 << 6;
        /// DC braking is forced.
        const DC_BRAKING = 1 << 7;
        /// Reverse.
        const REVERSE = 1 << 9;
        /// Run.
        const RUN = 1 << 10;
        /// Freewheel stop (ST = off).
        const FREEWHEEL = 1 << 11;
        /// State of emergency stop.
        const EMERGENCY_STOP = 1 << 12;
        /// On standby, with ST and RUN on as well.
        const STANDBY_RUN = 1 << 13;
        /// On standby: initialised, and stopped by no trip and no alarm.
        const STANDBY = 1 << 14;
        /// Local: the keypad has taken control by its LOC/REM key.
        const LOCAL = 1 << 15;
    }
}

impl StatusWord {
    /// The direction that the word tells.
    #[must_use]
    pub const fn direction(self) -> Direction {
        if self.contains(Self::REVERSE) { Direction::Reverse } else { Direction::Forward }
    }
}

bitflags! {
    /// The status word FD42, and FE42 as it was before the last trip (Altivar 21 Modbus §8.6, p. 34).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct StatusWord2: u16 {
        /// The energy counters FE76 and FE77 are being reset; otherwise they count.
        const ENERGY_RESET = 1 << 1;
        /// Ramp 2 is selected.
        const RAMP_2 = 1 << 8;
        /// Overcurrent stall level 2 (F185) is selected; otherwise level 1 (F601).
        const STALL_LEVEL_2 = 1 << 12;
    }
}

bitflags! {
    /// The status word FD49, and FE49 as it was before the last trip (Altivar 21 Modbus §8.6, p. 34).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct StatusWord3: u16 {
        /// The output RY is held.
        const RY_HELD = 1 << 0;
        /// RCH (F102).
        const RCH = 1 << 12;
        /// RCHF (F101, F102).
        const RCHF = 1 << 13;
    }
}

bitflags! {
    /// The alarms FC91 (Altivar 21 Modbus §8.7, p. 36).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct Alarms: u16 {
        /// Overcurrent; the keypad blinks C.
        const OVERCURRENT = 1 << 0;
        /// Overload of the drive; the keypad blinks L.
        const DRIVE_OVERLOAD = 1 << 1;
        /// Overload of the motor; the keypad blinks L.
        const MOTOR_OVERLOAD = 1 << 2;
        /// Overheat; the keypad blinks H.
        const OVERHEAT = 1 << 3;
        /// Overvoltage; the keypad blinks P.
        const OVERVOLTAGE = 1 << 4;
        /// Undervoltage of the main circuit.
        const UNDERVOLTAGE = 1 << 5;
        /// Undercurrent.
        const UNDERCURRENT = 1 << 7;
        /// Overtorque.
        const OVERTORQUE = 1 << 8;
        /// Cumulative hours of operation.
        const OPERATING_HOURS = 1 << 10;
        /// Undervoltage of the main circuit, as the relay MS shows it; the keypad blinks MOFF.
        const UNDERVOLTAGE_RELAY = 1 << 13;
        /// Forced deceleration and stop because the supply went away.
        const POWER_LOSS_STOP = 1 << 14;
        /// Automatic stop because the frequency fell to the lower limit again and again.
        const LOWER_LIMIT_STOP = 1 << 15;
    }
}

bitflags! {
    /// The maintenance alarms FE79 (Altivar 21 Modbus §8.7, p. 36).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct MaintenanceAlarms: u16 {
        /// The life of the fan is over.
        const FAN = 1 << 0;
        /// The life of the circuit board is over.
        const CIRCUIT_BOARD = 1 << 1;
        /// The life of the main capacitors is over.
        const MAIN_CAPACITOR = 1 << 2;
        /// The alarm that the user has set up.
        const USER = 1 << 3;
    }
}

bitflags! {
    /// The logic inputs FD06, and FE06 as they were before the last trip (Altivar 21 Modbus §8.8, p. 38).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct LogicInputs: u16 {
        /// F (F111).
        const F = 1 << 0;
        /// R (F112).
        const R = 1 << 1;
        /// RES (F113).
        const RES = 1 << 2;
        /// VIA (F118), only where F109 makes it a logic input.
        const VIA = 1 << 7;
    }
}

bitflags! {
    /// The logic outputs FD07, and FE07 as they were before the last trip (Altivar 21 Modbus §8.8, p. 38).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub struct LogicOutputs: u16 {
        /// RY (F130).
        const RY = 1 << 0;
        /// FL (F132).
        const FL = 1 << 2;
    }
}

/// Where commands come from now: FE45 (Altivar 21 Modbus §8.6, p. 35).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CommandSource {
    /// The terminals.
    Terminals,
    /// The keypad.
    Keypad,
    /// The serial link.
    Serial,
    /// A number that the manual does not list.
    Unknown(u16),
}

impl From<u16> for CommandSource {
    fn from(word: u16) -> Self {
        match word {
            0 => Self::Terminals,
            1 => Self::Keypad,
            2 => Self::Serial,
            other => Self::Unknown(other),
        }
    }
}

impl CommandSource {
    /// The same in terms that all families share; `None` for an unknown number.
    #[must_use]
    pub const fn control(self) -> Option<Control> {
        match self {
            Self::Terminals => Some(Control::Terminals),
            Self::Keypad => Some(Control::Panel),
            Self::Serial => Some(Control::Bus),
            Self::Unknown(_) => None,
        }
    }
}

/// Where the reference comes from now: FE46 (Altivar 21 Modbus §8.6, p. 35).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ReferenceSource {
    /// The analog input VIA.
    Via,
    /// The analog input VIB.
    Vib,
    /// The keypad.
    Keypad,
    /// The serial link.
    Serial,
    /// The up and down inputs.
    UpDown,
    /// A preset speed, which overrides every reference.
    PresetSpeed,
    /// A number that the manual does not list.
    Unknown(u16),
}

impl From<u16> for ReferenceSource {
    fn from(word: u16) -> Self {
        match word {
            1 => Self::Via,
            2 => Self::Vib,
            3 => Self::Keypad,
            4 => Self::Serial,
            5 => Self::UpDown,
            255 => Self::PresetSpeed,
            other => Self::Unknown(other),
        }
    }
}
