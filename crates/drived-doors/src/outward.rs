//! The way out: where something is posted to, and one request over a connection of its own, whatever the other side does.

use std::{fmt, net::IpAddr, pin::pin, str::FromStr, time::Duration};

use hyper::{Request, StatusCode, Uri, body::Body, client::conn::http1, header::RETRY_AFTER};
use hyper_util::rt::TokioIo;
use tokio::io::{AsyncRead, AsyncWrite};

/// The longest head of an answer; its body is not read.
const LONGEST_HEAD: usize = 16 << 10;
/// What this program calls itself.
pub const AGENT: &str = concat!("drived/", env!("CARGO_PKG_VERSION"));

const EXPECTED: &str = "expected https://HOST/PATH, or http:// in clear, without a user's name";

/// A URL of a receiver. Shown without its path: that of many a chat is its password.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target {
    pub host: String,
    pub port: u16,
    pub tls: bool,
    /// As the header `Host` has it.
    pub authority: String,
    pub path: String,
}

impl Target {
    /// Whether what is said in clear stays on this machine.
    pub fn is_here(&self) -> bool {
        self.host == "localhost" || self.host.parse().is_ok_and(|address: IpAddr| address.is_loopback())
    }
}

impl FromStr for Target {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let uri: Uri = text.parse().map_err(|_| EXPECTED)?;
        let (tls, usual) = match uri.scheme_str() {
            Some("https") => (true, 443),
            Some("http") => (false, 80),
            _ => return Err(EXPECTED),
        };
        let authority =
            uri.authority().filter(|authority| !authority.as_str().contains('@')).ok_or(EXPECTED)?;
        // A port that is none is none of ours to guess.
        let rest = authority.as_str().strip_prefix(authority.host()).ok_or(EXPECTED)?;
        let port = match rest.strip_prefix(':') {
            Some(port) => port.parse().ok().filter(|port| *port != 0).ok_or(EXPECTED)?,
            None => usual,
        };
        let host = authority.host().trim_start_matches('[').trim_end_matches(']').to_owned();
        if host.is_empty() {
            return Err(EXPECTED);
        }
        let path = uri.path_and_query().map_or("/", |path| path.as_str()).to_owned();
        Ok(Self { host, port, tls, authority: authority.to_string(), path })
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}://{}", if self.tls { "https" } else { "http" }, self.authority)
    }
}

/// What the head of an answer says.
#[derive(Debug, Clone, Copy)]
pub struct Answer {
    pub status: StatusCode,
    /// After how long it may be tried again, where it says so.
    pub after: Option<Duration>,
}

/// Sends a request over a connection of its own. It waits for as long as the other side does: whoever asks sets its time.
///
/// # Errors
/// It was not sent, or nobody knows.
pub async fn exchange<B>(
    stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static,
    request: Request<B>,
) -> Result<Answer, hyper::Error>
where
    B: Body<Data: Send, Error: Into<Box<dyn std::error::Error + Send + Sync>>> + 'static,
{
    let mut builder = http1::Builder::new();
    let (mut sender, connection) = builder.max_buf_size(LONGEST_HEAD).handshake(TokioIo::new(stream)).await?;
    let mut answer = pin!(sender.send_request(request));
    let answer = tokio::select! {
        biased;
        answer = &mut answer => answer,
        // With the connection the answer is known: it came, or never will.
        _ = connection => answer.await,
    }?;
    let after = answer.headers().get(RETRY_AFTER).and_then(|after| after.to_str().ok()?.parse().ok());
    Ok(Answer { status: answer.status(), after: after.map(Duration::from_secs) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_url_is_read_as_rfc_3986_has_it_and_its_path_is_not_shown() {
        let target: Target = "https://hooks.example.org/services/T0/B0/secret?wait=true".parse().unwrap();
        assert_eq!((target.host.as_str(), target.port, target.tls), ("hooks.example.org", 443, true));
        assert_eq!(target.path, "/services/T0/B0/secret?wait=true");
        assert_eq!(target.to_string(), "https://hooks.example.org");
        let target: Target = "http://[::1]:8080".parse().unwrap();
        assert_eq!((target.host.as_str(), target.port, target.path.as_str()), ("::1", 8080, "/"));
        assert!(target.is_here() && target.authority == "[::1]:8080");
        assert!(!"http://10.0.0.7/".parse::<Target>().unwrap().is_here());
    }

    #[test]
    fn what_is_no_url_of_a_receiver_is_refused() {
        let wrong = [
            "",
            "ntfy.sh/topic",
            "ftp://host/",
            "http:///path",
            "https://anna:secret@host/",
            "http://host:0/",
            "http://host:99999/",
            "http://host:/",
            "http://ho st/",
            "/path",
        ];
        for text in wrong {
            assert_eq!(text.parse::<Target>(), Err(EXPECTED), "{text:?}");
        }
    }
}
