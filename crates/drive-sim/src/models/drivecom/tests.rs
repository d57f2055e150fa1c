use std::time::Duration;

use super::*;
use crate::{Ramp, Ramps};

const SECOND: Duration = Duration::from_secs(1);
const SLF: u16 = 5;

fn ramp(time: Duration) -> Ramp {
    Ramp { full_scale: 5_000, time }
}

const fn settings() -> Settings {
    let three = Ramp { full_scale: 5_000, time: Duration::from_secs(3) };
    let none = Injection { percent: 0, time: Duration::ZERO };
    Settings {
        bits: CommandBits::LEVEL_3,
        runs_by_level: false,
        ramps: Ramps { acceleration: three, deceleration: three },
        fast_stop: Ramp { full_scale: 5_000, time: Duration::from_millis(750) },
        stop: Stop::Ramp,
        injection_current: 70,
        injection_limit: 50,
        injection_time: Duration::from_millis(500),
        standstill: (Standstill::No, [none; 2]),
        low_speed: 0,
        high_speed: 5_000,
        low_speed_time: None,
        brake_release: Duration::ZERO,
        restarts: None,
        link: LinkWatch { timeout: Some(Duration::from_secs(10)), reaction: Reaction::Freewheel, code: SLF },
    }
}

fn basic() -> Settings {
    Settings { bits: CommandBits::BASIC, ..settings() }
}

/// Commanded by the bus.
fn drive(settings: Settings) -> Drivecom {
    let by_bus = Situation { commander: Commander::Bus, ..Situation::default() };
    Drivecom::new(Nameplate::light(20), settings, by_bus)
}

fn situate(drive: &mut Drivecom, change: impl FnOnce(&mut Situation)) {
    let mut situation = *drive.situation();
    change(&mut situation);
    drive.situate(situation);
}

fn refer(drive: &mut Drivecom, reference: i32) {
    situate(drive, |asked| (asked.reference, asked.bus_reference) = (reference, reference));
}

/// Up the ladder and at 50 Hz.
fn running(settings: Settings) -> Drivecom {
    let mut drive = drive(settings);
    refer(&mut drive, 5_000);
    for word in [0x0006, 0x0007, 0x000F] {
        drive.command(word);
    }
    drive.advance(3 * SECOND);
    assert_eq!(drive.eta(), 0x0627);
    drive
}

fn state_after(words: &[u16]) -> ChartState {
    let mut drive = drive(settings());
    words.iter().for_each(|word| drive.command(*word));
    drive.state()
}

#[test]
fn every_transition_of_the_chart_has_its_control_word() {
    use ChartState::{OperationEnabled, QuickStopActive, ReadyToSwitchOn, SwitchOnDisabled, SwitchedOn};
    let cases: [(&[u16], ChartState); 17] = [
        (&[], SwitchOnDisabled),
        (&[0x0007], SwitchOnDisabled),
        (&[0x000F], SwitchOnDisabled),
        (&[0x0006], ReadyToSwitchOn),
        (&[0x0006, 0x0007], SwitchedOn),
        (&[0x0006, 0x000F], OperationEnabled),
        (&[0x0006, 0x0000], SwitchOnDisabled),
        (&[0x0006, 0x0002], SwitchOnDisabled),
        (&[0x0006, 0x0007, 0x000F], OperationEnabled),
        (&[0x0006, 0x0007, 0x0006], ReadyToSwitchOn),
        (&[0x0006, 0x0007, 0x0002], SwitchOnDisabled),
        (&[0x0006, 0x000F, 0x0007], SwitchedOn),
        (&[0x0006, 0x000F, 0x0006], ReadyToSwitchOn),
        (&[0x0006, 0x000F, 0x0000], SwitchOnDisabled),
        (&[0x0006, 0x000F, 0x0002], QuickStopActive),
        (&[0x0006, 0x000F, 0x0002, 0x000F], QuickStopActive),
        (&[0x0006, 0x000F, 0x0002, 0x0000], SwitchOnDisabled),
    ];
    for (words, state) in cases {
        assert_eq!(state_after(words), state, "{words:04X?}");
    }
}

