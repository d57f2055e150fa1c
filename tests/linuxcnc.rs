//! LinuxCNC's own drivers of spindle drives, which run real ones in workshops, drive our simulated ones over a pty: they were written by
//! another hand, from drives and not from documents. `DRIVED_LINUXCNC` names the folder into which its Debian packages were unpacked.
#![cfg(unix)]

use std::{
    env,
    path::{Path, PathBuf},
    process::Stdio,
    sync::Arc,
    time::Duration,
};

use drive_core::SerialSettings;
use drive_families::{Family, SetUp};
use drive_profile::{definition, digest, read, shipped};
use drive_sim::{Observation, Panel, Serving, SimLine, SimSlave, Wiring};
use drive_testing::peers::{is_there, runs};
use tokio::{
    io::{AsyncBufReadExt as _, AsyncWriteExt as _, BufReader, Lines},
    process::{Child, ChildStdin, ChildStdout, Command},
    time::{sleep, timeout},
};

/// Longer than any of this takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

#[tokio::test(flavor = "multi_thread")]
async fn linuxcnc_runs_turns_round_stops_and_resets_a_simulated_wj200() {
    let Some(folder) = folder() else { return };
    let bench = Bench::of("wj200", "9600 8N1");
    let load = format!("loadusr -W wj200_vfd --device {} --baud 9600", bench.port.display());
    let mut hal = Hal::start(&folder, &load).await;
    let pin = |name: &str| format!("wj200-vfd.0.{name}");
    hal.set(&pin("enable"), "1").await;
    hal.set(&pin("commanded-frequency"), "30").await;
    hal.set(&pin("run"), "1").await;
    hal.set(&pin("mbslaveaddr"), "1").await;
    bench.until("30 Hz forward", |seen| seen.output_frequency == 3_000).await;
    hal.until(&pin("is-running"), "TRUE").await;
    hal.until(&pin("is-at-speed"), "TRUE").await;
    hal.set(&pin("reverse"), "1").await;
    bench.until("30 Hz in reverse", |seen| seen.output_frequency == -3_000).await;
    hal.set(&pin("commanded-frequency"), "20").await;
    bench.until("20 Hz in reverse", |seen| seen.output_frequency == -2_000).await;
    hal.set(&pin("run"), "0").await;
    bench.until("rest", |seen| !seen.running && seen.shaft_frequency == 0).await;
    hal.until(&pin("is-running"), "FALSE").await;
    // It resets a trip by itself as long as it is enabled, and is not told to run here.
    bench.machine.trip(9);
    bench.until("the reset", |seen| seen.trip.is_none()).await;
    assert!(!bench.machine.observe().running, "a reset is no start");
    hal.until(&pin("is-alarm"), "FALSE").await;
    hal.end().await;
}

/// It sets bit 6 of each command, the second ramp, which the profile does not use. `vfdb_vfd` has no twin here: it is for a VFD-B, whose
/// states at 2101h are others than an MS300's, and its stop is a 0, which on that map is no function.
#[tokio::test(flavor = "multi_thread")]
async fn linuxcnc_runs_turns_round_stops_and_resets_a_simulated_vf_s15() {
    let Some(folder) = folder() else { return };
    let bench = Bench::of("vfs15", "9600 8N1");
    let ini = bench.port.with_extension("ini");
    let text =
        format!("[VFS11]\nTYPE=rtu\nDEVICE={}\nBAUD=9600\nPARITY=none\nTARGET=1\n", bench.port.display());
    std::fs::write(&ini, text).expect("it can be written");
    let mut hal = Hal::start(&folder, &format!("loadusr -W vfs11_vfd --ini {}", ini.display())).await;
    let pin = |name: &str| format!("vfs11_vfd.{name}");
    // 20 rpm are one hertz.
    hal.set(&pin("nameplate-RPM"), "1000").await;
    hal.set(&pin("speed-command"), "600").await;
    hal.set(&pin("spindle-on"), "1").await;
    hal.set(&pin("enable"), "1").await;
    bench.until("30 Hz forward", |seen| seen.output_frequency == 3_000).await;
    hal.until(&pin("at-speed"), "TRUE").await;
    hal.set(&pin("spindle-fwd"), "0").await;
    bench.until("30 Hz in reverse", |seen| seen.output_frequency == -3_000).await;
    hal.set(&pin("speed-command"), "400").await;
    bench.until("20 Hz in reverse", |seen| seen.output_frequency == -2_000).await;
    hal.set(&pin("spindle-on"), "0").await;
    bench.until("rest", |seen| !seen.running && seen.shaft_frequency == 0).await;
    hal.until(&pin("is-stopped"), "TRUE").await;
    // Still in reverse: the word of its reset has the bit of the direction, which takes nothing from it.
    bench.machine.trip(9);
    hal.until(&pin("trip-code"), "9").await;
    hal.set(&pin("err-reset"), "1").await;
    bench.until("the reset", |seen| seen.trip.is_none()).await;
    assert!(!bench.machine.observe().running, "a reset is no start");
    hal.until(&pin("trip-code"), "0").await;
    hal.end().await;
    let _ = std::fs::remove_file(ini);
}

