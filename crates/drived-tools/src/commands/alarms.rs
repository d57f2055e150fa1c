//! `drived alarms`: what troubles the plant, and who has taken note of it.

use serde_json::{Value, json};

use drive_fleet::alarms::AlarmView;
use drived_client::{Daemon, DaemonArgs, path_of};
use drived_plant::plant::alarms::AlarmsView;
use drived_words::{failure::Failure, json::unix, output};

/// List the alarms of the running daemon, acknowledge and shelve them
///
/// An alarm stays until it is so no more and somebody has acknowledged it. One that follows from another, such as a drive on a dead line,
/// is suppressed by that one. Of a motor that turns or may, none can be shelved.
#[derive(Debug, clap::Subcommand)]
pub enum Command {
    /// List them, those that wait for somebody first
    List {
        /// Also those that are suppressed by another
        #[arg(long)]
        all: bool,
        #[command(flatten)]
        daemon: DaemonArgs,
    },
    /// Take note of alarms
    Acknowledge {
        /// Their numbers, as they are listed
        #[arg(value_name = "NUMBER", required_unless_present = "all")]
        numbers: Vec<u64>,
        /// All that wait for it now
        #[arg(long, conflicts_with = "numbers")]
        all: bool,
        /// What is to be remembered of it
        #[arg(long, value_name = "TEXT")]
        note: Option<String>,
        #[command(flatten)]
        daemon: DaemonArgs,
    },
    /// Put an alarm aside for a time
    Shelve {
        /// Its number
        #[arg(value_name = "NUMBER")]
        number: u64,
        /// For how long, from 1 to 1440 minutes
        #[arg(long = "for", value_name = "MINUTES", default_value_t = 480)]
        minutes: u32,
        /// Why
        #[arg(long, value_name = "TEXT")]
        why: String,
        #[command(flatten)]
        daemon: DaemonArgs,
    },
    /// Say that what an alarm asks for was done: maintenance, whose hours and starts are counted from now on, or that a motor which an earlier
    /// run may have left turning was seen to stand
    Done {
        /// Its number
        #[arg(value_name = "NUMBER")]
        number: u64,
        /// What is to be remembered of it
        #[arg(long, value_name = "TEXT")]
        note: Option<String>,
        #[command(flatten)]
        daemon: DaemonArgs,
    },
    /// Take an alarm back from where it was put aside
    Unshelve {
        /// Its number
        #[arg(value_name = "NUMBER")]
        number: u64,
        #[command(flatten)]
        daemon: DaemonArgs,
    },
}

pub async fn run(command: Command) -> Result<(), Failure> {
    match command {
        Command::List { all, daemon } => {
            let told = read(&mut daemon.connect().await?).await?;
            daemon.say(&told, || list(&told, all))
        }
        Command::Acknowledge { numbers, all, note, daemon } => {
            let mut connection = daemon.connect().await?;
            let told = read(&mut connection).await?;
            let is_meant = |alarm: &&AlarmView| {
                if all { alarm.state.waits() } else { numbers.contains(&alarm.alarm.id) }
            };
            let known = |number: &&u64| !told.alarms.iter().any(|alarm| alarm.alarm.id == **number);
            if let Some(number) = numbers.iter().find(known) {
                return Err(Failure::Input(format!("there is no alarm {number}, or it is over")));
            }
            let mut done = Vec::new();
            for alarm in told.alarms.iter().filter(is_meant) {
                // What has come again since it was listed is not meant.
                let mut body = json!({ "count": alarm.alarm.count });
                if let Some(note) = &note {
                    body["note"] = note.as_str().into();
                }
                done.push(act(&mut connection, alarm.alarm.id, "acknowledge", &body).await?);
            }
            let done = AlarmsView { alarms: done, dropped: told.dropped };
            daemon.say_done(&done, || match &*done.alarms {
                [] => output::say("no alarm waits for anybody"),
                some => some.iter().try_for_each(one),
            })
        }
        Command::Shelve { number, minutes, why, daemon } => {
            let body = json!({ "minutes": minutes, "why": why });
            let shelved = act(&mut daemon.connect().await?, number, "shelve", &body).await?;
            daemon.say_done(&shelved, || one(&shelved))
        }
        Command::Done { number, note, daemon } => {
            let body = note.map_or(json!({}), |note| json!({ "note": note }));
            let done = act(&mut daemon.connect().await?, number, "done", &body).await?;
            daemon.say_done(&done, || one(&done))
        }
        Command::Unshelve { number, daemon } => {
            let back = act(&mut daemon.connect().await?, number, "unshelve", &json!({})).await?;
            daemon.say_done(&back, || one(&back))
        }
    }
}

async fn read(daemon: &mut Daemon) -> Result<AlarmsView, Failure> {
    daemon.read(&["alarms"]).await
}

async fn act(daemon: &mut Daemon, number: u64, what: &str, body: &Value) -> Result<AlarmView, Failure> {
    daemon.post(&path_of(&["alarms", &number.to_string(), what]), body).await?.done()
}

fn one(alarm: &AlarmView) -> Result<(), Failure> {
    output::say(format_args!("{}: {alarm}", alarm.state))
}

fn list(told: &AlarmsView, all: bool) -> Result<(), Failure> {
    let mut alarms: Vec<&AlarmView> =
        told.alarms.iter().filter(|alarm| all || alarm.alarm.suppressed_by.is_none()).collect();
    alarms.sort_by_key(|alarm| (!alarm.state.waits(), alarm.severity, alarm.alarm.id));
    if alarms.is_empty() {
        return output::say("no alarms");
    }
    let now = unix(tokio::time::Instant::now());
    let mut rows = output::Table::new(["number", "state", "of", "what", "for", "times", "what to do first"]);
    for alarm in alarms {
        let AlarmView { alarm: known, text, .. } = alarm;
        let mut what = text.clone();
        if alarm.members > 0 {
            what += &format!(" ({} follow from it)", alarm.members);
        }
        if let Some(who) = &known.acknowledged {
            let note = who.note.as_ref().map(|note| format!(": {note}")).unwrap_or_default();
            what += &format!(" [{}{note}]", who.by);
        }
        if let Some(shelved) = &known.shelved {
            what += &format!(" [shelved by {}: {}]", shelved.by, shelved.why);
        }
        rows.row([
            known.id.to_string(),
            alarm.state.to_string(),
            known.of(),
            what,
            lasts(now.saturating_sub(known.last_unix_ms)),
            known.count.to_string(),
            known.remedy.clone(),
        ]);
    }
    output::say_table(rows)?;
    match told.dropped {
        0 => Ok(()),
        dropped => output::say(format_args!("{dropped} older ones were dropped: there were too many")),
    }
}

fn lasts(milliseconds: u64) -> String {
    match milliseconds / 1_000 {
        seconds @ 0..120 => format!("{seconds} s"),
        seconds @ 120..7_200 => format!("{} min", seconds / 60),
        seconds @ 7_200..172_800 => format!("{} h", seconds / 3_600),
        seconds => format!("{} d", seconds / 86_400),
    }
}
