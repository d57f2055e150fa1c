//! Outputs that are not at their setpoints.

use super::*;
use crate::alarms::{AlarmKind, Look, Moment};

fn moment(rig: &Rig) -> Moment {
    Moment { at: rig.now, unix_ms: 0 }
}

/// What is told of an output that is not at its setpoint.
fn off(rig: &Rig) -> Option<String> {
    let concerns = rig.snapshot().concerns(rig.now);
    let told = concerns.into_iter().find(|concern| concern.kind == ConcernKind::OffSetpoint);
    told.map(|concern| concern.detail.unwrap_or_default())
}

/// Reverse is inhibited in the drive (a V20's P1110, a WJ200's b035): the motor comes down, and stays there.
#[test]
fn a_motor_that_is_driven_and_comes_no_nearer_to_its_setpoint_is_told_once_that_lasts() {
    let mut rig = Rig::running_at(25);
    rig.drive.status.at_reference = Some(false);
    // 50 Hz in 1000 s.
    for centihertz in (0..1_500).step_by(5) {
        rig.drive.status.output_frequency = Some(Frequency::from_centihertz(centihertz));
        rig.pass(1_000 * MS);
        assert_eq!(off(&rig), None, "{centihertz}: a slow ramp");
    }
    rig.pass(30_000 * MS);
    assert_eq!(off(&rig).as_deref(), Some("output 14.95 Hz, setpoint 25.00 Hz"));
    rig.drive.status.output_frequency = Some(Frequency::from_hertz(16));
    rig.pass(1_000 * MS);
    assert_eq!(off(&rig), None, "it goes on");
    rig.drive.status.output_frequency = Some(Frequency::from_hertz(24));
    rig.pass(60_000 * MS);
    assert_eq!(off(&rig), None, "slip");
}

/// A scale that is wrong by ten, as of a drive by a file: nobody waits until it says that it is at its reference.
#[test]
fn a_motor_that_goes_on_above_its_setpoint_is_told_on_its_way() {
    let mut rig = Rig::running_at(20);
    rig.drive.status.at_reference = Some(false);
    let mut told = Vec::new();
    // Up to the setpoint and an overshoot of a moment, back, and then on.
    for hertz in [10, 20, 24, 25, 24, 20, 24, 28, 32, 36, 40, 44] {
        rig.drive.status.output_frequency = Some(Frequency::from_hertz(hertz));
        rig.pass(1_000 * MS);
        told.extend(off(&rig).map(|_| hertz));
    }
    assert_eq!(told, [36, 40, 44]);
    // It is given a lower setpoint, and comes down.
    for hertz in (24..44).rev().step_by(2) {
        rig.drive.status.output_frequency = Some(Frequency::from_hertz(hertz));
        rig.pass(1_000 * MS);
        assert_eq!(off(&rig), None, "{hertz}");
    }
}

/// 100 % of a G120's setpoint is its p2000 (G120X p. 250), which nobody reads in hertz: at a p2000 of 60 Hz and a full scale of 50 Hz what is
/// asked as 25 Hz is 30 Hz, and the drive says that it is there.
#[test]
fn a_drive_that_is_at_its_reference_and_not_at_its_setpoint_is_told_once_that_lasts() {
    let mut rig = Rig::running_at(25);
    for (hertz, at_reference, told) in [
        (25, true, None),
        // On its way it is told by nothing.
        (30, false, None),
        // The compensation of slip.
        (27, true, None),
        (30, true, Some("output 30.00 Hz, setpoint 25.00 Hz")),
        (20, true, Some("output 20.00 Hz, setpoint 25.00 Hz")),
        (25, true, None),
    ] {
        rig.drive.status.output_frequency = Some(Frequency::from_hertz(hertz));
        rig.drive.status.at_reference = Some(at_reference);
        rig.pass(1_000 * MS);
        if hertz == 30 {
            assert_eq!(off(&rig), None, "a setpoint may be on its way");
        }
        rig.pass(2_000 * MS);
        assert_eq!(off(&rig).as_deref(), told, "{hertz} Hz, {at_reference}");
    }
}

/// Behind a lost line nobody knows what was given since: the drive's own reference is what it has to come to.
#[test]
fn behind_a_lost_line_an_output_is_held_against_the_drives_own_reference() {
    for measured in [false, true] {
        let mut rig = Rig::running_at(25);
        rig.drive.status.at_reference = Some(true);
        rig.pass(2_000 * MS);
        rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
        rig.pass(60_000 * MS);
        assert_eq!(rig.snapshot().link, Link::Lost);
        rig.drive.failing = None;
        let fifty = Frequency::from_hertz(50);
        match measured {
            true => rig.drive.reference = Some(fifty.into()),
            false => rig.drive.status.reference = Some(fifty),
        }
        rig.pass(60_000 * MS);
        assert_eq!((rig.snapshot().link, rig.snapshot().setpoint), (Link::Connected, None));
        assert_eq!(off(&rig).as_deref(), Some("output 25.00 Hz, the drive's own reference 50.00 Hz"));
        // Somebody else gives it another, to which it goes.
        rig.drive.status.output_frequency = Some(fifty);
        rig.pass(500 * MS);
        assert_eq!(off(&rig), None);
        rig.drive.status.output_frequency = Some(Frequency::from_hertz(20));
        rig.drive.status.reference = rig.drive.status.reference.map(|_| Frequency::from_hertz(20));
        rig.pass(2_500 * MS);
        assert_eq!(off(&rig), None, "what was measured before is none of its output of now");
    }
}

#[test]
fn a_motor_of_ours_whose_setpoint_nobody_knows_and_that_tells_no_reference_is_told_as_that() {
    let told = |rig: &Rig| {
        let concerns = rig.snapshot().concerns(rig.now);
        concerns.iter().any(|concern| concern.kind == ConcernKind::SetpointUnknown)
    };
    let mut rig = Rig::running_at(25);
    assert!(!told(&rig));
    rig.drive.reference = None;
    rig.drive.failing = Some(PortError::Timeout { after: 100 * MS });
    rig.pass(60_000 * MS);
    rig.drive.failing = None;
    rig.pass(60_000 * MS);
    assert!(told(&rig));
    assert!(
        !Look::at_drive("north", &rig.snapshot(), moment(&rig))
            .seen
            .contains(&AlarmKind::Drive(ConcernKind::OffSetpoint))
    );
    rig.order(setpoint(25));
    rig.pass(1_000 * MS);
    assert!(!told(&rig), "it was given one");
}