/// Run, direction and reset in registers of their own, the frequency in tenths of a hertz. It reads thirteen words in a row at 2100h, of which
/// the GS4 has fewer: the twin gets the others, as a GS2 has them. It counts on a direction that acts while the motor runs.
#[tokio::test(flavor = "multi_thread")]
async fn linuxcnc_runs_turns_round_stops_and_resets_a_simulated_gs2() {
    let Some(folder) = folder() else { return };
    let register = |address: u16, access: &str| {
        format!(
            "[register.W{address:04X}]\nwhat = \"another\"\naddress = {address}\naccess = {access}\nsource = \"linuxcnc\"\n\n"
        )
    };
    let read = [0x2100, 0x2104, 0x2105, 0x2106, 0x2107, 0x2108, 0x2109, 0x210A, 0x210B, 0x210C];
    let read = read.map(|address| register(address, "\"read\"")).concat();
    // The way of its stop, both ramps, and the stall prevention: it sets them when it begins.
    let set = [0x0100, 0x0101, 0x0102, 0x0605];
    let others =
        read + &set.map(|address| register(address, "\"read_write\"\nstorage = \"unknown\"")).concat();
    let bench = Bench::of_text(
        "gs4",
        "9600 8N1",
        &[
            ("read_words = \"unknown\"", "read_words = 13"),
            ("reads_across = \"unknown\"", "reads_across = true"),
            ("acts = \"unknown\"", "acts = \"level\""),
            ("[state]\n", &format!("{others}[state]\n")),
        ],
    );
    let load = format!("loadusr -W gs2_vfd --device {} --rate 9600 --parity none", bench.port.display());
    let mut hal = Hal::start(&folder, &load).await;
    let pin = |name: &str| format!("gs2_vfd.{name}");
    hal.set(&pin("nameplate-HZ"), "60").await;
    hal.set(&pin("nameplate-RPM"), "1800").await;
    hal.set(&pin("speed-command"), "900").await;
    hal.set(&pin("spindle-fwd"), "1").await;
    bench.nudged(&mut hal, &pin("spindle-on"), "1", |seen| seen.running).await;
    bench.until("30 Hz forward", |seen| seen.output_frequency == 3_000).await;
    hal.until(&pin("at-speed"), "TRUE").await;
    bench.nudged(&mut hal, &pin("spindle-fwd"), "0", |seen| seen.setpoint == -3_000).await;
    bench.until("30 Hz in reverse", |seen| seen.output_frequency == -3_000).await;
    hal.set(&pin("speed-command"), "600").await;
    bench.until("20 Hz in reverse", |seen| seen.output_frequency == -2_000).await;
    bench.nudged(&mut hal, &pin("spindle-on"), "0", |seen| seen.setpoint == 0).await;
    bench.until("rest", |seen| !seen.running && seen.shaft_frequency == 0).await;
    hal.until(&pin("is-stopped"), "TRUE").await;
    bench.machine.trip(9);
    bench.nudged(&mut hal, &pin("err-reset"), "1", |seen| seen.trip.is_none()).await;
    assert!(!bench.machine.observe().running, "a reset is no start");
    hal.end().await;
}

