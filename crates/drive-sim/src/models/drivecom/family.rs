//! What the Altivar 28 and 58 do alike as models: fixed inputs, one step from a write to what it does.

use std::time::Duration;

use super::{
    Around, Commander, Drivecom, Reaction, Readings, Run, RunInputs, Settings, Situation, StopInputs,
    Terminals, Wiring,
};
use crate::{
    Bank, Cast, Exception, Model, Nameplate, Observation, Panel, Protocol, Rules, UniTe,
    world::{Act, Surroundings, Switch},
};

/// How two wires give a run command; the parameter is not on the bus of these drives.
pub(in crate::models) const TWO_WIRES: Switch = Switch {
    name: "2-wire",
    readings: &["transition", "level"],
    question: "LI1 and LI2 run at their edge, or by their level, so that a run command that stands runs again after a stop, \
               a reset or a loss of supply (BBV51701 p. 33, of the twin)",
};

/// Registers, chart and what is around them.
#[derive(Debug, Clone)]
pub(in crate::models) struct Unit {
    pub(in crate::models) bank: Bank,
    pub(in crate::models) drive: Drivecom,
    pub(in crate::models) around: Around,
    terminals: Terminals,
    /// Whether a run command of the terminals counts by its level ([`TWO_WIRES`]).
    pub(in crate::models) by_level: bool,
    /// What the bus has written as its reference, in hundredths of a hertz.
    pub(in crate::models) bus_reference: i32,
}

impl Unit {
    /// A unit of this size; the family then [refreshes](Family::refresh) it.
    pub(in crate::models) fn new(bank: Bank, nominal_current: u16, settings: Settings) -> Self {
        let plate = Nameplate::light(u32::from(nominal_current));
        Self {
            bank,
            drive: Drivecom::new(plate, settings, Situation::default()),
            around: Around::default(),
            terminals: Terminals::default(),
            by_level: false,
            bus_reference: 0,
        }
    }

    pub(in crate::models) const fn readings(&self) -> &Readings {
        self.drive.readings()
    }

    /// The reference of AI1, from low to high speed.
    pub(in crate::models) fn analog_reference(&self) -> i32 {
        let settings = self.drive.settings();
        let [low, high] = [settings.low_speed, settings.high_speed].map(u32::cast_signed);
        low + self.around.analog(1) * (high - low) / 10_000
    }

    /// LI1 runs forward and LI2 in reverse; with three wires LI1 stops, LI2 and LI3 run (BBV51701 p. 15, 33).
    fn wiring(&self, three_wires: bool) -> (Wiring, RunInputs) {
        let [first, second, third] = [1, 2, 3].map(|number| self.around.is_on(number));
        match (three_wires, self.by_level) {
            (true, _) => (Wiring::ThreeWire, RunInputs { forward: second, reverse: third, stop: first }),
            (_, true) => (Wiring::Level, RunInputs { forward: first, reverse: second, stop: true }),
            (_, false) => (Wiring::Transition, RunInputs { forward: first, reverse: second, stop: true }),
        }
    }
}

/// A family whose model is a [`Unit`] and these answers.
pub(in crate::models) trait Family: Send {
    /// Functions and limits.
    const RULES: Rules;
    /// What there is around the drive.
    const SURROUNDINGS: &'static Surroundings;
    /// The code of a loss of the power stage's supply; `None`: the drive is locked without a fault.
    const SUPPLY_FAULT: Option<u16>;

    fn unit(&self) -> &Unit;
    fn unit_mut(&mut self) -> &mut Unit;
    /// A register that the drive computes; `None` for one that is kept.
    fn computed(&self, address: u16) -> Option<u16>;
    /// What a write does beyond being kept.
    fn act(&mut self, address: u16, value: u16);
    /// The parameters in force.
    fn settings(&self) -> Settings;
    /// Who gives the run command, and whether by the keys.
    fn commander(&self) -> (Commander, bool);
    /// The reference in force, before the limits.
    fn reference(&self) -> i32;
    /// A switch of the family's own is put on a reading.
    fn choose(&mut self, name: &str, reading: &str);

    fn three_wires(&self) -> bool {
        false
    }
    /// The RUN key turns in reverse.
    fn key_reverses(&self) -> bool {
        false
    }
    fn powered_up(&mut self) {}
    /// The terminals have given a new run command.
    fn run_by_terminals(&mut self) {}
    fn joined(&mut self, _: Protocol) {}
    fn unite_words(&self) -> Option<UniTe> {
        None
    }

    /// Something has changed that acts on chart and motor: a register, an input, a key, a supply.
    fn refresh(&mut self) {
        let (settings, situation) = self.asked();
        let unit = self.unit_mut();
        unit.drive.set_settings(settings);
        unit.drive.situate(situation);
        if let Some(fault) = Self::SUPPLY_FAULT {
            match (unit.around.motor_supply, unit.drive.present_fault()) {
                (false, None) => unit.drive.trip(fault, Reaction::Freewheel, true),
                (true, Some(present)) if present == fault => unit.drive.cause_gone(),
                _ => {}
            }
        }
    }

