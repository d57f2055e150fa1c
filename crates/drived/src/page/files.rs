//! The files of the page, each with the path that it is served under.

/// A file.
pub(super) struct File {
    /// Its path, from the root.
    pub(super) path: &'static str,
    /// What is in it.
    pub(super) content: &'static [u8],
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

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        /// All of them.
        pub(super) const FILES: &[File] = &[
            File { path: "/", content: include_bytes!("web/index.html") },
            $(File { path: concat!("/", $name), content: include_bytes!(concat!("web/", $name)) },)*
        ];
    };
}

files![
    "api.js",
    "ask.js",
    "demo.js",
    "dom.js",
    "drive.js",
    "drive_faults.js",
    "drive_orders.js",
    "drive_tables.js",
    "events.js",
    "fault_texts.js",
    "faults_fr.js",
    "follow.js",
    "format.js",
    "icon.svg",
    "line.js",
    "line_last.js",
    "login.js",
    "main.js",
    "orders.js",
    "overview.js",
    "page.css",
    "plant.js",
    "row.js",
    "sentences_fr.js",
    "setpoint.js",
    "status_bits.js",
    "stop.js",
    "stream.js",
    "texts.js",
    "told.js",
    "trend.js",
    "trouble.js",
    "vendor/uplot.LICENSE",
    "vendor/uplot.css",
    "vendor/uplot.js",
    "words.js",
];
