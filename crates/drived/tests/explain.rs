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
    // BBV52816 04/2009 p. 12 to 14, all 8. The manual's "ACC = 13 s" holds where Inr is 1 s. The CRCs that it prints for the
    // last pair, 517Fh and 8FEDh, fit another address: these are computed.
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
            // p. 14 and 15 print the forms of the refusals without an example: the "Object Id" is incorrect, and a register
            // that does not exist.
            ("02 2B 0E 01 09", "02 AB 0E 02", "asks who it is", "error 02h: the object id is incorrect"),
            ("02 03 0C81 001E", "02 83 03", "reads ETA", "exception 03h"),
        ],
    );
}

#[test]
fn the_frames_of_the_altivar_21_say_what_its_manual_says_of_them() {
    // §7.4 to §8.5, all 32: "Lecture de la fréquence de sortie (FD00)", "Lecture incorrecte de 2 mots", "Lecture d'un bloc
    // indexé de 5 paramètres", "Réponse d'erreur pour adresse de début incorrecte", "Écriture de la valeur 60 Hz sur le
    // paramètre Consigne de fréquence (FA01)", "Le variateur rejette la requête car …", "Consigne de fréquence 80 Hz".
    // Computed are the CRCs of the confirmed block (printed 43B3h) and of the 80 Hz (printed B5A6h); the identification
    // (§7.9) is printed as a table, its texts and lengths there contradict each other, and 12 characters are ATV21H075M3X.
    assert_said(
        "atv21@1",
        &[
            (
                "01 03 FD00 0001 | B5A6",
                "01 03 02 1770 | B650",
                "reads FD00 (output frequency)",
                "answers FD00 (output frequency) 60.00 Hz",
            ),
            ("01 03 FD00 0002 | F5A7", "01 83 03 | 0131", "(2 words)", "exception 03h"),
            (
                "01 03 1875 0005 | 92B3",
                "01 03 0A 6404 1770 0000 26FB 0080 | 1E29",
                "reads 6261 (1875h) to 6265 (1879h) (5 words)",
                "answers 6261 (1875h) = 25604, 6262 (1876h) = 6000, 6263 (1877h) = 0, 6264 (1878h) = 9979",
            ),
            (
                "01 03 1875 0002 | D371",
                "01 03 04 6404 1770 | AAD6",
                "reads 6261 (1875h) to 6262 (1876h) (2 words)",
                "answers 6261 (1875h) = 25604, 6262 (1876h) = 6000",
            ),
            ("01 03 1876 0002 | 2371", "01 83 03 | 0131", "reads 6262 (1876h)", "exception 03h"),
            ("01 03 1875 0006 | D2B2", "01 83 03 | 0131", "(6 words)", "exception 03h"),
            (
                "01 06 FA01 1770 | E6C6",
                "01 06 FA01 1770 | E6C6",
                "writes FA01 (frequency reference) 60.00 Hz",
                "done",
            ),
            ("01 06 FFFF 0000 | 89EE", "01 86 02 | C3A1", "writes 65535 (FFFFh) = 0", "exception 02h"),
            (
                "01 10 FA01 0001 02 1770 | F39A",
                "01 10 FA01 0001 | 60D1",
                "writes FA01 (frequency reference) 60.00 Hz",
                "done",
            ),
            (
                "01 10 1870 0002 04 C400 1770 | 6DAF",
                "01 10 1870 0002 | 46B3",
                "writes 6256 (1870h) = 50176, 6257 (1871h) = 6000",
                "done",
            ),
            ("01 10 1870 0002 04 C400 1770 | 6DAF", "01 90 04 | 4DC3", "writes", "exception 04h"),
            (
                "01 10 1871 0002 04 C400 1770 | AC63",
                "01 90 03 | 0C01",
                "writes 6257 (1871h)",
                "exception 03h",
            ),
            (
                "01 10 1870 0003 04 C400 1770 | 6C7E",
                "01 90 03 | 0C01",
                "! its counts or its length do not fit",
                "exception 03h",
            ),
            (
                "01 10 1870 0002 03 C400 1770 | D86F",
                "01 90 03 | 0C01",
                "! its counts or its length do not fit",
                "exception 03h",
            ),
            (
                "01 2B 0E 01 00",
                "01 2B 0E 01 01 00 00 03 00 0D 54 65 6C 65 6D 65 63 61 6E 69 71 75 65 \
                 01 0C 41 54 56 32 31 48 30 37 35 4D 33 58 02 04 30 32 30 31",
                "asks who it is",
                "is vendor: Telemecanique, product: ATV21H075M3X, revision: 0201",
            ),
            (
                "01 06 FA01 1F40 | E112",
                "01 06 FA01 1F40 | E112",
                "writes FA01 (frequency reference) 80.00 Hz",
                "done",
            ),
        ],
    );
}

