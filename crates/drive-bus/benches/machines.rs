//! The pure machines: encoding, delimiting and decoding, choosing.
#![allow(missing_docs, reason = "criterion's macros make an undocumented function")]

use std::{hint::black_box, sync::Arc, time::Duration};

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use drive_bus::{
    Echo, LineConfig, answer,
    exchange::{Machine, rtu, rtu::Rtu},
    master::Master,
    pdu,
    schedule::{Chosen, Readiness, Rules, Schedule},
};
use drive_core::{Class, Terms, serial::SerialSettings};
use tokio::time::Instant;
use tokio_modbus::Request;

fn encode(criterion: &mut Criterion) {
    let read = Request::ReadHoldingRegisters(3201, 8);
    criterion.bench_function("encode a read of 8 registers with its CRC", |bench| {
        bench.iter(|| rtu::frame(1, &pdu::encode(black_box(&read)).unwrap()));
    });
    let write = Request::WriteMultipleRegisters(3201, (0..63).collect());
    criterion.bench_function("encode a write of 63 registers with its CRC", |bench| {
        bench.iter(|| rtu::frame(1, &pdu::encode(black_box(&write)).unwrap()));
    });
}

fn answer_to(request: &Request<'_>) -> Vec<u8> {
    answer_of(1, request)
}

fn answer_of(slave: u8, request: &Request<'_>) -> Vec<u8> {
    let len = answer::likely_len(request);
    let mut pdu = vec![0; len];
    pdu[0] = request.function_code().value();
    pdu[1] = (len - 2) as u8;
    rtu::frame(slave, &pdu).to_vec()
}

fn decode(criterion: &mut Criterion) {
    let request = Arc::new(Request::ReadHoldingRegisters(3201, 8));
    let (encoded, bytes) = (pdu::encode(&request).unwrap(), answer_to(&request));
    let now = Instant::now();
    let mut machine = Rtu::new(SerialSettings::MODBUS_DEFAULT, Duration::from_millis(20), Echo::Off);
    criterion.bench_function("exchange: a read of 8 registers, answered whole", |bench| {
        bench.iter(|| {
            machine.start(1, Arc::clone(&request), &encoded);
            machine.handle_sent(now, now);
            machine.handle_bytes(now, black_box(&bytes))
        });
    });
    criterion.bench_function("exchange: a read of 8 registers, answered byte by byte", |bench| {
        bench.iter(|| {
            machine.start(1, Arc::clone(&request), &encoded);
            machine.handle_sent(now, now);
            bytes.iter().map(|byte| machine.handle_bytes(now, &[*byte])).last()
        });
    });
}

fn schedule(criterion: &mut Criterion) {
    let now = Instant::now();
    let full = || {
        let mut schedule = Schedule::new(Rules { limit: 1_000, aging: Duration::from_secs(1) });
        for work in 0..1_000_u32 {
            let class = Class::ALL[1 + work as usize % 4];
            schedule.push(now, (work % 247 + 1) as u8, Terms::of(class), work).unwrap();
        }
        schedule
    };
    criterion.bench_function("schedule: one choice among 1000 requests", |bench| {
        bench.iter_batched_ref(
            full,
            |schedule| match schedule.choose(now, |_| Readiness {
                at: now,
                takes: Duration::from_millis(20),
                holds_line: false,
            }) {
                Chosen::Send(entry) => entry.work,
                Chosen::Wait(_) | Chosen::Idle => 0,
            },
            BatchSize::SmallInput,
        );
    });
}

fn master(criterion: &mut Criterion) {
    let config = LineConfig { unpaced: true, ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT) };
    let mut master: Master<()> = Master::new(Instant::now(), config);
    let now = Instant::now();
    master.handle_up(now);
    let bytes = answer_to(&Request::ReadHoldingRegisters(3201, 8));
    criterion.bench_function("master: one call, from its submission to its outcome", |bench| {
        bench.iter(|| {
            let request = Request::ReadHoldingRegisters(3201, 8);
            master.submit(now, 1, request, Terms::default(), ()).unwrap();
            master.poll_transmit(now).unwrap();
            master.handle_sent(now);
            master.handle_bytes(now, black_box(&bytes));
            master.poll_outcome().unwrap()
        });
    });
}

/// Each of 31 slaves is asked for its status and something of the background all the time, as on a full line.
fn full_line(criterion: &mut Criterion) {
    let config = LineConfig { unpaced: true, ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT) };
    let mut now = Instant::now();
    let mut master: Master<(u8, Class, u16)> = Master::new(now, config);
    master.handle_up(now);
    let ask = |master: &mut Master<_>, now, (slave, class, count)| {
        let read = Request::ReadHoldingRegisters(3201, count);
        master.submit(now, slave, read, Terms::of(class).sparing(3), (slave, class, count)).unwrap();
    };
    for slave in 1..=31 {
        ask(&mut master, now, (slave, Class::Status, 2));
        ask(&mut master, now, (slave, Class::Background, 8));
    }
    criterion.bench_function("master: one call of a line whose 31 slaves are asked all the time", |bench| {
        bench.iter(|| {
            let sent = master.poll_transmit(now).unwrap();
            master.handle_sent(now);
            now += Duration::from_millis(18);
            let request = Request::ReadHoldingRegisters(3201, u16::from_be_bytes([sent[4], sent[5]]));
            master.handle_bytes(now, &answer_of(sent[0], &request));
            let (again, outcome) = master.poll_outcome().unwrap();
            outcome.unwrap().unwrap();
            now += Duration::from_millis(2);
            ask(&mut master, now, again);
        });
    });
}

criterion_group!(machines, encode, decode, schedule, master, full_line);
criterion_main!(machines);
