//! `drived export`: what a metrics store, a board and a SCADA need to know of drived.

use std::path::PathBuf;

use crate::{config::Config, failure::Failure, gateway::virtual_unit, metrics, output};

/// Print the alert rules for Prometheus, the board for Grafana, or the map of a gateway's virtual unit
///
/// A running daemon has the first two at /alerts.yml and /grafana.json.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Which of them
    what: What,
    /// The configuration whose drives stand in the map
    #[arg(long, value_name = "FILE", default_value = "drives.toml")]
    config: PathBuf,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum What {
    /// Alert rules, in YAML
    Alerts,
    /// The board, in JSON, to be imported
    Dashboard,
    /// The registers of the virtual unit, in CSV
    GatewayMap,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    match args.what {
        What::Alerts => output::say_as_it_is(metrics::ALERTS.trim_end()),
        What::GatewayMap => {
            let config = Config::load_workable(&args.config)?;
            let drives = config.lines.iter().flat_map(|line| &line.drives);
            let names: Vec<&str> = drives.map(|drive| drive.settings.name.as_str()).collect();
            output::say_as_it_is(virtual_unit::map(&names))
        }
        What::Dashboard => output::say_as_it_is(format_args!("{:#}", metrics::dashboard())),
    }
}
