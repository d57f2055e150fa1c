//! What else may decide than the words of the bus: the active sources FE45 and FE46, the keypad, and the inputs with their
//! functions (§6.2, §8.4 to §8.6, §8.8).

use drive_core::{
    Class, Control, Frequency, Port, Refusal, Result, Status,
    registers::{
        Register,
        access::{ReadWrite, Readable},
    },
};

use crate::{
    Atv21, Authority, registers as map,
    words::{CommandSource, CommandWord, LogicInputs, ReferenceSource, StatusWord},
};

/// CMOD: the serial link commands.
pub(crate) const BY_SERIAL_LINK: u16 = 2;
/// FMOD: the serial link gives the reference.
pub(crate) const REFERENCE_BY_SERIAL_LINK: u16 = 4;
/// Functions of inputs that give no run command: none, FCHG, forced local.
const HARMLESS: [u16; 3] = [0, 38, FORCES[0]];
/// Functions of inputs by which the terminals decide whatever the bus says (§8.4, §8.5): forced local, forced operation,
/// forced run.
const FORCES: [u16; 3] = [48, 52, 53];

/// The function of F110 that keeps ST on, as the VF-S11 is delivered: a release, and no run command.
const ALWAYS_RELEASED: u16 = 1;
const INPUTS_UNKNOWN: Refusal = Refusal::Overridden {
    by: "an input that cannot be read, for the drive has no FD06, and that may be on,",
    remedy: "set CMOD = 2, so that the inputs command nothing",
};

/// An input: its bit in FD06 (`None`: always on), the parameter of its function, and its names in a refusal.
struct Input {
    bit: Option<LogicInputs>,
    function: Register<ReadWrite>,
    /// With each of [`FORCES`].
    forces: [&'static str; 3],
    remedy: &'static str,
    on: &'static str,
}

macro_rules! input {
    ($name:literal, $parameter:literal, $bit:expr, $function:ident) => {
        Input {
            bit: $bit,
            function: map::$function,
            forces: [
                concat!($name, " by its function forced local control (", $parameter, " = 48)"),
                concat!($name, " by its function forced operation (", $parameter, " = 52)"),
                concat!($name, " by its function forced run (", $parameter, " = 53)"),
            ],
            remedy: concat!("switch it off, or give ", $parameter, " another function"),
            on: concat!($name, ", which is on, with the terminals in command once FA00 is 0,"),
        }
    };
}

const INPUTS: [Input; 5] = [
    input!("F110", "F110", None, ALWAYS_FUNCTION),
    input!("input F", "F111", Some(LogicInputs::F), INPUT_F_FUNCTION),
    input!("input R", "F112", Some(LogicInputs::R), INPUT_R_FUNCTION),
    input!("input RES", "F113", Some(LogicInputs::RES), INPUT_RES_FUNCTION),
    input!("input VIA", "F118", Some(LogicInputs::VIA), INPUT_VIA_FUNCTION),
];

/// The settings that say who commands and what the inputs do: while the motor runs or an input is on, a change of one may
/// start it, stop it or change its speed.
pub(crate) const DECIDE: [Register<ReadWrite>; 9] = [
    map::COMMAND_MODE,
    map::REFERENCE_MODE,
    map::SECOND_REFERENCE,
    map::ALWAYS_FUNCTION,
    map::INPUT_F_FUNCTION,
    map::INPUT_R_FUNCTION,
    map::INPUT_RES_FUNCTION,
    map::INPUT_VIA_FUNCTION,
    map::VIA_IS_LOGIC,
];

/// The terminals as they stand: FD06, CMOD, and F110 to F113 and F118, as far as this drive has them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Terminals {
    inputs: Option<LogicInputs>,
    pub(crate) command_mode: Option<u16>,
    functions: [Option<u16>; 5],
}

impl Terminals {
    /// The same with another value in one of the parameters that say what they do.
    pub(crate) fn with(mut self, parameter: u16, value: u16) -> Self {
        if parameter == map::COMMAND_MODE.address() {
            self.command_mode = Some(value);
        }
        for (function, input) in self.functions.iter_mut().zip(&INPUTS) {
            if input.function.address() == parameter {
                *function = Some(value);
            }
        }
        if parameter == map::VIA_IS_LOGIC.address() {
            // What stands at VIA counts from then on, and nothing tells it before.
            self.inputs = self.inputs.map(|inputs| inputs | LogicInputs::VIA);
        }
        self
    }

    /// The inputs that are on, or may be, each with its function; `None`: one that this drive does not have.
    fn on(&self) -> impl Iterator<Item = (&'static Input, Option<u16>)> {
        let inputs = self.inputs;
        let all = INPUTS.iter().zip(self.functions);
        all.filter(move |(input, function)| match input.bit {
            None => function.is_some(),
            Some(bit) => inputs.is_none_or(|inputs| inputs.contains(bit)),
        })
    }

    /// The input by which the terminals decide whatever the bus says.
    pub(crate) fn force(&self) -> Option<Refusal> {
        self.forces(&FORCES)
    }

