//! The registers of a simulated drive: RAM, the EEPROM image behind it, and the rules of each row.

use drive_core::registers::{Access, Factory, Range, Row, Storage};

use crate::model::Exception;

/// Why a register is not written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// There is no such register.
    #[error("there is no such register")]
    Unknown,
    /// The register can only be read.
    #[error("the register can only be read")]
    ReadOnly,
    /// The register is written only while the motor is stopped.
    #[error("the register is written only while the motor is stopped")]
    Running,
    /// The value is outside the register's range.
    #[error("the value is outside the register's range")]
    Range,
}

/// As most drives say it; a family with numbers of its own maps for itself.
impl From<Refusal> for Exception {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Unknown | Refusal::ReadOnly => Self::ILLEGAL_ADDRESS,
            Refusal::Range => Self::ILLEGAL_VALUE,
            Refusal::Running => Self::FAILURE,
        }
    }
}

/// The registers of one drive, made from the rows of its family.
///
/// ```
/// use drive_core::registers;
/// use drive_sim::{Bank, Refusal};
///
/// registers! {
///     /// One parameter.
///     const ROWS;
///
///     ACC: ReadWrite(9001, "ACC", "acceleration", RamUntilSaved, Unit::scaled("s", 1), Range::Within(1, 32_760), Factory::Value(30), Elsewhere, "BBV51701 p. 39");
/// }
///
/// let mut bank = Bank::new(ROWS);
/// assert_eq!(bank.read(9001), Ok(30));
/// assert_eq!(bank.write(9001, 0, true), Err(Refusal::Range));
/// bank.write(9001, 50, true).unwrap();
/// bank.power_cycle();
/// assert_eq!(bank.read(9001), Ok(30), "it was never saved");
/// ```
#[derive(Debug, Clone)]
pub struct Bank {
    /// Sorted by address.
    cells: Vec<Cell>,
    eeprom_writes: u32,
}

#[derive(Debug, Clone, Copy)]
struct Cell {
    row: &'static Row,
    factory: u16,
    ram: u16,
    eeprom: u16,
}

impl Bank {
    /// Every register at its factory setting, or 0 where the manual prints none as a number: see
    /// [`set_factory`](Self::set_factory).
    #[must_use]
    pub fn new(rows: impl IntoIterator<Item = &'static Row>) -> Self {
        let cell = |row: &'static Row| {
            let factory = match row.factory {
                Factory::Value(value) => value,
                Factory::None | Factory::Described(_) | Factory::Chosen(..) | Factory::Percent(..) => 0,
            };
            Cell { row, factory, ram: factory, eeprom: factory }
        };
        let mut cells: Vec<_> = rows.into_iter().map(cell).collect();
        cells.sort_by_key(|cell| cell.row.address);
        Self { cells, eeprom_writes: 0 }
    }

    /// Gives a register the factory setting that its row only describes ("0.7 In"), here and now as a number.
    /// Nothing happens when there is no such register.
    pub fn set_factory(&mut self, address: u16, value: u16) {
        if let Some(cell) = self.cell_mut(address) {
            (cell.factory, cell.ram, cell.eeprom) = (value, value, value);
        }
    }

    /// The row of a register.
    #[must_use]
    pub fn row(&self, address: u16) -> Option<&'static Row> {
        self.cell(address).map(|cell| cell.row)
    }

    /// The content of a register as the drive's inside has it; 0 when there is no such register.
    #[must_use]
    pub fn value(&self, address: u16) -> u16 {
        self.peek(address).unwrap_or(0)
    }

    /// The content of a register, if there is one.
    #[must_use]
    pub fn peek(&self, address: u16) -> Option<u16> {
        self.cell(address).map(|cell| cell.ram)
    }

    /// Changes a register in RAM from inside, without the rules of its row; `false` when there is no such register.
    pub fn set(&mut self, address: u16, value: u16) -> bool {
        let cell = self.cell_mut(address);
        cell.map(|cell| cell.ram = value).is_some()
    }

    /// Changes a register in RAM and EEPROM from inside, as a setting made on the panel does; `false` when there is
    /// no such register.
    pub fn set_for_good(&mut self, address: u16, value: u16) -> bool {
        let cell = self.cell_mut(address);
        let found = cell.map(|cell| (cell.ram, cell.eeprom) = (value, value)).is_some();
        self.eeprom_writes = self.eeprom_writes.saturating_add(u32::from(found));
        found
    }

    /// Reads a register as the line does.
    ///
    /// # Errors
    /// [`Exception::ILLEGAL_ADDRESS`] when there is none or it can only be written.
    pub fn read(&self, address: u16) -> Result<u16, Exception> {
        let cell = self.cell(address).filter(|cell| cell.row.access.is_readable());
        cell.map(|cell| cell.ram).ok_or(Exception::ILLEGAL_ADDRESS)
    }

    /// Whether a register would take this value from the line, by the rules of its row. For a range that the row
    /// only describes, the drive judges the rest.
    ///
    /// # Errors
    /// A [`Refusal`].
    pub fn check(&self, address: u16, value: u16, stopped: bool) -> Result<(), Refusal> {
        let row = self.row(address).ok_or(Refusal::Unknown)?;
        match row.access {
            Access::Read => return Err(Refusal::ReadOnly),
            Access::WriteStopped if !stopped => return Err(Refusal::Running),
            Access::WriteStopped | Access::ReadWrite | Access::Write => {}
        }
        // What a drive does with a bit that nobody may write is printed nowhere: this one takes the word.
        let is_allowed = matches!(row.range, Range::Bits(_)) || row.range.allows(row.unit.number(value));
        if is_allowed { Ok(()) } else { Err(Refusal::Range) }
    }

    /// Writes a register as the line does: into RAM, and into EEPROM where the row says that each write goes there
    /// or the manual does not say.
    ///
    /// # Errors
    /// A [`Refusal`]; nothing is written then.
    pub fn write(&mut self, address: u16, value: u16, stopped: bool) -> Result<(), Refusal> {
        self.check(address, value, stopped)?;
        match self.row(address).map(|row| row.storage) {
            Some(Storage::Eeprom | Storage::Unknown) => self.set_for_good(address, value),
            Some(Storage::Volatile | Storage::RamUntilSaved) | None => self.set(address, value),
        };
        Ok(())
    }

    /// Saves all parameters to EEPROM. Counted as one write, as the manuals count their orders to save.
    pub fn save(&mut self) {
        for cell in &mut self.cells {
            cell.eeprom = cell.ram;
        }
        self.eeprom_writes = self.eeprom_writes.saturating_add(1);
    }

    /// Puts the factory setting into RAM wherever `chosen` says so, of all registers that can be written.
    pub fn restore_factory(&mut self, chosen: impl Fn(&Row) -> bool) {
        for cell in self.cells.iter_mut().filter(|cell| cell.row.access.is_writable() && chosen(cell.row)) {
            cell.ram = cell.factory;
        }
    }

    /// Supply off and on: parameters come back from EEPROM, volatile registers as they are after power-up.
    pub fn power_cycle(&mut self) {
        for cell in &mut self.cells {
            cell.ram = if cell.row.storage == Storage::Volatile { cell.factory } else { cell.eeprom };
        }
    }

    /// How often the EEPROM was written.
    #[must_use]
    pub const fn eeprom_writes(&self) -> u32 {
        self.eeprom_writes
    }

    fn index(&self, address: u16) -> Option<usize> {
        self.cells.binary_search_by_key(&address, |cell| cell.row.address).ok()
    }

    fn cell(&self, address: u16) -> Option<&Cell> {
        self.index(address).and_then(|index| self.cells.get(index))
    }

    fn cell_mut(&mut self, address: u16) -> Option<&mut Cell> {
        self.index(address).and_then(|index| self.cells.get_mut(index))
    }
}

