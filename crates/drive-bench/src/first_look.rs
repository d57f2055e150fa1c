//! The first look at the page: when its stop can be pressed, when the first value is there, and what has come over the network by
//! then; on a good line with 200 drives, and over a network of 400 ms and 50 kB/s. Wants Chromium and Playwright.

use std::{
    fs,
    net::{SocketAddr, TcpStream},
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::Value;

use crate::{
    Error,
    doors::plant::{Folder, Running, free, program, text, until},
    peers::{Python, interpreter},
    report::{Goal, Report, Unit},
};

const SECTION: &str = "first look";
/// Drives on a line.
const ON_A_LINE: usize = 25;
/// How often it is looked; the worst is told.
const LOOKS: usize = 5;
/// A round trip, and bytes a second.
const FAR: [&str; 2] = ["400", "50000"];

/// Looks at both.
pub(crate) fn measure(report: &mut Report) -> Result<(), Error> {
    if !Path::new("/usr/bin/chromium").exists() || !Python("playwright").is_installed() {
        return Err("it wants /usr/bin/chromium and the Python module playwright (DRIVED_PYTHON)".into());
    }
    let near = Look::worst_of(200, &[])?;
    report.row(SECTION, "200 drives on a good line: STOP usable", Unit::Millis, near.stop, Goal::None);
    report.row(SECTION, "200 drives on a good line: first value", Unit::Millis, near.value, Goal::None);
    report.row(SECTION, "200 drives on a good line: all rows", Unit::Millis, near.all, Goal::AtMost(1_000.0));
    let requests = format!("200 drives on a good line: bytes in {} requests", near.requests);
    report.row(SECTION, requests, Unit::KiB, near.bytes / 1_024.0, Goal::AtMost(100_000.0 / 1_024.0));
    let far = Look::worst_of(10, &FAR)?;
    // One more for the connection, which Chromium does not delay.
    let round_trip: f64 = FAR[0].parse()?;
    let (stop, value) = (far.stop + round_trip, far.value + round_trip);
    report.row(
        SECTION,
        "400 ms and 50 kB/s: STOP usable, with the connection",
        Unit::Millis,
        stop,
        Goal::AtMost(1_000.0),
    );
    report.row(
        SECTION,
        "400 ms and 50 kB/s: first value, with the connection",
        Unit::Millis,
        value,
        Goal::AtMost(2_500.0),
    );
    Ok(())
}

/// What was seen.
#[derive(Debug, Clone, Copy)]
struct Look {
    stop: f64,
    value: f64,
    all: f64,
    bytes: f64,
    requests: f64,
}

impl Look {
    /// The worst of some looks at a page with so many drives.
    fn worst_of(drives: usize, network: &[&str]) -> Result<Self, Error> {
        let plant = Plant::start(drives)?;
        let looks =
            (0..LOOKS).map(|_| Self::at(&plant, drives, network)).collect::<Result<Vec<_>, Error>>()?;
        let worst = |of: fn(&Self) -> f64| looks.iter().map(of).fold(0.0, f64::max);
        Ok(Self {
            stop: worst(|look| look.stop),
            value: worst(|look| look.value),
            all: worst(|look| look.all),
            bytes: worst(|look| look.bytes),
            requests: worst(|look| look.requests),
        })
    }

    fn at(plant: &Plant, drives: usize, network: &[&str]) -> Result<Self, Error> {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/first_look.py");
        let mut command = Command::new(interpreter());
        let page = format!("http://{}/", plant.http);
        let output = command.arg(script).args([&page, &drives.to_string()]).args(network).output()?;
        let told = String::from_utf8(output.stdout)?;
        let numbers = told.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>()?;
        let [stop, value, all, bytes, requests] = numbers[..] else {
            return Err(String::from_utf8_lossy(&output.stderr).into_owned().into());
        };
        Ok(Self { stop, value, all, bytes, requests })
    }
}

/// A daemon with so many simulated drives, all of which have been seen.
struct Plant {
    http: SocketAddr,
    _running: Vec<Running>,
    _folder: Folder,
}

impl Plant {
    fn start(drives: usize) -> Result<Self, Error> {
        let (program, folder, http) = (program()?, Folder::new()?, free()?);
        let at = |name: &str| -> PathBuf { folder.0.join(name) };
        let mut config = format!("[http]\nlisten = \"{http}\"\n[socket]\npath = {:?}\n", at("drived.sock"));
        let mut running = Vec::new();
        for (line, begins) in (0..drives).step_by(ON_A_LINE).enumerate() {
            let members = ON_A_LINE.min(drives - begins);
            let (link, which) = (at(&format!("line-{line}")), format!("atv312@1-{members}"));
            running.push(Running::start(&program, &["sim", "--drive", &which, "--pty", text(&link)?])?);
            until(|| link.exists())?;
            config += &format!(
                "[lines.l{line}]\nport = {link:?}\n[[drives]]\nline = \"l{line}\"\ndrive = \"{which}\"\nname = \"pump {line}.{{}}\"\n"
            );
        }
        let file = at("drives.toml");
        fs::write(&file, config)?;
        running.push(Running::start(&program, &["run", "--config", text(&file)?])?);
        until(|| TcpStream::connect(http).is_ok())?;
        let socket = at("drived.sock");
        until(|| {
            let mut asked = Command::new(&program);
            let told = asked.args(["status", "--json", "--socket"]).arg(&socket).output();
            told.is_ok_and(|told| {
                let state: Value = serde_json::from_slice(&told.stdout).unwrap_or_default();
                let there = state["drives"].as_array().into_iter().flatten();
                there.filter(|drive| drive["link"] == "connected").count() == drives
            })
        })?;
        Ok(Self { http, _running: running, _folder: folder })
    }
}
