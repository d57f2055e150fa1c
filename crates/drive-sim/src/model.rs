//! What a simulated drive is: [`Model`], the rules of its functions, and what an observer sees of it.

use std::time::Duration;

use drive_core::{
    SerialSettings,
    registers::{Place, Space},
};

use crate::world::{Act, Panel, Surroundings};

/// What a slave has said to a request, once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Played {
    /// From the end of the request to the first character. For UNI-TELWAY: until the reply was ready.
    pub after: Duration,
    /// What it said.
    pub says: Says,
}

/// What was said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Says {
    /// The PDU of an answer, exceptions included, or a UNI-TE reply.
    Message(Vec<u8>),
    /// Characters that make no frame, as they are.
    Characters(Vec<u8>),
    /// Nothing.
    Nothing,
}

/// An exception code, as a slave answers it after the function code with its highest bit set.
///
/// The codes 1 to 4 are those of Modbus; families have their own beyond them, so this is a number and not a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Exception(pub u8);

impl Exception {
    /// 01: the function is not known.
    pub const ILLEGAL_FUNCTION: Self = Self(1);
    /// 02: the register does not exist, or its access forbids the request.
    pub const ILLEGAL_ADDRESS: Self = Self(2);
    /// 03: a value or a quantity is not permitted.
    pub const ILLEGAL_VALUE: Self = Self(3);
    /// 04: the request cannot be carried out now.
    pub const FAILURE: Self = Self(4);
    /// 06: the slave is busy and has not carried the request out.
    pub const BUSY: Self = Self(6);
}

/// To whom a request was sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Cast {
    /// To this slave alone; it answers.
    Unicast,
    /// To all slaves (address 0); nobody answers.
    Broadcast,
}

/// What was wrong with a frame that nobody could take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Damage {
    /// Its check does not fit.
    Check,
    /// It is too short or too long to be one.
    Length,
}

/// A run of registers that one request names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Block {
    /// The function code of the request.
    pub function: u8,
    /// The first register.
    pub first: u16,
    /// How many.
    pub quantity: u16,
}

/// Which functions a family has, and how much it does in one request. What a rule does not allow is answered before
/// the model is asked: an unknown function by exception 01, a wrong quantity by 03.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rules {
    /// Most words of function 03; 0: the drive has no such function. The other limits likewise.
    pub read_holding: u16,
    /// Most words of function 04.
    pub read_input: u16,
    /// Whether there is a function 06.
    pub write_single: bool,
    /// Most words of function 10h.
    pub write_multiple: u16,
    /// The sub-codes of function 08.
    pub diagnostics: &'static [u16],
    /// Whether there is a function 0Bh (event counter).
    pub event_counter: bool,
    /// The functions that a broadcast may carry; any other broadcast does nothing.
    pub broadcast: &'static [u8],
    /// The usual time from the last bit of a request to the first bit of its answer.
    pub turnaround: Duration,
}

/// What the slaves of a line speak.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Protocol {
    /// Modbus RTU.
    #[default]
    Rtu,
    /// Modbus ASCII.
    Ascii,
    /// UNI-TELWAY with UNI-TE requests.
    UniTelway,
}

/// How a party of a line speaks and listens.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Dialect {
    /// Speed and character format.
    pub settings: SerialSettings,
    /// The protocol.
    pub protocol: Protocol,
}

/// What a drive needs to answer UNI-TE requests (VVDED397054 p. 11–13); reads and writes of words go to its registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UniTe {
    /// Product type, sub-type and version of the identification.
    pub product: [u8; 3],
    /// The text of the identification.
    pub name: &'static str,
    /// The registers that request F2h writes, in its order: command, reference, acceleration, deceleration.
    pub command: [u16; 4],
    /// The registers that its answer reports, in its order: reference, status, fault, motor current.
    pub report: [u16; 4],
}

/// What an observer of the machine sees, without using the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Observation {
    /// The output stage feeds the motor, at any frequency, braking included.
    pub running: bool,
    /// Frequency at the output in hundredths of a hertz, negative in reverse; 0 while the motor coasts.
    pub output_frequency: i32,
    /// Speed of the shaft as a frequency in hundredths of a hertz, also while the motor coasts.
    pub shaft_frequency: i32,
    /// The frequency that the drive steers for, in hundredths of a hertz, negative in reverse.
    pub setpoint: i32,
    /// Motor current in tenths of an ampere.
    pub current: u32,
    /// The code of the present trip, in the family's own numbers.
    pub trip: Option<u16>,
    /// Whether panel or terminals have taken control away from the bus.
    pub local: bool,
    /// How often the EEPROM was written since the drive was made.
    pub eeprom_writes: u32,
}

/// One simulated drive at register level.
///
/// A model knows nothing of frames, lines, clocks or tasks. The slave that owns it ([`crate::SimLine`] makes one per
/// address) parses requests, applies the [`Rules`], counts, and lets time pass by [`advance`](Self::advance) before
/// it touches the model; between two touches nothing runs.
///
/// # For implementors
/// Only the methods without a body are needed. `advance` **must** give the same result whether a time passes in one
/// step or in many, and must cost the same for a millisecond as for an hour: compute ramps and timers, do not step
/// them. [`Motor`](crate::Motor), [`Bank`](crate::Bank) and [`Watchdog`](crate::Watchdog) are made that way.
pub trait Model: Send {
    /// Functions and limits of the family.
    fn rules(&self) -> &Rules;

