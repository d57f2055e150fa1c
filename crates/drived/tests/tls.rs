//! The page and the API by TLS, asked by clients that were not written here: curl, Python, openssl and Chromium. Where they are
//! not installed the tests print why they are skipped; where `CI` is set they fail instead, because `.ci/run` installs them.
#![cfg(unix)]

mod support;

use std::{
    fs,
    os::unix::fs::PermissionsExt as _,
    path::PathBuf,
    process::{Command, Stdio},
};

use support::{File, Running, Sim, free_port, is_there, path, python_with};

/// A daemon that speaks by TLS alone, with the certificate of these tests.
struct Daemon {
    running: Option<Running>,
    _sim: Sim,
    file: File,
    folder: PathBuf,
    port: u16,
}

impl Daemon {
    fn start(name: &str) -> Self {
        let sim = Sim::serve(name, &["atv312@1-2"]);
        let (folder, port) = (path(&format!("{name}-files")), free_port());
        fs::create_dir_all(&folder).expect("it can be made");
        for file in ["certificate.pem", "key.pem"] {
            let from = format!("{}/tests/tls/{file}", env!("CARGO_MANIFEST_DIR"));
            fs::copy(from, folder.join(file)).expect("it can be copied");
        }
        fs::set_permissions(folder.join("key.pem"), fs::Permissions::from_mode(0o600)).expect("it is ours");
        let file = |name: &str| folder.join(name).display().to_string();
        let text = format!(
            "[http]\nlisten = \"127.0.0.1:{port}\"\ntls = {{ certificate = {:?}, key = {:?} }}\n[defaults]\ncontrol = true\n\
             [lines.bench]\nport = \"{}\"\n[[drives]]\nline = \"bench\"\ndrive = \"atv312@1-2\"\nname = \"pump {{}}\"\n",
            file("certificate.pem"),
            file("key.pem"),
            sim.link()
        );
        let config = File::new(name, &text);
        let mut running = Running::start(&["run", "--config", config.path()]);
        for _ in 0..2 {
            running.wait_for(r#""event":"identified""#);
        }
        Self { running: Some(running), _sim: sim, file: config, folder, port }
    }

    fn certificate(&self) -> String {
        self.folder.join("certificate.pem").display().to_string()
    }

    fn address(&self, path: &str) -> String {
        format!("https://localhost:{}{path}", self.port)
    }

    fn end(mut self) {
        let (code, _) = self.running.take().expect("it runs").interrupt();
        assert_eq!(code, Some(0));
        fs::remove_dir_all(&self.folder).expect("it is ours");
    }
}

/// Whether it ended well, and all that it said.
fn said(command: &mut Command) -> (bool, String) {
    let output = command.stdin(Stdio::null()).output().expect("it starts");
    let said = [output.stdout, output.stderr].concat();
    (output.status.success(), String::from_utf8_lossy(&said).into_owned())
}

#[test]
fn curl_that_trusts_the_certificate_stops_the_motors_by_either_version_and_is_told_to_come_so_again() {
    if !is_there("curl", &["--version"]) {
        return;
    }
    let daemon = Daemon::start("tls-curl");
    let curl = |more: &[&str], path: &str| {
        let mut command = Command::new("curl");
        command.args(["--silent", "--show-error", "--include", "--max-time", "60"]).args(more);
        said(command.arg(daemon.address(path)))
    };
    let trusts = daemon.certificate();
    for version in [&["--tlsv1.2", "--tls-max", "1.2"][..], &["--tlsv1.3"]] {
        let json = ["--header", "Content-Type: application/json", "--data", "{}"];
        let stop = [version, &["--cacert", &trusts], &json].concat();
        let (is_done, answer) = curl(&stop, "/api/v1/stop?wait=20s");
        assert!(is_done && answer.starts_with("HTTP/1.1 200"), "{version:?}: {answer}");
        assert!(answer.contains("strict-transport-security: max-age=31536000"), "{answer}");
        assert!(answer.contains("\"confirmed\":2"), "{answer}");
    }
    // What is older is not spoken, who is not trusted is not asked, and nobody is answered in clear.
    let (is_done, answer) = curl(&["--tls-max", "1.1", "--cacert", &trusts], "/api/v1/state");
    assert!(!is_done && !answer.contains("HTTP/1.1"), "{answer}");
    let (is_done, answer) = curl(&[], "/api/v1/state");
    assert!(!is_done && answer.contains("certificate"), "{answer}");
    let mut in_clear = Command::new("curl");
    in_clear.args([
        "--silent",
        "--show-error",
        "--max-time",
        "60",
        &format!("http://localhost:{}/", daemon.port),
    ]);
    let (is_done, answer) = said(&mut in_clear);
    assert!(!is_done && !answer.contains("drived</title>"), "{answer}");
    daemon.end();
}

#[test]
fn python_by_its_own_library_and_by_requests_reads_the_state_over_tls_1_2_and_1_3() {
    let Some(python) = python_with("requests") else { return };
    let daemon = Daemon::start("tls-python");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/tls/client.py");
    let mut client = Command::new(python);
    let (is_done, answer) = said(client.args([script, &daemon.port.to_string(), &daemon.certificate()]));
    assert!(is_done, "{answer}");
    assert_eq!(
        answer,
        "TLSv1.2 pump 1, pump 2\nTLSv1.3 pump 1, pump 2\nrequests pump 1, pump 2\nnot trusted\n"
    );
    daemon.end();
}

#[test]
fn openssl_agrees_on_tls_1_3_verifies_the_certificate_and_is_refused_with_tls_1_1() {
    if !is_there("openssl", &["version"]) {
        return;
    }
    let daemon = Daemon::start("tls-openssl");
    let connect = format!("localhost:{}", daemon.port);
    let client = |more: &[&str]| {
        let mut command = Command::new("openssl");
        command.args(["s_client", "-connect", &connect, "-CAfile", &daemon.certificate()]);
        said(command.args(["-verify_return_error", "-verify_hostname", "localhost"]).args(more))
    };
    let (is_done, answer) = client(&[]);
    assert!(
        is_done && answer.contains("TLSv1.3") && answer.contains("Verify return code: 0 (ok)"),
        "{answer}"
    );
    let (is_done, answer) = client(&["-tls1_2"]);
    assert!(
        is_done && answer.contains("TLSv1.2") && answer.contains("Verify return code: 0 (ok)"),
        "{answer}"
    );
    // Its own lowest level would refuse to ask for it.
    let (is_done, answer) = client(&["-tls1_1", "-cipher", "ALL:@SECLEVEL=0"]);
    assert!(!is_done && answer.contains("alert"), "{answer}");
    daemon.end();
}

#[test]
fn a_renewed_certificate_is_served_after_a_reload_and_one_whose_key_does_not_fit_is_refused() {
    if !is_there("openssl", &["version"]) {
        return;
    }
    let mut daemon = Daemon::start("tls-renewed");
    let served = |daemon: &Daemon| {
        let connect = format!("localhost:{}", daemon.port);
        said(Command::new("openssl").args(["s_client", "-connect", &connect])).1
    };
    let (certificate, key) = (daemon.folder.join("certificate.pem"), daemon.folder.join("key.pem"));
    let made = |certificate: &PathBuf, key: &PathBuf| {
        let mut make = Command::new("openssl");
        make.args(["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "9", "-subj", "/CN=renewed"]);
        let (is_done, answer) = said(make.arg("-keyout").arg(key).arg("-out").arg(certificate));
        assert!(is_done, "{answer}");
        fs::set_permissions(key, fs::Permissions::from_mode(0o600)).expect("it is ours");
    };
    let reload = |daemon: &mut Daemon, log: &str| {
        let running = daemon.running.as_mut().expect("it runs");
        running.signal("-HUP");
        running.wait_for_log(log);
    };
    // The certificate is there before its key.
    made(&certificate, &daemon.folder.join("other.pem"));
    reload(&mut daemon, "the old configuration holds on: [http]: ");
    assert!(!served(&daemon).contains("renewed"));
    made(&certificate, &key);
    reload(&mut daemon, "the certificate of [http] renewed");
    assert!(served(&daemon).contains("renewed"));
    let checked = support::run(&["check", "--config", daemon.file.path()]);
    // Nine whole days, or less by what has passed since it was made.
    assert!(
        ["8", "9"].iter().any(|days| checked.out.contains(&format!("ends in {days} days"))),
        "{checked:?}"
    );
    daemon.end();
}

#[test]
fn chromium_with_the_certificate_shows_the_page_and_stops_the_motors() {
    let Some(python) = python_with("playwright") else { return };
    if !is_there("/usr/bin/chromium", &["--version"]) || !is_there("openssl", &["version"]) {
        return;
    }
    let daemon = Daemon::start("tls-chromium");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/page.py");
    let (is_done, answer) = said(Command::new(python).args([script, "encrypted", &daemon.address("/")]));
    assert!(is_done, "{answer}");
    daemon.end();
}
