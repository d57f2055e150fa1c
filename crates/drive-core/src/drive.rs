//! The [`Drive`] trait: what every family does, and what is promised about it.

use std::time::Duration;

use async_trait::async_trait;
use auto_impl::auto_impl;

use crate::{
    address::SlaveAddress,
    calls::Lifetimes,
    capabilities::{Capabilities, Reaction, Watchdog, WatchdogCapability},
    error::{Error, Result},
    faults::Faults,
    identity::Identity,
    intent::Intent,
    kept_readings::KeptReadings,
    lease::{Ground, Lease, Recognised},
    refusal::{Refusal, SelfRestart},
    registers::{Place, Row, Written},
    setpoint::{Direction, Setpoint, StopMode},
    status::{Measurements, Status},
    stopped::{Follower, Stopped},
    withdrawn::Withdrawn,
};

/// A write to all slaves at once: no slave answers, so nothing is confirmed by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct BroadcastWrite {
    /// The function code that the family takes for it, 06 or 16.
    pub function: u8,
    /// The register.
    pub register: u16,
    /// The word.
    pub value: u16,
}

/// A variable-speed drive on a line.
///
/// One value stands for one slave. It knows the family's registers and nothing of the line: every exchange goes
/// through a [`Port`](crate::Port), whose class and lifetime each method sets by itself: `stop` is a stop, `start`,
/// `set_setpoint` and `reset_faults` are commands, `status` is a status poll, everything else is background.
///
/// # For callers
/// - Nothing is called done because it was sent. A command that returns `Ok` was seen in the drive's own words; one
///   that returns [`Error::NotConfirmed`] was sent and not seen; [`ErrorKind::OutcomeUnknown`](crate::ErrorKind) means
///   that nobody knows.
/// - **A start that ends in one of these two may still start the motor**: its run command is not taken back, and acts when
///   what kept it from acting goes away. Unless the motor is to run, follow it by [`stop`](Self::stop).
/// - Nothing restarts by itself. No method retries a start, and none clears a fault but `reset_faults`.
/// - A setpoint is refused when the drive's limits forbid it or its register cannot hold it exactly; it is never
///   clamped or rounded.
/// - `&mut self` is one conversation with the drive. Share a drive by giving it to one task.
///
/// # For implementors
/// - `start` **must** read a fresh status before it writes anything, and refuse with [`Error::Refused`] when the drive
///   has a fault or somebody else controls it.
/// - An edge (reset, emergency stop, EEPROM save) **must** be written once and then cleared, never held.
/// - What the family cannot do **must** be [`Error::Unsupported`] and **must** be absent from
///   [`capabilities`](Self::capabilities).
/// - What is read once (units, limits, block configuration) **must** be read again after [`forget`](Self::forget).
/// - What a drive sends **must not** panic, in debug or release.
///
/// # Cancellation
/// **The future of a method does nothing until it is polled**: also a stop that stands in a `select!` beside a branch that is
/// ready may never be sent. A program with other things to do gives its drives to a fleet (`drive-fleet`), where a
/// command is on its way when its method returns.
///
/// Dropping the future of any method leaves the line whole and the drive as the last exchange left it; what is unsent is
/// withdrawn by the port, but for the write of a stop, which is sent all the same where the port has a schedule. A dropped
/// command may have been carried out, in part; read the status, and stop a drive whose start was dropped.
///
/// # Drives of several families
/// `Box<dyn Drive>` and `&mut dyn Drive` are drives as well, so that what takes `impl Drive` takes them:
///
/// ```
/// use drive_core::{Drive, Result, State};
///
/// async fn is_at_rest(mut drive: impl Drive) -> Result<bool> {
///     Ok(drive.status().await?.is_standstill())
/// }
///
/// async fn are_at_rest(drives: &mut [Box<dyn Drive>]) -> Result<bool> {
///     for drive in drives {
///         if !is_at_rest(&mut *drive).await? {
///             return Ok(false);
///         }
///     }
///     Ok(true)
/// }
/// ```
///
/// # Errors
/// Every method that talks to the drive returns [`Error::Port`] when no valid answer came and [`Error::Exception`]
/// when the drive refused; the methods say what else they return.
#[async_trait]
#[auto_impl(&mut, Box)]
pub trait Drive: Send {
    /// The slave that it talks to.
    fn slave(&self) -> SlaveAddress;

    /// What this family can do.
    fn capabilities(&self) -> &'static Capabilities;

    /// How long its calls may wait on the line until they are sent.
    fn lifetimes_mut(&mut self) -> &mut Lifetimes;

    /// What long jobs of class Background have read that were cut, for whoever begins them again; `None` where nothing is kept.
    fn kept_mut(&mut self) -> Option<&mut KeptReadings> {
        None
    }

