//! Parameters, and their way to the EEPROM.

use drive_core::{
    Class, Command as Order, Error, ErrorKind, Port, Refusal, Result, Row, Written,
    registers::{Storage, refuse_commands},
};

use crate::{
    Drive3g3ev,
    registers::{COMMAND, ENTER, INPUT_TERMINALS, N02, N06, N07, N08, OUTPUT_FREQUENCY, REFERENCE},
    status::is_run,
    words::Command,
};

/// Saves that the EEPROM takes in its life (§4.5).
pub const EEPROM_LIFE: u32 = 100_000;

/// What the sample of §4.5 writes to ENTER.
const ENTER_WORD: u16 = 0;

/// Who commands, and what the inputs do: n02, n06 to n08.
const MOVE_CONTROL: [u16; 4] = [N02.address(), N06.address(), N07.address(), N08.address()];

/// The manual lists no functions, and does not say whether their level counts or their edge.
const INPUT_IS_ON: Refusal = Refusal::Overridden {
    by: "an input that is on (002Bh, or bits 4 to 6 of 0001h), which may start the motor by another function,",
    remedy: "open the inputs first",
};

/// What is known of the EEPROM.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Eeprom {
    saves: u32,
    /// Whether a parameter was changed since the last save.
    changed: bool,
}

impl Eeprom {
    /// An EEPROM that was written so many times already.
    pub(crate) const fn after(saves: u32) -> Self {
        Self { saves, changed: false }
    }
}

impl<P: Port> Drive3g3ev<P> {
    pub(crate) async fn change_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        refuse_commands(row, &[COMMAND.address(), REFERENCE.address()])?;
        if row.address == ENTER.address() {
            return Err(Error::Unsupported {
                what: "writing ENTER as a parameter",
                reason: "a save to EEPROM is counted and refused when nothing changed; use it",
            });
        }
        if MOVE_CONTROL.contains(&row.address) {
            let order = Order::WriteParameter(row.address);
            self.check_rest(order).await?;
            let on = self.registers.at(Class::Background).read(INPUT_TERMINALS).await?;
            if on != 0 || !self.inputs().is_empty() {
                return Err(self.refused(order, INPUT_IS_ON));
            }
        }
        let outcome = self.registers.at(Class::Background).change_row(row, word).await;
        // Whatever was read before may be another now, also when it is not known whether the write arrived.
        let may_have_changed = match &outcome {
            Ok(written) => written.changed,
            Err(error) => {
                !matches!(error.kind(), ErrorKind::Refused | ErrorKind::Exception | ErrorKind::NotSent)
            }
        };
        if may_have_changed && row.storage == Storage::RamUntilSaved {
            self.settings.written(row);
            self.watch.forget_settings();
            self.eeprom.changed = true;
        }
        outcome
    }

    /// Refuses what is done only to a motor that stands, and under no run command: one that does not act may act by it.
    async fn check_rest(&mut self, order: Order) -> Result<()> {
        let stands = Command::from_bits_retain(self.read_command(Class::Background).await?.value);
        let status = self.read_status(Class::Background).await?;
        let turns = status.raw(OUTPUT_FREQUENCY.address()) != Some(0);
        if stands.contains(Command::RUN) || is_run(&status) || turns {
            return Err(self.refused(order, Refusal::MotorRunning));
        }
        Ok(())
    }

    pub(crate) const fn assume_unsaved(&mut self) {
        self.eeprom.changed = true;
    }

    pub(crate) async fn enter(&mut self) -> Result<u32> {
        if !self.eeprom.changed {
            return Err(self.refused(Order::Persist, Refusal::NothingToSave));
        }
        if self.eeprom.saves >= EEPROM_LIFE {
            return Err(self.refused(Order::Persist, Refusal::EepromLife));
        }
        self.check_rest(Order::Persist).await?;
        let outcome = self.registers.at(Class::Background).edge().write(ENTER, ENTER_WORD).await;
        let may_have_saved = match &outcome {
            Ok(()) => true,
            Err(error) => {
                !matches!(error.kind(), ErrorKind::Refused | ErrorKind::Exception | ErrorKind::NotSent)
            }
        };
        self.eeprom.saves += u32::from(may_have_saved);
        outcome?;
        self.eeprom.changed = false;
        Ok(self.eeprom.saves)
    }
}
