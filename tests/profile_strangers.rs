//! Drives that were written by another hand, in another language, from the documents alone, driven by our engine through the profiles that are
//! shipped: started, turned round, stopped, tripped, reset, lost, without power, taken at the panel. What the engine says is held against the
//! shaft that the stranger prints.
#![cfg(unix)]

use std::{
    collections::VecDeque,
    fmt::Write as _,
    process::Stdio,
    sync::{Arc, Mutex},
    time::Duration,
};

use drive_bus::{Line, LineConfig};
use drive_core::{
    Direction, Drive, Error, ErrorKind, Frequency, Motion, SerialSettings, SlaveAddress, State, Status,
    StopMode, Verdict,
};
use drive_families::{Family, Options};
use drive_profile::{Level, Profile, definition, read, shipped};
use support::peers;
use tokio::{
    io::{AsyncBufReadExt as _, AsyncWriteExt as _, BufReader},
    process::{Child, ChildStdin, Command},
    sync::{mpsc, watch},
    time::{Instant, sleep, timeout},
};

/// How far apart a look at the drive and what its stranger printed may be on a busy machine.
const APART: Duration = Duration::from_millis(700);

/// A stranger, and the profile that drives it.
struct Kind {
    key: &'static str,
    /// How it is commanded.
    pattern: &'static str,
    /// Its profile, where none is shipped.
    text: Option<&'static str>,
    script: &'static str,
    arguments: &'static [&'static str],
    /// How long its ramps take from 0 to its nominal frequency, in seconds.
    ramp: &'static str,
    /// What its owner says.
    options: &'static [(&'static str, &'static str)],
    /// A trip that can be reset.
    trip: u16,
    /// The words by which another master starts one that the profile only stops: register and word.
    others: &'static [(u16, u16)],
    /// What its owner writes each time it was switched on.
    enables: &'static [(u16, u16)],
}

const fn kind(key: &'static str, script: &'static str, pattern: &'static str) -> Kind {
    Kind {
        key,
        pattern,
        text: None,
        script,
        arguments: &[],
        ramp: "2",
        options: &[("commands-alone", "yes"), ("full-scale", "50Hz"), ("highest", "50Hz")],
        trip: 9,
        others: &[],
        enables: &[],
    }
}

impl Kind {
    fn profile(&self) -> Profile {
        match self.text {
            Some(text) => read(text).unwrap_or_else(|refusals| panic!("{refusals}")),
            None => shipped::find(self.key).expect("it is shipped").clone(),
        }
    }
}

/// What a stranger printed of itself.
#[derive(Debug, Clone, PartialEq)]
struct Truth {
    hertz: f64,
    running: bool,
    direction: Direction,
    tripped: bool,
}

/// All of them, each with a profile that is shipped.
fn kinds() -> Vec<Kind> {
    vec![
        kind("v20", "v20.py", "PROFIdrive"),
        kind("wj200", "wj200.py", "coils"),
        kind("mx2", "wj200.py", "coils"),
        Kind { arguments: &["102"], ..kind("danfoss-fc", "danfoss.py", "bits") },
        // REF of 2666h is 60 %, 047Ch runs it by the FC profile: FC 202 Design Guide p. 175.
        Kind {
            arguments: &["51"],
            others: &[(50_009, 0x2666), (49_999, 0x047C)],
            ..kind("danfoss-fc51", "danfoss.py", "bits")
        },
        kind("goodrive", "goodrive.py", "code"),
        // Forward run, A. p. 786; 30 Hz.
        Kind { others: &[(0x2001, 3_000), (0x2000, 0x12)], trip: 1, ..kind("ms300", "ms300.py", "bits") },
        Kind { arguments: &["s15"], ..kind("vfs15", "toshiba.py", "bits") },
        Kind { arguments: &["320"], ..kind("altivar", "altivar.py", "CiA 402") },
        // Printed 0004, write enable: 0 at power-up.
        Kind { enables: &[(3, 1)], trip: 1, ..kind("ig5a", "ig5a.py", "bits") },
        // Its works setting trips it within 100 ms of silence.
        Kind { arguments: &["--set", "p2040=0"], ..kind("g120", "g120.py", "PROFIdrive") },
        // 0002h in 0.01 Hz, 0001h bit 0 runs forward: SIEPC71061627 p. 559.
        Kind { others: &[(2, 3_000), (1, 1)], ..kind("a1000", "yaskawa.py", "bits") },
        // The ABB Drives profile: 0406h, 0407h, 046Fh; REF1 of 20000 is 100 %.
        Kind {
            arguments: &["550"],
            others: &[(0, 0x0406), (1, 12_000), (0, 0x0407), (0, 0x046F)],
            trip: 1,
            ..kind("acs550", "abb.py", "ABB")
        },
        // Patterns of control that no shipped profile has at motion.
        Kind {
            text: Some(include_str!("../crates/drive-profile/tests/data/abb.toml")),
            arguments: &["355"],
            trip: 1,
            ..kind("abb", "abb.py", "ABB")
        },
        Kind {
            text: Some(include_str!("../crates/drive-profile/tests/data/split.toml")),
            arguments: &["split"],
            trip: 1,
            options: &[],
            ..kind("split", "nobody.py", "split registers")
        },
        Kind {
            text: Some(include_str!("../crates/drive-profile/tests/data/signed.toml")),
            arguments: &["signed"],
            trip: 1,
            options: &[],
            ..kind("signed", "nobody.py", "setpoint is the command")
        },
        Kind {
            text: Some(include_str!("../crates/drive-profile/tests/data/directions.toml")),
            arguments: &["directions"],
            trip: 1,
            options: &[],
            ..kind("directions", "nobody.py", "coils of directions")
        },
    ]
}

