//! `drived export`: what a metrics store, a board, a SCADA and a manual's reader need to know of drived.

mod hosts;
mod man;

use std::path::PathBuf;

#[cfg(test)]
pub(crate) use self::man::ENVIRONMENT;
#[cfg(feature = "gateway")]
use super::names::numbered;
use drived_file::Config;
#[cfg(feature = "gateway")]
use drived_gateway::virtual_unit;
use drived_http::metrics;
use drived_words::{failure::Failure, output};

/// Print the alert rules for Prometheus, the board for Grafana, the map of a gateway's virtual unit, the schema of a profile, or what one
/// of many hosts needs; write the man pages
///
/// A running daemon has the first two at /alerts.yml and /grafana.json.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Which of them
    what: What,
    /// The configuration whose drives stand in the map, and whose HTTP server is scraped
    #[arg(long, value_name = "FILE", default_value = "drives.toml")]
    config: PathBuf,
    /// The name of the host, by which others reach it
    #[arg(long, value_name = "NAME", required_if_eq("what", "host"))]
    host: Option<String>,
    /// The site of the host, as it stands in topics and labels; plant unless it is said
    #[arg(long, value_name = "NAME")]
    site: Option<String>,
    /// The folder of the man pages
    #[arg(long, value_name = "FOLDER", required_if_eq("what", "man"))]
    to: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum What {
    /// Alert rules, in YAML
    Alerts,
    /// The board, in JSON, to be imported
    Dashboard,
    /// The registers of the virtual unit, in CSV
    #[cfg(feature = "gateway")]
    GatewayMap,
    /// The schema of a profile, in JSON, for editors
    ProfileSchema,
    /// A file for the file_sd of Prometheus, in JSON, with this host in it
    FileSd,
    /// A configuration for one of many hosts, to be filled in
    Host,
    /// A man page for each subcommand
    Man,
}

pub(crate) fn run(args: &Args, program: clap::Command) -> Result<(), Failure> {
    match (args.what, &args.to) {
        (What::Man, Some(folder)) => man::write(program, folder),
        (What::Man, None) => Err(Failure::Input("expected --to FOLDER for the man pages".to_owned())),
        (_, Some(_)) => Err(Failure::Input("--to is for the man pages: this is printed".to_owned())),
        (What::Alerts, None) => output::say_as_it_is(metrics::ALERTS.trim_end()),
        #[cfg(feature = "gateway")]
        (What::GatewayMap, None) => {
            let config = Config::load_workable(&args.config)?;
            output::say_as_it_is(virtual_unit::map(&numbered(&config)?.slots()))
        }
        (What::ProfileSchema, None) => {
            output::say_as_it_is(format_args!("{:#}", drive_profile::schema().as_value()))
        }
        (What::FileSd, None) => {
            let config = Config::load_workable(&args.config)?;
            output::say_as_it_is(format_args!(
                "{:#}",
                hosts::file_sd(&config.doors, args.host.as_deref(), args.site.as_deref())?
            ))
        }
        (What::Host, None) => {
            let host = args.host.as_deref().unwrap_or_default();
            output::say_as_it_is(hosts::template(host, args.site.as_deref())?.trim_end())
        }
        (What::Dashboard, None) => output::say_as_it_is(format_args!("{:#}", metrics::dashboard())),
    }
}
