//! `[[webhooks]]` as a [`Face`].

use std::{
    path::PathBuf,
    pin::Pin,
    sync::{Arc, Mutex},
    time::Duration,
};

use drived_config::{config::Entry as _, names::topic_id};
use drived_doors::{believed, secret};
use drived_face::{
    ConfigError, Configured, Face, Failure, Key, Meaning, Open, Opening, Samples, Site, Surroundings,
    Written, same,
};
use hyper::header::HeaderValue;
use serde_json::{Map, Value, json};
use tokio::{
    sync::{Notify, watch},
    task::JoinHandle,
    time::timeout,
};
use tokio_rustls::rustls::{ClientConfig, crypto};
use toml::Spanned;

use crate::{
    config::{WebhookConfig, WebhookEntry, webhooks},
    counters::Counters,
    memory::Memory,
    message::Body,
    outbox::Outbox,
    post::Way,
    sending::{Receiver, hear},
    signature::Secret,
};

/// What a program adds that tells webhooks.
pub const FACE: &dyn Face = &OfAlarms;

/// How long the last words may take.
const LAST_WORDS: Duration = Duration::from_secs(5);

struct OfAlarms;

const ROW: Key = Key::of_table(
    "[[webhooks]]",
    &["[who is told of alarms](alarms-and-webhooks.md#webhooks) by a POST"],
    "none",
);

impl Face for OfAlarms {
    fn table(&self) -> &'static str {
        "webhooks"
    }

    fn row(&self) -> &'static Key {
        &ROW
    }

    fn keys(&self) -> &'static [Key] {
        WebhookEntry::KEYS
    }

    fn configure(&self, written: Written<'_>, site: &Site<'_>) -> Result<Box<dyn Configured>, ConfigError> {
        let source = written.source();
        let entries: Vec<Spanned<WebhookEntry>> = written.read()?;
        let folder = site.state.folder.clone();
        Ok(Box::new(All { webhooks: webhooks(source, &entries)?, folder }))
    }
}

/// The receivers of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
struct All {
    webhooks: Vec<WebhookConfig>,
    /// Where it is kept what they have been told.
    folder: Option<PathBuf>,
}

impl Configured for All {
    fn is_same(&self, other: &dyn Configured) -> bool {
        same(self, other)
    }

    fn meaning(&self) -> Vec<Meaning> {
        let meaning = |webhook: &WebhookConfig| Meaning {
            head: format!("webhook {}: alarms go to {}", webhook.name, webhook.target),
            rows: vec![("told", told(webhook)), ("signed", signed(webhook).to_owned())],
        };
        self.webhooks.iter().map(meaning).collect()
    }

    fn object(&self) -> Map<String, Value> {
        let object = |webhook: &WebhookConfig| {
            let target = webhook.target.to_string();
            json!({ "name": webhook.name, "to": target, "told": told(webhook), "signed": webhook.secret.is_some() })
        };
        Map::from_iter([("webhooks".to_owned(), self.webhooks.iter().map(object).collect())])
    }

    fn check(&self) -> Result<(), Failure> {
        self.webhooks.iter().try_for_each(|webhook| way(webhook).map(drop))
    }

    fn prepare(&self) -> Result<Opening, Failure> {
        let ways = self.webhooks.iter().map(|webhook| Ok((webhook.clone(), way(webhook)?)));
        let ways: Vec<_> = ways.collect::<Result<_, Failure>>()?;
        let folder = self.folder.clone();
        Ok(Box::new(move |around| {
            // Read once the face before this one is closed.
            let memory = Memory::in_folder(folder.as_deref());
            Box::new(Webhooks::open(ways, memory, around))
        }))
    }
}

/// What a receiver is told, in words.
fn told(WebhookConfig { wanted, form, pause, .. }: &WebhookConfig) -> String {
    let which = if wanted.only_coming { "what comes or comes again" } else { "each step of their life" };
    let how = match &form.body {
        Body::Alarm => "as JSON".to_owned(),
        Body::Text => "as a text".to_owned(),
        Body::Field(field) => format!("as a text in {field:?}"),
    };
    let severity = wanted.severity;
    format!("from severity {severity} on, {which}, {how}, one in {pause:?} at most")
}

