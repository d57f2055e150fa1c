//! Which reference counts, its sign and its limits. Frequencies are hundredths of a hertz.

use super::rules::*;
use super::{at, channel, inputs};
use crate::referee::answer::{Answer, Origin, Reference, Rule, Who};
use crate::referee::world::World;

/// The lowest and the highest frequency.
fn limits(world: &World) -> (i32, i32) {
    let sixty = world.word(at::BFR, 0) == 1;
    let high = world.word(at::HSP, if sixty { 600 } else { 500 });
    (i32::from(world.word(at::LSP, 0)) * 10, i32::from(high) * 10)
}

/// What the output tends to, or nothing near a skip frequency, where the manual promises no value.
fn tends(world: &World, asks: i32) -> Option<u32> {
    let (low, high) = limits(world);
    let tends = asks.abs().min(high).max(low).unsigned_abs();
    let skipped = [at::JPF, at::JF2].iter().any(|&address| {
        let skip = u32::from(world.word(address, 0)) * 10;
        skip != 0 && tends.abs_diff(skip) <= 100
    });
    (!skipped).then_some(tends)
}

fn analog(world: &World, number: u8) -> i32 {
    let (low, high) = limits(world);
    let share = i32::from(world.analog.get(&number).copied().unwrap_or(0));
    let asks = low + (high - low) * share.abs() / 10_000;
    if share < 0 { -asks } else { asks }
}

/// What a channel gives: where it comes from, what it asks for, and whether that is negative.
type Given = (Origin, Option<i32>, Option<bool>);

fn given(origin: Origin, asks: i32) -> Given {
    (origin, Some(asks), Some(asks < 0))
}

/// The reference of the bus.
fn bus(world: &World) -> Answer<Given> {
    let fine = world.written.get(&at::CMI).is_some_and(|word| word >> 9 & 1 == 1);
    let signed = |address: u16| world.written.get(&address).map(|&word| i32::from(word as i16));
    match (signed(at::LFR), signed(at::LFRD)) {
        (Some(_), Some(_)) => Answer::Silent(&TWO_REFERENCES),
        (None, Some(word)) if fine => Answer::Says(given(Origin::Bus, word * 60_000 / 32_767), &SIGNED_RPM),
        (None, Some(0)) => Answer::Says(given(Origin::Bus, 0), &SIGNED_RPM),
        (None, Some(word)) => Answer::Says((Origin::Bus, None, Some(word < 0)), &SIGNED_RPM),
        (Some(word), None) if fine => Answer::Says(given(Origin::Bus, word * 60_000 / 32_767), &SIGNED),
        (word, None) => Answer::Says(given(Origin::Bus, word.unwrap_or(0) * 10), &SIGNED),
    }
}

/// What a channel such as Fr1 or a summing input gives.
fn of_channel(world: &World, setting: u16) -> Answer<Given> {
    match setting {
        0 => Answer::Silent(&REFERENCE_NONE),
        number @ (1..=3 | 16) => {
            let number = number as u8;
            Answer::Says(given(Origin::Analog(number), analog(world, number)), &ANALOG)
        }
        164 => bus(world),
        167 => Answer::Says((Origin::OtherBus, None, None), &OTHER_REFERENCES),
        163 => Answer::Says(given(Origin::RemoteTerminal, world.panel.reference), &OTHER_REFERENCES),
        _ => Answer::Says((Origin::UpDown, None, Some(false)), &OTHER_REFERENCES),
    }
}

fn said(world: &World, (origin, asks, negative): Given, rule: &'static Rule) -> Answer<Reference> {
    let tends = asks.and_then(|asks| tends(world, asks));
    Answer::Says(Reference { origin, asks, negative, tends }, rule)
}

/// Inputs that select preset speeds or the jog.
fn selected(world: &World) -> Option<(Given, &'static Rule)> {
    let tcc = world.word(at::TCC, 0);
    if inputs::active_at_1(world, world.word(at::JOG, if tcc == 1 { 132 } else { 0 })) {
        return Some((given(Origin::Jog, i32::from(world.word(at::JGF, 100)) * 10), &JOGGING));
    }
    let factory = |input| if tcc == 1 { 0 } else { input };
    let by = [(at::PS2, factory(131)), (at::PS4, factory(132)), (at::PS8, 0), (at::PS16, 0)];
    by.iter()
        .any(|&(address, factory)| inputs::active_at_1(world, world.word(address, factory)))
        .then_some(((Origin::Preset, None, Some(false)), &PRESET_SPEEDS))
}

/// The setting that gives the reference now, and whether summing inputs are added to it.
fn setting(world: &World) -> (u16, bool) {
    if channel::is_l3(world) {
        return channel::reference_channel(world);
    }
    // L1 and L2: the bus's own when the bus commands, else the channel
    match channel::commander(world).said() {
        Some(Who::Bus) => (164, false),
        Some(Who::RemoteTerminal) => (163, false),
        _ => channel::reference_channel(world),
    }
}

/// A summing input, added to Fr1.
fn add(world: &World, setting: u16, sum: Answer<Reference>) -> Answer<Reference> {
    let Answer::Says(sum, rule) = sum else {
        return sum;
    };
    match of_channel(world, setting) {
        Answer::Silent(silence) => Answer::Silent(silence),
        Answer::Says((Origin::Analog(number), ..), _)
            if world.analog.get(&number).copied().unwrap_or(0) == 0 =>
        {
            Answer::Says(sum, rule)
        }
        Answer::Says((_, more, _), _) => {
            let asks = sum.asks.zip(more).map(|(asks, more)| asks + more);
            said(world, (sum.origin, asks, asks.map(|asks| asks < 0)), &SUMMING)
        }
    }
}

fn of_forced_local(world: &World) -> Answer<Reference> {
    if !channel::is_l3(world) {
        return Answer::Silent(&FORCED_LOCAL_NOT_L3);
    }
    match of_channel(world, world.word(at::FLOC, 1)) {
        Answer::Says(given, _) => said(world, given, &FORCED_LOCAL),
        Answer::Silent(silence) => Answer::Silent(silence),
    }
}

pub(super) fn reference(world: &World) -> Answer<Reference> {
    match channel::forced_local(world) {
        None => return Answer::Silent(&FORCED_LOCAL_LEVEL),
        Some(true) => return of_forced_local(world),
        Some(false) => {}
    }
    let (setting, sums) = setting(world);
    if let Some((given, rule)) = selected(world) {
        let analog = matches!(setting, 1..=3 | 16);
        return if analog { said(world, given, rule) } else { Answer::Silent(&PRESET_AND_BUS) };
    }
    let mut reference = match of_channel(world, setting) {
        Answer::Silent(silence) => return Answer::Silent(silence),
        Answer::Says(given, rule) => {
            let by_l1 = given.0 == Origin::Bus && !channel::is_l3(world);
            said(world, given, if by_l1 { &L1_BUS } else { rule })
        }
    };
    if sums {
        for (address, factory) in [(at::SA2, 2), (at::SA3, 0)] {
            match world.word(address, factory) {
                0 => {}
                setting => reference = add(world, setting, reference),
            }
        }
    }
    match reference {
        // the limits are the rule where they make the frequency
        Answer::Says(reference, _) if limited(reference) => Answer::Says(reference, &LIMITS),
        other => other,
    }
}

fn limited(reference: Reference) -> bool {
    reference.asks.zip(reference.tends).is_some_and(|(asks, tends)| asks.unsigned_abs() != tends)
}
