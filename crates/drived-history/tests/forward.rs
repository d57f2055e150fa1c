//! What is sent on to a database of other people's, VictoriaMetrics from Debian's packages, through its outages and through kills of ours: every
//! value is there once, and none is missing. Where that program is not installed it says so and shows nothing.

use std::{
    collections::BTreeMap,
    io::{Read as _, Write as _},
    net::{TcpListener, TcpStream},
    path::Path,
    process::{Child, Command, Stdio},
    sync::{
        Arc,
        atomic::{AtomicI64, Ordering},
    },
    time::{Duration, SystemTime},
};

use drived_config::testing::Folder;
use drived_history::{
    forward::{self, Forward},
    quantity::{Quantity, Set},
    record::Moment,
    tracker::Tracker,
    write::{
        Limits,
        inbox::{Inbox, Shown},
        writer::{Health, Writer},
    },
};
use tokio::{sync::watch, task::JoinHandle};

const HZ: Quantity = Quantity::OUTPUT_FREQUENCY;
const PROGRAM: &str = "victoria-metrics";

/// The database, ended as an operator ends it.
struct Database(Child);

impl Database {
    fn start(port: u16, data: &Path) -> Option<Self> {
        let child = Command::new(PROGRAM)
            .arg(format!("-httpListenAddr=127.0.0.1:{port}"))
            .arg(format!("-storageDataPath={}", data.display()))
            .args(["-dedup.minScrapeInterval=1ms", "-search.latencyOffset=0s"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        child.ok().map(Self)
    }

    fn end(mut self) {
        let id = self.0.id().to_string();
        let told = Command::new("kill").args(["-TERM", &id]).status().unwrap();
        assert!(told.success());
        self.0.wait().unwrap();
    }
}

impl Drop for Database {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Every sample of a field that the database has: its times, and what stands there.
fn samples(port: u16, field: &str) -> Vec<(i64, f64)> {
    let get = || -> std::io::Result<String> {
        let mut stream = TcpStream::connect(("127.0.0.1", port))?;
        stream.set_read_timeout(Some(Duration::from_secs(20)))?;
        write!(stream, "GET /api/v1/export?match%5B%5D=drive_{field} HTTP/1.0\r\nHost: localhost\r\n\r\n")?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer)?;
        Ok(answer)
    };
    let answer = get().unwrap_or_default();
    let body = answer.split_once("\r\n\r\n").map_or("", |(_, body)| body);
    let mut all = Vec::new();
    for line in body.lines() {
        let Ok(series) = serde_json::from_str::<serde_json::Value>(line) else { continue };
        assert_eq!(series["metric"]["drive"], "pump 1", "{series}");
        let (times, values) =
            (series["timestamps"].as_array().unwrap(), series["values"].as_array().unwrap());
        all.extend(
            times.iter().zip(values).map(|(at, value)| (at.as_i64().unwrap(), value.as_f64().unwrap())),
        );
    }
    all.sort_by_key(|(at, _)| *at);
    all
}

/// A history that lives through its time as fast as it is told to.
struct Recorder {
    inbox: Inbox,
    steady: Arc<AtomicI64>,
    tracker: Tracker,
    begin_ms: i64,
    health: watch::Receiver<Health>,
    /// What was shown: when by the wall, and the count.
    shown: BTreeMap<i64, i64>,
    random: fastrand::Rng,
}

impl Recorder {
    fn start(path: &Path, begin_ms: i64) -> Self {
        let (inbox, steady) = (Inbox::default(), Arc::new(AtomicI64::new(0)));
        let (health, seen) = watch::channel(Health::Opening);
        let now = Arc::clone(&steady);
        let clock = move || {
            let steady_ms = now.load(Ordering::SeqCst);
            Moment { steady_ms, wall_ms: begin_ms + steady_ms }
        };
        let writer = Writer {
            path: path.to_owned(),
            limits: Limits::default(),
            inbox: inbox.clone(),
            clock,
            health,
            is_anew: false,
        };
        drop(writer.start().unwrap());
        let (tracker, shown) = (Tracker::default(), BTreeMap::new());
        Self { inbox, steady, tracker, begin_ms, health: seen, shown, random: fastrand::Rng::with_seed(7) }
    }

    /// Lives through these seconds, with a value each that leaves its deadband.
    async fn live(&mut self, seconds: i64) {
        self.health.wait_for(|health| *health == Health::Writing).await.unwrap();
        let from = self.steady.load(Ordering::SeqCst);
        for second in 1..=seconds {
            let at = from + second * 1_000;
            let count = 10 * self.random.i64(0..100) + if second % 2 == 0 { 3_000 } else { 1_000 };
            let seen = self.tracker.see(at, 3_000, &[(HZ, count)]).unwrap();
            self.inbox.show(Shown { drive: "pump 1".into(), set: Set::Status, seen }).unwrap();
            self.shown.insert(self.begin_ms + at, count);
            self.steady.store(at, Ordering::SeqCst);
            if second % 60 == 0 {
                // The writer looks at its clock twice a second.
                tokio::time::sleep(Duration::from_millis(600)).await;
            }
        }
    }
}

fn forward(path: &Path, port: u16, inbox: &Inbox) -> (JoinHandle<()>, watch::Receiver<Option<String>>) {
    let target = format!("http://127.0.0.1:{port}/write").parse().unwrap();
    let (health, seen) = watch::channel(None);
    let forward = Forward { target, token: None };
    (tokio::spawn(forward::run(path.to_owned(), forward, inbox.clone(), health)), seen)
}

/// Waits until the database has a sample of this time or a later one.
async fn has(port: u16, at: i64) {
    let is_there = || samples(port, "output_frequency_hz").last().is_some_and(|(last, _)| *last >= at);
    for _ in 0..600 {
        if is_there() {
            return;
        }
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
    panic!("{at} has not come: {:?}", samples(port, "output_frequency_hz").last());
}

#[tokio::test(flavor = "multi_thread")]
async fn through_outages_of_the_database_and_kills_of_ours_every_value_is_there_once() {
    let folder = Folder::new("history-forward");
    let (path, data) = (folder.file("history.sqlite"), folder.file("database"));
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let Some(database) = Database::start(port, &data) else {
        println!("skipped: {PROGRAM} is not installed");
        return;
    };
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap().as_millis();
    // Two hours ago, at a whole minute: what a database believes to be now is not in its future.
    let begin_ms = (i64::try_from(now).unwrap() - 7_200_000) / 60_000 * 60_000;
    let mut recorder = Recorder::start(&path, begin_ms);
    let (sending, mut failing) = forward(&path, port, &recorder.inbox);
    recorder.live(300).await;
    has(port, begin_ms + 200_000).await;

    // It is away for ten minutes.
    database.end();
    recorder.live(600).await;
    failing.wait_for(Option::is_some).await.unwrap();
    let database = Database::start(port, &data).unwrap();
    failing.wait_for(Option::is_none).await.unwrap();
    has(port, begin_ms + 800_000).await;

    // We are killed in the middle of sending, while it is away, and begin again.
    database.end();
    recorder.live(900).await;
    sending.abort();
    let _ = sending.await;
    let _database = Database::start(port, &data).unwrap();
    let (_sending, _failing) = forward(&path, port, &recorder.inbox);
    recorder.live(120).await;
    let end = begin_ms + 1_800_000;
    has(port, end).await;

    let expected: Vec<(i64, f64)> = recorder
        .shown
        .iter()
        .filter(|(at, _)| **at <= end)
        .map(|(at, count)| (*at, *count as f64 / 100.0))
        .collect();
    let found: Vec<(i64, f64)> =
        samples(port, "output_frequency_hz").into_iter().filter(|(at, _)| *at <= end).collect();
    let missing: Vec<_> = expected.iter().filter(|one| !found.contains(one)).collect();
    assert_eq!(missing, Vec::<&(i64, f64)>::new(), "left out of {}", expected.len());
    assert_eq!(found.len(), expected.len(), "each once");
    println!("{} values, each there once", found.len());
}
