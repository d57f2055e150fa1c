//! Examples that BBV51701 prints.

use super::*;
use crate::referee::{
    Family, Key, Verdict, commander, effects, explains, next, order, reference, ruling, starts_by,
};

fn write(address: u16, value: u16) -> Change {
    Change::Write { address, value }
}

fn input(li: u8, closed: bool) -> Change {
    Change::Input { bit: li - 1, closed }
}

/// Controlled by the bus as p.11 advises: L3, and Modbus for the command and the reference. SA2 unassigned.
fn l3(more: &[(u16, u16)]) -> World {
    let mut words: std::collections::BTreeMap<u16, u16> = [(at::LAC, 2), (at::FR1, 164), (at::SA2, 0)].into();
    words.extend(more.iter().copied());
    World::switched_on(Family::Atv312, words)
}

const TO_RUN: [Change; 3] = [
    Change::Write { address: at::CMD, value: 0x0006 },
    Change::Write { address: at::CMD, value: 0x0007 },
    Change::Write { address: at::CMD, value: 0x000F },
];

/// Running at 30 Hz by the bus.
fn running(more: &[(u16, u16)]) -> World {
    let mut world = l3(more);
    // stop inputs that are active at 0 are closed
    world.inputs = 0b11_0000;
    let mut world = world.after(&[write(at::LFR, 300)]).after(&TO_RUN);
    world.turning = true;
    world
}

fn turning(reverse: bool, tends: u32) -> Motion {
    Motion::Turning { reverse, tends: Some(tends) }
}

fn last(world: &World, change: &Change) -> Option<Effect> {
    effects(world, change).last().and_then(|effect| effect.said())
}

#[test]
fn at_switching_on_with_l3_the_chart_must_be_followed() {
    // p.11, the note
    let world = l3(&[]);
    assert_eq!(world.state, State::SwitchOnDisabled);
    assert_eq!(starts_by(&world, &write(at::CMD, 0x000F)), Start::MayNot);
    assert_eq!(explains(&running(&[]), turning(false, 3000)), Verdict::Must);
}

#[test]
fn at_switching_on_with_l1_a_run_command_starts_at_once() {
    // p.11, the note
    let world = World::factory(Family::Atv312);
    assert_eq!(commander(&world).said(), Some(Who::Terminals));
    assert_eq!(starts_by(&world, &write(at::CMD, 0x000F)), Start::MayStart);
}

#[test]
fn the_printed_control_words_do_what_the_figure_says() {
    // p.10, the examples
    let world = running(&[]);
    assert_eq!(explains(&world.after(&[write(at::CMD, 0x080F)]), turning(true, 3000)), Verdict::Must);
    assert_eq!(last(&world, &write(at::CMD, 0x100F)), Some(Effect::Stops(Stop::Ramp)));
    let l1 = World { turning: true, ..World::factory(Family::Atv312).after(&[write(at::CMD, 0x000F)]) };
    assert_eq!(last(&l1, &write(at::CMD, 0x200F)), Some(Effect::Stops(Stop::Injection { tenths: None })));
    assert_eq!(last(&l1, &write(at::CMD, 0x400F)), Some(Effect::Stops(Stop::Fast)));
}

#[test]
fn with_l3_bits_13_and_14_do_nothing_as_delivered() {
    // p.19: "bit 13: No action, bit 14: No action"
    for word in [0x200F, 0x400F] {
        assert_eq!(last(&running(&[]), &write(at::CMD, word)), Some(Effect::Continues));
    }
    let assigned = running(&[(at::FST, 174)]);
    assert_eq!(last(&assigned, &write(at::CMD, 0x400F)), Some(Effect::Stops(Stop::Fast)));
}

#[test]
fn bit_12_no_longer_stops_once_it_selects_something_else() {
    // p.19, the factory assignments of L3
    assert_eq!(last(&running(&[(at::RPS, 172)]), &write(at::CMD, 0x100F)), Some(Effect::Continues));
}

#[test]
fn shutdown_and_disable_voltage_coast() {
    // p.10, last line
    for word in [0x0006, 0x0000] {
        assert_eq!(last(&running(&[]), &write(at::CMD, word)), Some(Effect::Stops(Stop::Freewheel)));
    }
}

#[test]
fn after_a_quick_stop_no_run_command_is_taken_before_disable_voltage() {
    // p.11
    let stopped = running(&[]).after(&[write(at::CMD, 0x0002)]);
    assert_eq!(order(&stopped).said(), Some(Order::Stop(Stop::Fast)));
    assert_eq!(starts_by(&stopped, &write(at::CMD, 0x000F)), Start::MayNot);
    let restarted = stopped.after(&[write(at::CMD, 0)]).after(&TO_RUN);
    assert_eq!(explains(&restarted, turning(false, 3000)), Verdict::Must);
}

