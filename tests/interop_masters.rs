//! Masters that were not written here read and write the simulated drives over a pty.
#![cfg(unix)]

use std::{env, path::PathBuf, process::Output};

use drive_core::SerialSettings;
use drive_families::Family;
use drive_sim::{Model, Protocol, Serving, SimLine, SimSlave, Wiring, models};
use support::peers;
use tokio::process::Command;

/// ETA of an Altivar 312 that stands under bus control: "switch on disabled" (BBV51701 p. 10), not forced local (p. 21).
const SWITCH_ON_DISABLED: u16 = 0x0240;

#[tokio::test(flavor = "multi_thread")]
async fn mbpoll_reads_and_writes_a_simulated_altivar_312() {
    let Some(mbpoll) = peers::program("mbpoll") else { return };
    let rig = Rig::new("mbpoll");
    let ask = async |arguments: &str| run(Command::new(&mbpoll).args(rig.mbpoll(arguments))).await;

    // W3104 HSP and W3105 LSP, printed by reference number, which mbpoll takes as the address with -0.
    let answer = ask("-a 2 -r 3104 -c 2 -1 -t 4").await;
    assert!(text(&answer).contains("[3104]: \t500\n[3105]: \t0\n"), "{}", text(&answer));

    // W9001 ACC.
    let answer = ask("-a 2 -r 9001 -t 4 PORT 13").await;
    assert!(text(&answer).contains("Written 1 references."), "{}", text(&answer));
    assert_eq!(rig.drive.peek(9001), Some(13));

    // A register that the drive does not have.
    let answer = ask("-a 2 -r 2999 -c 1 -1 -t 4").await;
    assert!(text(&answer).contains("Illegal data address"), "{}", text(&answer));

    // One word more than its 29.
    let answer = ask("-a 2 -r 3104 -c 30 -1 -t 4").await;
    assert!(text(&answer).contains("Illegal data value"), "{}", text(&answer));
}

#[tokio::test(flavor = "multi_thread")]
async fn minimalmodbus_reads_and_writes_a_simulated_altivar_312() {
    let Some(python) = peers::python_with("minimalmodbus") else { return };
    let rig = Rig::new("minimalmodbus");
    let answer = run(Command::new(python)
        .arg(peers::script("minimalmodbus_master.py"))
        .arg(&rig.port)
        .args(["rtu", "2", "r:3201:1", "w:9001:13", "m:9001:20,30", "r:9001:2", "r:2999:1"]))
    .await;
    let expected = format!("{SWITCH_ON_DISABLED}\nwritten\nwritten\n20 30\nIllegalRequestError\n");
    assert_eq!(text(&answer), expected);
    assert_eq!((rig.drive.peek(9001), rig.drive.peek(9002)), (Some(20), Some(30)));
}

#[tokio::test(flavor = "multi_thread")]
async fn minimalmodbus_reads_and_writes_a_simulated_altivar_58_in_modbus_ascii() {
    let Some(python) = peers::python_with("minimalmodbus") else { return };
    let ascii = Wiring { protocol: Protocol::Ascii, ..Wiring::rtu(Family::ATV58.capabilities().factory) };
    let rig = Rig::serving("minimalmodbus-ascii", ascii, models::atv58::Atv58::new());
    let answer = run(Command::new(python)
        .arg(peers::script("minimalmodbus_master.py"))
        .arg(&rig.port)
        // W250 HSP to W253; ACC to 1.0 s as the sample of VVDED397054 p. 23/47 writes it; CMD and W401; a word that the
        // drive does not have.
        .args(["ascii", "2", "r:250:4", "w:252:10", "m:400:6,500", "r:252:1", "r:900:1"]))
    .await;
    assert_eq!(text(&answer), "500 0 30 30\nwritten\nwritten\n10\nIllegalRequestError\n");
    assert_eq!((rig.drive.peek(400), rig.drive.peek(401)), (Some(6), Some(500)));
}

/// A simulated drive at address 2 on a pty.
struct Rig {
    port: PathBuf,
    drive: SimSlave,
    _serving: Serving,
}

impl Rig {
    fn new(name: &str) -> Self {
        let drive = models::atv312::Atv312::under_bus_control();
        Self::serving(name, Wiring::rtu(SerialSettings::MODBUS_DEFAULT), drive)
    }

    fn serving(name: &str, wiring: Wiring, drive: impl Model + 'static) -> Self {
        let line = SimLine::new(wiring);
        let drive = line.add(2, drive).expect("address 2 is free");
        let port = env::temp_dir().join(format!("drived-interop-{name}-{}", std::process::id()));
        let serving = line.serve_pty(&port).expect("a pty can be had");
        Self { port, drive, _serving: serving }
    }

    /// The arguments with the port where `PORT` stands, else at the end.
    fn mbpoll(&self, arguments: &str) -> Vec<String> {
        let port = self.port.display().to_string();
        let mut all: Vec<String> = "-m rtu -b 19200 -P even -0 -o 2".split(' ').map(str::to_owned).collect();
        all.extend(arguments.split(' ').map(|argument| argument.replace("PORT", &port)));
        if !arguments.contains("PORT") {
            all.push(port);
        }
        all
    }
}

async fn run(command: &mut Command) -> Output {
    command.output().await.expect("the peer can be run")
}

fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}