#[test]
fn the_frames_of_the_3g3ev_say_what_its_manual_says_of_them() {
    // §4.1.2, §4.2.2, §4.3.2, §4.5, §5.4, §6, all 28. The frequencies are tenths of a hertz: "600 = 0258(h)" is 60 Hz. The
    // confirmation of §4.3.2 is printed with register 0120h; its CRC is that of 0001h.
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
                "reads 0020h (state of the signals) to 0023h (frequency reference in force) (4 words)",
                "run",
            ),
            ("02 03 0020 0004 | 45F0", "02 83 03 | F131", "(4 words)", "exception 03h"),
            ("01 10 0001 0002 04 0001 0258 | 6339", "01 10 0001 0002 | 1008", "writes 0001h", "done"),
            ("01 10 0001 0002 04 0001 0258 | 6339", "01 90 02 | CDC1", "writes 0001h", "exception 02h"),
            ("01 10 0900 0001 02 0000 | 3F50", "", "writes 0900h (ENTER)", ""),
            ("0103 0114 0001", "0103 02 0003", "reads n20", "answers n20 0.3 s"),
            ("0110 0114 0001 02 0032", "0110 0114 0001", "writes n20 5.0 s", "done"),
            (
                "0110 0002 0001 02 0258 | A728",
                "0110 0002 0001 | A009",
                "3g3ev@1: writes 0002h (frequency reference)",
                "done",
            ),
            (
                "0210 0002 0001 02 0258 | B3D8",
                "0210 0002 0001 | A03A",
                "3g3ev@2: writes 0002h (frequency reference)",
                "3g3ev@2: done",
            ),
            ("0010 0001 0001 02 0001 | 6BD1", "", "all: writes 0001h (run command and inputs) 0001h", ""),
            (
                "0103 0024 0001 | C401",
                "0103 02 0258 | B8DE",
                "reads 0024h (output frequency)",
                "answers 0024h",
            ),
            (
                "0203 0024 0001 | C432",
                "0203 02 0258 | FCDE",
                "3g3ev@2: reads 0024h",
                "3g3ev@2: answers 0024h",
            ),
            (
                "0203 002C 0001 | 45F0",
                "0203 02 0065 | 3C6F",
                "reads 002Ch",
                "002Ch (state of the drive) 0065h: run",
            ),
            ("0110 0114 0001 02 0014 | B58B", "0110 0114 0001 | 4031", "writes n20 2.0 s", "done"),
        ],
    );
}

#[test]
fn the_frames_of_the_altivar_28_say_what_its_manual_says_of_them() {
    // VVDED399092, all 4: "lecture des mots W450 à W456 de l'esclave 2" (their values are printed as xxxx, the 14 of their
    // count is decimal), "écriture des valeurs 15 et 200 dans les mots W400 et W401 de l'esclave 2".
    assert_said(
        "atv28@2",
        &[
            (
                "02 03 01C2 0007",
                "02 03 0E 00C8 00C8 0000 000C 0FA0 0014 001E",
                "atv28@2: reads FrH to tHd (7 words)",
                "answers FrH 20.0 Hz",
            ),
            ("02 10 0190 0002 04 000F 00C8", "02 10 0190 0002", "writes CMD 000Fh, LFr 20.0 Hz", "done"),
        ],
    );
}

