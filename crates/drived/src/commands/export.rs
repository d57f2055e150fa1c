//! `drived export`: what a metrics store and a board need to know of drived.

use crate::{failure::Failure, metrics, output};

/// Print the alert rules for Prometheus, or the board for Grafana
///
/// A running daemon has them at /alerts.yml and /grafana.json.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Which of them
    what: What,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum What {
    /// Alert rules, in YAML
    Alerts,
    /// The board, in JSON, to be imported
    Dashboard,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    match args.what {
        What::Alerts => output::say_as_it_is(metrics::ALERTS.trim_end()),
        What::Dashboard => output::say_as_it_is(format_args!("{:#}", metrics::dashboard())),
    }
}