/// It writes the run command and the frequency again in each of its turns, forward alone, and reads one word at a time. What it gives and where
/// it sees the output is not in the shipped profile, which is only stopped: the twin gets it from there.
#[tokio::test(flavor = "multi_thread")]
async fn linuxcnc_runs_and_stops_a_simulated_huanyang_gt() {
    let Some(folder) = folder() else { return };
    let read = [0x3002, 0x3003, 0x3004, 0x3005, 0x3006, 0x300A, 0x300B, 0x300C, 0x300D, 0x3010, 0x3014];
    let others = read
        .map(|address| {
            format!("[register.W{address:04X}]\nwhat = \"another\"\naddress = {address}\naccess = \"read\"\nsource = \"repos\"\n\n")
        })
        .concat();
    let speed = "[register.SPEED]\nwhat = \"frequency by the bus\"\naddress = 0x2000\naccess = \"read_write\"\nstorage = \"unknown\"\nunit = \"%\"\n\
         scale = [1, 100]\nsource = \"repos\"\n\n[register.OUTPUT]\nwhat = \"output frequency\"\naddress = 0x3000\naccess = \"read\"\nunit = \"Hz\"\n\
         scale = [1, 100]\nsource = \"repos\"\n\n";
    let setpoint = "[setpoint]\nregister = \"SPEED\"\nfull_scale = \"owner\"\nlimits = { low = 0, high = 10000 }\n\
         sign_is_direction = false\nsource = \"repos\"\n\n[start]\n";
    let bench = Bench::of_text(
        "huanyang-gt",
        "38400 8N1",
        &[
            ("setpoint = \"unknown\"\nwatchdog", "watchdog"),
            ("[state]\n", &format!("{speed}{others}[state]\n")),
            ("output = \"unknown\"", "output = \"OUTPUT\""),
            ("[start]\n", setpoint),
            (
                "forward = \"unknown\"",
                "forward = { steps = [{ write = \"COMMAND\", words = [1] }], source = \"repos\" }",
            ),
        ],
    );
    let load = format!(
        "loadusr -W hy_gt_vfd --device {} --rate 38400 --parity none --motor-max-speed 3000 --max-frequency 50 --min-frequency 1",
        bench.port.display()
    );
    let mut hal = Hal::start(&folder, &load).await;
    let pin = |name: &str| format!("hy_gt_vfd.{name}");
    hal.set(&pin("speed-cmd"), "1800").await;
    hal.set(&pin("spindle-on"), "1").await;
    bench.until("30 Hz forward", |seen| seen.output_frequency == 3_000).await;
    hal.until(&pin("freq-fb"), "30").await;
    hal.set(&pin("speed-cmd"), "1200").await;
    bench.until("20 Hz", |seen| seen.output_frequency == 2_000).await;
    bench.machine.trip(9);
    hal.until(&pin("fault-info"), "9").await;
    bench.until("rest", |seen| !seen.running && seen.shaft_frequency == 0).await;
    bench.machine.panel(Panel::Reset);
    // It has never taken its run command back: what runs here is what it writes.
    bench.until("20 Hz again", |seen| seen.output_frequency == 2_000).await;
    hal.set(&pin("spindle-on"), "0").await;
    bench.until("rest", |seen| !seen.running && seen.shaft_frequency == 0).await;
    hal.end().await;
}

/// The folder of its packages.
fn folder() -> Option<PathBuf> {
    let folder = env::var_os("DRIVED_LINUXCNC").map(PathBuf::from);
    let found = folder.filter(|folder| folder.join("usr/bin/halcmd").is_file());
    is_there(found.is_some(), "LinuxCNC (DRIVED_LINUXCNC)").then_some(found).flatten()
}

/// A simulated drive of a profile at address 1 on a pty.
struct Bench {
    port: PathBuf,
    machine: SimSlave,
    _serving: Serving,
}

impl Bench {
    fn of(key: &str, settings: &str) -> Self {
        Self::of_text(key, settings, &[])
    }