    /// Reads one register.
    ///
    /// # Errors
    /// The exception that the drive answers.
    fn read(&mut self, address: u16) -> Result<u16, Exception>;

    /// Writes one register.
    ///
    /// # Errors
    /// The exception that the drive answers; for a broadcast it has no other consequence than that nothing is done.
    fn write(&mut self, address: u16, value: u16, cast: Cast) -> Result<(), Exception>;

    /// Lets time pass.
    fn advance(&mut self, elapsed: Duration);

    /// The supply of the control comes or goes. Without it the motor is not fed and coasts, and nothing acts; the
    /// slave hears and says nothing meanwhile. With it the drive is as after power-up, what is in EEPROM apart.
    fn power(&mut self, on: bool);

    /// Supply off and on again.
    fn power_cycle(&mut self) {
        self.power(false);
        self.power(true);
    }

    /// The drive trips with a code of its family, as if the cause had come and gone: a reset clears it.
    fn trip(&mut self, code: u16);

    /// Sets the load at the shaft in percent of the motor's nominal torque.
    fn set_load(&mut self, percent: u16);

    /// Somebody at the panel acts.
    fn panel(&mut self, action: Panel);

    /// What there is around the drive.
    fn surroundings(&self) -> &'static Surroundings {
        &Surroundings::NONE
    }

    /// Something happens around the drive; every name is one of its [`surroundings`](Self::surroundings).
    fn world(&mut self, act: Act) {
        let _ = act;
    }

    /// What an observer of the machine sees.
    fn observe(&self) -> Observation;

    /// A rule of the family about reading this block, beyond the limit of words.
    ///
    /// # Errors
    /// The exception that the drive answers instead of reading.
    fn check_read(&self, block: Block) -> Result<(), Exception> {
        let _ = block;
        Ok(())
    }

    /// Whether [`write`](Self::write) would take this word now. Every word of a block is asked before the first is
    /// written, so that a block with one word that is refused writes nothing.
    ///
    /// # Errors
    /// The exception that the drive answers instead of writing.
    fn check_word(&self, address: u16, value: u16, cast: Cast) -> Result<(), Exception> {
        let _ = (address, value, cast);
        Ok(())
    }

    /// A rule of the family about writing this block, beyond the limit of words. Nothing is written when it refuses.
    ///
    /// # Errors
    /// The exception that the drive answers instead of writing.
    fn check_write(&self, block: Block, values: &[u16], cast: Cast) -> Result<(), Exception> {
        let _ = (block, values, cast);
        Ok(())
    }

    /// Any function that [`Rules`] does not know (2Bh, vendor codes): from the request PDU, function code included,
    /// to the answer's, function code included. What a drive refuses in a form of its own is an answer here.
    ///
    /// # Errors
    /// The exception that the drive answers.
    fn other(&mut self, request: &[u8]) -> Result<Vec<u8>, Exception> {
        let _ = request;
        Err(Exception::ILLEGAL_FUNCTION)
    }

    /// A valid frame for this drive was received, whatever it asks: re-arms a watchdog. Comes before the request
    /// itself.
    fn frame_seen(&mut self, cast: Cast) {
        let _ = cast;
    }

    /// A frame was received that is damaged, and of which nobody can tell whom it was for.
    fn frame_damaged(&mut self, damage: Damage) {
        let _ = damage;
    }

    /// What a master has to leave between the end of this drive's answer, or of a request to all, and the start of the
    /// next request that concerns it, where that is more than t3.5. A shorter one is recorded as a
    /// [`Breach::Pause`](crate::Breach::Pause), and answered nevertheless.
    fn pause(&self) -> Duration {
        Duration::ZERO
    }

    /// The drive is put on a line that speaks this, at this address. A drive that shows its address as a setting, or
    /// whose times depend on the protocol, learns it here.
    fn join(&mut self, address: u8, protocol: Protocol) {
        let _ = (address, protocol);
    }

    /// The address that the drive has given itself since it [joined](Self::join), for a family where the setting acts
    /// at once; 0: it answers nobody. `None`: still the one that it was put at.
    fn own_address(&self) -> Option<u8> {
        None
    }

    /// What a slave that is no model, but plays a recording back, says to a request; `None`: it is none. It is asked before
    /// anything else.
    fn play(&mut self, request: &[u8], cast: Cast) -> Option<Played> {
        let _ = (request, cast);
        None
    }

    /// How the drive answers UNI-TE; `None`: it does not speak it.
    fn unite(&self) -> Option<UniTe> {
        None
    }

    /// Whether the drive hears the line at all; `false` while it starts up.
    fn listens(&self) -> bool {
        true
    }

    /// The content of a register as the drive's inside has it, without the rules of the line. For tests.
    fn peek(&self, address: u16) -> Option<u16>;

    /// Changes a register from inside, without the rules of the line; `false` when there is no such register. For
    /// tests and for what happens at the machine (an input, a parameter set on the panel).
    fn poke(&mut self, address: u16, value: u16) -> bool;

    /// As [`peek`](Self::peek), of a coil or an input too.
    fn peek_at(&self, place: Place) -> Option<u16> {
        if place.space == Space::HoldingRegister { self.peek(place.address) } else { None }
    }

    /// As [`poke`](Self::poke), of a coil or an input too.
    fn poke_at(&mut self, place: Place, value: u16) -> bool {
        place.space == Space::HoldingRegister && self.poke(place.address, value)
    }
}
