//! `[[webhooks]]`: who is told of alarms.

use std::{
    ops::Range,
    path::{Path, PathBuf},
    time::Duration,
};

use drive_fleet::Severity;
use drived_config::{
    config::{ConfigError, Entry as _, Parsed, Source, of, settings, within, words},
    host::host_name,
};
use drived_doors::outward::Target;
use drived_words::duration::Time;
use toml::Spanned;

use crate::{
    message::{Body, Form},
    outbox::Wanted,
    sending::LONGEST_SETTLE,
    template::{Template, USUAL},
};

/// How many receivers there may be.
const MOST: usize = 16;
const SECOND: Duration = Duration::from_secs(1);

/// A receiver.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WebhookConfig {
    pub(crate) name: String,
    pub(crate) target: Target,
    /// The certificates of those who vouch for it; `None`: those of the system.
    pub(crate) authorities: Option<PathBuf>,
    /// The file of the header by which it lets us in.
    pub(crate) authorization: Option<PathBuf>,
    /// The file of the secret by which messages are signed.
    pub(crate) secret: Option<PathBuf>,
    pub(crate) wanted: Wanted,
    pub(crate) form: Form,
    /// How long it may take for one message.
    pub(crate) within: Duration,
    /// Between two messages.
    pub(crate) pause: Duration,
}

words! {
    /// What it is told of.
    SeverityValue(Severity):
    "warning" => Severity::Warning,
    "alarm" => Severity::Alarm
}

words! {
    /// Of which steps in the life of an alarm.
    Tell(bool):
    "all" => false,
    "coming" => true
}

words! {
    /// What is posted.
    BodyValue(&'static str):
    "alarm" => "alarm",
    "text" => "text"
}

settings! {
    /// `[[webhooks]]`.
    WebhookEntry sets WebhookConfig;

    /// by which it is known in the log and to `/metrics`
    name: String = "`\"webhook\"`";
    /// where to: `"https://HOST/PATH"`. The path is shown nowhere: that of many a chat is its password
    url: Parsed<Target> = "it has to be said";
    /// `true`: `http://` to others than this machine, where something else encrypts
    plain: bool = "`false`";
    /// a file with the certificates, in PEM, of those who vouch for the receiver
    authorities: PathBuf = "those of the system";
    /// a file with the value of the header `Authorization`, such as `Bearer` and a token
    authorization: PathBuf = "none";
    /// a file with the secret by which each message is signed: `whsec_` and 24 to 64 bytes in base64
    secret: PathBuf = "messages are not signed";
    /// `"alarm"`: only what somebody should go to now; `"warning"`: also what somebody should see to
    severity: Parsed<SeverityValue> = "`\"warning\"`", |to, said| to.wanted.severity = said.0.0;
    /// `"all"`: each step of an alarm's life; `"coming"`: only that it comes, or comes again
    tell: Parsed<Tell> = "`\"all\"`", |to, said| to.wanted.only_coming = said.0.0;
    /// so long an alarm waits at its coming, up to 60 s, until its cause is known or it follows from another; one about a motor that
    /// moves or may does not wait
    settle: Parsed<Time> = "`\"2s\"`",
        |to, said| to.wanted.settle = within(said.0.0, Duration::ZERO..=LONGEST_SETTLE, "")?;
    /// `"alarm"`: all that is known, as JSON; `"text"`: the text alone, in clear
    body: Parsed<BodyValue> = "`\"alarm\"`",
        |to, said| to.form.body = if said.0.0 == "text" { Body::Text } else { Body::Alarm };
    /// instead: a JSON object with the text in this field and nothing else, such as `"text"` or `"content"`
    field: String = "none", |to, said| to.form.body = Body::Field(said.clone());
    /// the text, with `{host}`, `{of}`, `{drive}`, `{line}`, `{alarm}`, `{text}`, `{severity}`, `{state}`, `{what_to_do}`, `{since}`,
    /// `{last}`, `{count}`, `{members}`, `{who}` and `{note}` in it
    text: Parsed<Template> = "`\"{of}: {text} ({state}). {what_to_do}\"`", |to, said| to.form.text = said.0.clone();
    /// what `{host}` is, and how each message's id begins
    host: String = "the name of this machine", |to, said| to.form.host = said.clone();
    /// how long the receiver may take for one message, 1 s to 60 s
    timeout: Parsed<Time> = "`\"10s\"`", |to, said| to.within = within(said.0.0, SECOND..=60 * SECOND, "")?;
    /// between two messages, up to an hour: meanwhile of each alarm what is new takes the place of what waits
    pause: Parsed<Time> = "`\"1s\"`", |to, said| to.pause = within(said.0.0, Duration::ZERO..=3_600 * SECOND, "")?;
}

/// The receivers of a file.
pub(crate) fn webhooks(
    source: Source<'_>,
    entries: &[Spanned<WebhookEntry>],
) -> Result<Vec<WebhookConfig>, ConfigError> {
    let mut all: Vec<WebhookConfig> = Vec::new();
    for entry in entries {
        let (said, whole) = (entry.get_ref(), entry.span());
        let webhook = said.checked(source, whole.clone())?;
        if all.len() == MOST {
            return Err(source.error(whole, format_args!("expected at most {MOST} of them")));
        }
        if all.iter().any(|other| other.name == webhook.name) {
            let place = said.name.as_ref().map_or(whole, Spanned::span);
            return Err(source.error(place, format_args!("two webhooks are named {:?}", webhook.name)));
        }
        all.push(webhook);
    }
    Ok(all)
}

impl WebhookEntry {
    fn checked(&self, source: Source<'_>, whole: Range<usize>) -> Result<WebhookConfig, ConfigError> {
        let name = of(&self.name).map_or("webhook", String::as_str);
        for said in [&self.name, &self.host, &self.field].into_iter().flatten() {
            if said.get_ref().trim().is_empty() || said.get_ref().chars().any(char::is_control) {
                return Err(source.error(said.span(), "expected a name without control characters"));
            }
        }
        let Some(url) = &self.url else {
            return Err(source.error(whole, "expected url = \"https://HOST/PATH\""));
        };
        let target = url.get_ref().0.clone();
        if !target.tls && !target.is_here() && !of(&self.plain).is_some_and(|plain| *plain) {
            let problem = "alarms and tokens would cross the network in clear: expected https://, or plain = true where \
                           something else encrypts";
            return Err(source.error(url.span(), problem));
        }
        if let (Some(_), Some(field)) = (&self.body, &self.field) {
            return Err(source.error(field.span(), "expected body or field, not both"));
        }
        let folder = source.file.parent().unwrap_or(Path::new(""));
        let beside = |said: &Option<Spanned<PathBuf>>| of(said).map(|path| folder.join(path));
        let text = USUAL.parse().map_err(|problem: String| source.error(whole, problem))?;
        let mut webhook = WebhookConfig {
            name: name.to_owned(),
            target,
            authorities: beside(&self.authorities),
            authorization: beside(&self.authorization),
            secret: beside(&self.secret),
            wanted: Wanted { severity: Severity::Warning, only_coming: false, settle: 2 * SECOND },
            form: Form { host: host_name().unwrap_or_default(), text, body: Body::Alarm },
            within: 10 * SECOND,
            pause: SECOND,
        };
        self.set(source, &mut webhook)?;
        Ok(webhook)
    }
}