/// The third column of the table of patterns in the README of `drive-profile`.
#[test]
fn the_readme_names_the_strangers_of_each_pattern() {
    let readme = include_str!("../crates/drive-profile/README.md");
    let rows =
        readme.split("| Pattern |").nth(1).and_then(|rest| rest.split("\n\n").next()).expect("there is one");
    let rows =
        rows.lines().skip(2).map(|row| row.trim_matches('|').split('|').map(str::trim).collect::<Vec<_>>());
    let mut named = 0;
    for row in rows {
        let of_it = kinds().into_iter().filter(|kind| kind.pattern == row[0]).map(|kind| {
            named += 1;
            let profile = kind.profile();
            let how = match profile.level() {
                Level::Motion if profile.file().start.reverse.given().is_none() => " (not reversed)",
                Level::Motion => "",
                _ => " (stopped alone)",
            };
            format!("`{}`{how}", kind.key)
        });
        assert_eq!(row[2], of_it.collect::<Vec<_>>().join(", "), "{}", row[0]);
    }
    assert_eq!(named, kinds().len(), "each is in a pattern of the table");
}

/// All at once: most of a life is waiting for a motor.
#[tokio::test(flavor = "multi_thread")]
async fn what_is_said_of_a_drive_of_another_hand_is_what_its_shaft_does() {
    let Some(python) = peers::python_with("pymodbus") else { return };
    let mut lives = tokio::task::JoinSet::new();
    for kind in kinds() {
        lives.spawn(life(python.clone(), kind));
    }
    while let Some(lived) = lives.join_next().await {
        lived.unwrap_or_else(|failed| std::panic::resume_unwind(failed.into_panic()));
    }
}

/// On a slow ramp, with a setpoint below the output before it, a stop does not show in the time of a command. A watchdog of these two is fed
/// by a command word alone: a run word behind that stop would hold the motor at its setpoint for ever.
#[tokio::test(flavor = "multi_thread")]
async fn a_stop_that_shows_late_is_followed_by_no_run_word() {
    let Some(python) = peers::python_with("pymodbus") else { return };
    let mut lives = tokio::task::JoinSet::new();
    for kind in kinds().into_iter().filter(|kind| matches!(kind.key, "v20" | "danfoss-fc")) {
        lives.spawn(comes_down_late(python.clone(), kind));
    }
    while let Some(lived) = lives.join_next().await {
        lived.unwrap_or_else(|failed| std::panic::resume_unwind(failed.into_panic()));
    }
}

