//! What is right of what a program says: pure, and held against what it must not take for right.

use std::time::Instant;

use crate::{
    child::Ended,
    report::{Plant, Told},
};

/// An answer of HTTP has its form and is no failure of the server's own; nothing is an answer to what is no request.
pub(super) fn http(answer: &[u8]) -> Result<(), String> {
    let shown = || String::from_utf8_lossy(&answer[..answer.len().min(200)]).into_owned();
    if answer.is_empty() {
        return Ok(());
    }
    let status = answer.strip_prefix(b"HTTP/1.1 ").or_else(|| answer.strip_prefix(b"HTTP/1.0 "));
    let status = status.and_then(|rest| std::str::from_utf8(rest.get(..3)?).ok()?.parse::<u16>().ok());
    match status {
        Some(500) => Err(format!("the server failed: {}", shown())),
        Some(100..=599) if answer.windows(4).any(|end| end == b"\r\n\r\n") => Ok(()),
        _ => Err(format!("no answer of HTTP: {}", shown())),
    }
}

/// Each answer of Modbus TCP is a frame, and that to a request that was sent: with its number, its unit and its function.
pub(super) fn gateway(sent: &[u8], mut answers: &[u8]) -> Result<(), String> {
    while !answers.is_empty() {
        let [a, b, 0, 0, high, low, unit, function, ..] = *answers else {
            return Err(format!("no frame of Modbus TCP: {answers:02X?}"));
        };
        let len = 6 + usize::from(u16::from_be_bytes([high, low]));
        let Some(rest) = answers.get(len..).filter(|_| (9..=260).contains(&len)) else {
            return Err(format!("a frame that is cut off or too long: {answers:02X?}"));
        };
        let asked = sent.windows(8).any(|request| {
            // A function code that is set in its highest bit is refused as it is.
            let is_of_it = request[7] == function & 0x7F || request[7] | 0x80 == function;
            request[..4] == [a, b, 0, 0] && request[6] == unit && is_of_it
        });
        if !asked {
            return Err(format!("nobody has asked for {:02X?}", &answers[..len]));
        }
        answers = rest;
    }
    Ok(())
}

/// A tool ends with a code of its own, and says why where it is not 0.
pub(super) fn tool(ended: &Ended) -> Result<(), String> {
    let shown = || ended.stderr.chars().take(400).collect::<String>();
    if ended.stderr.contains("panicked") {
        return Err(format!("a panic: {}", shown()));
    }
    match ended.status.map(|status| status.code()) {
        None => Err("it does not end".to_owned()),
        Some(Some(0)) => Ok(()),
        Some(Some(1 | 2)) if ended.stderr.trim().is_empty() && ended.stdout.trim().is_empty() => {
            Err("refused without a word".to_owned())
        }
        Some(Some(1 | 2)) => Ok(()),
        Some(code) => Err(format!("it ends with {code:?}: {}", shown())),
    }
}

/// Nothing panicked in the daemon.
pub(super) fn log(log: &str) -> Result<(), String> {
    match log.lines().find(|line| line.contains("panicked")) {
        Some(line) => Err(format!("a panic in the daemon: {line}")),
        None => Ok(()),
    }
}

/// In KiB.
pub(super) fn memory(before: u64, after: u64, growth: u64) -> Result<(), String> {
    if after > before + growth { Err(format!("{before} KiB before, {after} KiB behind it")) } else { Ok(()) }
}

/// What a wrong program would say or do, and whether it is taken for wrong.
pub fn find_plants() -> Told {
    let begun = Instant::now();
    let mut told = Told::new("the program from outside, against planted defects", "answers");
    // Transaction 1501h, unit 1, function 3, one register: an answer with two bytes.
    let sent = [0x15, 1, 0, 0, 0, 6, 1, 3, 0, 4, 0, 1];
    let right = [0x15, 1, 0, 0, 0, 5, 1, 3, 2, 0, 5];
    let changed = |at: usize, to: u8| {
        let mut bytes = right;
        bytes[at] = to;
        gateway(&sent, &bytes)
    };
    let ended = |code: Option<i32>, stderr: &str| {
        let status = code.map(exit_status);
        tool(&Ended { status, stdout: String::new(), stderr: stderr.to_owned() })
    };
    let wrong = [
        ("HTTP: the server's own failure", http(b"HTTP/1.1 500 Internal Server Error\r\n\r\n")),
        ("HTTP: a status that is none", http(b"HTTP/1.1 2xx OK\r\n\r\n")),
        ("HTTP: a head that does not end", http(b"HTTP/1.1 200 OK\r\nContent-Length: 1")),
        ("HTTP: the page without a head", http(b"<html>")),
        ("gateway: another transaction", changed(1, 2)),
        ("gateway: another unit", changed(6, 2)),
        ("gateway: another function", changed(7, 4)),
        ("gateway: another protocol", changed(3, 1)),
        ("gateway: a length beyond its end", changed(5, 9)),
        ("gateway: half an answer", gateway(&sent, &right[..6])),
        ("gateway: an answer behind the answer", gateway(&sent, &[right, [9; 11]].concat())),
        ("a tool: a panic", ended(Some(1), "thread 'main' panicked at src/x.rs")),
        ("a tool: a code that is none of its own", ended(Some(101), "drived: why")),
        ("a tool: it does not end", ended(None, "")),
        ("a tool: refused without a word", ended(Some(2), "")),
        ("the daemon: a panic in its log", log("a\nthread 'tokio-rt' panicked at x.rs\n")),
        ("the daemon: it keeps what it was sent", memory(50_000, 150_000, super::GROWTH)),
    ];
    for (name, held) in wrong {
        told.count += 1;
        told.plants.push(Plant { name: name.to_owned(), found_by: held.err() });
    }
    told.took = begun.elapsed();
    told
}

#[cfg(unix)]
fn exit_status(code: i32) -> std::process::ExitStatus {
    std::os::unix::process::ExitStatusExt::from_raw(code << 8)
}

#[cfg(windows)]
fn exit_status(code: i32) -> std::process::ExitStatus {
    std::os::windows::process::ExitStatusExt::from_raw(code as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_right_is_taken_for_right_and_each_wrong_answer_is_found() {
        let sent = [0x15, 1, 0, 0, 0, 6, 1, 3, 0, 4, 0, 1];
        assert_eq!(gateway(&sent, &[0x15, 1, 0, 0, 0, 5, 1, 3, 2, 0, 5]), Ok(()));
        assert_eq!(gateway(&sent, &[0x15, 1, 0, 0, 0, 3, 1, 0x83, 2]), Ok(()));
        assert_eq!(http(b"HTTP/1.1 404 Not Found\r\n\r\n{}"), Ok(()));
        let refused = Ended { status: Some(exit_status(2)), stdout: String::new(), stderr: "why".to_owned() };
        assert_eq!(tool(&refused), Ok(()));
        let told = find_plants();
        assert_eq!(told.plants_found(), told.plants.len(), "{told}");
    }
}
