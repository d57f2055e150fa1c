//! The log of a line. In a program of its own, because whether a place logs is remembered for the whole process.

mod support;

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use drive_bus::Slave;
use support::{MS, line};
use tokio_modbus::client::Reader as _;

async fn is_answered(slave: Slave) -> bool {
    tokio_modbus::client::Context::from(slave).read_holding_registers(3201, 1).await.is_ok()
}

/// Counts what would be logged at level INFO and above.
struct Log(Arc<AtomicUsize>);

impl tracing::Subscriber for Log {
    fn enabled(&self, metadata: &tracing::Metadata<'_>) -> bool {
        // What a program makes known of its lines is its own affair: the library says it at debug.
        *metadata.level() <= tracing::Level::DEBUG && metadata.target().starts_with("drive_bus")
    }

    fn new_span(&self, _: &tracing::span::Attributes<'_>) -> tracing::Id {
        tracing::Id::from_u64(1)
    }

    fn record(&self, _: &tracing::Id, _: &tracing::span::Record<'_>) {}

    fn record_follows_from(&self, _: &tracing::Id, _: &tracing::Id) {}

    fn event(&self, _: &tracing::Event<'_>) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    fn enter(&self, _: &tracing::Id) {}

    fn exit(&self, _: &tracing::Id) {}
}

#[tokio::test(start_paused = true)]
async fn a_dead_slave_is_logged_once_and_counted_ever_after() {
    let logged = Arc::new(AtomicUsize::new(0));
    let _guard = tracing::subscriber::set_default(Log(Arc::clone(&logged)));
    let (line, mut peer) = line(|config| config);
    assert_eq!(logged.swap(0, Ordering::Relaxed), 1, "the line is up");
    let listening = tokio::spawn(async move {
        loop {
            peer.request().await;
        }
    });
    for _ in 0..600 {
        assert!(!is_answered(line.slave(1)).await);
        tokio::time::sleep(100 * MS).await;
    }
    assert_eq!(logged.load(Ordering::Relaxed), 1, "the slave is off-line");
    let stats = &line.stats().slaves[&1];
    assert!(stats.probes > 3 && stats.outcomes.refused > 400, "{stats:?}");
    listening.abort();
}
