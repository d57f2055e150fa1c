//! The Modbus TCP gateway before clients that were not written here, and before those that mean it harm.
#![cfg(unix)]

mod support;

use std::{
    env,
    io::{Read as _, Write as _},
    net::{TcpListener, TcpStream},
    process::Command,
    time::Duration,
};

use drive_testing::peers;
use support::{File, Running, Sim, path};

/// A daemon over 31 drives with a gateway; the last of them does not answer.
struct Daemon {
    running: Option<Running>,
    sim: Sim,
    port: u16,
    _file: File,
}

impl Daemon {
    fn start(name: &str, more: &str) -> Self {
        let sim = Sim::serve(name, &["atv312@1-31"]);
        // Free now, and hardly anybody's a moment later.
        let port =
            TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr()).expect("a port").port();
        let text = format!(
            "snapshots = \"0\"\n[http]\nlisten = \"off\"\n[lines.bench]\nport = \"{},19200,8E1\"\n\
             [[drives]]\nline = \"bench\"\ndrive = \"atv312@1-31\"\nname = \"pump {{}}\"\n\
             [[gateways]]\nlisten = \"127.0.0.1:{port}\"\npatience = \"2s\"\n{more}\n",
            sim.link()
        );
        let file = File::new(name, &text);
        let socket = path(&format!("{name}.sock"));
        let arguments =
            ["run", "--config", file.path(), "--socket", socket.to_str().expect("the path is text")];
        let mut running = Running::start(&arguments);
        for _ in 0..31 {
            running.wait_for(r#""event":"identified""#);
        }
        let mut daemon = Self { running: Some(running), sim, port, _file: file };
        daemon.sim.say("atv312@31 cable cut", "done");
        daemon.running.as_mut().expect("it runs").wait_for(r#""event":"lost""#);
        daemon
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).expect("it listens");
        // So that a test that fails ends.
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a time-out can be set");
        stream
    }

    /// One read of ETA, as a client that has just come.
    fn reads(&self) -> Option<[u8; 11]> {
        let mut stream = self.connect();
        stream.write_all(&[0x15, 0x01, 0, 0, 0, 6, 1, 3, 0x0C, 0x81, 0, 1]).ok()?;
        let mut answer = [0; 11];
        stream.read_exact(&mut answer).ok().map(|()| answer)
    }
}

/// Eight at once, four by libmodbus and four by pymodbus, while the daemon polls 31 drives and one of them is dead.
#[test]
fn eight_strangers_at_once_get_right_answers_or_the_right_exception() {
    let python = env::var_os("DRIVED_PYTHON").unwrap_or_else(|| "python3".into());
    let has_mbpoll = peers::is_there(peers::runs("mbpoll", &["-V"]), "mbpoll");
    let has_pymodbus = peers::python_with("pymodbus").is_some();
    let daemon = Daemon::start("strangers", "");
    let port = daemon.port.to_string();
    std::thread::scope(|scope| {
        let mut clients = Vec::new();
        for client in 0..4_u8 {
            let (port, python) = (&port, &python);
            clients.push(scope.spawn(move || {
                for round in 0..if has_mbpoll { 8 } else { 0 } {
                    // One in eight asks the dead one.
                    let unit = if round == client { 31 } else { 1 + client * 7 + round % 7 };
                    let unit_text = unit.to_string();
                    let mut mbpoll = Command::new("mbpoll");
                    mbpoll.args([
                        "-m", "tcp", "-p", port, "-a", &unit_text, "-t", "4", "-r", "3202", "-c", "4",
                    ]);
                    let output = mbpoll.args(["-1", "-o", "5", "127.0.0.1"]).output().expect("mbpoll starts");
                    let said = String::from_utf8_lossy(&output.stdout).into_owned()
                        + &String::from_utf8_lossy(&output.stderr);
                    match unit {
                        31 => assert!(said.contains("Target device failed to respond"), "{said}"),
                        _ => assert!(said.contains("[3202]:") && said.contains("[3205]:"), "{unit}: {said}"),
                    }
                }
            }));
            clients.push(scope.spawn(move || {
                if !has_pymodbus {
                    return;
                }
                let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/gateway.py");
                let first = 1 + client * 8;
                let drives = if client == 3 { 7 } else { 8 };
                let arguments =
                    [port.clone(), first.to_string(), drives.to_string(), (3 * drives).to_string()];
                let output = Command::new(python).arg(script).args(arguments).output().expect("it starts");
                let said = String::from_utf8_lossy(&output.stdout);
                let expected = if client == 3 { "18 3 []\n" } else { "24 0 []\n" };
                assert_eq!(said, expected, "{}", String::from_utf8_lossy(&output.stderr));
            }));
        }
        for client in clients {
            client.join().expect("each client is content");
        }
    });
    let (code, _) = daemon.running.expect("it runs").interrupt();
    assert_eq!(code, Some(0));
}

/// A thousand that connect, some of which send half a header, some garbage, and some ask and never read.
#[test]
fn who_means_harm_is_put_out_and_the_next_client_is_served() {
    let daemon = Daemon::start("harm", "idle = \"1s\"\nclients = 8");
    let mut held = Vec::new();
    for number in 0..1_000 {
        let mut stream = daemon.connect();
        // It may be closed already: that is what is wanted.
        let _ = match number % 4 {
            0 => Ok(()),
            1 => stream.write_all(&[0, 1, 0, 0]),
            2 => stream.write_all(&[0xA5; 64 * 1024]),
            _ => stream.write_all(&[0x15, 0x01, 0, 0, 0, 6, 1, 3, 0x0C, 0x81, 0, 1].repeat(500)),
        };
        held.push(stream);
    }
    // Each is ended in its time, though nobody closes his side.
    for mut stream in held {
        let mut sink = Vec::new();
        let _ = stream.read_to_end(&mut sink);
    }
    let answer = daemon.reads().expect("it serves on");
    assert_eq!(answer[..9], [0x15, 0x01, 0, 0, 0, 5, 1, 3, 2]);
    let (code, _) = daemon.running.expect("it runs").interrupt();
    assert_eq!(code, Some(0));
}
