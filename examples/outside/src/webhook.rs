//! A face of one's own: what alarms the plant becomes a POST of JSON to a receiver over HTTP.
//!
//! The queue is the fleet's own: 4 096 events wait for a receiver that is down, and how many were lost beyond that is posted too. An
//! alarm is posted until it is taken, so one whose answer was lost comes twice: its `order` tells it.

use std::{future::Future, io, pin::Pin, time::Duration};

use drive_fleet::{Events, Received};
use drived_face::{ConfigError, Configured, Face, Failure, Key, Meaning, Open, Opening, Site, Written, same};
use serde_json::{Map, Value, json};
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::TcpStream,
    task::JoinHandle,
    time::{sleep, timeout},
};

/// How long a receiver may take, and how long one is left alone that did not.
const PATIENCE: Duration = Duration::from_secs(5);
const PAUSE: Duration = Duration::from_secs(1);

pub(crate) struct Webhook;

impl Face for Webhook {
    fn table(&self) -> &'static str {
        "webhook"
    }

    fn row(&self) -> &'static Key {
        const ROW: Key = Key::of_table("[webhook]", &["who is told of alarms"], "nobody");
        &ROW
    }

    fn configure(&self, written: Written<'_>, _: &Site<'_>) -> Result<Box<dyn Configured>, ConfigError> {
        Ok(Box::new(written.read::<Receiver>()?))
    }
}

/// `[webhook]` of the configuration.
#[derive(Debug, Clone, PartialEq, Eq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Receiver {
    /// `HOST:PORT/PATH`
    receiver: String,
}

impl Configured for Receiver {
    fn is_same(&self, other: &dyn Configured) -> bool {
        same(self, other)
    }

    fn meaning(&self) -> Vec<Meaning> {
        vec![Meaning { head: format!("webhook: alarms go to http://{}", self.receiver), rows: Vec::new() }]
    }

    fn object(&self) -> Map<String, Value> {
        Map::from_iter([("webhook".to_owned(), json!(self.receiver))])
    }

    fn prepare(&self) -> Result<Opening, Failure> {
        let receiver = self.receiver.clone();
        Ok(Box::new(|around| {
            let events = around.plant.fleet().events();
            Box::new(Posting(tokio::spawn(post_alarms(events, receiver))))
        }))
    }
}

struct Posting(JoinHandle<()>);

impl Open for Posting {
    /// The fleet's last words are posted, if somebody takes them.
    fn close(mut self: Box<Self>) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        Box::pin(async move {
            if timeout(PATIENCE, &mut self.0).await.is_err() {
                self.0.abort();
            }
        })
    }
}

/// Until the fleet ends. An event is taken from the fleet when the one before has arrived.
async fn post_alarms(mut events: Events, receiver: String) {
    loop {
        let told = match events.recv().await {
            Received::Event(event) if event.kind.is_alarm() => json!(event),
            Received::Event(_) => continue,
            Received::Missed(events) => json!({ "missed": events }),
            Received::End => return,
        };
        while let Err(error) = post(&receiver, &told.to_string()).await {
            tracing::warn!("webhook: {receiver}: {error}: alarms wait for it");
            sleep(PAUSE).await;
        }
    }
}

/// One POST; done is what was answered by a 2xx.
async fn post(receiver: &str, body: &str) -> io::Result<()> {
    let (host, path) = receiver.split_once('/').unwrap_or((receiver, ""));
    let request = format!(
        "POST /{path} HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\
         Connection: close\r\n\r\n{body}",
        body.len()
    );
    let exchange = async {
        let mut stream = TcpStream::connect(host).await?;
        stream.write_all(request.as_bytes()).await?;
        let mut begin = [0; "HTTP/1.1 2".len()];
        stream.read_exact(&mut begin).await?;
        let taken = begin.starts_with(b"HTTP/1.") && begin.ends_with(b" 2");
        if taken { Ok(()) } else { Err(io::Error::other("it did not take it")) }
    };
    timeout(PATIENCE, exchange).await?
}