#[test]
fn the_status_word_reads_as_the_manual_prints_it() {
    let mut drive = drive(settings());
    assert_eq!(drive.eta(), 0x0240);
    refer(&mut drive, 5_000);
    for (word, eta) in [(0x0006, 0x0221), (0x0007, 0x0223), (0x000F, 0x0227)] {
        drive.command(word);
        drive.advance(SECOND);
        assert_eq!(drive.eta(), eta, "{word:04X}");
    }
    drive.advance(2 * SECOND);
    assert_eq!((drive.eta(), drive.eti()), (0x0627, 0x4010));
    drive.command(0x080F);
    drive.advance(4 * SECOND);
    assert_eq!((drive.eta(), drive.eti()), (0x8227, 0xC250));
    drive.advance(2 * SECOND);
    assert_eq!(drive.eta(), 0x8627);
    drive.command(0x100F);
    drive.advance(3 * SECOND);
    assert_eq!((drive.eta(), drive.motor().is_fed()), (0x0627, false), "a normal stop");
}

#[test]
fn each_stop_takes_its_own_way_to_standstill() {
    // In hundredths of a second.
    let stop_time = |settings: Settings, word: u16| {
        let mut drive = running(settings);
        drive.command(word);
        let mut time = Duration::ZERO;
        while drive.motor().shaft_frequency() > 0 {
            drive.advance(Duration::from_millis(1));
            time += Duration::from_millis(1);
        }
        time.as_millis().div_ceil(10)
    };
    let basic = basic();
    assert_eq!(stop_time(basic, 0x100F), 300, "Stt");
    assert_eq!(stop_time(basic, 0x400F), 75, "fast stop");
    assert_eq!(stop_time(basic, 0x0002), 75, "quick stop");
    assert_eq!(stop_time(basic, 0x0007), 300, "disable operation");
    assert_eq!(stop_time(basic, 0x0000), 1_000, "freewheel, friction only");
    assert_eq!(stop_time(basic, 0x0006), 1_000, "freewheel, friction only");
    assert!(stop_time(basic, 0x200F) <= 50, "direct current");
    assert_eq!(stop_time(Settings { stop: Stop::Fast, ..basic }, 0x100F), 75);
}

#[test]
fn bits_that_level_3_does_not_assign_do_nothing() {
    for word in [0x200F, 0x400F] {
        let mut drive = running(settings());
        drive.command(word);
        drive.advance(SECOND);
        assert_eq!(drive.motor().output_frequency(), 5_000, "{word:04X}");
    }
}

// BBV51701 p. 40: "braking is activated when the logic state of the input or control word bit is at 1"; tdC belongs to the
// normal stop mode (p. 41). After 5 s the current is lowered.
#[test]
fn an_injection_lasts_as_long_as_its_bit_is_1() {
    let mut drive = running(basic());
    drive.command(0x200F);
    drive.advance(4_999 * SECOND / 1_000);
    assert_eq!((drive.eti() & 0x0020, drive.motor().current()), (0x0020, 14));
    drive.advance(3_600 * SECOND);
    assert_eq!((drive.eti() & 0x0020, drive.motor().current()), (0x0020, 10));
    drive.command(0x200F);
    assert!(drive.motor().is_braking());
    drive.command(0x000F);
    assert!(drive.motor().is_fed() && !drive.motor().is_braking(), "a run order is taken at once");
}

// p. 40, 41: as the normal stop mode (Stt = dCI) it lasts for tdC.
#[test]
fn an_injection_as_the_normal_stop_ends_by_itself_and_does_not_begin_again() {
    let mut drive = running(Settings { stop: Stop::DcInjection, ..basic() });
    drive.command(0x100F);
    drive.advance(Duration::from_millis(499));
    assert!(drive.motor().is_braking());
    drive.advance(Duration::from_millis(1));
    drive.command(0x100F);
    assert!(!drive.motor().is_fed());
}

// p. 20, 22: whether ETI bit 4 is 1 while direct current is injected is not said.
#[test]
fn eti_shows_an_injection_with_or_without_a_running_motor() {
    for (apart, shown) in [(false, 0x0030), (true, 0x0020)] {
        let mut drive = running(basic());
        drive.set_readings(Readings { injection_is_not_running: apart, ..Readings::default() });
        drive.command(0x200F);
        drive.advance(SECOND);
        assert_eq!(drive.eti() & 0x0030, shown);
    }
}

