//! `explain` over every frame that the manuals print: its words are those by which the manual explains the frame.

mod support;

use std::{fs, path::PathBuf, time::Duration};

use drive_bus::capture::{Captured, Direction, Dissector, Writer};
use drive_bus::exchange::{ascii, rtu};
use support::{path, run};

/// A capture of this test alone; removed when dropped.
struct Capture(PathBuf);

impl Capture {
    fn new(name: &str, dissector: Dissector, frames: &[(Direction, u64, Vec<u8>)]) -> Self {
        let file = path(&format!("explain-{name}.pcapng"));
        let mut writer = Writer::new(fs::File::create(&file).unwrap(), dissector).unwrap();
        for (direction, at, bytes) in frames {
            let at = Duration::from_millis(1_700_000_000_000) + Duration::from_micros(*at);
            writer.write(&Captured { at, direction: *direction, bytes: bytes.clone().into() }).unwrap();
        }
        Self(file)
    }

    fn explained(&self, options: &[&str]) -> String {
        let file = self.0.to_str().expect("the path is text");
        run(&[&["explain", file], options].concat()).assert_done().to_owned()
    }
}

impl Drop for Capture {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> = hex.bytes().filter(u8::is_ascii_hexdigit).collect();
    digits.chunks(2).map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}

/// A frame as the manuals print it: what stands behind `|` is its CRC, which is ours where none is printed.
fn frame(printed: &str) -> Vec<u8> {
    match printed.split_once('|') {
        Some(_) => bytes(printed),
        None => {
            let content = bytes(printed);
            rtu::frame(content[0], &content[1..]).to_vec()
        }
    }
}

/// Requests with their answers, each with what the manual says of it.
fn assert_said(family: &str, printed: &[(&str, &str, &str, &str)]) {
    let mut frames = Vec::new();
    for (index, (request, answer, ..)) in printed.iter().enumerate() {
        let at = index as u64 * 1_000_000;
        frames.push((Direction::Sent, at, frame(request)));
        if !answer.is_empty() {
            frames.push((Direction::Received, at + 50_000, frame(answer)));
        }
    }
    let capture = Capture::new(&family.replace('@', "-"), Dissector::Rtu, &frames);
    let said = capture.explained(&["--drive", family]);
    let mut rest = said.as_str();
    for (request, answer, asked, answered) in printed {
        for (bytes, words) in [(request, asked), (answer, answered)] {
            let found = rest.find(words);
            let begin = found.unwrap_or_else(|| panic!("{bytes}: {words:?} does not stand in\n{rest}"));
            rest = &rest[begin + words.len()..];
        }
    }
}

#[test]
fn the_frames_of_the_altivar_312_say_what_its_manual_says_of_them() {
    // BBV52816 04/2009 p. 12 to 15. The manual's "ACC = 13 s" holds where Inr is 1 s.
    assert_said(
        "atv312@2",
        &[
            (
                "02 03 0C1E 0004 | 276C",
                "02 03 08 0028 0258 01F4 0000 | 52B0",
                "atv312@2: reads SFr to LSP (4 words)",
                "answers SFr 4.0 kHz, tFr 60.0 Hz, HSP 50.0 Hz, LSP 0.0 Hz",
            ),
            ("02 06 2329 000D | 9270", "02 06 2329 000D | 9270", "writes ACC 13 × Inr", "done"),
            (
                "02 2B 0E 01 00 | 3477",
                "02 2B 0E 01 02 00 00 03 00 0D 54 45 4C 45 4D 45 43 41 4E 49 51 55 45 \
                 01 0F 41 54 56 33 31 48 55 30 39 4D 33 53 32 33 32 02 04 30 32 30 31 | A80F",
                "asks who it is",
                "is vendor: TELEMECANIQUE, product: ATV31HU09M3S232, revision: 0201",
            ),
            (
                "02 10 2329 0002 04 0014 001E | 73A4",
                "02 10 2329 0002 | 9BB7",
                "writes ACC 20 × Inr, dEC 30 × Inr",
                "done",
            ),
            // p. 15, exception codes.
            ("02 03 0C81 001E", "02 83 03", "reads ETA", "exception 03h"),
        ],
    );
}

