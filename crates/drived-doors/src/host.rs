//! Whether a request was meant for this server: names against rebinding, origins against other sites.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

use axum::http::{HeaderMap, HeaderValue, Method, header, uri::Authority};

/// Names by which this server may be called, without their ports.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Hosts(Vec<String>);

impl Hosts {
    /// The names of this machine to itself, the address that is listened on, and those that the configuration allows.
    pub(super) fn new(bound: Option<SocketAddr>, allowed: &[String]) -> Self {
        let own = [Ipv4Addr::LOCALHOST.into(), Ipv6Addr::LOCALHOST.into()];
        let addresses = own.into_iter().chain(bound.map(|address| address.ip())).map(in_url);
        let names = ["localhost".to_owned()].into_iter().chain(addresses);
        Self(names.chain(allowed.iter().map(|name| name.to_ascii_lowercase())).collect())
    }

    /// Whether a request names one of them as its host.
    pub(super) fn allow(&self, headers: &HeaderMap) -> bool {
        authority(headers).is_some_and(|host| self.0.contains(&host.host().to_ascii_lowercase()))
    }
}

/// As an address stands in a URL.
fn in_url(address: IpAddr) -> String {
    match address {
        IpAddr::V4(address) => address.to_string(),
        IpAddr::V6(address) => format!("[{address}]"),
    }
}

/// The one host that a request names; two are none.
fn authority(headers: &HeaderMap) -> Option<Authority> {
    let mut hosts = headers.get_all(header::HOST).iter();
    match (hosts.next(), hosts.next()) {
        (Some(host), None) => host.to_str().ok()?.parse().ok(),
        _ => None,
    }
}

/// Why a request that might change something is not taken: another site has sent it, or a form could have.
pub(super) fn foreign(method: &Method, headers: &HeaderMap) -> Option<&'static str> {
    if method == Method::GET || method == Method::HEAD {
        return None;
    }
    let site = headers.get("sec-fetch-site").map(HeaderValue::as_bytes);
    if site.is_some_and(|site| site != b"same-origin" && site != b"none") {
        return Some("it comes from the page of another site");
    }
    let own = |origin: &str| {
        let host = authority(headers)?;
        let (scheme, from) = origin.split_once("://")?;
        Some(matches!(scheme, "http" | "https") && from.eq_ignore_ascii_case(host.as_str()))
    };
    let origin = headers.get(header::ORIGIN).map(|origin| origin.to_str().ok().and_then(own));
    (origin.is_some_and(|own| own != Some(true))).then_some("its Origin is not this server")
}

/// Whether a body is said to be JSON, which no form of another site can say without asking first.
pub(super) fn is_json(headers: &HeaderMap) -> bool {
    let said = headers.get(header::CONTENT_TYPE).and_then(|said| said.to_str().ok()).unwrap_or_default();
    said.split(';').next().is_some_and(|kind| kind.trim().eq_ignore_ascii_case("application/json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(all: &[(&'static str, &str)]) -> HeaderMap {
        all.iter().fold(HeaderMap::new(), |mut headers, (name, value)| {
            headers.append(*name, value.parse().unwrap());
            headers
        })
    }

    #[test]
    fn only_the_names_of_this_server_are_its_host() {
        let hosts = Hosts::new(Some("192.168.1.5:7580".parse().unwrap()), &["Drives.example".to_owned()]);
        for host in [
            "localhost",
            "LOCALHOST:7580",
            "127.0.0.1:7580",
            "[::1]:7580",
            "192.168.1.5",
            "drives.example:443",
        ] {
            assert!(hosts.allow(&headers(&[("host", host)])), "{host}");
        }
        for host in [
            "evil.example",
            "localhost.evil.example",
            "127.0.0.1.nip.io",
            "192.168.1.6",
            "",
            "@localhost@evil",
        ] {
            assert!(!hosts.allow(&headers(&[("host", host)])), "{host}");
        }
        assert!(!hosts.allow(&headers(&[])), "no host");
        assert!(!hosts.allow(&headers(&[("host", "localhost"), ("host", "evil.example")])), "two hosts");
    }

    #[test]
    fn what_another_site_sends_is_foreign_and_what_no_browser_sends_is_not() {
        let host = ("host", "localhost:7580");
        for own in [
            &[host][..],
            &[host, ("origin", "http://localhost:7580")],
            &[host, ("origin", "http://localhost:7580"), ("sec-fetch-site", "same-origin")],
            &[host, ("sec-fetch-site", "none")],
        ] {
            assert_eq!(foreign(&Method::POST, &headers(own)), None, "{own:?}");
        }
        for other in [
            &[host, ("origin", "http://evil.example")][..],
            &[host, ("origin", "http://localhost:8080")],
            &[host, ("origin", "null")],
            &[host, ("origin", "http://localhost:7580.evil.example")],
            &[host, ("sec-fetch-site", "cross-site")],
            &[host, ("sec-fetch-site", "same-site")],
        ] {
            assert!(foreign(&Method::POST, &headers(other)).is_some(), "{other:?}");
            assert!(foreign(&Method::DELETE, &headers(other)).is_some(), "{other:?}");
            assert_eq!(foreign(&Method::GET, &headers(other)), None, "{other:?}");
        }
    }

    #[test]
    fn a_body_is_json_when_it_says_so() {
        for (said, is) in [
            ("application/json", true),
            ("Application/JSON; charset=utf-8", true),
            ("text/plain", false),
            ("", false),
        ] {
            assert_eq!(is_json(&headers(&[("content-type", said)])), is, "{said}");
        }
        assert!(!is_json(&headers(&[])));
    }
}
