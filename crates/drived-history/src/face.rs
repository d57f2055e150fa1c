//! The black box as a [`Face`]: it is there also where the file says nothing of it.

use std::{any::Any, pin::Pin, sync::Arc, thread::JoinHandle, time::Duration};

use drived_config::config::Entry as _;
use drived_face::{
    ConfigError, Configured, Face, Failure, Key, Meaning, Open, Opening, Plant, Site, Surroundings, Written,
};
use drived_plant::plant::views::NoticeView;
use serde_json::{Map, Value, json};
use tokio::{
    sync::{Notify, watch},
    task::JoinSet,
};

use crate::{
    asked::Asked,
    clocks::Clocks,
    config::{HistoryConfig, HistoryEntry},
    forward,
    listen::Listening,
    maintenance,
    past::InFile,
    untold::Ledger,
    write::{
        inbox::Inbox,
        writer::{Health, Writer},
    },
};

/// What a program adds that has a black box.
pub const FACE: &dyn Face = &BlackBox;

/// What a file says of the history, of the face with its table.
#[must_use]
pub fn config_of(face: &dyn Configured) -> Option<&HistoryConfig> {
    (face as &dyn Any).downcast_ref()
}

/// How long the disk has for what is written last.
const ENDED_WITHIN: Duration = Duration::from_secs(5);

struct BlackBox;

const ROW: Key = Key::of_table(
    "[history]",
    &["what the [history](history.md) keeps"],
    "values of two days, minutes of 90 days, and hours, events, alarms and commands of ten years, in 2 GiB at the most",
);

impl Face for BlackBox {
    fn table(&self) -> &'static str {
        "history"
    }

    fn row(&self) -> &'static Key {
        &ROW
    }

    fn keys(&self) -> &'static [Key] {
        HistoryEntry::KEYS
    }

    fn configure(&self, written: Written<'_>, site: &Site<'_>) -> Result<Box<dyn Configured>, ConfigError> {
        let source = written.source();
        let entry: HistoryEntry = written.read()?;
        Ok(Box::new(HistoryConfig::read(source, &entry, site)?))
    }

    fn unsaid(&self, site: &Site<'_>) -> Option<Box<dyn Configured>> {
        Some(Box::new(HistoryConfig::unsaid(site)))
    }
}

impl Configured for HistoryConfig {
    /// What it is expected to become goes with the drives: a drive more is no other history.
    fn is_same(&self, other: &dyn Configured) -> bool {
        let other = (other as &dyn Any).downcast_ref::<Self>();
        other.is_some_and(|other| Self { forecast: self.forecast, ..other.clone() } == *self)
    }

    fn meaning(&self) -> Vec<Meaning> {
        let Some(file) = &self.file else {
            return vec![Meaning { head: "no history is kept".to_owned(), rows: Vec::new() }];
        };
        let days = |milliseconds: i64| milliseconds / 86_400_000;
        let rows = vec![
            (
                "kept",
                format!(
                    "values as they were read for {} h, of each minute for {} days, of each hour, events, alarms and commands for {} years",
                    self.limits.polled_ms / 3_600_000,
                    days(self.limits.minutes_ms),
                    days(self.limits.years_ms) / 366,
                ),
            ),
            (
                "size",
                format!(
                    "{} at the most; {} by then if every value moves at every poll",
                    mebibytes(u64::try_from(self.limits.bytes).unwrap_or_default()),
                    mebibytes(self.forecast.bytes),
                ),
            ),
            (
                "written",
                format!("{} a day then, which wears an SD card", mebibytes(self.forecast.bytes_a_day)),
            ),
        ];
        let maintained = (!self.maintained.is_empty()).then(|| {
            ("maintenance", self.maintained.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))
        });
        let sent = self.forward.as_ref().map(|forward| ("sent on", format!("to {}", forward.target)));
        let rows = rows.into_iter().chain(maintained).chain(sent).collect();
        vec![Meaning { head: format!("history: in {}", file.display()), rows }]
    }

    fn object(&self) -> Map<String, Value> {
        let object = json!({
            "file": self.file,
            "largest_bytes": self.limits.bytes,
            "forecast_bytes": self.forecast.bytes,
            "forecast_bytes_a_day": self.forecast.bytes_a_day,
            "sent_on_to": self.forward.as_ref().map(|forward| forward.target.to_string()),
        });
        Map::from_iter([("history".to_owned(), object)])
    }

    fn prepare(&self) -> Result<Opening, Failure> {
        let config = self.clone();
        Ok(Box::new(move |around| Box::new(Recorder::open(config, around))))
    }
}