    /// Forgets everything that was read once (units, limits, block configuration) and is true only as long as the
    /// drive is the same and was not switched off. Call it after a reconnect.
    fn forget(&mut self);

    /// The run command of this side that stands in the drive, or may: kept through [`forget`](Self::forget), a lost line and
    /// standstill, until the drive's own words showed that it stands no more.
    fn lease(&self) -> Option<Lease>;

    /// Takes a run command for this side's that an earlier run of the program has given, where the drive holds that very
    /// word. The next [`status`](Self::status) says whether it is in force; one that does not stand ends then. Nothing is sent.
    fn adopt(&mut self, lease: Lease);

    /// The run command by which a start in this direction would be given now, as far as what was read tells: for whoever keeps a
    /// record of it before it is given. `None` where the family does not know it beforehand. Nothing is sent.
    fn run_word_for(&self, direction: Direction) -> Option<u16> {
        let _ = direction;
        None
    }

    /// What a contract rests on that a status has found otherwise than it was when it was last read or set; told once. Nobody else
    /// looks again: a watchdog that was armed is taken for armed until this says otherwise. Nothing is sent.
    fn take_changed(&mut self) -> Option<Ground> {
        None
    }

    /// Whether the drive behind this slave is one of this family, from what it said of itself
    /// ([`identify`](Self::identify)). Nothing is sent.
    fn recognise(&self, identity: &Identity) -> Recognised {
        let _ = identity;
        Recognised::CannotTell
    }

    /// What has to be set up so in the drive for its words to mean what its family takes them for, and was found otherwise when it was last
    /// read: with the drive's connect, each start and the [slow set](Self::measurements). A start is refused by it. `None`: nothing was
    /// found. Nothing is sent.
    fn unmet(&self) -> Option<Refusal> {
        None
    }

    /// How long the motor coasts at the most when its output is cut, as its owner says; `None`: nobody knows, and a motor that
    /// was cut [may coast](crate::Motion::Coasting) until it is driven again. Nothing is sent.
    fn set_coast_time(&mut self, time: Option<Duration>) {
        let _ = time;
    }

    /// How long direct current takes to bring the motor to rest, as its owner says: for so long it is
    /// [held](Stopped::injects_for) by a stop by [`StopMode::DcInjection`], at most for
    /// [`INJECTION_AT_MOST`](crate::INJECTION_AT_MOST). `None`: nobody knows, and [`INJECTION_TIME`](crate::INJECTION_TIME) counts.
    /// No drive of these families has a time of its own for an injection by the bus. Nothing is sent.
    fn set_injection_time(&mut self, time: Option<Duration>) {
        let _ = time;
    }

    /// Reads the fast set, in [`Capabilities::status_exchanges`] exchanges or fewer while the drive stands or runs. Of a drive
    /// with a lease, or whose watchdog was armed by this value, one more behind every
    /// [twentieth](crate::STATUSES_PER_TURN) or as often as the family says, and at once one more where its words speak against what was known of it: in all
    /// never more than one.
    async fn status(&mut self) -> Result<Status>;

    /// Reads the slow set.
    async fn measurements(&mut self) -> Result<Measurements>;

    /// Reads the present faults, the alarms and the history.
    async fn faults(&mut self) -> Result<Faults>;

    /// Starts the motor in a direction, or turns a running motor to that direction, at the setpoint that the drive
    /// holds. Returns the status in which the drive shows that the run command **is in force**: the bus is the active
    /// source of commands and of the reference, the run command stands, and the motor is driven in that direction. The
    /// speed is then on its way, not reached; so is a motor that turned the other way, as soon as its output goes down, and
    /// the status tells its old direction until it turns in the new one. That the word which was written reads back is no
    /// confirmation.
    ///
    /// # Errors
    /// [`Error::Refused`] when the drive has tripped, is not ready or is commanded by somebody else: no run command was
    /// written. [`Error::NotConfirmed`] when it does not show. It may stand in the drive then, and start the motor later:
    /// [`stop`](Self::stop) takes it back.
    async fn start(&mut self, direction: Direction) -> Result<Status>;

    /// Whether [`start`](Self::start) would refuse this direction as the drive is now; with a setpoint: once that was given, as far
    /// as it mends what speaks against a start. Asked before the setpoint that belongs to a start is given: a start that is refused
    /// has changed no speed of a motor that runs by somebody else's command. Nothing is written.
    ///
    /// # For implementors
    /// What refuses the start itself **must** answer here, so that there is one judgement. With a setpoint and a motor that nothing
    /// drives, whose speed nothing can change, what costs the line questions may be left to the start.
    ///
    /// # Errors
    /// Those of [`start`](Self::start), as far as they are known before anything is written.
    async fn may_start(&mut self, direction: Direction, setpoint: Option<Setpoint>) -> Result<()> {
        let _ = (direction, setpoint);
        Ok(())
    }

