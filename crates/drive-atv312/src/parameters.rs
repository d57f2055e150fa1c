//! Parameters, their EEPROM, and the communication watchdog that is set by three of them.

use std::time::Duration;

use drive_core::{
    Class, Command, Confirming, Control, Error, ErrorKind, Port, Reaction, Refusal, Result, Row, State,
    Watchdog, WatchdogCapability, Written,
    registers::{Access, Storage, refuse_commands},
};
use drive_drivecom::ChartState;

use crate::{
    Atv312,
    registers::{
        ADC, CFG, CMD, CMDD, CMI, ETI, FCS, INH, IOLR, LAC, LFR, LFRD, RP, RPR, SCS, SLL, TTO, TUN, address,
    },
    settings::{Known, LI1},
    words::{ControlWord, ExtendedControl, ExtendedStatus},
};

/// What the EEPROM takes in its life (p. 20).
const EEPROM_LIFE: u32 = 1_000_000;
/// How long a save may take. The manual prints no time; the word is written where the supply is good, or never.
const SAVED_WITHIN: Duration = Duration::from_secs(10);
/// `tUn` = YES: auto-tuning "as soon as possible" (p. 30).
const TUNE_NOW: u16 = 112;
/// One count of `ttO`.
const STEP: Duration = Duration::from_millis(100);

/// `ttO` and `SLL`. The Modbus manual prints 0.1 to 30 s for `ttO`, the variables manual 1 to 100 counts of 0.1 s: the
/// shorter is taken.
pub(crate) const WATCHDOG: WatchdogCapability = WatchdogCapability {
    min: STEP,
    max: Duration::from_secs(10),
    step: STEP,
    reactions: &[Reaction::Ignore, Reaction::Freewheel, Reaction::Ramp, Reaction::Fast],
    settable: true,
    // ttO and SLL change in RAM until CMI bit 1 saves them (BBV51701 p. 20, 22).
    wears: false,
};

/// What decides who commands, what the inputs and keys do, and what stops: a run command that waits for control acts by it.
const MOVES_CONTROL: [u16; 20] = [
    address::LAC,
    address::CHCF,
    address::COP,
    address::RFC,
    address::FR1,
    address::FR2,
    address::CCS,
    address::CD1,
    address::CD2,
    address::FLO,
    address::FLOC,
    address::LCC_KEYS,
    address::TCC,
    address::TCT,
    address::RRS,
    address::ROT,
    address::FST,
    address::NST,
    address::DCI,
    address::CFG,
];