#[test]
fn the_frames_of_the_altivar_21_say_what_its_manual_says_of_them() {
    // §7.4 to §8.5: "Lecture de la fréquence de sortie (FD00)", "Lecture incorrecte de 2 mots", "Écriture de la valeur 60 Hz sur
    // le paramètre Consigne de fréquence (FA01)", and the refusals.
    assert_said(
        "atv21@1",
        &[
            ("01 03 FD00 0001 | B5A6", "01 03 02 1770 | B650", "reads FD00", "answers FD00 60.00 Hz"),
            ("01 03 FD00 0002 | F5A7", "01 83 03 | 0131", "(2 words)", "exception 03h"),
            ("01 06 FA01 1770 | E6C6", "01 06 FA01 1770 | E6C6", "writes FA01 60.00 Hz", "done"),
            ("01 06 FFFF 0000 | 89EE", "01 86 02 | C3A1", "writes", "exception 02h"),
            ("01 10 FA01 0001 02 1770 | F39A", "01 10 FA01 0001 | 60D1", "writes FA01 60.00 Hz", "done"),
            ("01 10 1870 0002 04 C400 1770 | 6DAF", "01 90 04 | 4DC3", "writes", "exception 04h"),
            ("01 06 FA01 1F40 | E112", "01 06 FA01 1F40 | E112", "writes FA01 80.00 Hz", "done"),
        ],
    );
}

#[test]
fn the_frames_of_the_3g3ev_say_what_its_manual_says_of_them() {
    // §4.1.2, §4.2.2, §5, §6. The frequencies are tenths of a hertz: "600 = 0258(h)" is 60 Hz.
    assert_said(
        "3g3ev@1,2",
        &[
            (
                "01 08 0000 A537 | DA8D",
                "01 08 0000 A537 | DA8D",
                "asks for an echo of A5 37",
                "answers 00 00 A5 37",
            ),
            (
                "02 03 0020 0004 | 45F0",
                "02 03 08 0085 0000 0000 01F4 | 4E4C",
                "reads 0020h to 0023h (4 words)",
                "run",
            ),
            ("02 03 0020 0009", "02 83 03 | F131", "(9 words)", "exception 03h"),
            ("01 10 0220 0001 02 0000", "01 90 02 | CDC1", "writes", "exception 02h"),
            ("0110 0002 0001 02 0258 | A728", "0110 0002 0001 | A009", "3g3ev@1: writes 0002h", "done"),
            ("0010 0001 0001 02 0001 | 6BD1", "", "all: writes", ""),
            ("0103 0024 0001 | C401", "0103 02 0258 | B8DE", "reads 0024h", "answers 0024h"),
            ("0203 002C 0001 | 45F0", "0203 02 0065 | 3C6F", "reads 002Ch", "002Ch 0065h: run"),
            ("0110 0114 0001 02 0014 | B58B", "0110 0114 0001 | 4031", "2.0 s", "done"),
        ],
    );
}

#[test]
fn the_frames_of_the_altivar_58_say_what_its_manual_says_of_them() {
    // VVDED397054 p. 20/44 and 21/45: "ACC = 78,9 s", "writes 6 and 500 in words W400 and W401".
    assert_said(
        "atv58@1,2",
        &[
            (
                "01 03 01CF 0004 | 75CA",
                "01 03 08 0000 0000 0000 0000",
                "reads W463 to W466 (4 words)",
                "answers W463",
            ),
            ("01 06 00FC 0315 | 88C5", "01 06 00FC 0315 | 88C5", "writes ACC 78.9 s", "done"),
            (
                "02 10 0190 0002 04 0006 01F4 | 1801",
                "02 10 0190 0002 | 402A",
                "writes CMD 0006h, W401 500",
                "done",
            ),
        ],
    );
}

