//! What every family does alike, through `dyn Drive`: one story, told once, lived by each of them.

use drive_bus::{
    Protocol,
    protocol::{AsciiSettings, NetworkHeader, UniTelwaySettings},
};
use drive_core::{Faults, SerialSettings, State, serial::CharacterFormat};
use drive_families::Family;
use support::contracts::contract;

#[tokio::test(start_paused = true)]
async fn an_altivar_21_starts_reverses_stops_trips_and_recovers() {
    contract(Family::ATV21).lives_the_story().await;
}

#[tokio::test(start_paused = true)]
async fn an_altivar_28_starts_reverses_stops_trips_and_recovers() {
    contract(Family::ATV28).lives_the_story().await;
}

#[tokio::test(start_paused = true)]
async fn an_altivar_58_starts_reverses_stops_trips_and_recovers() {
    contract(Family::ATV58).lives_the_story().await;
}

#[tokio::test(start_paused = true)]
async fn an_altivar_58_lives_the_same_story_in_modbus_ascii() {
    for format in [CharacterFormat::F7E1, CharacterFormat::F8O1] {
        let settings = SerialSettings::new(9_600, format).expect("it is a speed of the card");
        let contract = contract(Family::ATV58);
        let rig = contract.rig_speaking(Protocol::Ascii(AsciiSettings::default()), settings);
        contract.lives_the_story_on(rig).await;
    }
}

#[tokio::test(start_paused = true)]
async fn an_altivar_58_lives_the_same_story_on_uni_telway() {
    let settings = Family::ATV58.capabilities().factory;
    for header in [NetworkHeader::default(), NetworkHeader::Simplified] {
        let protocol = Protocol::UniTelway(UniTelwaySettings { header, ..UniTelwaySettings::default() });
        let contract = contract(Family::ATV58);
        contract.lives_the_story_on(contract.rig_speaking(protocol, settings)).await;
    }
}

#[tokio::test(start_paused = true)]
async fn an_altivar_312_starts_reverses_stops_trips_and_recovers() {
    contract(Family::ATV312).lives_the_story().await;
}

#[tokio::test(start_paused = true)]
async fn a_3g3ev_starts_reverses_stops_trips_and_recovers() {
    contract(Family::OMRON_3G3EV).lives_the_story().await;
}

/// LFt 0 is nOF, "no fault" (ATV312 BBV51701 p. 24, ATV28 p. 22), and so is FC90 0 of an Altivar 21: the status word has tripped all the same.
#[tokio::test(start_paused = true)]
async fn a_drive_that_has_tripped_and_names_no_fault_is_told_as_that_and_as_no_code() {
    for family in [Family::ATV21, Family::ATV28, Family::ATV312] {
        let mut rig = contract(family).rig();
        let name = family.capabilities().name;
        let stands = rig.drive.faults().await.expect(name);
        assert_eq!((stands.tripped, stands.present), (false, vec![]), "{name}");
        rig.machine.trip(0);
        let status = rig.until("it has tripped", |status| status.state == State::Fault).await;
        assert_eq!(status.fault_code, None, "{name}");
        let Faults { tripped, present, .. } = rig.drive.faults().await.expect(name);
        assert_eq!((tripped, present), (true, vec![]), "{name}");
    }
}
