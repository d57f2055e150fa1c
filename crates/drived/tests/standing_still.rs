//! The program is stopped and continued from outside in the middle of its exchanges, for 0.3 to 3 s: what it prints is what
//! it prints when nobody disturbs it. In real time; nothing here asserts a duration.
#![expect(clippy::disallowed_methods, reason = "the tests have threads of their own")]

mod support;

use std::{
    io::{Read, Write},
    net::TcpListener,
    thread::{self, sleep},
    time::Duration,
};

use support::{Running, run};

/// Dumps of the parameters of a drive, disturbed: each line is that of the undisturbed dump.
fn dumps_are_what_they_are_undisturbed(line: &str, drive: &str) {
    let arguments = ["param", "dump", "--line", line, "--drive", drive];
    let undisturbed = run(&arguments).assert_done().to_owned();
    let mut ended = Vec::new();
    for pause in [170, 310] {
        let mut dump = Running::start(&arguments);
        // Ever other places of the exchanges are hit.
        for turn in 0.. {
            sleep(Duration::from_millis(pause + turn * 241 % 900));
            if dump.has_ended() {
                break;
            }
            dump.signal("-STOP");
            sleep(Duration::from_millis(300 + (turn * 7_919 + pause) % 2_700));
            dump.signal("-CONT");
        }
        let (code, out) = dump.end();
        if code == Some(0) {
            assert!(out == undisturbed, "undisturbed:\n{undisturbed}\ndisturbed:\n{out}");
        }
        ended.push(code);
    }
    assert!(ended.contains(&Some(0)), "{ended:?}");
}

/// A slave in which every register holds its own address: over Modbus TCP, or behind a serial server at 19200 bit/s.
fn server(is_modbus_tcp: bool) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let port = listener.local_addr().expect("it has an address").port();
    thread::spawn(move || {
        for mut stream in listener.incoming().map_while(Result::ok) {
            let (mut head, mut request) = ([0; 6], [0; 6]);
            loop {
                let heard = if is_modbus_tcp { stream.read_exact(&mut head) } else { Ok(()) };
                if heard.and_then(|()| stream.read_exact(&mut request)).is_err() {
                    break;
                }
                let first = u16::from_be_bytes([request[2], request[3]]);
                let words = (first..).take(request[5].into()).flat_map(u16::to_be_bytes);
                let mut answer: Vec<u8> = [request[0], 3, request[5] * 2].into_iter().chain(words).collect();
                sleep(Duration::from_micros(5_000 + 521 * (10 + answer.len() as u64)));
                if is_modbus_tcp {
                    head[5] = answer.len() as u8;
                    answer.splice(0..0, head);
                } else {
                    stream.read_exact(&mut [0; 2]).expect("a request has its CRC");
                    answer.extend(crc(&answer).to_le_bytes());
                }
                if stream.write_all(&answer).is_err() {
                    break;
                }
            }
        }
    });
    port
}

/// CRC-16 with the polynomial A001h (MODBUS over Serial Line V1.02, 6.2.2).
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xA001 } else { crc >> 1 })
    })
}

#[test]
fn a_dump_behind_a_serial_server_is_right_though_the_program_is_stopped_and_continued() {
    let line = format!("rtu+tcp://127.0.0.1:{},19200,8N1", server(false));
    dumps_are_what_they_are_undisturbed(&line, "atv28@1");
}

#[test]
fn a_dump_over_modbus_tcp_is_right_though_the_program_is_stopped_and_continued() {
    let line = format!("tcp://127.0.0.1:{}", server(true));
    dumps_are_what_they_are_undisturbed(&line, "atv28@1");
}
