//! A profile as a family, for programs that choose drives by name. With the feature `families`.

use std::{sync::Arc, time::Duration};

use drive_core::Frequency;
use drive_families::{Bit, Definition, OptionEntry, Options};

use crate::{
    drive::{Owner, ProfileDrive},
    profile::Profile,
};

const FULL_SCALE: &str = "full-scale";
const HIGHEST: &str = "highest";
const COMMANDS_ALONE: &str = "commands-alone";
const WATCHDOG_TIME: &str = "watchdog-time";

fn frequency(text: &str) -> Option<Frequency> {
    text.parse()
        .ok()
        .filter(|frequency| (Frequency::from_hertz(1)..=Frequency::from_hertz(650)).contains(frequency))
}

/// The time of a watchdog, such as `2s` or `500ms`.
fn time(text: &str) -> Option<Duration> {
    let milliseconds = match text.strip_suffix("ms") {
        Some(number) => number.trim().parse().ok()?,
        None => text.strip_suffix('s')?.trim().parse::<u64>().ok()?.checked_mul(1_000)?,
    };
    (100..=600_000).contains(&milliseconds).then(|| Duration::from_millis(milliseconds))
}

/// The last of them is an option of a drive whose watchdog any request feeds.
static OPTIONS: [OptionEntry; 4] = [
    OptionEntry::new(
        FULL_SCALE,
        "a frequency, such as 50Hz",
        "what 100 % of its setpoint is, of a drive that counts in percent",
        &|text| frequency(text).is_some(),
    ),
    OptionEntry::new(
        HIGHEST,
        "a frequency, such as 50Hz",
        "its highest setpoint, of a drive that does not tell it",
        &|text| frequency(text).is_some(),
    ),
    OptionEntry::new(
        COMMANDS_ALONE,
        "yes or no",
        "that nothing but this bus commands it, of a drive that does not tell: by it a fault is reset (default no)",
        &|text| matches!(text, "yes" | "no"),
    ),
    OptionEntry::new(
        WATCHDOG_TIME,
        "a time, such as 2s or 500ms",
        "the time of its communication watchdog, as it is set at the drive: it is asked often enough then",
        &|text| time(text).is_some(),
    ),
];

/// What its owner has said.
fn owner(options: &Options) -> Owner {
    let said = |name| options.get(name).and_then(frequency);
    Owner {
        full_scale: said(FULL_SCALE),
        highest: said(HIGHEST),
        commands_alone: options.get(COMMANDS_ALONE) == Some("yes"),
        watchdog: options.get(WATCHDOG_TIME).and_then(time),
    }
}

/// The family of a profile: `Family::new(definition(&profile)).add()` makes it known by its key. It lives as long as the program: whoever
/// reads files again keeps the one of each content.
#[must_use]
pub fn definition(profile: &Arc<Profile>) -> &'static Definition {
    let of = profile.clone();
    let open = Box::leak(Box::new(move |port, slave, options: &Options| -> Box<dyn drive_core::Drive> {
        Box::new(ProfileDrive::<Box<dyn drive_core::Port>>::new(port, slave, of.clone(), owner(options)))
    }));
    let of = profile.clone();
    let bits = Box::leak(Box::new(move |register| bits(&of, register)));
    let not_known: Vec<&'static str> = profile.not_known().map(drive_core::interned::text).collect();
    let [first @ .., _] = &OPTIONS;
    let options: &[OptionEntry] = if profile.is_fed_by_any_request() { &OPTIONS } else { first };
    let mut definition = Definition::new(profile.capabilities(), open)
        .with_options(options)
        .with_bits(bits)
        .with_revision(drive_core::interned::text(profile.digest()))
        .with_not_known(drive_core::interned::list(&not_known));
    if !profile.tells_itself() {
        definition = definition.without_tell_tale();
    }
    #[cfg(feature = "sim")]
    let definition = with_twin(definition, profile);
    Box::leak(Box::new(definition))
}

/// Its simulated twin.
#[cfg(feature = "sim")]
fn with_twin(definition: Definition, profile: &Arc<Profile>) -> Definition {
    use crate::machine::Machine;
    use drive_families::{SetUp, Twin};

    let machine = Machine::new(profile.clone());
    let machines = Box::leak(Box::new(move |set_up| -> Box<dyn drive_sim::Model> {
        let machine = machine.clone();
        Box::new(if set_up == SetUp::Factory { machine.at_the_panel() } else { machine })
    }));
    let twin = Twin::new(machines).told(&[(FULL_SCALE, "50Hz"), (HIGHEST, "50Hz"), (COMMANDS_ALONE, "yes")]);
    let trip = profile.fault_entries().first().map(|entry| entry.code);
    definition.with_twin(trip.map_or(twin, |trip| twin.tripping(trip)))
}

/// The states that the bits of a register say.
fn bits(profile: &Profile, register: u16) -> Vec<Bit> {
    let file = profile.file();
    let states = file.state.is.iter().map(crate::format::Spanned::get_ref);
    let of_register = states.filter(|is| {
        let named = file.named(is.bits.get_ref().register.get_ref());
        named.and_then(|named| file.place(named)).is_some_and(|(_, address)| address == register)
    });
    let bit = |is: &crate::format::StateIs| {
        let mask = *is.bits.get_ref().mask.get_ref();
        (mask.is_power_of_two() && is.bits.get_ref().value == mask)
            .then(|| Bit { mask, name: drive_core::interned::text(&is.state.state().to_string()) })
    };
    let mut bits: Vec<Bit> = of_register.filter_map(bit).collect();
    bits.sort_by_key(|bit| bit.mask);
    bits
}