#[test]
fn normal_stops_come_down_as_stt_says() {
    // p.40, p.41
    let by_injection = running(&[(at::STT, 3), (at::TDC, 20)]);
    let stop = Stop::Injection { tenths: Some(20) };
    assert_eq!(last(&by_injection, &write(at::CMD, 0x100F)), Some(Effect::Stops(stop)));
    assert_eq!(
        last(&running(&[(at::STT, 2)]), &write(at::CMD, 0x0007)),
        Some(Effect::Stops(Stop::Freewheel))
    );
}

#[test]
fn analog_input_2_is_added_to_the_reference_of_the_bus_as_delivered() {
    // p.42, p.15: SA2 = AI2 is summed to Fr1, and LAC = L3 does not put it back (p.35)
    let mut world = running(&[]);
    world.words.remove(&at::SA2);
    assert_eq!(explains(&world, turning(false, 3000)), Verdict::Must);
    world.analog.insert(2, 2000);
    assert_eq!(explains(&world, turning(false, 4000)), Verdict::Must);
    world.analog.insert(2, -8000);
    assert_eq!(explains(&world, turning(true, 1000)), Verdict::Must);
    assert_eq!(ruling(&world, turning(false, 3000)).verdict, Verdict::MustNot);
}

#[test]
fn a_preset_input_over_a_reference_of_the_bus_is_left_open() {
    // p.14, p.42: LI3 is PS2 as delivered
    let world = running(&[]).after(&[input(3, true)]);
    assert!(reference(&world).is_silent());
    assert!(!reference(&running(&[(at::PS2, 0)]).after(&[input(3, true)])).is_silent());
}

#[test]
fn a_run_at_reference_0_turns_at_lsp() {
    // p.27
    let world = running(&[(at::LSP, 100)]).after(&[write(at::LFR, 0)]);
    assert_eq!(explains(&world, turning(false, 1000)), Verdict::Must);
    let high = running(&[]).after(&[write(at::LFR, 600)]);
    assert_eq!(explains(&high, turning(false, 5000)), Verdict::Must);
}

#[test]
fn high_resolution_counts_600_hz_in_32767() {
    // p.19, p.20: CMI bit 9
    let world = running(&[]).after(&[write(at::CMI, 1 << 9), write(at::LFR, 2731)]);
    assert_eq!(reference(&world).said().and_then(|reference| reference.tends), Some(5000));
}

#[test]
fn a_fast_stop_input_stops_the_bus_and_its_release_restarts_only_by_level() {
    // p.40: trn as delivered
    let stopped = running(&[(at::FST, 134)]).after(&[input(6, false)]);
    assert_eq!(order(&stopped).said(), Some(Order::Stop(Stop::Fast)));
    assert_eq!(stopped.state, State::OperationEnabled);
    assert_eq!(starts_by(&stopped, &input(6, true)), Start::MayNot);
    let released = stopped.after(&[input(6, true)]);
    assert!(order(&released.after(&[write(at::CMD, 0x000F)])).is_silent());
    assert_eq!(
        starts_by(&released.after(&[write(at::CMD, 0x100F)]), &write(at::CMD, 0x000F)),
        Start::MayStart
    );
    let level = running(&[(at::FST, 134), (at::TCT, 0)]).after(&[input(6, false)]);
    assert_eq!(starts_by(&level, &input(6, true)), Start::MayStart);
}

#[test]
fn a_freewheel_input_leads_to_switch_on_disabled() {
    // p.8
    let stopped = running(&[(at::NST, 134)]).after(&[input(6, false)]);
    assert_eq!(stopped.state, State::SwitchOnDisabled);
    let released = stopped.after(&[input(6, true)]);
    assert_eq!(order(&released).said(), Some(Order::Locked));
    assert_eq!(starts_by(&released, &write(at::CMD, 0x000F)), Start::MayNot);
}

#[test]
fn a_3_wire_stop_input_stops_the_bus() {
    // p.8
    let mut world = l3(&[(at::TCC, 1)]);
    world.inputs = 1;
    let mut world = world.after(&[write(at::LFR, 300)]).after(&TO_RUN);
    world.turning = true;
    let stopped = world.after(&[input(1, false)]);
    assert_eq!(explains(&stopped, turning(false, 3000)), Verdict::MustNot);
    assert_eq!(stopped.state, State::SwitchOnDisabled);
}

#[test]
fn the_stop_key_stops_the_bus_unless_pst_is_no() {
    // p.8, p.38
    let stop = Change::Key { key: Key::Stop, held: true };
    let stopped = running(&[]).after(&[stop]);
    assert_eq!(
        (stopped.state, explains(&stopped, turning(false, 3000))),
        (State::SwitchOnDisabled, Verdict::MustNot)
    );
    assert_eq!(explains(&running(&[(at::PST, 0)]).after(&[stop]), turning(false, 3000)), Verdict::Must);
}

