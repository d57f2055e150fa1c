//! What one of many hosts needs: where it is scraped, and a configuration to begin with.

use std::net::SocketAddr;

use drived_doors::config::DoorsConfig;
use drived_words::failure::Failure;
use serde_json::{Value, json};

/// A host's entry for Prometheus' `file_sd_configs`, by its own schema: a list of groups of targets with their labels.
///
/// # Errors
/// Nothing can be scraped, or nobody knows by which name.
pub(super) fn file_sd(doors: &DoorsConfig, host: Option<&str>, site: Option<&str>) -> Result<Value, Failure> {
    let off = || Failure::Input("nothing is scraped there: its HTTP server is off".to_owned());
    let http = doors.http.as_ref().ok_or_else(off)?;
    let (ip, port) = (http.listen.ip(), http.listen.port());
    let host = host.map(name).transpose()?;
    let target = match host {
        Some(host) => format!("{host}:{port}"),
        None if ip.is_unspecified() => {
            let problem =
                format!("it listens at {ip}, which is no address to be scraped at: expected --host NAME");
            return Err(Failure::Input(problem));
        }
        None => SocketAddr::new(ip, port).to_string(),
    };
    let mut labels = json!({ "__scheme__": if http.tls.is_some() { "https" } else { "http" } });
    if let Some(host) = host {
        labels["host"] = json!(host);
    }
    if let Some(site) = site {
        labels["site"] = json!(name(site)?);
    }
    Ok(json!([{ "targets": [target], "labels": labels }]))
}

/// A configuration for a host of this name, at this site.
///
/// # Errors
/// One of them is no name.
pub(super) fn template(host: &str, site: Option<&str>) -> Result<String, Failure> {
    let site = name(site.unwrap_or("plant"))?;
    Ok(include_str!("host.toml").replace("SITE", site).replace("HOST", name(host)?))
}

/// A name as it stands in a URL and as a level of a topic.
fn name(host: &str) -> Result<&str, Failure> {
    let allowed = |character: char| character.is_ascii_alphanumeric() || "-._".contains(character);
    match !host.is_empty() && host.chars().all(allowed) {
        true => Ok(host),
        false => Err(Failure::Input(format!(
            "{host:?}: expected the name of a host or a site: letters, digits, -, . and _"
        ))),
    }
}