#[test]
fn a_bit_that_has_changed_is_named_and_one_that_stays_is_not_told_again() {
    // BBV51701 p. 13: 0627h is "operation enabled"; 0608h has tripped.
    let read = "02 03 0C81 0001";
    let answers = ["02 03 02 0627", "02 03 02 0627", "02 03 02 0628"];
    let mut frames = Vec::new();
    for (index, answer) in answers.iter().enumerate() {
        frames.push((Direction::Sent, index as u64 * 100_000, frame(read)));
        frames.push((Direction::Received, index as u64 * 100_000 + 20_000, frame(answer)));
    }
    let said = Capture::new("bits", Dissector::Rtu, &frames).explained(&["--drive", "atv312@2"]);
    assert_eq!(said.matches("(operation enabled)").count(), 1, "{said}");
    let change =
        "ETA 0627h to 0628h: ready is 0, switched on is 0, operation enabled is 0, fault is 1 (fault)";
    assert_eq!(said.matches(change).count(), 1, "{said}");
}

#[test]
fn what_is_wrong_is_said_and_counted() {
    let read = frame("02 03 0C81 0001");
    let mut damaged = frame("02 03 02 0627");
    damaged[3] ^= 1;
    // 19 200 8E1: 3.5 characters are 2.00 ms, the 8 characters of a request 4.58 ms. The fourth begins 1 ms behind the end of the
    // third.
    let frames = [
        (Direction::Sent, 0, read.clone()),
        (Direction::Received, 20_000, damaged),
        (Direction::Sent, 100_000, read.clone()),
        (Direction::Received, 120_000, frame("03 03 02 0627")),
        (Direction::Sent, 200_000, read.clone()),
        (Direction::Sent, 205_600, read),
    ];
    let said = Capture::new("wrong", Dissector::Rtu, &frames).explained(&[
        "--drive",
        "atv312@2",
        "--serial",
        "19200,8E1",
    ]);
    for part in [
        "! the CRC does not fit",
        "! slave 2 had not answered: read of 1 word from 3201",
        "! slave 2 was asked, not this one",
        "! silence before it 1.01 ms, 3.5 characters are 2.00 ms",
        "4 requests, 0 answers, 0 exceptions, 4 without an answer, 1 damaged, 1 silences too short",
    ] {
        assert!(said.contains(part), "{part} does not stand in\n{said}");
    }
}

#[test]
fn ascii_and_modbus_tcp_are_put_into_words_too() {
    // The Modbus ASCII frame of VVDED397054: the same read of W463 to W466.
    let request = ascii::frame(1, &[3, 0x01, 0xCF, 0, 4], b'\n').to_vec();
    let said = Capture::new("ascii", Dissector::Data, &[(Direction::Sent, 0, request)])
        .explained(&["--drive", "atv58@1"]);
    assert!(said.contains("atv58@1: reads W463 to W466 (4 words)"), "{said}");
    let request = [&[0, 7, 0, 0, 0, 6, 2][..], &[3, 0x0C, 0x81, 0, 1]].concat();
    let answer = [&[0, 7, 0, 0, 0, 3, 2][..], &[0x83, 2]].concat();
    let frames = [(Direction::Sent, 0, request), (Direction::Received, 9_000, answer)];
    let said = Capture::new("tcp", Dissector::Tcp, &frames).explained(&[]);
    assert!(said.contains("slave 2: reads 3201 (0C81h)") && said.contains("exception 02h"), "{said}");
}

#[test]
fn a_file_that_is_no_capture_is_refused_in_one_line() {
    let file = path("explain-none.pcapng");
    fs::write(&file, b"nothing of the kind").unwrap();
    run(&["explain", file.to_str().unwrap()]).assert_refused(2, "not a little-endian pcapng file");
    fs::remove_file(&file).unwrap();
    run(&["explain", "/dev/zero"]).assert_refused(2, "expected a file of at most 256 MiB");
}