#[test]
fn a_stop_key_and_a_stop_at_the_terminals_end_a_quick_stop() {
    // p.10: transition 12, "STOP key on display terminal or STOP at terminals"
    let quick_stop = write(at::CMD, 0x0002);
    let key = running(&[]).after(&[quick_stop, Change::Key { key: Key::Stop, held: true }]);
    let mut closed = l3(&[(at::TCC, 1)]);
    closed.inputs = 1;
    let terminal = closed.after(&TO_RUN).after(&[quick_stop, input(1, false)]);
    let released =
        [key.after(&[Change::Key { key: Key::Stop, held: false }]), terminal.after(&[input(1, true)])];
    for world in released {
        assert_eq!(world.state, State::SwitchOnDisabled);
        let again = world.after(&[write(at::LFR, 300)]).after(&TO_RUN);
        assert_eq!(explains(&again, turning(false, 3000)), Verdict::Must);
    }
}

#[test]
fn the_terminals_start_by_an_edge_as_delivered_and_by_a_level_with_lel() {
    // p.33
    let edge = World::factory(Family::Atv312);
    assert_eq!(starts_by(&edge, &input(1, true)), Start::MayStart);
    let cut = edge.after(&[input(1, true), Change::Mains(false)]);
    assert_eq!(starts_by(&cut, &Change::Mains(true)), Start::MayNot);
    let level = World::switched_on(Family::Atv312, [(at::TCT, 0)].into());
    let cut = level.after(&[input(1, true), Change::Mains(false)]);
    assert_eq!(starts_by(&cut, &Change::Mains(true)), Start::MayStart);
}

#[test]
fn with_pfo_forward_goes_before_reverse() {
    // p.33; LI2 is reverse as delivered
    let closed = [input(2, true), input(1, true)];
    let first = World::switched_on(Family::Atv312, [(at::TCT, 2)].into()).after(&closed);
    assert_eq!(explains(&first, Motion::Turning { reverse: false, tends: None }), Verdict::Must);
    let level = World::switched_on(Family::Atv312, [(at::TCT, 0)].into()).after(&closed);
    assert!(order(&level).is_silent());
}

#[test]
fn the_loss_of_the_line_trips_as_sll_says_and_with_nto_the_motor_goes_on() {
    // p.9, p.20, p.53
    let lost = Change::Link(false);
    assert_eq!(order(&running(&[]).after(&[lost])).said(), Some(Order::Tripped(Stop::Freewheel)));
    assert_eq!(order(&running(&[(at::SLL, 6)]).after(&[lost])).said(), Some(Order::Tripped(Stop::Ramp)));
    let unwatched = running(&[]).after(&[write(at::CMI, 1 << 14), lost]);
    assert_eq!(explains(&unwatched, turning(false, 3000)), Verdict::Must);
    assert_eq!(explains(&running(&[(at::SLL, 0)]).after(&[lost]), turning(false, 3000)), Verdict::Must);
}

#[test]
fn a_fault_is_reset_into_switch_on_disabled_once_its_cause_is_gone() {
    // p.12, transition 15
    let lost = running(&[]).after(&[Change::Link(false)]);
    assert_eq!(lost.after(&[write(at::CMD, 0x0080)]).tripped, Some(5));
    let back = lost.after(&[Change::Link(true)]);
    assert_eq!(effects(&back, &write(at::CMD, 0x0080)).first().and_then(|e| e.said()), Some(Effect::Resets));
    let reset = back.after(&[write(at::CMD, 0x0080)]);
    assert_eq!((reset.tripped, reset.state), (None, State::SwitchOnDisabled));
    assert_eq!(starts_by(&reset, &write(at::CMD, 0x000F)), Start::MayNot);
}

#[test]
fn a_run_kept_at_the_terminals_starts_at_the_reset_of_a_fault_by_level_only() {
    // p.52: FLr smooths the restart "if the run command is maintained" after the reset of the detected fault
    let reset = write(at::CMD, 0x0080);
    for (tct, start) in [(0, Start::MayStart), (1, Start::MayNot)] {
        let world = World::switched_on(Family::Atv312, [(at::LAC, 2), (at::TCT, tct)].into());
        let tripped = world.after(&[input(1, true), Change::Trip(18), Change::CauseGone]);
        assert_eq!(starts_by(&tripped, &reset), start, "tCt = {tct}");
    }
}