#[test]
fn with_the_basic_levels_the_drive_starts_without_the_chart() {
    let mut drive = drive(basic());
    situate(&mut drive, |asked| asked.commander = Commander::Terminals);
    assert_eq!((drive.state(), drive.motor().is_fed()), (ChartState::OperationEnabled, false));
    drive.handed_over_by_word(Commander::Bus);
    refer(&mut drive, 5_000);
    assert_eq!((drive.state(), drive.motor().is_fed()), (ChartState::OperationEnabled, false));
    drive.command(0x000F);
    drive.advance(3 * SECOND);
    assert_eq!(drive.motor().output_frequency(), 5_000);
}

#[test]
fn the_reference_is_held_between_low_and_high_speed_and_said_to_be_exceeded() {
    let mut drive = running(settings());
    drive.set_settings(Settings { low_speed: 500, high_speed: 4_500, ..settings() });
    for (asked, target, exceeded) in [(5_000, 4_500, true), (3_000, 3_000, false), (-100, -500, true)] {
        refer(&mut drive, asked);
        assert_eq!(drive.target(), target);
        assert_eq!(drive.eta() & 0x0800 != 0, exceeded, "{asked}");
    }
}

#[test]
fn a_fault_is_reset_by_a_rising_edge_and_nothing_restarts_by_itself() {
    let mut drive = running(settings());
    drive.trip(9, Reaction::Freewheel, false);
    assert_eq!((drive.eta() & 0x006F, drive.present_fault()), (0x0008, Some(9)));
    drive.command(0x000F);
    assert_eq!(drive.state(), ChartState::Fault);
    drive.command(0x008F);
    assert_eq!((drive.state(), drive.present_fault()), (ChartState::SwitchOnDisabled, None));
    drive.advance(SECOND);
    assert!(!drive.motor().is_fed());
    drive.trip(18, Reaction::Freewheel, false);
    drive.command(0x0080);
    assert_eq!(drive.state(), ChartState::Fault, "bit 7 was still set");
    drive.command(0x0000);
    drive.command(0x0080);
    assert_eq!(drive.state(), ChartState::SwitchOnDisabled);
    assert_eq!(drive.faults().map(|fault| fault.code).collect::<Vec<_>>(), [18, 9]);
}

#[test]
fn a_fault_whose_cause_persists_is_not_reset() {
    let mut drive = running(settings());
    drive.trip(8, Reaction::Freewheel, true);
    assert_eq!(drive.eti() & 0x0004, 0);
    drive.command(0x0080);
    assert_eq!(drive.state(), ChartState::Fault);
    drive.cause_gone();
    assert_eq!(drive.eti() & 0x0004, 0x0004);
    drive.command(0x0000);
    drive.command(0x0080);
    assert_eq!(drive.state(), ChartState::SwitchOnDisabled);
}

#[test]
fn a_fault_that_asks_for_a_ramp_is_a_reaction_until_the_motor_stands() {
    let mut drive = running(settings());
    drive.trip(16, Reaction::Ramp, false);
    drive.advance(Duration::from_millis(2_999));
    assert_eq!(drive.eta() & 0x006F, 0x000F);
    drive.command(0x0080);
    assert_eq!(drive.state(), ChartState::FaultReactionActive);
    drive.advance(Duration::from_millis(1));
    assert_eq!(drive.eta() & 0x006F, 0x0008);
}

#[test]
fn the_state_at_a_trip_is_kept_with_its_fault() {
    let mut drive = running(settings());
    drive.command(0x080F);
    drive.advance(4 * SECOND);
    drive.trip(9, Reaction::Freewheel, false);
    // Ready, no emergency stop, reverse, running, accelerating, Modbus, reverse requested.
    let status = drive.faults().next().map(|fault| fault.status);
    assert_eq!(status, Some(0b1100_0010_0011_0011));
}

#[test]
fn the_link_watchdog_trips_at_its_own_moment_within_a_long_step() {
    let mut drive = running(Settings {
        link: LinkWatch { timeout: Some(2 * SECOND), reaction: Reaction::Ramp, code: SLF },
        ..settings()
    });
    drive.frame_seen();
    drive.advance(2 * SECOND + SECOND / 2);
    assert_eq!(drive.motor().output_frequency(), 4_166, "half a second down a ramp of three");
    assert_eq!(drive.present_fault(), Some(SLF));
    drive.advance(SECOND * 3);
    assert_eq!(drive.state(), ChartState::Fault);
}