impl<P: Port> Atv312<P> {
    /// Changes a parameter. One that is written only with the motor stopped is refused here while it runs, and so is
    /// `CMI`, whose bits give the held reference another unit and a stopped drive its lock. `AdC` is refused while operation
    /// is enabled, everything while the drive saves its parameters, and a lower `LAC` always.
    pub(crate) async fn change_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        const INJECTS: Refusal = Refusal::Settings(
            "AdC injects current into a motor at rest without a run command (p. 41): disable operation first, by a freewheel stop",
        );
        const LOWERED: Refusal = Refusal::Settings(
            "LAC goes back to L2 or L1 only by a return to factory settings (p. 35): do that at the drive",
        );
        refuse_orders(row, word)?;
        let command = Command::WriteParameter(row.address);
        if row.access == Access::WriteStopped || [CMI.address(), ADC.address()].contains(&row.address) {
            let words = self.check_standing(command).await?.state_words();
            if row.address == ADC.address() && words.chart() == Some(ChartState::OperationEnabled) {
                return Err(self.refused(command, INJECTS));
            }
        } else if let Some(reason) = self.fast_words(Class::Command).await?.refuses_while_saving() {
            return Err(self.refused(command, reason));
        }
        if row.address == LAC.address() && word < self.registers.at(Class::Background).read(LAC).await? {
            return Err(self.refused(command, LOWERED));
        }
        if let Some(reason) = self.refuses_writes() {
            return Err(self.refused(command, reason));
        }
        if MOVES_CONTROL.contains(&row.address)
            && let Some(reason) = self.refuses_move(row, word).await?
        {
            return Err(self.refused(command, reason));
        }
        match self.write_row(row, word).await {
            // It falls back to nO as soon as the time is reset (p. 55).
            Err(Error::NotConfirmed { status, .. })
                if row.address == RPR.address() && status.raw(RPR.address()) == Some(0) =>
            {
                Ok(Written { changed: true, storage: row.storage })
            }
            written => written,
        }
    }

    /// Writes a row that differs. What was read once may be otherwise then, also when it is not known whether the write
    /// arrived, and a parameter in RAM is worth saving.
    pub(crate) async fn write_row(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        let outcome = self.registers.at(Class::Background).change_row(row, word).await;
        let may_have_changed = match &outcome {
            Ok(written) => written.changed,
            Err(error) => {
                !matches!(error.kind(), ErrorKind::Refused | ErrorKind::Exception | ErrorKind::NotSent)
            }
        };
        if may_have_changed {
            // One may change others as well, as LAC (p. 35) and tCC (p. 33) do: all are read again. Until its turn the input that inhibits
            // faults is looked at all the same.
            self.known = Known { inhibits: self.known.inhibits, ..Known::default() };
            self.proof.holds_if(|_| false);
            self.proof.doubt_limits();
            self.unsaved |= matches!(row.storage, Storage::RamUntilSaved | Storage::Unknown);
        }
        outcome
    }

    /// CMI bit 1, once: it clears itself when the drive begins, and ETI bit 0 tells when it has done.
    pub(crate) async fn save_parameters(&mut self) -> Result<u32> {
        if !self.unsaved {
            return Err(self.refused(Command::Persist, Refusal::NothingToSave));
        }
        if self.saves >= EEPROM_LIFE {
            return Err(self.refused(Command::Persist, Refusal::EepromLife));
        }
        if let Some(reason) = self.refuses_save().await? {
            return Err(self.refused(Command::Persist, reason));
        }
        let cmi = self.held_cmi().await?;
        let save = (cmi | ExtendedControl::SAVE).bits();
        let edge = self.registers.at(Class::Background).edge().write(CMI, save).await;
        match &edge {
            Err(error) if error.kind() != ErrorKind::OutcomeUnknown => return edge.map(|()| self.saves),
            // Also where the answer was lost: the EEPROM may have been written.
            _ => self.saves = self.saves.saturating_add(1),
        }
        let mut seen = edge.is_ok();
        let mut confirming = Confirming::within(SAVED_WITHIN);
        loop {
            let mut calls = self.registers.at(Class::Background);
            let cmi = calls.read(CMI).await.map_err(Error::after_write)?;
            let eti = calls.read(ETI).await.map_err(Error::after_write)?;
            let pending = ExtendedControl::from_bits_retain(cmi).contains(ExtendedControl::SAVE);
            let busy = ExtendedStatus::from_bits_retain(eti).contains(ExtendedStatus::EEPROM_BUSY);
            seen |= pending || busy;
            if !pending && !busy {
                // An order whose answer was lost and of which nothing showed may never have arrived.
                if seen {
                    self.unsaved = false;
                }
                return if seen { Ok(self.saves) } else { edge.map(|()| self.saves) };
            }
            if !confirming.again().await {
                break;
            }
        }
        // Refused by the drive, as with too low a supply: the order must not stay and act later.
        let withdrawn = self.registers.at(Class::Background).write(CMI, cmi.bits()).await;
        withdrawn.map_err(Error::after_write)?;
        let status = self.fast_status(Class::Background).await?;
        Err(self.not_confirmed(Command::Persist, status, None))
    }

    /// Why nothing is saved now: while `ETI` bit 0 is set the drive may take no stop (p. 22), so the motor stands, and no run
    /// command of the bus might turn it.
    async fn refuses_save(&mut self) -> Result<Option<Refusal>> {
        if let Some(reason) = self.refuses_writes() {
            return Ok(Some(reason));
        }
        let words = self.check_standing(Command::Persist).await?.state_words();
        self.read_settings(Class::Background).await?;
        let held = self.read_controls(Class::Background).await?.command;
        let runs =
            self.known.settings.meaning(held).is_run() && words.chart() == Some(ChartState::OperationEnabled);
        let asked = if words.control() == Control::Bus { None } else { self.terminals_ask_for_run().await? };
        Ok(runs.then_some(Refusal::State(State::Running)).or(asked))
    }

    /// Why a setting that moves control is not written now: somebody's run command might act by it.
    async fn refuses_move(&mut self, row: &Row, word: u16) -> Result<Option<Refusal>> {
        const STANDS: Refusal = Refusal::Settings(
            "CMD holds a run command, which may act when control moves: stop the motor first",
        );
        let held = self.read_controls(Class::Background).await?.command;
        if ControlWord::from_bits_retain(held).is_run() {
            return Ok(Some(STANDS));
        }
        self.inputs_ask_for_run(Some((row.address, word))).await
    }

    /// What `CMI` holds, without the two orders: one that still waits there is not given again with what is written back.
    async fn held_cmi(&mut self) -> Result<ExtendedControl> {
        let cmi = ExtendedControl::from_bits_retain(self.registers.at(Class::Background).read(CMI).await?);
        Ok(cmi - ExtendedControl::FACTORY_SETTINGS - ExtendedControl::SAVE)
    }

    /// `ttO`, `SLL` and the NTO bit of `CMI`.
    pub(crate) async fn read_watchdog(&mut self) -> Result<Watchdog> {
        let mut calls = self.registers.at(Class::Background);
        let timeout = calls.read(TTO).await?;
        let sll = calls.read(SLL).await?;
        let unwatched =
            ExtendedControl::from_bits_retain(calls.read(CMI).await?).contains(ExtendedControl::NO_TIMEOUT);
        let nto = if unwatched { ExtendedControl::NO_TIMEOUT.bits() } else { 0 };
        for (register, word) in [(TTO.address(), timeout), (SLL.address(), sll), (CMI.address(), nto)] {
            self.proof.watch.knows(register, word);
        }
        let reaction = reaction(sll);
        let off = unwatched || reaction == Reaction::Ignore;
        Ok(Watchdog { timeout: (!off).then(|| STEP * u32::from(timeout)), reaction: Some(reaction) })
    }

    /// Refuses a watchdog that could not act, because an input takes from the drive all faults that it would trip by, this one among them.
    pub(crate) async fn refuse_inhibited(&mut self) -> Result<()> {
        const INHIBITED: Refusal = Refusal::Settings(
            "a closed input inhibits every fault of the drive, that of its watchdog too (InH, p. 54): open it, or set InH to nO",
        );
        let inhibits = self.learn_inhibition(Class::Background).await?;
        self.proof.watch.knows(INH.address(), inhibits);
        let is_closed = match self.known.inhibits {
            Some(input) => self.registers.at(Class::Background).read(IOLR).await? >> input & 1 == 1,
            None => false,
        };
        self.proof.watch.knows(IOLR.address(), is_closed.into());
        if is_closed { Err(self.refused(Command::ArmWatchdog, INHIBITED)) } else { Ok(()) }
    }

    /// Reads `InH`, and which input it is.
    pub(crate) async fn learn_inhibition(&mut self, class: Class) -> Result<u16> {
        let inhibits = self.known.absent.word(&mut self.registers.at(class), INH.address()).await?;
        self.known.inhibits = inhibits.and_then(|source| source.checked_sub(LI1)).filter(|&input| input < 6);
        Ok(inhibits.unwrap_or(0))
    }

    /// Sets the three, reads them back and compares, where the watchdog can act.
    pub(crate) async fn set_watchdog(&mut self, timeout: Duration, reaction: Reaction) -> Result<Watchdog> {
        if reaction != Reaction::Ignore {
            self.refuse_inhibited().await?;
        }
        self.write_watchdog(timeout, reaction).await
    }

    async fn write_watchdog(&mut self, timeout: Duration, reaction: Reaction) -> Result<Watchdog> {
        if let Some(reason) = self.refuses_writes() {
            return Err(self.refused(Command::ArmWatchdog, reason));
        }
        let Some(sll) = reaction_code(reaction) else {
            return Err(Error::Unsupported {
                what: "this reaction of the watchdog",
                reason: "SLL knows ignore, freewheel, ramp and fast stop",
            });
        };
        let tto = self.time_out_counts(timeout)?;
        let current = self.read_watchdog().await?;
        self.proof.watch.set_armed(reaction != Reaction::Ignore);
        let wanted =
            Watchdog { timeout: (reaction != Reaction::Ignore).then_some(timeout), reaction: Some(reaction) };
        if current == wanted {
            return Ok(current);
        }
        // ttO and SLL are written only with the motor stopped (p. 11).
        self.check_standing(Command::ArmWatchdog).await?;
        self.change(TTO, tto).await?;
        self.change(SLL, sll).await?;
        // The last of the three: from here on the drive watches its line, with the time and the reaction that are
        // wanted.
        let cmi = self.held_cmi().await?;
        if cmi.contains(ExtendedControl::NO_TIMEOUT) {
            let watched = (cmi - ExtendedControl::NO_TIMEOUT).bits();
            self.registers.at(Class::Background).write(CMI, watched).await?;
        }
        let armed = self.read_watchdog().await?;
        if armed == wanted {
            return Ok(armed);
        }
        let status = self.fast_status(Class::Background).await?;
        Err(self.not_confirmed(Command::ArmWatchdog, status, None))
    }

    /// Puts the watchdog back to what it was found. One that the NTO bit had switched off is switched off by it again, so that
    /// `SLL` goes on protecting after the next power-up.
    pub(crate) async fn put_back_watchdog(&mut self, found: Watchdog) -> Result<Watchdog> {
        let timeout = found.timeout.unwrap_or(WATCHDOG.max);
        let reaction = found.reaction.unwrap_or(Reaction::Ignore);
        let set = self.write_watchdog(timeout, reaction).await?;
        if set == found || found.timeout.is_some() {
            return Ok(set);
        }
        let unwatched = (self.held_cmi().await? | ExtendedControl::NO_TIMEOUT).bits();
        self.registers.at(Class::Background).write(CMI, unwatched).await?;
        self.read_watchdog().await
    }

    fn time_out_counts(&self, timeout: Duration) -> Result<u16> {
        let WatchdogCapability { min, max, step, .. } = WATCHDOG;
        let whole = timeout.as_nanos().is_multiple_of(step.as_nanos());
        let counts = timeout.as_nanos() / step.as_nanos();
        match u16::try_from(counts) {
            Ok(counts) if whole && (min..=max).contains(&timeout) => Ok(counts),
            _ => Err(Error::WatchdogTime { slave: self.registers.slave(), timeout, min, max, step }),
        }
    }
}