    fn forces(&self, functions: &[u16]) -> Option<Refusal> {
        self.on().find_map(|(input, function)| {
            let forces = |force: &u16| Some(*force) == function && functions.contains(force);
            let index = FORCES.iter().position(forces)?;
            Some(Refusal::Overridden { by: input.forces[index], remedy: input.remedy })
        })
    }

    /// What would give a run command if FA00 were 0, or may. The manual lists few functions of inputs, so any other that is
    /// on counts as one; of a drive without FD06 every input is on.
    pub(crate) fn would_start(&self) -> Option<Refusal> {
        let forced = self.forces(&FORCES[1..]);
        let by_terminals = !matches!(self.command_mode, Some(1 | BY_SERIAL_LINK));
        let command = by_terminals || self.forces(&FORCES[..1]).is_some();
        forced.or_else(|| {
            let starts = |(input, function): &(&Input, Option<u16>)| match (input.bit, *function) {
                (None, Some(ALWAYS_RELEASED)) => false,
                (_, Some(function)) => !HARMLESS.contains(&function),
                (_, None) => true,
            };
            let (input, _) = self.on().find(starts).filter(|_| command)?;
            if self.inputs.is_none() && input.bit.is_some() {
                return Some(INPUTS_UNKNOWN);
            }
            Some(Refusal::Overridden { by: input.on, remedy: "switch it off first, or set CMOD = 2" })
        })
    }
}

/// Who commands instead of the bus, where FE45 or the keypad's LOC/REM says so.
pub(crate) fn other_command(word: StatusWord, source: CommandSource) -> Option<Refusal> {
    let (by, remedy) = match source {
        CommandSource::Keypad => ("the keypad (FE45 = 1)", "press its LOC/REM key, or set CMOD = 2"),
        CommandSource::Terminals => (
            "the terminal strip (FE45 = 0)",
            "switch off the input whose function is 48, 52 or 53 (F110 to F113, F118), or set CMOD = 2",
        ),
        CommandSource::Serial if word.contains(StatusWord::LOCAL) => {
            ("local control (FD01 bit 15)", "press the keypad's LOC/REM key")
        }
        CommandSource::Serial => return None,
        CommandSource::Unknown(_) => ("a source that the manual does not list (FE45)", "set CMOD = 2"),
    };
    Some(Refusal::Overridden { by, remedy })
}

/// What gives the reference instead of the bus.
pub(crate) const fn other_reference(source: ReferenceSource) -> Option<Refusal> {
    const REMEDY: &str = "set FMOD = 4, or switch off the input that switches the reference (F112 = 38) or forces local control (48)";
    let (by, remedy) = match source {
        ReferenceSource::Serial => return None,
        ReferenceSource::Via => ("the analog input VIA (FE46 = 1)", REMEDY),
        ReferenceSource::Vib => ("the analog input VIB (FE46 = 2)", REMEDY),
        ReferenceSource::Keypad => {
            ("the keypad's reference (FE46 = 3)", "press its LOC/REM key, or set FMOD = 4")
        }
        ReferenceSource::UpDown => ("the up and down inputs (FE46 = 5)", REMEDY),
        ReferenceSource::PresetSpeed => {
            ("a preset speed (FE46 = 255)", "stop by the bus, or switch off the inputs that choose it")
        }
        ReferenceSource::Unknown(_) => ("a reference that the manual does not list (FE46)", REMEDY),
    };
    Some(Refusal::Overridden { by, remedy })
}

/// The status word of a status.
pub(crate) fn status_word(status: &Status) -> StatusWord {
    StatusWord::from_bits_retain(status.raw(map::STATUS_WORD.address()).unwrap_or(0))
}

/// Who commands, of a status: it always holds FE45.
pub(crate) fn source(status: &Status) -> CommandSource {
    status.raw(map::COMMAND_SOURCE.address()).unwrap_or(u16::MAX).into()
}

/// Who commands instead of the bus, as a status tells it.
pub(crate) fn commanded_by_other(status: &Status) -> Option<Refusal> {
    other_command(status_word(status), source(status))
}

/// Who commands, in the terms of all families.
pub(crate) fn who(word: StatusWord, source: CommandSource) -> Control {
    crate::status::control(word, Some(source)).unwrap_or(Control::Local)
}

/// Whether the output goes down, from one reading to a later one.
pub(crate) fn is_falling(from: Option<Frequency>, to: Option<Frequency>) -> bool {
    matches!((from, to), (Some(from), Some(to)) if to < from)
}

impl<P: Port> Atv21<P> {
    /// The terminals as they stand, read anew: seven exchanges.
    pub(crate) async fn terminals(&mut self) -> Result<Terminals> {
        let inputs = self.optional(Class::Command, map::LOGIC_INPUTS).await?;
        let command_mode = self.optional(Class::Command, map::COMMAND_MODE).await?;
        let mut functions = [None; 5];
        for (function, input) in functions.iter_mut().zip(&INPUTS) {
            *function = self.optional(Class::Command, input.function).await?;
        }
        Ok(Terminals { inputs: inputs.map(LogicInputs::from_bits_retain), command_mode, functions })
    }