    /// Of a shipped profile with some places otherwise.
    fn of_text(key: &str, settings: &str, changes: &[(&str, &str)]) -> Self {
        let settings: SerialSettings = settings.parse().expect("it is a setting of a line");
        let is_it = |text: &&str| shipped::find(key).is_some_and(|found| digest(text) == found.digest());
        let text = shipped::TEXTS.iter().map(|(_, text)| *text).find(is_it).expect("it is shipped");
        let text = changes.iter().fold(text.to_owned(), |text, (place, by)| {
            assert_eq!(text.matches(place).count(), 1, "{key}: {place}");
            text.replace(place, by)
        });
        let profile = read(&text).unwrap_or_else(|refusals| panic!("{refusals}"));
        let family = Family::new(definition(&Arc::new(profile)));
        let line = SimLine::new(Wiring::rtu(settings));
        let machine = family.machine(SetUp::ForTheBus).expect("it has a twin");
        let machine = line.add_boxed(1, machine).expect("address 1 is free");
        let port = env::temp_dir().join(format!("drived-linuxcnc-{key}-{}", std::process::id()));
        let serving = line.serve_pty(&port).expect("a pty can be had");
        Self { port, machine, _serving: serving }
    }

    /// Until the drive is so by a switch that is thrown. `gs2_vfd` writes what has changed once, and takes it for done whatever came of that: on a
    /// busy machine it is thrown back and again.
    async fn nudged(&self, hal: &mut Hal, pin: &str, value: &str, is_so: impl Fn(&Observation) -> bool) {
        const TURNS: Duration = Duration::from_secs(5);
        let nudges = timeout(PATIENCE, async {
            loop {
                hal.set(pin, value).await;
                if timeout(TURNS, self.machine.wait_until(&is_so)).await.is_ok() {
                    break;
                }
                hal.set(pin, if value == "0" { "1" } else { "0" }).await;
                sleep(TURNS).await;
            }
        });
        assert!(nudges.await.is_ok(), "{pin} is never obeyed: {:?}", self.machine.observe());
    }

    async fn until(&self, what: &str, is_so: impl Fn(&Observation) -> bool) {
        let seen = timeout(PATIENCE, self.machine.wait_until(is_so)).await;
        assert!(seen.is_ok(), "never {what}: {:?}", self.machine.observe());
    }
}

/// LinuxCNC's hardware layer, to which its drivers belong: told by lines.
struct Hal {
    told: ChildStdin,
    says: Lines<BufReader<ChildStdout>>,
    child: Child,
}

impl Hal {
    async fn start(folder: &Path, load: &str) -> Self {
        let (bin, lib) = (folder.join("usr/bin"), folder.join("usr/lib"));
        let path = env::var("PATH").unwrap_or_default();
        // Its memory is one of the whole machine, and its drivers outlive it: where that may be, it gets a space of its own.
        const APART: &[&str] = &["--ipc", "--pid", "--fork", "--kill-child"];
        let can = runs("unshare", &[APART, &["true"]].concat());
        let apart = if can { [&["unshare"], APART].concat() } else { Vec::new() };
        let program = bin.join("halcmd").display().to_string();
        let words: Vec<&str> = apart.iter().copied().chain([&*program, "-k", "-f"]).collect();
        let (first, rest) = words.split_first().expect("there is one");
        let mut child = Command::new(first)
            .args(rest)
            .env("PATH", format!("{}:{path}", bin.display()))
            .env("LD_LIBRARY_PATH", format!("{0}:{0}/x86_64-linux-gnu", lib.display()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .kill_on_drop(true)
            .spawn()
            .expect("it can be run");
        let told = child.stdin.take().expect("it is piped");
        let says = BufReader::new(child.stdout.take().expect("it is piped")).lines();
        let mut hal = Self { told, says, child };
        hal.tell(load).await;
        hal
    }

    async fn tell(&mut self, line: &str) {
        self.told.write_all(format!("{line}\n").as_bytes()).await.expect("it listens");
    }

    async fn set(&mut self, name: &str, value: &str) {
        self.tell(&format!("setp {name} {value}")).await;
    }

    /// Until a pin holds this.
    async fn until(&mut self, name: &str, value: &str) {
        let told = timeout(PATIENCE, async {
            loop {
                self.tell(&format!("getp {name}")).await;
                let said = self.says.next_line().await.expect("it speaks").expect("it has not ended");
                if said.trim() == value {
                    break;
                }
                sleep(Duration::from_millis(20)).await;
            }
        });
        assert!(told.await.is_ok(), "{name} is never {value}");
    }

    async fn end(mut self) {
        self.tell("unloadusr all").await;
        drop(self.told);
        timeout(PATIENCE, self.child.wait()).await.expect("it ends").expect("it can be waited for");
    }
}