#[test]
fn what_stands_in_cmd_after_a_power_cycle_with_l1_is_left_open_until_it_is_written() {
    // p.11: operation is enabled at once there
    let run = World::factory(Family::Atv312).after(&[write(at::LFR, 300), write(at::CMD, 0x000F)]);
    let cycled = run.after(&[Change::Mains(false), Change::Mains(true)]);
    assert!(order(&cycled).is_silent());
    assert_eq!(order(&cycled.after(&[write(at::CMD, 0x0006)])).said(), Some(Order::Locked));
    let by_l3 = running(&[]).after(&[Change::Mains(false), Change::Mains(true)]);
    assert_eq!(order(&by_l3).said(), Some(Order::Locked));
}

#[test]
fn automatic_restart_starts_terminals_by_level_and_is_left_open_for_the_bus() {
    // p.51
    let level = World::switched_on(Family::Atv312, [(at::TCT, 0), (at::ATR, 1)].into());
    let tripped = level.after(&[input(1, true), Change::Trip(18), Change::CauseGone]);
    assert_eq!(starts_by(&tripped, &Change::Wait), Start::MayStart);
    assert_eq!(starts_by(&level.after(&[input(1, true), Change::Trip(9)]), &Change::Wait), Start::MayNot);
    let bus = running(&[(at::TCT, 0), (at::ATR, 1)]).after(&[Change::Trip(18)]);
    assert_eq!(starts_by(&bus, &Change::Wait), Start::ManualSilent);
    assert_eq!(starts_by(&running(&[]).after(&[Change::Trip(18)]), &Change::Wait), Start::MayNot);
}

#[test]
fn a_motor_stopped_by_tls_starts_by_a_write_of_the_reference_alone() {
    // p.28
    let mut world = running(&[(at::TLS, 50), (at::LSP, 100)]).after(&[write(at::LFR, 0)]);
    world.turning = false;
    assert_eq!(starts_by(&world, &write(at::LFR, 300)), Start::MayStart);
}

#[test]
fn a_channel_that_an_input_gives_to_the_terminals_leaves_its_return_open() {
    // p.37: CCS by LI5, Cd1 = Mdb, Cd2 = terminals
    let world = running(&[(at::CHCF, 2), (at::CD1, 10), (at::CD2, 1), (at::CCS, 133)]);
    assert_eq!(commander(&world).said(), Some(Who::Terminals)); // LI5 is closed here
    let mut bus = l3(&[(at::CHCF, 2), (at::CD1, 10), (at::CD2, 1), (at::CCS, 133)]);
    bus = bus.after(&[write(at::LFR, 300)]).after(&TO_RUN);
    assert_eq!(explains(&bus, turning(false, 3000)), Verdict::Must);
    let away = bus.after(&[input(5, true)]);
    assert_eq!(order(&away).said(), Some(Order::Rest));
    assert_eq!(starts_by(&away, &input(5, false)), Start::ManualSilent);
}

#[test]
fn a_change_of_tcc_unassigns_the_stop_inputs() {
    // p.33
    let world = l3(&[(at::NST, 134), (at::FST, 133)]);
    let after = next(&world, &write(at::TCC, 1));
    assert_eq!((after.words.get(&at::NST), after.words.get(&at::FST)), (None, None));
}

#[test]
fn lac_l3_puts_the_channels_back_and_no_write_leads_down_again() {
    // p.35
    let world = World::switched_on(Family::Atv312, [(at::FR1, 2), (at::LAC, 1)].into());
    let l3 = next(&world, &write(at::LAC, 2));
    assert_eq!((l3.words.get(&at::FR1), l3.words.get(&at::LAC)), (None, Some(&2)));
    assert_eq!(next(&l3, &write(at::LAC, 0)).words.get(&at::LAC), Some(&2));
}

#[test]
fn a_configuration_parameter_leads_back_to_switch_on_disabled() {
    // p.10, p.11
    let mut world = running(&[]);
    assert_eq!(next(&world, &write(at::STT, 1)).state, State::OperationEnabled); // refused while running
    world.turning = false;
    let after = next(&world, &write(at::STT, 1));
    assert_eq!((after.state, order(&after).said()), (State::SwitchOnDisabled, Some(Order::Locked)));
}

#[test]
fn an_external_fault_by_the_bus_stops_as_epl_says() {
    // p.20, p.52
    let world = running(&[(at::EPL, 7)]);
    assert_eq!(order(&world.after(&[write(at::CMI, 1 << 3)])).said(), Some(Order::Tripped(Stop::Fast)));
    let low = running(&[(at::ETF, 134), (at::LET, 0)]);
    assert_eq!(low.after(&[input(6, false)]).tripped, Some(8));
}

#[test]
fn the_old_addresses_of_an_atv28_command_too() {
    // p.57: 400 is CMD, 401 is LFr
    let world = World::factory(Family::Atv312).after(&[write(400, 15), write(401, 200)]);
    assert_eq!(explains(&world, turning(false, 2000)), Verdict::Must);
}
