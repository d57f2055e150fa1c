//! Families that break their contract, each in one way: a [`Contract`] that does not complain of one of them
//! is no contract. Made from any family by a wrapper around its drive or its port.

mod drive;
mod port;

use drive_core::{Drive, Port, SlaveAddress, registers::Row};
use drive_sim::{SimSlave, Surroundings};

use crate::{
    contract::{Contract, Open},
    worlds::{Configuration, Event, Judge, Surrounded, Values},
};

/// A way in which a family breaks its contract.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Mutant {
    /// A start is confirmed by anything that the drive then says.
    StartConfirmedByAnything,
    /// A stop is confirmed by anything that the drive then says.
    StopConfirmedByAnything,
    /// The run command is written twice.
    RunTwice,
    /// A stop travels like a slow reading.
    StopInTheBackground,
    /// A status is read before a stop is written.
    StopReadsFirst,
    /// A stop is written once and not again.
    StopOnce,
    /// A reset is written and held.
    ResetAsALevel,
    /// A setpoint counts as held because it was sent.
    SetpointNotCompared,
    /// What was read once is never read again.
    ForgetForgetsNothing,
    /// A reset is confirmed because it was sent.
    ResetConfirmedByAnything,
    /// A run command that was withdrawn counts as gone because that was sent.
    WithdrawalConfirmedByAnything,
    /// Commands have no lifetime.
    CommandsLiveForEver,
    /// Whatever the drive says, the run command is in force.
    AlwaysInForce,
    /// Whatever the drive says, nobody knows whether the run command is in force.
    NeverKnown,
    /// `forget` ends the lease.
    ForgetEndsTheLease,
    /// A stop that was sent ends the lease.
    StopSentEndsTheLease,
    /// No output is standstill.
    NoOutputIsStandstill,
    /// Whatever reference the motor follows, the run command is in force.
    AnyReferenceIsOurs,
    /// Whatever speaks against a start, it may be given its setpoint.
    AnyStartMay,
    /// What fails behind a write is told as if nothing had been written.
    NothingWrittenSaidOfAll,
    /// A start of which no answer came has no lease.
    LeaseWantsAnAnswer,
    /// Whoever has control, the bus has it.
    ControlAlwaysTheBus,
    /// A run command is withdrawn by a stop, whoever has given it.
    WithdrawalStopsWhoever,
    /// A reset is sent whether it has tripped or not.
    ResetWithoutATrip,
}

impl Mutant {
    /// All of them.
    pub const ALL: [Self; 24] = [
        Self::StartConfirmedByAnything,
        Self::StopConfirmedByAnything,
        Self::RunTwice,
        Self::StopInTheBackground,
        Self::StopReadsFirst,
        Self::StopOnce,
        Self::ResetAsALevel,
        Self::SetpointNotCompared,
        Self::ForgetForgetsNothing,
        Self::ResetConfirmedByAnything,
        Self::WithdrawalConfirmedByAnything,
        Self::CommandsLiveForEver,
        Self::AlwaysInForce,
        Self::NeverKnown,
        Self::ForgetEndsTheLease,
        Self::StopSentEndsTheLease,
        Self::NoOutputIsStandstill,
        Self::AnyReferenceIsOurs,
        Self::AnyStartMay,
        Self::NothingWrittenSaidOfAll,
        Self::LeaseWantsAnAnswer,
        Self::ControlAlwaysTheBus,
        Self::WithdrawalStopsWhoever,
        Self::ResetWithoutATrip,
    ];

    /// The family of a contract with this fault in it.
    #[must_use]
    pub fn of(self, contract: Contract) -> Contract {
        let Contract { open, control, around, .. } = contract;
        let register = control.map(|control| control.register);
        let around =
            around.map(|around| Box::new(Broken { mutant: self, register, around }) as Box<dyn Surrounded>);
        Contract { open: self.breaks(register, open), around, ..contract }
    }

    /// What makes a drive, with this fault in it.
    fn breaks(self, register: Option<u16>, open: Box<Open>) -> Box<Open> {
        Box::new(move |port: Box<dyn Port>, slave: SlaveAddress| -> Box<dyn Drive> {
            let (port, tap) = port::Faulty::before(self, port, register);
            Box::new(drive::Faulty::new(self, open(Box::new(port), slave), tap))
        })
    }
}

/// The worlds of a family, with the fault in its drives.
struct Broken {
    mutant: Mutant,
    register: Option<u16>,
    around: Box<dyn Surrounded>,
}

impl Surrounded for Broken {
    fn configurations(&self) -> Vec<Configuration> {
        let broken = |configuration: Configuration| Configuration {
            open: self.mutant.breaks(self.register, configuration.open),
            ..configuration
        };
        self.around.configurations().into_iter().map(broken).collect()
    }

    fn events(&self, around: &Surroundings) -> Vec<Event> {
        self.around.events(around)
    }

    fn other_masters(&self) -> Vec<Event> {
        self.around.other_masters()
    }

    fn judge(&self, machine: &SimSlave) -> Option<Box<dyn Judge>> {
        self.around.judge(machine)
    }

    fn parameter(&self) -> Option<(&'static str, u16)> {
        self.around.parameter()
    }

    fn values_of(&self, row: &Row) -> Option<Values> {
        self.around.values_of(row)
    }
}