#[cfg(test)]
mod tests {
    use drive_core::registers;

    use super::*;

    registers! {
        /// One register of each kind.
        const ROWS;

        SETTING: WriteStopped(30, "SET", "a setting", RamUntilSaved, Unit::CODE, Range::Within(0, 2), Factory::Value(1), Manual, "test");
        COMMAND: ReadWrite(10, "CMD", "a command", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "test");
        WORN: ReadWrite(20, "EEP", "written to EEPROM each time", Eeprom, Unit::scaled("Hz", 1).signed(), Range::Within(-5, 5), Factory::Value(3), Manual, "test");
        STATUS: Read(11, "ETA", "a status", Volatile, Unit::BITS, Range::Any, Factory::None, Manual, "test");
        ENTER: Write(12, "ENT", "an order", Volatile, Unit::COUNT, Range::Any, Factory::None, Manual, "test");
    }

    #[test]
    fn what_is_in_ram_is_lost_by_a_power_cycle_and_what_is_in_eeprom_is_not() {
        let mut bank = Bank::new(ROWS);
        for (address, value) in [(SETTING.address(), 2), (COMMAND.address(), 15), (WORN.address(), 5)] {
            bank.write(address, value, true).unwrap();
        }
        bank.power_cycle();
        let values =
            |bank: &Bank| [SETTING.address(), COMMAND.address(), WORN.address()].map(|a| bank.value(a));
        assert_eq!(values(&bank), [1, 0, 5]);
        bank.write(SETTING.address(), 2, true).unwrap();
        bank.save();
        bank.power_cycle();
        assert_eq!(values(&bank), [2, 0, 5]);
        assert_eq!(bank.eeprom_writes(), 2);
    }

    #[test]
    fn each_rule_of_a_row_has_its_refusal() {
        let mut bank = Bank::new(ROWS);
        assert_eq!(bank.write(31, 0, true), Err(Refusal::Unknown));
        assert_eq!(bank.write(STATUS.address(), 0, true), Err(Refusal::ReadOnly));
        assert_eq!(bank.write(SETTING.address(), 0, false), Err(Refusal::Running));
        assert_eq!(bank.write(SETTING.address(), 3, true), Err(Refusal::Range));
        assert_eq!(bank.write(WORN.address(), (-6_i16).cast_unsigned(), true), Err(Refusal::Range));
        assert_eq!(bank.write(WORN.address(), (-5_i16).cast_unsigned(), true), Ok(()));
        assert_eq!(bank.read(ENTER.address()), Err(Exception::ILLEGAL_ADDRESS));
        assert_eq!(bank.read(31), Err(Exception::ILLEGAL_ADDRESS));
    }

    #[test]
    fn a_factory_setting_comes_back_where_it_is_chosen() {
        let mut bank = Bank::new(ROWS);
        bank.set_factory(SETTING.address(), 0);
        bank.set(SETTING.address(), 2);
        bank.set(WORN.address(), 4);
        bank.restore_factory(|row| row.address != WORN.address());
        assert_eq!([bank.value(SETTING.address()), bank.value(WORN.address())], [0, 4]);
    }
}