const fn signed(webhook: &WebhookConfig) -> &'static str {
    match webhook.secret.is_some() {
        true => "yes, by Standard Webhooks",
        false => "no: whoever reaches the receiver can tell it of alarms",
    }
}

/// How a receiver is reached.
fn way(webhook: &WebhookConfig) -> Result<Way, Failure> {
    let of = |error: String| Failure::Input(format!("webhook {}: {error}", webhook.name));
    let in_file = |file: &PathBuf, error: &str| of(format!("{}: {error}", file.display()));
    let tls = webhook.target.tls.then(|| {
        let config = ClientConfig::builder_with_provider(Arc::new(crypto::ring::default_provider()))
            .with_safe_default_protocol_versions()
            .map_err(|error| error.to_string())?;
        let roots = believed(webhook.authorities.as_deref())?;
        Ok(Arc::new(config.with_root_certificates(roots).with_no_client_auth()))
    });
    let authorization = webhook.authorization.as_ref().map(|file| {
        let mut value = HeaderValue::from_str(&secret(file).map_err(of)?)
            .map_err(|_| in_file(file, "expected one line, such as Bearer and a token"))?;
        value.set_sensitive(true);
        Ok(value)
    });
    let key = webhook
        .secret
        .as_ref()
        .map(|file| Secret::read(&secret(file).map_err(of)?).map_err(|error| in_file(file, error)));
    Ok(Way {
        target: webhook.target.clone(),
        tls: tls.transpose().map_err(of)?,
        authorization: authorization.transpose()?,
        secret: key.transpose()?,
        content_type: webhook.form.content_type(),
        within: webhook.within,
    })
}

/// The receivers while the face is open.
struct Webhooks {
    receivers: Vec<Arc<Receiver>>,
    hearing: JoinHandle<()>,
    keeping: JoinHandle<()>,
    posting: Vec<JoinHandle<()>>,
    ended: watch::Sender<bool>,
    memory: Memory,
}

impl Webhooks {
    fn open(ways: Vec<(WebhookConfig, Way)>, memory: Memory, around: &Surroundings) -> Self {
        memory.keep_only(&ways.iter().map(|(webhook, _)| webhook.name.as_str()).collect::<Vec<_>>());
        let receiver = |(webhook, way): (WebhookConfig, Way)| {
            let told = memory.of(&webhook.name);
            Arc::new(Receiver {
                // It stands in a header.
                outbox: Mutex::new(Outbox::new(topic_id(&webhook.form.host), webhook.wanted, told)),
                name: webhook.name,
                form: webhook.form,
                way,
                pause: webhook.pause,
                counters: Counters::default(),
                offered: Notify::new(),
                memory: memory.clone(),
            })
        };
        let receivers: Vec<_> = ways.into_iter().map(receiver).collect();
        let ended = watch::Sender::new(false);
        let posting =
            receivers.iter().map(|receiver| tokio::spawn(Arc::clone(receiver).post_all(ended.subscribe())));
        Self {
            posting: posting.collect(),
            hearing: tokio::spawn(hear(around.plant.clone(), receivers.clone())),
            keeping: tokio::spawn(memory.clone().keep()),
            receivers,
            ended,
            memory,
        }
    }
}

impl Open for Webhooks {
    fn collect(&self, samples: &mut Samples) {
        for receiver in &self.receivers {
            receiver.counters.collect(&receiver.name, samples);
        }
    }

    fn tell(&self) {
        for receiver in &self.receivers {
            tracing::info!("webhook {}: {}", receiver.name, receiver.counters.in_words());
        }
    }

    /// What becomes of the motors is told until [`Self::close`].
    fn close(self: Box<Self>) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        Box::pin(async move {
            self.hearing.abort();
            // One that has failed hears nothing more either.
            let _ = self.hearing.await;
            self.ended.send_replace(true);
            let mut posting = self.posting;
            let all = async {
                for task in &mut posting {
                    let _ = task.await;
                }
            };
            let _ = timeout(LAST_WORDS, all).await;
            posting.iter().for_each(JoinHandle::abort);
            self.keeping.abort();
            let _ = self.keeping.await;
            if let Err(error) = self.memory.write().await {
                tracing::warn!("what the webhooks have told is not kept: {error}");
            }
        })
    }
}
