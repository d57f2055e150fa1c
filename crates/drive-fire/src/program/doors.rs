//! What comes in over the network.

use super::{judge, plant::Plant};
use crate::fuzz::{Source, change};

/// Requests as programs send them; none of them starts anything.
const REQUESTS: &[&str] = &[
    "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "GET /api/v1/state HTTP/1.1\r\nHost: localhost\r\nAccept: application/json\r\n\r\n",
    "GET /api/v1/drives/pump%201 HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "GET /api/v1/drives/pump%201/history?seconds=60 HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "GET /api/v1/drives/pump%201/past?value=output_frequency_hz&from=0&to=1 HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "GET /api/v1/drives/fan/parameters/ACC HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "GET /api/v1/drives/fan/why?at=now HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "GET /api/v1/history/moment?at=1700000000000 HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "GET /api/v1/events/recent HTTP/1.1\r\nHost: localhost\r\nIf-None-Match: \"1\"\r\n\r\n",
    "HEAD /healthz HTTP/1.0\r\nHost: localhost\r\nRange: bytes=0-1\r\n\r\n",
    "POST /api/v1/drives/pump%201/setpoint HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 18\r\n\r\n{\"frequency\":25.5}",
    "POST /api/v1/drives/pump%202/stop HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 15\r\n\r\n{\"mode\":\"ramp\"}",
    "POST /api/v1/groups/pumps/stop HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\n\r\n",
    "POST /api/v1/selected/stop HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 28\r\n\r\n{\"drives\":[\"pump 1\",\"fan\"]}\n",
    "POST /api/v1/drives/fan/reset HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer abc\r\nContent-Length: 0\r\n\r\n",
    "POST /api/v1/login HTTP/1.1\r\nHost: localhost\r\nOrigin: http://localhost\r\nCookie: session=abc\r\nContent-Type: application/json\r\nContent-Length: 13\r\n\r\n{\"token\":\"x\"}",
];

/// One request, as it is or changed, or two behind each other.
pub(super) fn http(plant: &Plant, rng: &mut Source) -> Result<(), String> {
    let mut bytes = REQUESTS[rng.usize(..REQUESTS.len())].as_bytes().to_vec();
    if rng.u8(..5) == 0 {
        bytes.extend(REQUESTS[rng.usize(..REQUESTS.len())].as_bytes());
    }
    if rng.u8(..8) > 0 {
        change(rng, &mut bytes);
    }
    let answer = plant.ask(plant.http, &bytes);
    let answer = answer.map_err(|error| format!("{error}: {}", String::from_utf8_lossy(&bytes)))?;
    judge::http(&answer).map_err(|why| format!("{why}\n    to {}", String::from_utf8_lossy(&bytes)))
}

/// PDUs as a SCADA sends them (MODBUS Application Protocol V1.1b3, section 6; BBV51701): none of them starts anything.
const ASKED: &[&[u8]] = &[
    &[3, 0x0C, 0x81, 0, 4],
    &[3, 0, 0, 0, 20],
    &[4, 0x0C, 0x81, 0, 1],
    &[6, 0x21, 0x35, 0, 6],
    &[6, 0x21, 0x36, 0, 0xFA],
    &[16, 0x21, 0x35, 0, 2, 4, 0, 6, 0, 0xFA],
    &[8, 0, 0, 0xA5, 0x37],
    &[0x2B, 0x0E, 1, 0],
    &[1, 0, 0, 0, 8],
    &[0x17, 0, 0, 0, 1, 0, 1, 0, 1, 2, 0, 6],
];

/// Some frames in one stream, as they are or changed.
pub(super) fn gateway(plant: &Plant, rng: &mut Source) -> Result<(), String> {
    let mut sent = Vec::new();
    for _ in 0..rng.usize(1..4) {
        let pdu = ASKED[rng.usize(..ASKED.len())];
        let unit = [1, 2, 5, 247, 0, 9, 255][rng.usize(..7)];
        let [high, low] = (pdu.len() as u16 + 1).to_be_bytes();
        let [a, b] = rng.u16(..).to_be_bytes();
        let mut frame = [&[a, b, 0, 0, high, low, unit], pdu].concat();
        if rng.u8(..4) > 0 {
            change(rng, &mut frame);
        }
        sent.extend(frame);
    }
    let answers = plant.ask(plant.gateway, &sent).map_err(|error| format!("{error}: {sent:02X?}"))?;
    judge::gateway(&sent, &answers).map_err(|why| format!("{why}\n    to {sent:02X?}"))
}

/// What is asked rightly is answered rightly: by HTTP, by a stop, by the gateway.
pub(super) fn lives(plant: &Plant) -> Result<(), String> {
    let ready = b"GET /api/v1/drives HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    let answer = plant.ask(plant.http, ready).map_err(|error| format!("HTTP is dead: {error}"))?;
    if !answer.starts_with(b"HTTP/1.1 200") {
        return Err(format!("HTTP is dead: {}", String::from_utf8_lossy(&answer)));
    }
    let stop =
        b"POST /api/v1/drives/fan/stop HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n\
                 Content-Length: 2\r\nConnection: close\r\n\r\n{}";
    let answer = plant.ask(plant.http, stop).map_err(|error| format!("no stop: {error}"))?;
    if !answer.starts_with(b"HTTP/1.1 2") {
        return Err(format!("no stop: {}", String::from_utf8_lossy(&answer)));
    }
    let read = [0x15, 1, 0, 0, 0, 6, 1, 3, 0x0C, 0x81, 0, 1];
    // Where this machine has too much to do a simulated drive may be late: then it is asked again.
    let mut said = Vec::new();
    for _ in 0..5 {
        said = plant.ask(plant.gateway, &read).map_err(|error| format!("the gateway is dead: {error}"))?;
        match said[..] {
            [0x15, 1, 0, 0, 0, 5, 1, 3, 2, _, _] => return Ok(()),
            [0x15, 1, 0, 0, 0, 3, 1, 0x83, 0x0B] => {}
            _ => break,
        }
    }
    Err(format!("the gateway is dead: {said:02X?}"))
}

/// Nobody has started a motor.
pub(super) fn nothing_moves(plant: &Plant) -> Result<(), String> {
    let all = b"GET /api/v1/drives HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    let answer = plant.ask(plant.http, all).map_err(|error| error.to_string())?;
    let text = String::from_utf8_lossy(&answer);
    if text.contains("\"running\"") && text.contains("\"state\":\"running\"") {
        return Err(format!("a motor runs, and nobody has started it: {text}"));
    }
    Ok(())
}
