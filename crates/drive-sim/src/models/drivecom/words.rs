//! The words of a DRIVECOM drive: what the control word asks, and what the status words say.

use super::{ChartState, Commander, Drivecom, Stop, orders::Order};

/// Bit 7 of the control word: resets a fault when it rises.
pub(super) const FAULT_RESET: u16 = 0x0080;
const SWITCH_ON: u16 = 0x0001;
/// Active at 0.
const DISABLE_VOLTAGE: u16 = 0x0002;
/// Active at 0.
const QUICK_STOP: u16 = 0x0004;
const ENABLE_OPERATION: u16 = 0x0008;

/// Motor thermal state from which the drive warns, in percent.
const THERMAL_ALARM: u16 = 100;

/// The state after a control word (BBV51701 p. 12). Faults are not left this way.
pub(super) const fn next(state: ChartState, word: u16) -> ChartState {
    use ChartState::{OperationEnabled, QuickStopActive, ReadyToSwitchOn, SwitchOnDisabled, SwitchedOn};
    let voltage = word & DISABLE_VOLTAGE != 0;
    let no_quick_stop = word & QUICK_STOP != 0;
    let switch_on = word & SWITCH_ON != 0;
    let enable = word & ENABLE_OPERATION != 0;
    match (state, voltage, no_quick_stop, switch_on, enable) {
        (ReadyToSwitchOn | SwitchedOn | OperationEnabled | QuickStopActive, false, ..) => SwitchOnDisabled,
        (ReadyToSwitchOn | SwitchedOn, true, false, ..) => SwitchOnDisabled,
        (OperationEnabled, true, false, ..) => QuickStopActive,
        (SwitchOnDisabled | SwitchedOn | OperationEnabled, true, true, false, _) => ReadyToSwitchOn,
        (ReadyToSwitchOn | OperationEnabled, true, true, true, false) => SwitchedOn,
        (ReadyToSwitchOn | SwitchedOn, true, true, true, true) => OperationEnabled,
        _ => state,
    }
}

impl Drivecom {
    /// The status word ETA (BBV51701 p. 21).
    #[must_use]
    pub fn eta(&self) -> u16 {
        let state = match self.state {
            ChartState::SwitchOnDisabled => 0x0040,
            ChartState::ReadyToSwitchOn => 0x0021,
            ChartState::SwitchedOn => 0x0023,
            ChartState::OperationEnabled => 0x0027,
            ChartState::QuickStopActive => 0x0007,
            ChartState::FaultReactionActive => 0x000F,
            ChartState::Fault => 0x0008,
        };
        let asked = self.situation.bus_reference.unsigned_abs();
        let exceeded = asked > self.settings.high_speed || asked < self.settings.low_speed;
        // 0627h is also what a drive at rest after a normal stop shows (BBV51701 p. 21).
        let steers = self.motor.is_fed() && !self.motor.is_braking();
        let reached = self.motor.is_at_target() || (self.state == ChartState::OperationEnabled && !steers);
        state
            | bit(7, self.thermal_alarm())
            | bit(9, !self.situation.forced_local)
            | bit(10, reached)
            | bit(11, exceeded)
            | bit(14, self.stopped_by_key)
            | bit(15, self.motor.output_frequency() < 0)
    }

    /// The extended status word ETI (BBV51701 p. 22), but for bit 0 and 1, which belong to the family's memory.
    #[must_use]
    pub fn eti(&self) -> u16 {
        let fast = matches!(self.order, Order::Stop(Stop::Fast)) && self.motor.is_stopping();
        let commander = self.situation.commander;
        let injects = self.motor.is_braking();
        let runs = self.motor.is_fed() && !(injects && self.readings.injection_is_not_running);
        let transient = self.motor.is_accelerating() || self.motor.is_decelerating();
        bit(2, self.is_resettable())
            | bit(4, runs)
            | bit(5, injects)
            | bit(6, transient)
            | bit(7, self.thermal_alarm())
            | bit(9, self.motor.is_accelerating())
            | bit(10, self.motor.is_decelerating())
            | bit(12, fast)
            | bit(13, matches!(commander, Commander::RemoteTerminal | Commander::CanOpen))
            | bit(14, matches!(commander, Commander::Bus | Commander::CanOpen))
            | bit(15, self.target() < 0)
    }

    /// The state at a trip, as EP1–EP4 keep it (BBV51701 p. 25).
    pub(super) fn fault_status(&self) -> u16 {
        let (eta, eti) = (self.eta(), self.eti());
        let of_eta = |from: u32, to: u32| bit(to, eta & bit(from, true) != 0);
        of_eta(1, 0)
            | of_eta(5, 1)
            | of_eta(6, 2)
            | of_eta(15, 4)
            | bit(5, eti & bit(4, true) != 0)
            | bit(6, eti & bit(5, true) != 0)
            | (eti & 0xEE80)
    }

    fn thermal_alarm(&self) -> bool {
        self.motor.thermal_state() >= THERMAL_ALARM
    }
}

fn bit(number: u32, set: bool) -> u16 {
    u16::from(set) << number
}
