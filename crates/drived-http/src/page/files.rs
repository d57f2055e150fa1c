//! The files of the page, each with the path that it is served under.

use super::bundle;

/// A file.
pub(super) struct File {
    /// Its path, from the root.
    pub(super) path: &'static str,
    /// What is in it.
    pub(super) content: Vec<u8>,
}

impl File {
    /// The content type, by the end of the name; what has none of these is text.
    pub(super) fn kind(&self) -> &'static str {
        match self.path.rsplit('.').next() {
            Some("js") => "text/javascript; charset=utf-8",
            Some("css") => "text/css; charset=utf-8",
            Some("svg") => "image/svg+xml",
            _ if self.path == "/" => "text/html; charset=utf-8",
            _ => "text/plain; charset=utf-8",
        }
    }
}

/// All of them.
pub(super) fn files() -> Vec<File> {
    let served = SERVED.iter().map(|(path, content)| File { path, content: content.to_vec() });
    let made =
        [("/", index()), ("/app.js", bundle::of(MODULES, "main.js")), ("/more.js", bundle::more(LATER))];
    served.chain(made.map(|(path, text)| File { path, content: text.into_bytes() })).collect()
}

/// The document, with what stops the motors in its first bytes.
fn index() -> String {
    INDEX.replace("{stop.css}", STOP_STYLE).replace("{stop.js}", STOP_SCRIPT)
}

const INDEX: &str = include_str!("web/index.html");
/// The path of a stop, which stands in the document itself.
pub(super) const STOP_SCRIPT: &str = include_str!("web/stop.js");
pub(super) const STOP_STYLE: &str = include_str!("web/stop.css");

macro_rules! files {
    ($name:ident: $type:ty = $read:ident($prefix:literal), $($file:literal),* $(,)?) => {
        pub(super) const $name: &[(&str, $type)] = &[$((concat!($prefix, $file), $read!(concat!("web/", $file))),)*];
    };
}

files![
    SERVED: &[u8] = include_bytes("/"),
    "faults_fr.js",
    "findings_fr.js",
    "icon.svg",
    "icon_alarm.svg",
    "page.css",
    "sentences_fr.js",
    "vendor/uplot.LICENSE",
    "vendor/uplot.css",
    "vendor/uplot.js",
];

files![
    MODULES: &str = include_str(""),
    "alarm_words.js",
    "api.js",
    "ask.js",
    "attention.js",
    "curves.js",
    "decimal.js",
    "demo.js",
    "dom.js",
    "fold.js",
    "follow.js",
    "format.js",
    "given.js",
    "login.js",
    "main.js",
    "orders.js",
    "overview.js",
    "place.js",
    "plant.js",
    "row.js",
    "search.js",
    "selection.js",
    "several.js",
    "shown.js",
    "sort.js",
    "stream.js",
    "texts.js",
    "tile.js",
    "told.js",
    "trouble.js",
    "vocabulary.js",
    "words.js",
];

files![
    LATER: &str = include_str(""),
    "alarms.js",
    "at.js",
    "drive.js",
    "drive_faults.js",
    "drive_orders.js",
    "drive_tables.js",
    "enter.js",
    "event_rows.js",
    "events.js",
    "line.js",
    "line_last.js",
    "past.js",
    "past_links.js",
    "past_texts.js",
    "past_time.js",
    "past_values.js",
    "plot.js",
    "setpoint.js",
    "setup.js",
    "setup_added.js",
    "setup_found.js",
    "setup_port.js",
    "setup_scan.js",
    "setup_texts.js",
    "status_bits.js",
    "trend.js",
    "why.js",
];
