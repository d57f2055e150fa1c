//! Registers and their values as a person writes and reads them.

use drive_core::{Capabilities, Row};
use drive_families::Family;

use drived_words::{
    failure::Failure,
    meant::did_you_mean,
    output::Table,
    registers::alike,
    registers::{factory, range},
};

/// Every register of a family.
pub(super) fn list(family: Family) -> Table {
    let mut table =
        Table::new(["register", "mnemonic", "name and range", "access, kept in", "factory", "source"]);
    let capabilities = family.capabilities();
    for row in capabilities.rows {
        table.row([
            row.place().to_string(),
            row.code.to_owned(),
            with_range(row),
            format!("{} {}", row.access, row.storage),
            factory(capabilities, row),
            row.source.to_owned(),
        ]);
    }
    table
}
/// The register that a person names, by mnemonic or address.
pub(super) fn find(family: Family, text: &str) -> Result<&'static Row, Failure> {
    let rows = family.capabilities().rows;
    Row::find(rows, text).ok_or_else(|| {
        let meant = did_you_mean(&alike(rows, text));
        let list = format!("drived param list {family} has all");
        let why = if meant.is_empty() { format!(": {list}") } else { format!("{meant} {list}") };
        Failure::Input(format!("{family} has no register {text:?}{why}"))
    })
}

/// A table of registers with their values.
pub(super) fn value_table() -> Table {
    Table::new(["register", "mnemonic", "value", "name and range", "access", "factory"])
}

/// A row of it.
pub(super) fn value_cells(capabilities: &Capabilities, row: &Row, value: String) -> [String; 6] {
    [
        row.place().to_string(),
        row.code.to_owned(),
        value,
        with_range(row),
        row.access.to_string(),
        factory(capabilities, row),
    ]
}

fn with_range(row: &Row) -> String {
    match range(row) {
        range if range.is_empty() => row.name.to_owned(),
        range => format!("{}: {range}", row.name),
    }
}
