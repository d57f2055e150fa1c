//! Mistakes of a tired person, fifty-five of them as somebody made them: each is understood, where nothing else can be meant, or is
//! answered on one line that says what to type.

use std::fs;

use crate::support::{Sim, path, run};

/// What becomes of a mistake.
enum Ends {
    /// It is answered: the exit code, and what the one line says.
    Answered(i32, &'static [&'static str]),
    /// It is understood: the exit code, and what stands in the result, or in the one line why a drive does not do it.
    Understood(i32, &'static str),
}

use Ends::{Answered, Understood};

/// The mistakes by their numbers. `LINE` is the port of simulated drives set up for the bus (which take the start of the 53rd), `CAPTURE` a capture, `~` a space inside a word.
const MISTAKES: [(u32, &str, Ends); 55] = [
    (
        1,
        "scan --line /dev/ttyUSB9,19200,8E1",
        Answered(2, &["there is no serial port /dev/ttyUSB9", "present"]),
    ),
    (2, "scan --line COM3,19200,8E1", Answered(2, &["there is no serial port COM3", "present"])),
    (3, "scan --line ttyUSB9,19200,8E1", Answered(2, &["there is no serial port ttyUSB9", "present"])),
    (4, "scan --line /dev/null,19200,8E1", Answered(2, &["/dev/null is no serial port", "present"])),
    (5, "scan --line /etc/passwd,19200,8E1", Answered(2, &["/etc/passwd is no serial port", "present"])),
    (6, "scan --line /tmp,19200,8E1", Answered(2, &["/tmp is a folder and no serial port", "present"])),
    (7, "scan LINE", Answered(2, &["did you mean --line LINE?"])),
    (8, "scan -l LINE,19200,8E1", Answered(2, &["did you mean --line?"])),
    (
        9,
        "scan --line LINE,19200,E81",
        Answered(2, &["\"E81\" is not a character format", "did you mean 8E1?"]),
    ),
    (10, "scan --line LINE,19200,8e1 --addresses 1", Understood(0, "1 of 1 address answer")),
    (11, "scan --line LINE:19200:8E1 --addresses 1", Understood(0, "1 of 1 address answer")),
    (12, "scan --line LINE,19.2k,8E1 --addresses 1", Understood(0, "1 of 1 address answer")),
    (13, "scan --line LINE,~19200,~8E1 --addresses 1", Understood(0, "1 of 1 address answer")),
    (14, "scan --line LINE,8E1,19200 --addresses 1", Understood(0, "1 of 1 address answer")),
    (
        15,
        "scan --line LINE,19200,8E1 --addresses 0",
        Answered(2, &["0 is not a slave address", "expected 1 to 247"]),
    ),
    (16, "scan --line LINE,19200,8E1 --addresses 1..3", Understood(0, "3 of 3 addresses answer")),
    (
        17,
        "scan --line LINE,19200,8E1 --addresses 248",
        Answered(2, &["248 is not a slave address", "expected 1 to 247"]),
    ),
    (18, "scan --line LINE,19200,8E1 --addresses 3-1", Answered(2, &["did you mean 1-3?"])),
    (19, "scan --line LINE,19200,8E1 --addresses 1~2~3", Understood(0, "3 of 3 addresses answer")),
    (
        20,
        "scan --line LINE,19200,8E1 --addresses 1,1,1",
        Answered(2, &["the address 1 is named twice: once is enough"]),
    ),
    (21, "status --line LINE,19200,8E1 --drive atv321@1", Answered(2, &["did you mean atv21 or atv312?"])),
    (22, "status --line LINE,19200,8E1 --drive ATV312@1", Understood(0, "control")),
    (23, "status --line LINE,19200,8E1 --drive atv312:1", Understood(0, "control")),
    (24, "status --line LINE,19200,8E1 --drive atv312", Answered(2, &["at which address? atv312@1"])),
    (
        25,
        "status --line LINE,19200,8E1 --drive atv312@99",
        Answered(1, &["does not answer", "drived scan --line LINE,19200,8E1"]),
    ),
    (26, "status --line LINE,19200,8E1 --drive 1", Answered(2, &["of which family? drived scan finds it"])),
    (27, "status --line LINE,19200,8E1", Answered(2, &["such as --drive atv312@1, which drived scan finds"])),
    (
        28,
        "status pump1 --socket CAPTURE.sock",
        Answered(2, &["start one by drived run --config FILE", "--line and --drive"]),
    ),
    (
        29,
        "setpoint --line LINE,19200,8E1 --drive atv312@1 30",
        Answered(2, &["\"30\" of what? 30Hz, or 30rpm"]),
    ),
    (
        30,
        "setpoint --line LINE,19200,8E1 --drive atv312@1 30hz",
        Understood(0, "holds the setpoint 30.00 Hz"),
    ),
    (
        31,
        "setpoint --line LINE,19200,8E1 --drive atv312@1 30,5Hz",
        Understood(0, "holds the setpoint 30.50 Hz"),
    ),
    (32, "setpoint --line LINE,19200,8E1 --drive atv312@1 -30Hz", Answered(2, &["no sign", "type 30Hz"])),
    (
        33,
        "setpoint --line LINE,19200,8E1 --drive atv312@1 1500rpm",
        Understood(0, "holds the setpoint 1500 rpm"),
    ),
    (34, "param get --line LINE,19200,8E1 --drive atv312@1 acc", Understood(0, "ACC")),
    (
        35,
        "param get --line LINE,19200,8E1 --drive atv312@1 ACCEL",
        Answered(2, &["did you mean ACC", "drived param list atv312"]),
    ),
    (36, "param get --line LINE,19200,8E1 --drive atv312@1 0x2329", Understood(0, "ACC")),
    (
        37,
        "param get --line LINE,19200,8E1 --drive atv312@1 49001",
        Answered(2, &["did you mean 9001 (ACC)?"]),
    ),
    (38, "param set --line LINE,19200,8E1 --drive atv312@1 ACC 4,5", Understood(0, "ACC is now 4.5 s")),
    (39, "param set --line LINE,19200,8E1 --drive atv312@1 ACC=4.6", Understood(0, "ACC is now 4.6 s")),
    (
        40,
        "param set --line LINE,19200,8E1 --drive atv312@1 ACC -1",
        Answered(2, &["\"-1\" is no value", "such as 3.0 s"]),
    ),
    (41, "param set --line LINE,19200,8E1 --drive atv312@1 ETA 5", Answered(2, &["can only be read"])),
    (42, "param set --line LINE,19200,8E1 --drive atv312@1 ACC 4.5s", Understood(0, "ACC is now 4.5 s")),
    (43, "read --line LINE,19200,8E1 --drive atv312@1 ACC", Answered(2, &["did you mean drived param get?"])),
    (44, "statsu --line LINE,19200,8E1 --drive atv312@1", Answered(2, &["did you mean drived status?"])),
    (
        45,
        "scan --line tcp://127.0.0.1:1 --addresses 1",
        Answered(2, &["cannot connect to 127.0.0.1:1", "see that host and port"]),
    ),
    (
        46,
        "scan --line rtu+tcp://127.0.0.1 --addresses 1",
        Answered(2, &["\"127.0.0.1\" is not HOST:PORT, such as"]),
    ),
    (
        47,
        "scan --line rtu+tcp://nohost.invalid:4001,19200,8E1 --addresses 1",
        Answered(2, &["cannot connect to nohost.invalid", "see that host"]),
    ),
    (48, "doctor --line LINE,19200,8E1 --drive atv312@1 --for 5", Answered(2, &["5 of what? 5s or 5min"])),
    (
        49,
        "doctor --line LINE,19200,8E1 --drive atv312@1 --addresses 1-3",
        Answered(2, &["leave one of them out"]),
    ),
    (
        50,
        "report --to /nonexist/x.html --line LINE,19200,8E1 --drive atv312@1",
        Answered(2, &["/nonexist", "nothing was read"]),
    ),
    (51, "param restore", Answered(2, &["such as pump1.toml, as drived param backup writes it"])),
    (
        52,
        "param restore CAPTURE --line LINE,19200,8E1",
        Answered(2, &["it is a capture and no backup", "drived explain"]),
    ),
    (
        53,
        "start --line LINE,19200,8E1 --drive atv312@4",
        Understood(0, "started forward at 0.00 Hz: its setpoint is zero"),
    ),
    (54, "completions powershell", Answered(2, &["[possible values: bash, zsh, fish]"])),
    (55, "plan --line LINE,19200,8E1 --drive atv312@1-40", Answered(2, &["share the drives among lines"])),
];

