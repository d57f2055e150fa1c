//! What is around the drive, and how it acts on chart and motor.

use drive_atv312::{
    FAULTS, ROWS,
    registers::address::{self, *},
};

use super::{
    Atv312, EPF, LFF, SLF, USF,
    routing::{Giver, Routing},
    settings,
};
use crate::{
    models::drivecom::{self, Settings, Situation},
    world::Surroundings,
};

/// LI1 to LI6 and the analog inputs as p. 23 has them; `HMI` is the plug of the remote terminal, in from the start.
pub(super) const SURROUNDINGS: Surroundings = Surroundings {
    family: "atv312",
    terminals: drivecom::TERMINALS,
    analog_inputs: drivecom::ANALOG_INPUTS,
    switches: &[
        drivecom::PRIORITY,
        drivecom::BUS_REFERENCE,
        drivecom::PRESETS,
        drivecom::GIVEN_BACK,
        drivecom::STOP_RELEASED,
        drivecom::RESET,
        drivecom::MOTOR_RUNNING,
        drivecom::DISABLE_OPERATION,
        drivecom::RESTART,
        drivecom::TERMINAL_REFERENCE,
    ],
    trips: FAULTS,
    rows: ROWS,
};

impl Atv312 {
    pub(super) fn routing(&self) -> Routing<'_> {
        let (bank, around, readings) = (&self.bank, &self.around, self.drive.readings());
        Routing { bank, around, readings, commanded: self.commanded }
    }

    /// Something has changed that acts on chart and motor: a register, an input, a key, a supply.
    pub(super) fn refresh(&mut self) {
        let (settings, situation) = self.asked();
        self.drive.set_settings(settings);
        self.drive.situate(situation);
        let resets = self.routing().is_on(self.bank.value(RSF));
        if !std::mem::replace(&mut self.resets, resets) && resets {
            self.drive.reset();
        }
        self.meet_causes();
    }

    /// What is asked of the drive now.
    pub(super) fn asked(&mut self) -> (Settings, Situation) {
        let (wiring, inputs) = self.routing().wiring();
        let before = self.terminals.run();
        let terminals = self.terminals.see(wiring, inputs);
        if terminals.is_some() && terminals != before && self.drive.readings().newest_commands {
            self.commanded = false;
        }
        let output = self.drive.motor().output_frequency();
        let lost = self.routing().is_signal_lost();
        self.kept_speed = lost.then(|| self.kept_speed.unwrap_or(output));
        let routing = self.routing();
        let situation = Situation {
            commander: routing.commander(),
            forced_local: routing.is_forced_local(),
            run: routing.run(terminals),
            stops: routing.stops(),
            reference: match (self.kept_speed, self.bank.value(LFL)) {
                (Some(_), 4) => i32::from(self.bank.value(address::LFF)) * 10,
                (Some(speed), 5) => speed,
                _ => routing.reference(self.bus_reference, output),
            },
            bus_reference: self.bus_reference,
        };
        (settings::settings(&routing), situation)
    }

    /// Trips for what is wrong around the drive, and notices that it no longer is.
    fn meet_causes(&mut self) {
        let routing = self.routing();
        let unplugged = routing.giver() == Giver::RemoteTerminal && !self.around.remote_terminal;
        let causes = [
            (USF, !self.around.motor_supply),
            (LFF, routing.is_signal_lost()),
            (EPF, routing.external_fault()),
            (SLF, unplugged),
        ];
        match self.drive.present_fault() {
            // Of the link's fault the drive itself knows when it is gone.
            Some(code) if code != SLF && causes.contains(&(code, false)) => self.drive.cause_gone(),
            Some(_) => {}
            None => {
                for (code, _) in causes.into_iter().filter(|(_, is_there)| *is_there) {
                    self.trip_by(code, true);
                }
            }
        }
    }

    /// Trips as the settings say, unless an input inhibits all faults (`InH`, p. 54).
    pub(super) fn trip_by(&mut self, code: u16, cause_persists: bool) {
        let inhibited = self.routing().is_on(self.bank.value(INH));
        if !inhibited && self.drive.present_fault().is_none_or(|present| present != code || !cause_persists) {
            self.drive.trip(code, settings::reaction_to(&self.bank, code), cause_persists);
        }
    }
}
