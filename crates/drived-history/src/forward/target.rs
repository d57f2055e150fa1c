//! Where it is sent to: [`Target`].

use std::{fmt, str::FromStr};

use hyper::Uri;

const EXPECTED: &str = "expected http://HOST:PORT/PATH, such as http://127.0.0.1:8428/write; https has to be made by a proxy on this machine";

/// The address of a database, as its own documents have it, without the precision of times.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target {
    pub(super) host: String,
    pub(super) port: u16,
    /// As the header `Host` has it.
    pub(super) authority: String,
    /// With the precision of times.
    pub(super) path: String,
}

impl FromStr for Target {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let uri: Uri = text.parse().map_err(|_| EXPECTED)?;
        let authority =
            uri.authority().filter(|authority| !authority.as_str().contains('@')).ok_or(EXPECTED)?;
        if uri.scheme_str() != Some("http") {
            return Err(EXPECTED);
        }
        // A port that is none is none of ours to guess.
        let rest = authority.as_str().strip_prefix(authority.host()).ok_or(EXPECTED)?;
        let port = match rest.strip_prefix(':') {
            Some(port) => port.parse().ok().filter(|port| *port != 0).ok_or(EXPECTED)?,
            None => 80,
        };
        let host = authority.host().trim_start_matches('[').trim_end_matches(']').to_owned();
        let path = uri.path_and_query().map_or("/write", |path| path.as_str());
        let path = if path == "/" { "/write" } else { path };
        let and = if path.contains('?') { '&' } else { '?' };
        Ok(Self { host, port, authority: authority.to_string(), path: format!("{path}{and}precision=ms") })
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = self.path.strip_suffix("precision=ms").unwrap_or(&self.path);
        write!(f, "http://{}{}", self.authority, path.trim_end_matches(['?', '&']))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_as_the_databases_document_it_and_times_are_in_milliseconds() {
        for (text, path) in [
            ("http://127.0.0.1:8428", "/write?precision=ms"),
            ("http://127.0.0.1:8428/write", "/write?precision=ms"),
            ("http://db:8086/api/v2/write?org=o&bucket=b", "/api/v2/write?org=o&bucket=b&precision=ms"),
        ] {
            let target: Target = text.parse().unwrap();
            assert_eq!(target.path, path);
        }
        let target: Target = "http://[::1]:8086/write?db=plant".parse().unwrap();
        assert_eq!((&*target.host, target.port), ("::1", 8_086));
        assert_eq!(target.to_string(), "http://[::1]:8086/write?db=plant");
        for wrong in
            ["", "db:8086", "https://db/write", "http://anna:secret@db/", "http://db:0/", "http:///write"]
        {
            assert_eq!(wrong.parse::<Target>(), Err(EXPECTED), "{wrong}");
        }
    }
}