    /// FA00 as the drive holds it, remembered for the next stop.
    pub(crate) async fn command_word(&mut self, class: Class) -> Result<CommandWord> {
        let word = self.registers.at(class).read(map::COMMAND_WORD).await?;
        self.watch.run.reads(word);
        let word = CommandWord::from_bits_retain(word);
        self.held = Some(word);
        Ok(word)
    }

    /// FE46.
    pub(crate) async fn active_reference(&mut self) -> Result<ReferenceSource> {
        let word = self.registers.at(Class::Command).read(map::REFERENCE_SOURCE).await?;
        let active = ReferenceSource::from(word);
        self.proof.source = Some(active);
        Ok(active)
    }

    /// Reads FA00, where this status shows that it may be another one than is remembered: then the next stop needs no
    /// reading before its word is written. What cannot be read now, a later status tells. False: there was no need.
    pub(crate) async fn keep_stop_ready(&mut self, status: &Status) -> bool {
        let shown = (status_word(status).intersection(CHOSEN_OR_ORDERED), source(status));
        let unproved = self.watch.run.lease().is_some() && self.watch.run.held().is_none();
        if self.held.is_some() && self.shown == Some(shown) && !unproved {
            return false;
        }
        self.shown = self.command_word(Class::Status).await.is_ok().then_some(shown);
        if self.modes.is_none() && self.authority == Authority::Priority {
            self.read_modes(Class::Status).await.ok();
        }
        true
    }

    /// CMOD and FMOD, which are not in the drive's own manual.
    pub(crate) async fn read_modes(&mut self, class: Class) -> Result<()> {
        let command = self.optional(class, map::COMMAND_MODE).await?;
        self.modes = Some([command, self.optional(class, map::REFERENCE_MODE).await?]);
        Ok(())
    }

    /// A register that this drive may lack.
    pub(crate) async fn optional(
        &mut self,
        class: Class,
        register: Register<impl Readable>,
    ) -> Result<Option<u16>> {
        let mut calls = self.registers.at(class);
        self.absent.word(&mut calls, register.address()).await
    }
}

/// What FD01 shows of FA00: another word there shows in one of them, if not at once.
const CHOSEN_OR_ORDERED: StatusWord = StatusWord::MOTOR_2
    .union(StatusWord::PID_OFF)
    .union(StatusWord::RAMP_2)
    .union(StatusWord::REVERSE)
    .union(StatusWord::RUN)
    .union(StatusWord::LOCAL);

/// What gives the reference instead of what this word asks for: a preset speed where it chooses one, else the bus.
pub(crate) fn not_in_force(word: CommandWord, active: ReferenceSource) -> Option<Refusal> {
    let preset = active == ReferenceSource::PresetSpeed && word.preset_speed() != 0;
    if preset { None } else { other_reference(active) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn terminals(inputs: u16, command_mode: u16, functions: [u16; 5]) -> Terminals {
        let [always, f, r, res, via] = functions;
        Terminals {
            inputs: Some(LogicInputs::from_bits_retain(inputs)),
            command_mode: Some(command_mode),
            functions: [Some(always), Some(f), Some(r), Some(res), Some(via)],
        }
    }

    #[test]
    fn an_input_counts_as_a_run_command_where_the_terminals_would_command() {
        // F111 = 2, as the drive's own manual calls forward; the Modbus manual does not say.
        let functions = [0, 2, 3, 10, 0];
        assert!(terminals(0, 0, functions).would_start().is_none(), "all off");
        assert!(terminals(1, 0, functions).would_start().is_some());
        assert!(terminals(2, 0, functions).would_start().is_some());
        assert!(terminals(1, 2, functions).would_start().is_none(), "CMOD = 2");
        assert!(terminals(1, 1, functions).would_start().is_none(), "CMOD = 1: the keypad's");
        assert!(terminals(0x80, 0, functions).would_start().is_none(), "VIA without a function");
    }

    #[test]
    fn an_input_that_forces_local_control_makes_the_other_inputs_count() {
        let functions = [0, 2, 48, 10, 0];
        assert!(terminals(2, 2, functions).would_start().is_none(), "it gives no run command itself");
        assert!(terminals(3, 2, functions).would_start().is_some());
        assert!(terminals(2, 0, functions).would_start().is_none());
    }

    #[test]
    fn forced_operation_and_forced_run_count_whatever_commands() {
        for (inputs, functions) in [(0, [53, 0, 0, 0, 0]), (1, [0, 52, 0, 0, 0]), (0x80, [0, 0, 0, 0, 53])] {
            for mode in [0, 1, 2] {
                let terminals = terminals(inputs, mode, functions);
                assert!(terminals.would_start().is_some(), "{terminals:?}");
                assert_eq!(terminals.would_start(), terminals.force());
            }
        }
        assert!(terminals(1, 2, [0, 2, 53, 0, 0]).force().is_none(), "R is off");
    }

    #[test]
    fn a_refusal_names_the_input_its_parameter_and_what_to_do() {
        let refusal = terminals(2, 2, [0, 2, 53, 0, 0]).force().unwrap();
        assert_eq!(
            refusal.to_string(),
            "input R by its function forced run (F112 = 53) decides instead: \
             switch it off, or give F112 another function"
        );
    }
}
