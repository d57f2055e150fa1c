//! Outputs that are not at their setpoints.

use super::*;

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
