//! A family of which nothing is known when a program is compiled: its tables and functions hold what was read at run time.

use drive_core::{
    Capabilities, Row,
    access::Access,
    interned,
    registers::{Confidence, Factory, Range, Space, Storage, Unit},
};
use drive_families::{Bit, Definition, Family, OptionEntry, Options};

/// What a file says: a name, the address of its status, the name of that register's lowest bit, its highest setpoint.
const FILE: &str = "fan7 100 RUN 45";

/// The family of a file; everything in it lives as long as the program.
fn read(file: &str) -> Family {
    let [key, address, bit, highest] = file.split(' ').collect::<Vec<_>>()[..] else { panic!("four words") };
    let (address, highest): (u16, u32) = (address.parse().unwrap(), highest.parse().unwrap());
    let status = Row {
        space: Space::HoldingRegister,
        address,
        code: interned::text("STA"),
        name: "status",
        access: Access::Read,
        storage: Storage::Volatile,
        unit: Unit::BITS,
        range: Range::Any,
        factory: Factory::None,
        confidence: Confidence::Manual,
        source: "its file",
    };
    let capabilities = interned::one(Capabilities {
        rows: interned::list(&[status]),
        ..Capabilities::least(interned::text(key), "A drive from a file")
    });
    let bit = interned::text(bit);
    let bits = move |of: u16| if of == address { vec![Bit { mask: 1, name: bit }] } else { Vec::new() };
    let is_setpoint = move |text: &str| text.parse().is_ok_and(|hertz: u32| (1..=highest).contains(&hertz));
    let options =
        vec![OptionEntry::new("highest", "a frequency", "its highest", Box::leak(Box::new(is_setpoint)))];
    // Whose driver it is says nothing here.
    let definition = Definition::new(capabilities, &|port, slave, _| Family::ATV312.open(port, slave))
        .with_options(options.leak())
        .with_bits(Box::leak(Box::new(bits)));
    Family::new(Box::leak(Box::new(definition)))
}

#[test]
fn a_family_from_a_file_is_one_by_name_with_options_bits_and_rows_like_those_that_are_built_in() {
    let family = read(FILE);
    family.add().expect("nobody has its name");
    let known: Family = "FAN7".parse().expect("it is known");
    assert_eq!(known, family);
    assert_eq!(known.capabilities().rows[0].code, "STA");
    assert_eq!(known.bits(100).iter().map(|bit| bit.name).collect::<Vec<_>>(), ["RUN"]);
    assert!(known.bits(101).is_empty());
    let mut options = Options::default();
    assert!(options.set("highest", "46").is_err(), "more than its file allows");
    options.set("highest", "45").expect("what its file allows");
    options.check(known).expect("the option is this family's");
    assert!(options.check(Family::ATV312).is_err());
    // The same file again is the same family, and has the same tables.
    assert!(std::ptr::eq(read(FILE).capabilities(), family.capabilities()));
    assert_eq!(read(FILE).add().unwrap_err().0, "fan7");
}