    /// Stops the motor, whatever is known of the drive and whatever its settings are: **it never ends without a stop on
    /// the wire**, but where the port leads to another slave than the drive was made for. A mode that the family, or the drive as it is set up, does not have is replaced: by the stop that the
    /// drive's own settings select when the run command goes, provided that it acts; else by a fast stop; else by
    /// freewheel. DC injection is never a substitute. [`Stopped`] says which mode was used. Returns when the drive shows
    /// that no run command is in force any more; the motor may still be coming down.
    ///
    /// Nothing is read before the first stop word is written: it is kept ready from the last reading. A drive that was
    /// never read gets a word that stops it and leaves command where it was last known to be.
    ///
    /// Some drives inject direct current for as long as they are told to: end a stop by [`StopMode::DcInjection`] with
    /// one by [`StopMode::Ramp`] once its [time](Stopped::injects_for) is over, or the motor is heated at rest. One that is ended
    /// earlier leaves a motor that [may coast](crate::Motion::Coasting).
    ///
    /// # Errors
    /// [`Error::NotConfirmed`] when the stop does not show, with what keeps the motor turning where the drive tells it:
    /// repeat it, or stop the motor where it is commanded from. Never [`Error::Unsupported`] or [`Error::Refused`].
    /// [`Error::OtherSlave`] when its port leads to another slave: nothing was sent, and no other drive is stopped in its place.
    async fn stop(&mut self, mode: StopMode) -> Result<Stopped>;

    /// Ends the run command that this side has given, and nothing else: no fast stop, no freewheel, no injection and no
    /// change of who commands, any of which could stop what somebody else has started. For a drive that somebody else has
    /// taken over while it ran by our command, so that nothing starts when he gives it back. Returns when the drive holds
    /// no run command of this side; [`Withdrawn`] tells whether there was one.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for families that have no such word; [`Error::NotConfirmed`] when the run command still
    /// stands.
    async fn withdraw(&mut self) -> Result<Withdrawn> {
        Err(Error::Unsupported {
            what: "withdrawal of the run command",
            reason: "the family has no word that ends it and nothing else",
        })
    }

    /// Gives the drive a setpoint. `Ok` means that the drive holds the value and that it is the reference **in force**, or
    /// will be with the next start by the bus; the motor follows its ramp if it runs. A setpoint that is not yet sent is
    /// replaced by a later one.
    ///
    /// # Errors
    /// [`Error::Setpoint`] when the drive's limits or its register forbid the value; [`Error::Unsupported`] for a kind
    /// of setpoint that the family does not take.
    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()>;

    /// Resets the present fault, once. Whether there is one is looked at first: without one **nothing is written**, for the words by which
    /// some families reset take the voltage from a motor that runs. Returns the status in which the drive shows none. The motor does not start: a reset is
    /// sent only where it is proved that nobody's run command becomes active by it. Some drives forget their setpoint by it;
    /// give it again before a start.
    ///
    /// # Errors
    /// [`Error::Refused`] with the input, channel or parameter by which the motor might start, or command would change hands.
    /// [`Error::NotConfirmed`] when the drive still shows a fault: its cause is not gone.
    async fn reset_faults(&mut self) -> Result<Status>;

    /// Asks the drive what it is.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for families that cannot say.
    async fn identify(&mut self) -> Result<Identity> {
        Err(Error::Unsupported {
            what: "identification",
            reason: "the family has no function and no register for it",
        })
    }

    /// Gives control back to the panel or the terminals. The motor must stand, so that nobody is surprised by what the
    /// other channel says.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for families in which the bus cannot do it; [`Error::Refused`] while the motor runs.
    async fn release(&mut self) -> Result<Status> {
        Err(Error::Unsupported { what: "release", reason: "the family's bus cannot give control back" })
    }

    /// Reads which settings of the drive start its motor again by themselves. Empty: none does, as far as the manual
    /// says. A start is refused with [`Refusal::RestartsItself`](crate::Refusal::RestartsItself) while one does that was
    /// not accepted.
    async fn self_restarts(&mut self) -> Result<Vec<SelfRestart>> {
        Ok(Vec::new())
    }

    /// Accepts that the drive starts again by itself by these settings, named by their mnemonics, from now on. Nothing is
    /// sent.
    fn accept_self_restart(&mut self, codes: &[&str]) {
        let _ = codes;
    }

    /// The communication watchdog of this drive on its line, which may differ from the one that
    /// [`capabilities`](Self::capabilities) list for the family, as the protocol decides it on some.
    fn watchdog_capability(&self) -> Option<WatchdogCapability> {
        self.capabilities().watchdog
    }