fn mebibytes(bytes: u64) -> String {
    format!("{} MiB", bytes.div_ceil(1 << 20))
}

/// Tells that nothing can be sent on, and when it can again: it is kept meanwhile, so that this is no alarm.
async fn tell_forwarding(plant: Plant, mut failing: watch::Receiver<Option<String>>) {
    while failing.changed().await.is_ok() {
        let text = match &*failing.borrow_and_update() {
            Some(why) => format!("the history cannot be sent on, and is kept until it can: {why}"),
            None => "the history is sent on again".to_owned(),
        };
        tracing::warn!("{text}");
        plant.tell_notice(NoticeView::new("history_forward", false, text));
    }
}

/// The open black box.
struct Recorder(Option<Recording>);

struct Recording {
    plant: Plant,
    listening: Listening,
    /// What is sent on, and what is counted.
    tasks: JoinSet<()>,
    inbox: Inbox,
    writing: Option<JoinHandle<()>>,
}

impl Recorder {
    fn open(config: HistoryConfig, around: &Surroundings) -> Self {
        let Some(path) = config.file else { return Self(None) };
        let is_anew = around.plant.has_kept_past();
        let (inbox, clocks) = (Inbox::default(), Clocks::begin());
        let done = Arc::new(Notify::new());
        let limits = config.limits;
        let past =
            InFile { path: path.clone(), limits, inbox: inbox.clone(), clocks, done: Arc::clone(&done) };
        around.plant.set_past(Some(Arc::new(Asked(past))));
        let ledger = Ledger::new(path.clone(), inbox.clone(), clocks);
        around.plant.set_untold(Some(Arc::new(ledger)));
        let (health, seen) = watch::channel(Health::Opening);
        let listening = Listening::start(&around.plant, &inbox, clocks, seen);
        let clock = move || clocks.now();
        let mut tasks = JoinSet::new();
        if let Some(forward) = config.forward {
            let (failing, seen) = watch::channel(None);
            tasks.spawn(forward::run(path.clone(), forward, inbox.clone(), failing));
            tasks.spawn(tell_forwarding(around.plant.clone(), seen));
        }
        let counted = maintenance::count(
            path.clone(),
            config.maintained,
            around.plant.clone(),
            inbox.clone(),
            done,
            clocks,
        );
        tasks.spawn(counted);
        let writer = Writer {
            path,
            limits: config.limits,
            inbox: inbox.clone(),
            clock,
            health: health.clone(),
            is_anew,
        };
        let writing = writer.start();
        if let Err(error) = &writing {
            health.send_replace(Health::Failing(error.to_string()));
        }
        let plant = around.plant.clone();
        Self(Some(Recording { plant, listening, tasks, inbox, writing: writing.ok() }))
    }
}

impl Open for Recorder {
    /// It goes on: what becomes of the motors is what somebody will ask for.
    fn close(self: Box<Self>) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        Box::pin(async move {
            let Some(Recording { plant, listening, tasks, inbox, writing }) = self.0 else { return };
            plant.set_past(None);
            plant.set_untold(None);
            drop((listening, tasks));
            match plant.is_closing() {
                true => inbox.end(),
                false => inbox.close(),
            }
            let joined = tokio::task::spawn_blocking(move || writing.map(JoinHandle::join));
            let _ = tokio::time::timeout(ENDED_WITHIN, joined).await;
        })
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{forecast::Forecast, write::Limits};

    fn config(file: &Path) -> HistoryConfig {
        HistoryConfig {
            file: Some(file.to_owned()),
            limits: Limits::default(),
            forecast: Forecast::default(),
            forward: None,
            maintained: Vec::new(),
        }
    }

    #[test]
    fn a_history_is_no_other_one_because_a_drive_has_come() {
        let one = config(Path::new("history.sqlite"));
        let forecast = Forecast { bytes: 7, bytes_a_day: 1 };
        assert!(one.is_same(&HistoryConfig { forecast, ..one.clone() }));
        assert!(!one.is_same(&config(Path::new("other.sqlite"))));
    }
}
