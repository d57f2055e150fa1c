//! Where it is sent to: [`Target`].

use std::{fmt, str::FromStr};

use drived_doors::outward;

const EXPECTED: &str = "expected http://HOST:PORT/PATH, such as http://127.0.0.1:8428/write; https has to be made by a proxy on this machine";

/// The address of a database, as its own documents have it, with the precision of times.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target(pub(super) outward::Target);

impl FromStr for Target {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let target: outward::Target = text.parse().map_err(|_| EXPECTED)?;
        if target.tls {
            return Err(EXPECTED);
        }
        let path = if target.path == "/" { "/write" } else { &*target.path };
        let and = if path.contains('?') { '&' } else { '?' };
        Ok(Self(outward::Target { path: format!("{path}{and}precision=ms"), ..target }))
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(outward::Target { authority, path, .. }) = self;
        let path = path.strip_suffix("precision=ms").unwrap_or(path);
        write!(f, "http://{authority}{}", path.trim_end_matches(['?', '&']))
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
            assert_eq!(target.0.path, path);
        }
        let target: Target = "http://[::1]:8086/write?db=plant".parse().unwrap();
        assert_eq!((&*target.0.host, target.0.port), ("::1", 8_086));
        assert_eq!(target.to_string(), "http://[::1]:8086/write?db=plant");
        for wrong in
            ["", "db:8086", "https://db/write", "http://anna:secret@db/", "http://db:0/", "http:///write"]
        {
            assert_eq!(wrong.parse::<Target>(), Err(EXPECTED), "{wrong}");
        }
    }
}
