//! What is asked of a DRIVECOM drive from outside, as its family's settings route it.

/// Who gives the run command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Commander {
    /// The control word.
    Bus,
    /// The terminals, or the keys of the drive itself.
    #[default]
    Terminals,
    /// The keys of the remote terminal.
    RemoteTerminal,
    /// The other bus of the drive, on which nobody is.
    CanOpen,
}

/// A run command that does not come from the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Run {
    /// Forward.
    Forward,
    /// In reverse.
    Reverse,
}

/// Stops that inputs order, whoever commands (BBV51701 p. 8).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct StopInputs {
    /// A stop along the shortened ramp.
    pub fast: bool,
    /// A stop by direct current, as long as the input is on.
    pub injection: bool,
    /// A freewheel stop, the stop of 3-wire control, or no supply of the power stage: the drive is locked.
    pub lock: bool,
}

/// What acts on the drive at this moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Situation {
    /// Who gives the run command.
    pub commander: Commander,
    /// Whether the drive is forced to local control.
    pub forced_local: bool,
    /// The run command of a commander that is not the bus.
    pub run: Option<Run>,
    /// Stops by inputs.
    pub stops: StopInputs,
    /// The reference in force in hundredths of a hertz, negative in reverse, before the limits.
    pub reference: i32,
    /// What the bus has written as its reference, in force or not.
    pub bus_reference: i32,
}