#[test]
fn without_a_time_out_or_a_reaction_a_silent_line_trips_nobody() {
    let ignored = LinkWatch { timeout: Some(SECOND), reaction: Reaction::Ignore, code: SLF };
    let mut by_reaction = running(Settings { link: ignored, ..settings() });
    let mut by_bit = running(settings());
    by_bit.set_no_timeout(true);
    for drive in [&mut by_reaction, &mut by_bit] {
        drive.frame_seen();
        drive.advance(3_600 * SECOND);
        assert_eq!(drive.present_fault(), None);
    }
}

// p. 37, 55: what the standing word does when control comes back is not said.
#[test]
fn giving_control_back_restarts_a_standing_run_word_or_waits_for_a_new_one() {
    for acts in [false, true] {
        let mut drive = running(settings());
        drive.set_readings(Readings { standing_word_acts: acts, ..Readings::default() });
        let local = |drive: &mut Drivecom, forced_local: bool| {
            let commander = if forced_local { Commander::Terminals } else { Commander::Bus };
            situate(drive, |asked| (asked.commander, asked.forced_local) = (commander, forced_local));
        };
        local(&mut drive, true);
        assert_eq!((drive.eta() & 0x0200, drive.eti() & 0x6000), (0, 0));
        drive.command(0x000F);
        drive.advance(3 * SECOND);
        assert!(!drive.motor().is_fed());
        local(&mut drive, false);
        drive.advance(SECOND);
        assert_eq!(drive.motor().is_fed(), acts);
        drive.command(0x000F);
        assert!(drive.motor().is_fed());
    }
}

#[test]
fn the_stop_key_locks_the_drive_and_the_status_says_who_stopped_it() {
    let mut drive = running(settings());
    drive.stop_key();
    assert_eq!((drive.state(), drive.eta()), (ChartState::SwitchOnDisabled, 0x4240));
    for word in [0x0006, 0x000F] {
        drive.command(word);
    }
    assert_eq!(drive.eta() & 0x4000, 0);
}

#[test]
fn a_configuration_write_locks_the_drive() {
    let mut drive = drive(settings());
    drive.command(0x0006);
    drive.configuration_written();
    assert_eq!(drive.state(), ChartState::SwitchOnDisabled);
}

// p. 11: commanded by its terminals a drive is in operation enabled by itself.
#[test]
fn orders_do_nothing_when_another_channel_commands() {
    let mut drive = drive(settings());
    situate(&mut drive, |asked| asked.commander = Commander::Terminals);
    for word in [0x0006, 0x0000, 0x0006, 0x0007, 0x000F] {
        drive.command(word);
        assert_eq!((drive.state(), drive.eti() & 0x6000), (ChartState::OperationEnabled, 0));
        assert!(!drive.motor().is_fed());
    }
    situate(&mut drive, |asked| asked.commander = Commander::RemoteTerminal);
    assert_eq!(drive.eti() & 0x6000, 0x2000);
    situate(&mut drive, |asked| asked.run = Some(Run::Reverse));
    refer(&mut drive, 1_000);
    drive.advance(3 * SECOND);
    assert_eq!(drive.motor().output_frequency(), -1_000);
}

#[test]
fn a_new_ramp_acts_on_a_motor_that_runs() {
    let mut drive = running(settings());
    let slow = ramp(Duration::from_secs(30));
    drive.set_settings(Settings { ramps: Ramps { acceleration: slow, deceleration: slow }, ..settings() });
    refer(&mut drive, 0);
    drive.advance(3 * SECOND);
    assert_eq!(drive.motor().output_frequency(), 4_500);
}

#[test]
fn a_power_cycle_ends_the_run_and_remembers_the_faults() {
    let mut drive = running(settings());
    drive.trip(9, Reaction::Freewheel, false);
    drive.power_off();
    drive.power_up(settings(), *drive.situation());
    assert_eq!((drive.state(), drive.present_fault()), (ChartState::SwitchOnDisabled, None));
    assert_eq!(drive.faults().count(), 1);
    assert!(drive.motor().shaft_frequency() > 0, "the shaft turns on");
}