#[test]
fn the_frames_of_the_altivar_58_say_what_its_manual_says_of_them() {
    // VVDED397054 p. 20/44 and 21/45, all 6 in RTU: "ACC = 78,9 s", "writes 6 and 500 in words W400 and W401".
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
            // p. 21/45, the table of function 8: sub-code, data, and what is executed. 04 is not answered.
            ("01 08 0000 1234", "01 08 0000 1234", "asks for an echo of 12 34", "answers 00 00 12 34"),
            ("01 08 0001 0000", "01 08 0001 0000", "restart communication", "answers"),
            ("01 08 0003 3B00", "01 08 0003 3B00", "change the delimiter of ASCII: 3B 00", "answers"),
            ("01 08 000A 0000", "01 08 000A 0000", "clear counters", "answers"),
            ("01 08 000B 0000", "01 08 000B 0102", "count of messages on the line", "answers 00 0B 01 02"),
            ("01 08 000C 0000", "01 08 000C 0102", "count of damaged messages", "answers"),
            ("01 08 000D 0000", "01 08 000D 0102", "count of exceptions", "answers"),
            ("01 08 000E 0000", "01 08 000E 0102", "count of messages to this slave", "answers"),
            ("01 0B", "01 0B 0000 0007", "read event counter", "answers 00 00 00 07"),
            ("01 08 0004 0000", "", "force listen only", ""),
        ],
    );
}

#[test]
fn the_ascii_frame_of_the_altivar_58_is_a_write_of_10_to_w252_of_slave_2() {
    // VVDED397054 p. 22/46: "Question and response", 3A 30 32 30 36 … 46 32 0D 0A; W252 is ACC in tenths of a second.
    let printed = bytes("3A 30 32 30 36 30304643 30303041 4632 0D 0A");
    let frames = [(Direction::Sent, 0, printed.clone()), (Direction::Received, 30_000, printed)];
    let said = Capture::new("ascii-58", Dissector::Data, &frames).explained(&["--drive", "atv58@2"]);
    assert!(said.contains("> atv58@2: writes ACC 1.0 s\n") && said.contains("< atv58@2: done"), "{said}");
}

/// A data frame of UNI-TELWAY to or from slave 1, with the header that is one byte; each 10h of length and data twice.
fn telway(unite: &str) -> Vec<u8> {
    let unite = bytes(unite);
    let length = u8::try_from(unite.len() + 1).unwrap();
    let mut frame = vec![0x10, 0x02, 1];
    for byte in [&[length, 0], &unite[..]].concat() {
        frame.extend(if byte == 0x10 { vec![byte; 2] } else { vec![byte] });
    }
    frame.push(frame.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte)));
    frame
}