    /// Sends the cheapest request that feeds the drive's communication watchdog.
    async fn keep_alive(&mut self) -> Result<()>;

    /// Reads how the drive's communication watchdog is set.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for families that have none or do not tell.
    async fn watchdog(&mut self) -> Result<Watchdog> {
        Err(Error::Unsupported { what: "watchdog", reason: "the manual gives no register for it" })
    }

    /// Sets the drive's communication watchdog and reads it back.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for families or reactions that cannot be set; [`Error::WatchdogTime`] for a time that the
    /// drive cannot keep; [`Error::NotConfirmed`] when it reads back otherwise.
    async fn arm_watchdog(&mut self, timeout: Duration, reaction: Reaction) -> Result<Watchdog> {
        let _ = (timeout, reaction);
        Err(Error::Unsupported { what: "watchdog", reason: "the manual gives no register for it" })
    }

    /// Puts the drive's communication watchdog back to what [`watchdog`](Self::watchdog) found before it was armed, and reads
    /// it back. A time that was found switched off is not restored, because nothing told it.
    ///
    /// # Errors
    /// As [`arm_watchdog`](Self::arm_watchdog).
    async fn restore_watchdog(&mut self, found: Watchdog) -> Result<Watchdog> {
        match (found.timeout, found.reaction) {
            (Some(timeout), Some(reaction)) => self.arm_watchdog(timeout, reaction).await,
            (Some(_), None) => Err(Error::Unsupported {
                what: "restoring the watchdog",
                reason: "its reaction was not told",
            }),
            (None, _) => {
                let least = self.watchdog_capability().map_or(Duration::ZERO, |watchdog| watchdog.min);
                self.arm_watchdog(least, Reaction::Ignore).await
            }
        }
    }

    /// What a word asks that another master would write to a register: `None` where that register is no command. It is for
    /// who carries it out by the methods of this trait instead, under their rules; nothing is written. **What stops is told
    /// without an exchange**; for a setpoint the unit of its register may have to be read.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for words that the family does not understand, and for registers that act on the motor in ways
    /// that no method stands for. A family that does not say which registers command its motor refuses all.
    async fn intent(&mut self, register: u16, word: u16) -> Result<Option<Intent>> {
        let _ = (register, word);
        Intent::kept()
    }

    /// Who hears of each status that a [`stop`](Self::stop) reads which does not show it yet, and of the drive's refusal: so a stop that is not obeyed, and is waited
    /// for as long as any, leaves nobody with what was so before it. It may tell nothing.
    fn follow_stops(&mut self, follower: Follower) {
        drop(follower);
    }

    /// By which stop the values stop the motor that another master would write at once, where no [word](Self::intent) of them tells that by
    /// itself: to coils (1 is on), or to registers that are a stop together. What they hold besides is left out of it. `None`: by none.
    fn stopped_by(&self, written: &[(Place, u16)]) -> Option<StopMode> {
        let _ = written;
        None
    }

    /// Reads the register of a row.
    ///
    /// # Errors
    /// [`Error::AccessForbidden`] for a register that can only be written.
    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16>;

    /// Writes the register of a row, unless the drive holds the value already, and reads it back. One that moves control is
    /// written only where it is proved that nobody's run command becomes active by it.
    ///
    /// # Errors
    /// [`Error::Refused`] while the motor runs, where that is not to be changed then, and with what might start it.
    /// [`Error::AccessForbidden`] and [`Error::ValueNotAllowed`] before anything is sent; [`Error::NotConfirmed`] when
    /// it reads back otherwise.
    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written>;

    /// Saves the drive's parameters to EEPROM, if one was changed since the last save. Returns how many saves this
    /// value has made. The motor stands: some drives take no stop while their EEPROM is written.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for families without such a command; [`Error::Refused`] while the motor runs;
    /// [`Refusal::NothingToSave`](crate::Refusal::NothingToSave) when nothing was changed.
    async fn persist(&mut self) -> Result<u32> {
        Err(Error::Unsupported { what: "saving parameters", reason: "the family has no command for it" })
    }

    /// Says that parameters may have been changed since the last save without this value having seen it: by another
    /// program, by an earlier run of this one, at the panel. The next [`persist`](Self::persist) is then sent. Families
    /// without such a command do nothing. Nothing is sent.
    fn assume_changed(&mut self) {}

    /// The write that stops every drive of this family on a line at once, for the modes in
    /// [`Capabilities::broadcast_stops`]. Nobody confirms it: follow it by a `stop` to each.
    fn broadcast_stop(&self, mode: StopMode) -> Option<BroadcastWrite> {
        let _ = mode;
        None
    }
}