    /// What is asked of the drive now.
    fn asked(&mut self) -> (Settings, Situation) {
        let three_wires = self.three_wires();
        let unit = self.unit_mut();
        let (wiring, inputs) = unit.wiring(three_wires);
        let before = unit.terminals.run();
        let terminals = unit.terminals.see(wiring, inputs);
        if terminals.is_some() && terminals != before {
            self.run_by_terminals();
        }
        let (commander, by_keys) = self.commander();
        let key = if self.key_reverses() { Run::Reverse } else { Run::Forward };
        let around = &self.unit().around;
        let unsupplied = !around.motor_supply && Self::SUPPLY_FAULT.is_none();
        let situation = Situation {
            commander,
            forced_local: around.forced_local,
            run: match commander {
                Commander::Bus => None,
                _ if by_keys => around.key_run.then_some(key),
                _ => terminals,
            },
            stops: StopInputs { lock: unsupplied || three_wires && !inputs.stop, ..StopInputs::default() },
            reference: self.reference(),
            bus_reference: self.unit().bus_reference,
        };
        (self.settings(), situation)
    }
}

impl<F: Family> Model for F {
    fn rules(&self) -> &Rules {
        &F::RULES
    }

    fn read(&mut self, address: u16) -> Result<u16, Exception> {
        let kept = self.unit().bank.read(address)?;
        Ok(self.computed(address).unwrap_or(kept))
    }

    fn check_word(&self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        Ok(self.unit().bank.check(address, value, !self.unit().drive.motor().is_fed())?)
    }

    fn write(&mut self, address: u16, value: u16, _: Cast) -> Result<(), Exception> {
        let unit = self.unit_mut();
        unit.bank.write(address, value, !unit.drive.motor().is_fed())?;
        self.act(address, value);
        Ok(())
    }

    fn advance(&mut self, elapsed: Duration) {
        self.unit_mut().drive.advance(elapsed);
    }

    fn power(&mut self, on: bool) {
        let three_wires = self.three_wires();
        let unit = self.unit_mut();
        if !on {
            return unit.drive.power_off();
        }
        unit.bank.power_cycle();
        unit.around.power_up();
        unit.bus_reference = 0;
        let (_, inputs) = unit.wiring(three_wires);
        unit.terminals.power_up(inputs);
        self.powered_up();
        let (settings, situation) = self.asked();
        self.unit_mut().drive.power_up(settings, situation);
        self.refresh();
    }

    fn trip(&mut self, code: u16) {
        self.unit_mut().drive.trip(code, Reaction::Freewheel, false);
    }

    fn set_load(&mut self, percent: u16) {
        self.unit_mut().drive.set_load(percent);
    }

    fn panel(&mut self, action: Panel) {
        let (_, by_keys) = self.commander();
        let unit = self.unit_mut();
        match action {
            Panel::Run if !by_keys => return,
            Panel::Reset => {
                unit.drive.reset();
            }
            Panel::Stop if !by_keys => unit.drive.stop_key(),
            _ => {}
        }
        unit.around.panel(action);
        self.refresh();
    }

    fn surroundings(&self) -> &'static Surroundings {
        F::SURROUNDINGS
    }

    fn world(&mut self, act: Act) {
        let unit = self.unit_mut();
        match act {
            Act::Reading(name, reading) if name == TWO_WIRES.name => {
                unit.by_level = TWO_WIRES.readings.get(1) == Some(&reading);
            }
            Act::Reading(name, reading) => {
                let mut readings = *unit.readings();
                if readings.choose(name, reading) {
                    unit.drive.set_readings(readings);
                } else {
                    self.choose(name, reading);
                }
            }
            _ => unit.around.act(act),
        }
        self.refresh();
    }

    fn observe(&self) -> Observation {
        self.unit().drive.observe(self.unit().bank.eeprom_writes())
    }

    fn frame_seen(&mut self, _: Cast) {
        self.unit_mut().drive.frame_seen();
    }

    fn join(&mut self, _: u8, protocol: Protocol) {
        self.joined(protocol);
        self.refresh();
    }

    fn unite(&self) -> Option<UniTe> {
        self.unite_words()
    }

    fn peek(&self, address: u16) -> Option<u16> {
        self.unit().bank.peek(address).map(|kept| self.computed(address).unwrap_or(kept))
    }

    fn poke(&mut self, address: u16, value: u16) -> bool {
        let kept = self.computed(address).is_none() && self.unit_mut().bank.set(address, value);
        if kept {
            self.refresh();
        }
        kept
    }
}
