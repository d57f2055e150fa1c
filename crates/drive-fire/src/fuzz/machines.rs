//! The machine of each protocol: whatever comes, in any chunks at any times, it does not panic, it ends, it keeps nothing without
//! bound, it understands the next good answer, and it takes nothing for an answer that is none.

use std::{sync::Arc, time::Duration};

use drive_bus::{
    Echo,
    exchange::{
        Machine, Step,
        ascii::{Ascii, AsciiSettings},
        mbap::Mbap,
        rtu::Rtu,
        unitelway::UniTelway,
    },
    pdu,
    protocol::UniTelwaySettings,
};
use drive_core::serial::SerialSettings;
use tokio::time::Instant;
use tokio_modbus::{Request, Response};

use super::{
    Target,
    broken::{Broken, Defect},
    bytes::{ascii_frame, pieces, rtu_frame, telway_frame},
    source::Source,
};

const MS: Duration = Duration::from_millis(1);
const SERIAL: SerialSettings = SerialSettings::MODBUS_DEFAULT;
/// The slave that is asked.
const SLAVE: u8 = 1;
/// Longer than any exchange may take behind its time.
const FOR_EVER: Duration = Duration::from_secs(60);

fn machine(target: Target) -> Box<dyn Machine> {
    match target {
        Target::Ascii => Box::new(Ascii::new(SERIAL, AsciiSettings::default(), Echo::Off)),
        Target::Mbap => Box::new(Mbap::new()),
        Target::UniTelway => Box::new(UniTelway::new(SERIAL, UniTelwaySettings::default(), 20 * MS)),
        _ => Box::new(Rtu::new(SERIAL, 20 * MS, Echo::Off)),
    }
}

fn a_request(rng: &mut Source, target: Target) -> Request<'static> {
    let requests = [
        Request::ReadHoldingRegisters(3201, 4),
        Request::ReadHoldingRegisters(3201, 1),
        Request::WriteSingleRegister(8501, 6),
        Request::WriteMultipleRegisters(1, vec![1, 2].into()),
        Request::ReadInputRegisters(8, 1),
        Request::Custom(8, vec![0, 0, 0xA5, 0x37].into()),
    ];
    // UNI-TELWAY has no form for the last two.
    let count = if target == Target::UniTelway { 4 } else { requests.len() };
    requests.into_iter().nth(rng.usize(..count)).unwrap_or(Request::ReadHoldingRegisters(0, 1))
}

pub(super) fn execute(target: Target, rng: &mut Source, defect: Option<Defect>) -> Result<(), String> {
    let mut machine = machine(target);
    if let Some(defect) = defect {
        machine = Box::new(Broken::new(machine, defect));
    }
    let mut now = Instant::now();
    for _ in 0..2 {
        now = exchange(target, rng, &mut *machine, now)?;
    }
    understands(target, &mut *machine, now)
}

/// One exchange in the midst of anything; when it is over.
fn exchange(
    target: Target,
    rng: &mut Source,
    machine: &mut dyn Machine,
    begun: Instant,
) -> Result<Instant, String> {
    let request = a_request(rng, target);
    let pdu = pdu::encode(&request).map_err(|error| error.to_string())?;
    let mut now = begun;
    let sent = machine.start(SLAVE, Arc::new(request.clone()), &pdu);
    machine.handle_sent(now, now + 50 * MS);
    let number = [sent.first().copied().unwrap_or_default(), sent.get(1).copied().unwrap_or_default()];
    let stream = match target {
        Target::Ascii => pieces(rng, ascii_frame),
        Target::UniTelway => pieces(rng, telway_frame),
        Target::Mbap => pieces(rng, |rng, slave, pdu| {
            let [a, b] = if rng.bool() { number } else { rng.u16(..).to_be_bytes() };
            let len = (pdu.len() as u16 + 1).to_be_bytes();
            [&[a, b, 0, 0, len[0], len[1], slave], pdu].concat()
        }),
        _ => pieces(rng, rtu_frame),
    };
    let mut heard = Vec::new();
    for piece in stream {
        now += Duration::from_micros(rng.u64(..40_000));
        heard.extend(&piece);
        let step = machine.handle_bytes(now, &piece);
        if machine.take_strays().len() > 4 * (heard.len() + 300) {
            return Err("strays without bound".to_owned());
        }
        if goes_on(target, machine, step, &request, number, &heard, now)? {
            return Ok(now + 1_000 * MS);
        }
        if machine.deadline().is_some_and(|deadline| deadline <= now) {
            let step = machine.handle_timeout(now);
            if goes_on(target, machine, step, &request, number, &heard, now)? {
                return Ok(now + 1_000 * MS);
            }
        }
    }
    // Time alone ends it.
    let last = now;
    while let Some(deadline) = machine.deadline() {
        now = now.max(deadline);
        let step = machine.handle_timeout(now);
        if goes_on(target, machine, step, &request, number, &heard, now)? {
            return Ok(now + 1_000 * MS);
        }
        if now > last + FOR_EVER {
            return Err("the exchange never ends".to_owned());
        }
    }
    Err("the exchange has no end and waits for nothing".to_owned())
}