async fn comes_down_late(python: std::path::PathBuf, kind: Kind) {
    let mut stage = Stage::begin(&python, Kind { ramp: "20", ..kind }).await;
    stage.set_setpoint(30).await;
    stage.start(Direction::Forward).await;
    stage.until("15 Hz", |truth| truth.hertz > 15.0).await;
    stage.set_setpoint(3).await;
    let stopped = stage.drive.stop(StopMode::Ramp).await;
    stage.note("stop", &outcome(&stopped));
    stage.claim(stopped.is_err(), "a stop is told by an output that only follows its setpoint");
    for _ in 0..10 {
        let kept = stage.drive.keep_alive().await;
        stage.note("keep-alive", &outcome(&kept));
        stage.look_for("behind the stop", Duration::from_secs(1)).await;
    }
    stage.until("it stands", |truth| truth.hertz == 0.0 && !truth.running).await;
    stage.stop().await;
    stage.end();
}

/// The whole life of one.
async fn life(python: std::path::PathBuf, kind: Kind) {
    let mut stage = Stage::begin(&python, kind).await;
    stage.enable().await;
    let level = stage.kind.profile().level();
    stage.look_for("standing", Duration::from_secs(1)).await;
    if level == Level::Motion {
        stage.is_driven().await;
    } else {
        stage.is_stopped_alone().await;
    }
    stage.end();
}

struct Stage {
    kind: Kind,
    drive: Box<dyn Drive>,
    line: Line,
    stdin: ChildStdin,
    printed: Arc<Mutex<VecDeque<(Instant, Truth)>>>,
    /// How often it was asked to print, and how often it has.
    asked: u64,
    looked: watch::Receiver<u64>,
    /// What the engine came to, step by step.
    told: String,
    contradictions: Vec<String>,
    _child: Child,
}