#[test]
fn the_requests_of_unite_say_what_the_manual_of_the_altivar_58_says_of_them() {
    // VVDED397054 p. 11–13/35–37. The manual prints codes, categories and fields, and one example whole: "READ words W250 to
    // W253", code and category 0736h, six bytes of parameters, reply 66h with the type 07h and four words.
    let talks: [(&str, &str, &str, &str); 13] = [
        (
            "36 07 68 07 FA00 0400",
            "66 07 FA00 F401 1503 1E00",
            "atv58@1: reads W250 to W253 (4 words)",
            "replies W250 250, W251 500, ACC 78.9 s, W253 30",
        ),
        ("04 07 FC00", "34 1503", "reads ACC", "replies ACC 78.9 s"),
        ("14 07 FC00 1503", "FE", "writes ACC 78.9 s", "done"),
        ("37 07 68 07 9001 0200 0600 F401", "FE", "writes CMD 0006h, W401 500", "done"),
        ("0F 07", "3F 18 58 21 0A 4154562D35385531384E", "asks who it is", "is Altivar 58, V2.1, ATV-58U18N"),
        ("30 07", "60 2A 01", "asks for the version of its protocol", "replies 2A 01"),
        ("FA 07 A537", "FB A537", "asks to mirror A5 37", "mirrors A5 37"),
        (
            "A2 07",
            "D2 0100 0200 0300 0400",
            "reads the error counters of its link",
            "sent and not acknowledged 1, sent and refused 2, received and not acknowledged 3, received and refused 4",
        ),
        ("A4 07", "FE", "sets the error counters of its link to 0", "done"),
        (
            "F2 07 00 00 0F00 F401 1E00 2800",
            "F2 30 00 F401 3706 0000 0C00",
            "commands CMD 000Fh, FRH 500, ACC 30, DEC 40",
            "reports FRH 500, ETA 0637h, FLT 0000h, LCR 12",
        ),
        // "Negative response H'FD', cause: incorrect number of parameters".
        (
            "F2 07 00 00",
            "FD",
            "request F2h of UNI-TE",
            "! negative reply FDh: the manual names a wrong number",
        ),
        ("04 07 FC00", "FD 06", "reads ACC", "refuses the read of 1 word from 252"),
        ("04 07 FC00", "66 07 0100 0200", "reads ACC", "! it does not fit the request"),
    ];
    let mut frames = Vec::new();
    let (sent, received) = (Direction::Sent, Direction::Received);
    let mut at = 0;
    for (request, reply, ..) in talks {
        for (direction, bytes) in [
            (sent, telway(request)),
            (received, vec![0x06]),
            (sent, vec![0x10, 0x05, 1]),
            (received, vec![0x04]),
            (sent, vec![0x10, 0x05, 1]),
            (received, telway(reply)),
            (sent, vec![0x06]),
        ] {
            at += 20_000;
            frames.push((direction, at, bytes));
        }
    }
    let said = Capture::new("unite", Dissector::Data, &frames).explained(&["--drive", "atv58@1"]);
    let mut rest = said.as_str();
    for (request, reply, asked, replied) in talks {
        let link =
            ["ACK: taken", "poll: the slave may speak", "EOT: nothing to say", "poll: the slave may speak"];
        for words in [&[asked][..], &link, &[replied, "ACK: taken"]].concat() {
            let found = rest
                .find(words)
                .unwrap_or_else(|| panic!("{request}, {reply}: {words:?} does not stand in\n{rest}"));
            rest = &rest[found + words.len()..];
        }
    }
    assert!(rest.contains("13 requests, 11 answers, 2 exceptions, 0 without an answer, 0 damaged"), "{rest}");
}

#[test]
fn a_unite_request_that_was_refused_by_nak_or_never_acknowledged_is_sent_again_and_counts_as_one() {
    let (sent, received) = (Direction::Sent, Direction::Received);
    let write = telway("14 07 FC00 1503");
    let frames = [
        (sent, 0, write.clone()),
        (received, 10_000, vec![0x15]),
        (sent, 20_000, write.clone()),
        (sent, 40_000, write),
        (received, 50_000, vec![0x06]),
        (sent, 60_000, vec![0x10, 0x05, 1]),
        (received, 70_000, telway("FE")),
        (sent, 80_000, telway("04 07 FC00")),
    ];
    let said = Capture::new("unite-again", Dissector::Data, &frames).explained(&["--drive", "atv58@1"]);
    assert!(said.contains("NAK: once more") && said.contains("< atv58@1: done"), "{said}");
    assert!(said.contains("4 requests, 1 answers, 0 exceptions, 1 without an answer"), "{said}");
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

/// A response's function is the request's + 80h (BBV52816 p. 15): it is known without the request.
#[test]
fn a_refusal_whose_question_is_not_there_is_one_all_the_same() {
    let said = run(&["explain", "--drive", "atv312@3", "03 83 02 61 31"]).assert_done().to_owned();
    for part in ["refuses the function 03h, read registers", "! exception 02h", "1 exceptions"] {
        assert!(said.contains(part), "{part} does not stand in\n{said}");
    }
    let frames =
        [(Direction::Received, 0, frame("04 90 22")), (Direction::Received, 1_000, frame("02 AB 0E 01"))];
    let said = Capture::new("alone", Dissector::Rtu, &frames).explained(&["--trouble"]);
    for part in
        ["refuses the function 10h, write registers", "! exception 22h", "ReadDeviceId", "2 exceptions"]
    {
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
    run(&["explain", file.to_str().unwrap()]).assert_refused(2, "nothing in it looks like a frame");
    fs::remove_file(&file).unwrap();
    run(&["explain", "/dev/zero"]).assert_refused(2, "it is a device: expected a file, or a pipe");
}