/// Refuses what acts as soon as it is written, and so is no parameter: commands, and orders to the drive (p. 16, 19, 20,
/// 30–32, 56).
fn refuse_orders(row: &Row, word: u16) -> Result<()> {
    const RECALL: (&str, &str) = (
        "a return to factory settings by a parameter",
        "it gives control back to the terminals and changes what they do; do it at the drive",
    );
    const SAVE: (&str, &str) = (
        "saving to EEPROM by a parameter",
        "a save to EEPROM is counted and refused when nothing changed; use it",
    );
    refuse_commands(row, &[CMD.address(), CMDD.address(), LFR.address(), LFRD.address()])?;
    let is = |register: u16| row.address == register;
    let cmi = ExtendedControl::from_bits_retain(if is(CMI.address()) { word } else { 0 });
    let (what, reason) = if cmi.contains(ExtendedControl::FACTORY_SETTINGS)
        || is(FCS.address())
        || is(CFG.address())
    {
        RECALL
    } else if cmi.contains(ExtendedControl::SAVE) || is(SCS.address()) {
        SAVE
    } else if is(RP.address()) {
        ("a fault reset by a parameter", "the fault reset checks the drive first; use it")
    } else if is(TUN.address()) && word == TUNE_NOW {
        ("auto-tuning by a parameter", "the motor takes its nominal current at once; tune it at the drive")
    } else {
        return Ok(());
    };
    Err(Error::Unsupported { what, reason })
}

const fn reaction(sll: u16) -> Reaction {
    match sll {
        0 => Reaction::Ignore,
        1 => Reaction::Freewheel,
        6 => Reaction::Ramp,
        7 => Reaction::Fast,
        _ => Reaction::Unknown(sll),
    }
}

const fn reaction_code(reaction: Reaction) -> Option<u16> {
    match reaction {
        Reaction::Ignore => Some(0),
        Reaction::Freewheel => Some(1),
        Reaction::Ramp => Some(6),
        Reaction::Fast => Some(7),
        Reaction::DcInjection | Reaction::Trip | Reaction::Unknown(_) => None,
    }
}