impl Stage {
    async fn begin(python: &std::path::Path, kind: Kind) -> Self {
        let mut child = Command::new(python)
            .arg(peers::script("strangers").join(kind.script))
            .args(kind.arguments)
            .args(["--tcp", "0", "--ramp", kind.ramp, "--coast", "3"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .kill_on_drop(true)
            .spawn()
            .expect("the stranger can be run");
        let stdin = child.stdin.take().expect("it is piped");
        let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
        let ready = lines.next_line().await.expect("it speaks").expect("it is ready");
        let ready: serde_json::Value = serde_json::from_str(&ready).expect("it speaks JSON");
        let port = ready["tcp"].as_u64().expect("it names its port");
        let printed = Arc::new(Mutex::new(VecDeque::new()));
        let (to, (first, mut seen)) = (printed.clone(), mpsc::channel(1));
        let (look, looked) = watch::channel(0);
        tokio::spawn(async move {
            while let Ok(Some(line)) = lines.next_line().await {
                let Ok(value) = serde_json::from_str::<serde_json::Value>(&line) else { continue };
                let truth = Truth {
                    hertz: value["shaft_hz"].as_f64().unwrap_or(f64::NAN),
                    running: value["running"] == true,
                    direction: if value["direction"] == "reverse" {
                        Direction::Reverse
                    } else {
                        Direction::Forward
                    },
                    tripped: value["tripped"] == true,
                };
                to.lock().expect("no panic").push_back((Instant::now(), truth));
                first.try_send(()).ok();
                value["look"].as_u64().map(|number| look.send(number));
            }
        });
        seen.recv().await.expect("it prints its shaft");
        let profile = kind.profile();
        let family = Family::new(definition(&Arc::new(profile)));
        // Its options are known once it is.
        family.exchange().expect("no family that is built in has its name");
        let mut options = Options::default();
        for (name, value) in kind.options {
            options.set(name, value).expect("it is an option of a profile");
        }
        let config = LineConfig::rtu_over_tcp(format!("127.0.0.1:{port}"), SerialSettings::MODBUS_DEFAULT);
        let line = Line::open(config).await.expect("it opens");
        let slave = SlaveAddress::try_from(1).expect("it is one");
        let drive = family.open_with(line.slave(1), slave, &options);
        Self {
            kind,
            drive,
            line,
            stdin,
            printed,
            asked: 0,
            looked,
            told: String::new(),
            contradictions: Vec::new(),
            _child: child,
        }
    }

    /// What its owner does each time it was switched on.
    async fn enable(&mut self) {
        self.write_as_another(self.kind.enables).await;
    }

    async fn write_as_another(&mut self, words: &[(u16, u16)]) {
        use tokio_modbus::client::Writer as _;
        let mut other = tokio_modbus::client::Context::from(self.line.slave(1));
        for &(register, word) in words {
            other
                .write_multiple_registers(register, &[word])
                .await
                .expect("it answers")
                .expect("it takes it");
            sleep(Duration::from_millis(150)).await;
        }
    }

    /// Whatever its profile lets be done.
    async fn is_driven(&mut self) {
        let key = self.kind.key;
        self.set_setpoint(30).await;
        self.start(Direction::Forward).await;
        self.until("30 Hz forward", |truth| truth.hertz > 29.5).await;
        let reverses = self.drive.run_word_for(Direction::Reverse).is_some();
        if reverses {
            self.start(Direction::Reverse).await;
            self.until("30 Hz in reverse", |truth| truth.hertz < -29.5).await;
            self.start(Direction::Forward).await;
            self.until("30 Hz forward again", |truth| truth.hertz > 29.5).await;
        }
        self.set_setpoint(20).await;
        self.until("20 Hz", |truth| truth.hertz < 20.5).await;
        self.stop().await;

        self.start(Direction::Forward).await;
        self.until("20 Hz", |truth| truth.hertz > 19.5).await;
        self.say(&format!("trip {}", self.kind.trip)).await;
        self.until("the trip", |truth| truth.tripped).await;
        let status = self.until_status("the trip is told", |status| status.state == State::Fault).await;
        self.note("tripped", &format!("{:?}", status.fault_code));
        let refused = self.drive.start(Direction::Forward).await;
        self.claim(refused.is_err(), "a start of a drive that has tripped is confirmed");
        self.until("the shaft stands", |truth| truth.hertz == 0.0).await;
        let reset = self.drive.reset_faults().await;
        self.note("reset", &outcome(&reset));
        self.settle(Duration::from_millis(2_500)).await;
        let now = self.now();
        self.claim(reset.is_err() || !now.tripped, "a reset is confirmed, and it has tripped still");
        assert!(!now.tripped, "{key}: {}", self.told);
        self.look_for("behind the reset", Duration::from_secs(2)).await;
        self.claim(!self.ran_within(Duration::from_secs(2)), "the motor was started by a reset");

        // Out of sight, with the run command that stands.
        self.set_setpoint(20).await;
        self.start(Direction::Forward).await;
        self.until("20 Hz", |truth| truth.hertz > 19.5).await;
        self.say("deaf 6").await;
        self.until_lost().await;
        self.drive.forget();
        self.until_answer().await;
        self.look_for("back", Duration::from_secs(1)).await;
        self.stop().await;
        // Its own watchdog may have stopped it, as it comes from the factory.
        while self.now().tripped {
            let reset = self.drive.reset_faults().await;
            self.note("reset", &outcome(&reset));
            let unsent = reset.is_err_and(|error| error.kind() == ErrorKind::NotSent);
            self.settle(Duration::from_secs(1)).await;
            assert!(unsent || !self.now().tripped, "{}: {}", self.kind.key, self.told);
        }

        // A power cycle in the middle: nothing starts it again. A setpoint that was kept for a start is forgotten with the line.
        self.set_setpoint(20).await;
        self.start(Direction::Forward).await;
        self.until("20 Hz", |truth| truth.hertz > 19.5).await;
        self.say("power off").await;
        self.until_lost().await;
        self.drive.forget();
        self.say("power on").await;
        self.until_answer().await;
        self.enable().await;
        self.until("the shaft stands", |truth| truth.hertz == 0.0).await;
        self.look_for("behind the power cycle", Duration::from_secs(3)).await;
        self.claim(!self.ran_within(Duration::from_secs(3)), "the motor was started behind a power cycle");
        let withdrawn = self.drive.withdraw().await;
        self.note("withdraw", &outcome(&withdrawn));

        // The panel runs it: no run command of this side is in force then, and none is given.
        self.say("panel 15").await;
        self.until("15 Hz", |truth| truth.hertz.abs() > 14.5).await;
        self.look_for("at the panel", Duration::from_secs(1)).await;
        let taken = self.drive.start(Direction::Reverse).await;
        self.note("start at the panel", &outcome(&taken));
        self.claim(taken.is_err(), "a start of a drive that its panel runs is confirmed");
        self.say("remote").await;
        self.look_for("back from the panel", Duration::from_secs(3)).await;
        let stopped = self.drive.stop(StopMode::Ramp).await;
        self.note("stop", &outcome(&stopped));
        self.until("it stands", |truth| truth.hertz == 0.0).await;
    }

    /// A drive that the profile only stops: another master runs it.
    async fn is_stopped_alone(&mut self) {
        let started = self.drive.start(Direction::Forward).await;
        self.claim(
            matches!(&started, Err(error) if error.kind() == ErrorKind::Unsupported),
            "a start beyond its level",
        );
        self.write_as_another(self.kind.others).await;
        self.until("another master runs it", |truth| truth.hertz > 15.0).await;
        self.look_for("run by another", Duration::from_secs(1)).await;
        self.stop().await;
    }

    async fn set_setpoint(&mut self, hertz: u16) {
        let set = loop {
            let set = self.drive.set_setpoint(Frequency::from_hertz(hertz).into()).await;
            self.note(&format!("{hertz} Hz"), &outcome(&set));
            if !set.as_ref().is_err_and(wrote_nothing) {
                break set;
            }
            sleep(Duration::from_millis(300)).await;
        };
        // Of some drives nothing shows a setpoint before they run: that is said, and is no refusal.
        let fits = set.is_ok() || matches!(set, Err(Error::NotConfirmed { .. }));
        assert!(fits, "{}: {}", self.kind.key, self.told);
    }

    async fn start(&mut self, direction: Direction) {
        for _ in 0..10 {
            let started = self.drive.start(direction).await;
            self.note(&format!("start {direction}"), &outcome(&started));
            if started.is_ok() {
                self.look_for("started", Duration::from_millis(300)).await;
                self.claim(self.now().running, "a start is confirmed, and its output is off");
                return;
            }
            let unsent = started.as_ref().is_err_and(wrote_nothing);
            assert!(unsent, "{}: {}", self.kind.key, self.told);
            sleep(Duration::from_millis(300)).await;
        }
        panic!("{}: it is never sent: {}", self.kind.key, self.told);
    }

    async fn stop(&mut self) {
        // A stop that takes longer to show than it is waited for is repeated, as the fleet does.
        for _ in 0..5 {
            let stopped = self.drive.stop(StopMode::Ramp).await;
            self.note("stop", &outcome(&stopped));
            if stopped.is_ok() {
                break;
            }
        }
        self.claim(self.drive.lease().is_none(), "a stop leaves a run command");
        self.until("it stands", |truth| truth.hertz == 0.0 && !truth.running).await;
        self.look_for("stopped", Duration::from_millis(500)).await;
    }

    /// Looks at the drive for a while, each look held against the shaft.
    async fn look_for(&mut self, what: &str, time: Duration) {
        let until = Instant::now() + time;
        while Instant::now() < until {
            if let Err(error) = self.look().await {
                self.note(what, &error.to_string());
            }
            sleep(Duration::from_millis(50)).await;
        }
    }

    async fn look(&mut self) -> Result<Status, Error> {
        let before = Instant::now();
        let status = self.drive.status().await?;
        sleep(Duration::from_millis(120)).await;
        // What it prints of this moment may come late: behind what it is asked to print now nothing of before is missing.
        self.asked += 1;
        let asked = self.asked;
        self.stdin.write_all(format!("look {asked}\n").as_bytes()).await.expect("it listens");
        self.looked.wait_for(|looked| *looked >= asked).await.expect("it prints");
        self.judge(&status, before);
        Ok(status)
    }

    /// What is said that was so at no time around the look.
    fn judge(&mut self, status: &Status, before: Instant) {
        let around = self.around(before.checked_sub(APART).unwrap_or(before), Instant::now());
        let ever = |is: &dyn Fn(&Truth) -> bool| around.iter().any(is);
        let mut lies = Vec::new();
        let driven = matches!(status.motion, Motion::Driven) || status.state == State::Running;
        if driven && !ever(&|truth| truth.running) {
            lies.push("it is told to run, and its output is off".to_owned());
        }
        if status.motion == Motion::AtRest && !ever(&|truth| truth.hertz.abs() < 1.0) {
            lies.push("it is told at rest, and it turns".to_owned());
        }
        if status.is_fault() && !ever(&|truth| truth.tripped) {
            lies.push("it is told to have tripped, and has not".to_owned());
        }
        if !status.is_fault() && status.state != State::Unknown && !ever(&|truth| !truth.tripped) {
            lies.push("it has tripped, and that is not told".to_owned());
        }
        if status.verdict == Some(Verdict::InForce) && !ever(&|truth| truth.running) {
            lies.push("a run command is told in force, and its output is off".to_owned());
        }
        if let Some(output) = status.output_frequency {
            let hertz = f64::from(output.centihertz()) / 100.0;
            let fits =
                |truth: &Truth| (truth.hertz.abs() - hertz).abs() < 3.0 || (!truth.running && hertz == 0.0);
            if !ever(&fits) {
                lies.push(format!("it is told to have {hertz} Hz"));
            }
        }
        if let (Some(direction), State::Running) = (status.direction, status.state)
            && !ever(&|truth| truth.direction == direction || truth.hertz.abs() < 1.0)
        {
            lies.push(format!("it is told to turn {direction}"));
        }
        for lie in lies {
            self.contradictions.push(format!("{lie}: {status:?}, around it {around:?}"));
        }
    }

    /// What was printed between the two, and what stood at the first.
    fn around(&self, from: Instant, to: Instant) -> Vec<Truth> {
        let printed = self.printed.lock().expect("no panic");
        let stood = printed.iter().rev().find(|(at, _)| *at <= from);
        let between = printed.iter().filter(|(at, _)| *at > from && *at <= to);
        stood.into_iter().chain(between).map(|(_, truth)| truth.clone()).collect()
    }

    fn now(&self) -> Truth {
        self.printed.lock().expect("no panic").back().expect("it has printed").1.clone()
    }

    fn ran_within(&self, time: Duration) -> bool {
        let from = Instant::now().checked_sub(time).unwrap_or_else(Instant::now);
        self.around(from, Instant::now()).iter().any(|truth| truth.running)
    }

    async fn settle(&mut self, time: Duration) {
        let until = Instant::now() + time;
        while Instant::now() < until {
            // A drive that starts anew behind a reset does not answer.
            self.look().await.ok();
            sleep(Duration::from_millis(50)).await;
        }
    }

    async fn until(&mut self, what: &str, is_so: impl Fn(&Truth) -> bool) {
        let told = timeout(Duration::from_secs(30), async {
            while !is_so(&self.now()) {
                self.look().await.ok();
                sleep(Duration::from_millis(30)).await;
            }
        });
        assert!(told.await.is_ok(), "{}: never {what}; {:?}\n{}", self.kind.key, self.now(), self.told);
    }

    async fn until_status(&mut self, what: &str, is_so: impl Fn(&Status) -> bool) -> Status {
        let told = timeout(Duration::from_secs(30), async {
            loop {
                match self.look().await {
                    Ok(status) if is_so(&status) => return status,
                    _ => sleep(Duration::from_millis(30)).await,
                }
            }
        });
        told.await.unwrap_or_else(|_| panic!("{}: never {what}\n{}", self.kind.key, self.told))
    }

    async fn until_lost(&mut self) {
        let told = timeout(Duration::from_secs(30), async { while self.look().await.is_ok() {} });
        assert!(told.await.is_ok(), "{}: it answers", self.kind.key);
    }

    async fn until_answer(&mut self) {
        self.until_status("an answer", |_| true).await;
    }

    async fn say(&mut self, line: &str) {
        self.note("stranger", line);
        self.stdin.write_all(format!("{line}\n").as_bytes()).await.expect("it listens");
    }

    fn note(&mut self, what: &str, came: &str) {
        writeln!(self.told, "  {what}: {came}").expect("a text");
    }

    fn claim(&mut self, is_so: bool, otherwise: &str) {
        if !is_so {
            self.contradictions.push(format!("{otherwise}: {:?}", self.now()));
        }
    }

    fn end(self) {
        println!("{}:\n{}", self.kind.key, self.told);
        assert!(
            self.contradictions.is_empty(),
            "{}:\n{}\n{}",
            self.kind.key,
            self.contradictions.join("\n"),
            self.told
        );
    }
}

/// Behind a lost answer the line keeps a slave's late answers apart: an order may expire before its turn, and what is read before it is written
/// may be taken for a late answer. Both say so, and may be asked for again.
fn wrote_nothing(error: &Error) -> bool {
    matches!(error.kind(), ErrorKind::NotSent | ErrorKind::NoAnswer)
}

fn outcome<T>(result: &Result<T, Error>) -> String {
    match result {
        Ok(_) => "confirmed".to_owned(),
        Err(error) => error.to_string(),
    }
}