#[test]
fn every_mistake_of_a_tired_person_is_understood_or_answered_on_one_line() {
    // The last is asked nothing before it is started: one that was asked trips by its watchdog while all the others are tried.
    let sim = Sim::serve_with("mistakes", &["atv312@1-4"], &[]);
    let capture = path("mistakes.pcapng");
    fs::write(&capture, [&[0x0A, 0x0D, 0x0D, 0x0A][..], &[0xFF; 24]].concat()).expect("it can be written");
    let capture_name = capture.to_str().expect("the path is text");
    let mut wrong = Vec::new();
    for (number, typed, ends) in &MISTAKES {
        let here =
            |text: &str| text.replace("LINE", sim.link()).replace("CAPTURE", capture_name).replace('~', " ");
        let words: Vec<String> = typed.split(' ').map(here).collect();
        let ended = run(&words.iter().map(String::as_str).collect::<Vec<_>>());
        println!(
            "{number:>2} rc {:?}: {}{}",
            ended.code,
            ended.err,
            if ended.err.is_empty() { "understood\n" } else { "" }
        );
        let is_as_told = match ends {
            Answered(code, reasons) => {
                let is_line = ended.err.starts_with("drived: ") && ended.err.lines().count() == 1;
                let says = |reason: &&str| ended.err.contains(&here(reason));
                ended.code == Some(*code) && is_line && reasons.iter().all(says)
            }
            Understood(code, told) => {
                ended.code == Some(*code) && format!("{}{}", ended.out, ended.err).contains(told)
            }
        };
        if !is_as_told {
            wrong.push((number, ended));
        }
    }
    let _ = fs::remove_file(capture);
    assert!(wrong.is_empty(), "{wrong:#?}");
}