/// What a step asks for is done. True: the exchange is over.
fn goes_on(
    target: Target,
    machine: &mut dyn Machine,
    step: Step,
    request: &Request<'_>,
    number: [u8; 2],
    heard: &[u8],
    now: Instant,
) -> Result<bool, String> {
    match step {
        Step::More => Ok(false),
        Step::Send(_) => {
            machine.handle_sent(now, now + 50 * MS);
            Ok(false)
        }
        Step::Wait(_) => {
            let goes_on = machine.resume(SLAVE).is_some();
            if goes_on {
                machine.handle_sent(now, now + 50 * MS);
            }
            Ok(!goes_on)
        }
        Step::Done(Ok(Ok(response))) => {
            let told = spoken(&response);
            let said = target == Target::UniTelway || was_said(target, number, heard, &told, request);
            if said {
                Ok(true)
            } else {
                Err(format!("nobody has said {told:02X?} to {request:?}: {heard:02X?}"))
            }
        }
        Step::Done(_) => Ok(true),
    }
}

/// The PDU of what was told, made by hand.
pub(crate) fn spoken(response: &Response) -> Vec<u8> {
    let two =
        |function: u8, a: u16, b: u16| [&[function], &a.to_be_bytes()[..], &b.to_be_bytes()[..]].concat();
    let words = |function: u8, words: &[u16]| {
        let bytes = words.iter().flat_map(|word| word.to_be_bytes());
        [function, words.len() as u8 * 2].into_iter().chain(bytes).collect()
    };
    match response {
        Response::ReadHoldingRegisters(read) => words(3, read),
        Response::ReadInputRegisters(read) => words(4, read),
        Response::WriteSingleRegister(at, word) => two(6, *at, *word),
        Response::WriteMultipleRegisters(at, count) => two(16, *at, *count),
        Response::Custom(function, data) => [&[*function], &data[..]].concat(),
        _ => Vec::new(),
    }
}

/// Whether a whole frame of the slave with this PDU was heard, and fits what was asked.
fn was_said(target: Target, number: [u8; 2], heard: &[u8], pdu: &[u8], request: &Request<'_>) -> bool {
    let fits = match request {
        Request::WriteSingleRegister(at, word) => {
            *pdu == [&[6], &at.to_be_bytes()[..], &word.to_be_bytes()[..]].concat()[..]
        }
        Request::WriteMultipleRegisters(at, words) => {
            *pdu == [&[16], &at.to_be_bytes()[..], &(words.len() as u16).to_be_bytes()[..]].concat()[..]
        }
        Request::ReadHoldingRegisters(_, count) | Request::ReadInputRegisters(_, count) => {
            pdu.len() == 2 + 2 * usize::from(*count)
        }
        _ => true,
    };
    let frame = match target {
        Target::Ascii => {
            let lrc = pdu.iter().fold(SLAVE, |sum, byte| sum.wrapping_add(*byte)).wrapping_neg();
            let bytes = [SLAVE].into_iter().chain(pdu.iter().copied()).chain([lrc]);
            format!(":{}\r", bytes.map(|byte| format!("{byte:02X}")).collect::<String>()).into_bytes()
        }
        Target::Mbap => {
            let len = (pdu.len() as u16 + 1).to_be_bytes();
            [&[number[0], number[1], 0, 0, len[0], len[1], SLAVE], pdu].concat()
        }
        _ => {
            let mut frame = [&[SLAVE], pdu].concat();
            let crc = frame.iter().fold(0xFFFF_u16, |register, byte| {
                (0..8).fold(register ^ u16::from(*byte), |register, _| {
                    if register & 1 == 1 { register >> 1 ^ 0xA001 } else { register >> 1 }
                })
            });
            frame.extend(crc.to_le_bytes());
            frame
        }
    };
    fits && heard.windows(frame.len()).any(|window| window == frame)
}

/// The next good answer is understood; on a connection, which delivers whole what it delivers, the one behind it at the latest: the
/// head of a frame that never goes on takes one answer with it.
fn understands(target: Target, machine: &mut dyn Machine, now: Instant) -> Result<(), String> {
    // A UNI-TELWAY slave is asked first what it holds: its own crate's fuzz leads it through that.
    if target == Target::UniTelway {
        return Ok(());
    }
    let first = understands_next(target, machine, now);
    if first.is_ok() || target != Target::Mbap {
        return first;
    }
    while let Some(deadline) = machine.deadline() {
        if deadline > now + FOR_EVER {
            return Err("the exchange never ends".to_owned());
        }
        machine.handle_timeout(deadline);
    }
    understands_next(target, machine, now + FOR_EVER)
}

fn understands_next(target: Target, machine: &mut dyn Machine, now: Instant) -> Result<(), String> {
    let request = Request::ReadInputRegisters(0, 1);
    let encoded = pdu::encode(&request).map_err(|error| error.to_string())?;
    let sent = machine.start(SLAVE, Arc::new(request), &encoded);
    machine.handle_sent(now, now + 500 * MS);
    let answer = match target {
        Target::Ascii => b":0104020007F2\r\n".to_vec(),
        Target::Mbap => [&sent[..2], &[0, 0, 0, 5, SLAVE, 4, 2, 0, 7]].concat(),
        _ => vec![1, 4, 2, 0, 7, 0xF8, 0xF2],
    };
    match machine.handle_bytes(now + 5 * MS, &answer) {
        Step::Done(Ok(Ok(Response::ReadInputRegisters(words)))) if words == [7] => Ok(()),
        step => Err(format!("the next good answer is not understood: {step:?}")),
    }
}
