//! One POST, within its time, whatever the other side does.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use drived_doors::outward::{self, AGENT, Answer, Target};
use http_body_util::Full;
use hyper::{
    Request, StatusCode,
    header::{AUTHORIZATION, CONTENT_TYPE, HOST, HeaderValue, USER_AGENT},
};
use tokio::{net::TcpStream, time::timeout};
use tokio_rustls::{
    TlsConnector,
    rustls::{ClientConfig, pki_types::ServerName},
};

use crate::{counters::Why, signature::Secret};

/// Where and by which rights.
#[derive(Clone)]
pub(crate) struct Way {
    pub(crate) target: Target,
    pub(crate) tls: Option<Arc<ClientConfig>>,
    pub(crate) authorization: Option<HeaderValue>,
    pub(crate) secret: Option<Secret>,
    pub(crate) content_type: &'static str,
    pub(crate) within: Duration,
}

/// Why it was not taken, and when it may be tried again, where the receiver says so.
#[derive(Debug, thiserror::Error)]
#[error("{text}")]
pub(crate) struct NotTaken {
    pub(crate) why: Why,
    pub(crate) text: String,
    pub(crate) after: Option<Duration>,
}

impl NotTaken {
    fn new(why: Why, text: impl Into<String>) -> Self {
        Self { why, text: text.into(), after: None }
    }

    fn unreachable(error: impl std::fmt::Display) -> Self {
        Self::new(Why::Unreachable, error.to_string())
    }
}

impl Way {
    /// Posts this. Done is what is answered by a 2xx; a redirection is not followed.
    ///
    /// # Errors
    /// It was not taken, or nobody knows.
    pub(crate) async fn post(&self, id: &str, unix_s: u64, body: String) -> Result<(), NotTaken> {
        let request = self.request(id, unix_s, body)?;
        let status = timeout(self.within, self.exchange(request)).await;
        let Answer { status, after } =
            status.map_err(|_| NotTaken::new(Why::Timeout, format!("no answer in {:?}", self.within)))??;
        match status {
            _ if status.is_success() => Ok(()),
            // These may be taken once somebody has seen to the receiver, or later.
            StatusCode::UNAUTHORIZED
            | StatusCode::FORBIDDEN
            | StatusCode::NOT_FOUND
            | StatusCode::METHOD_NOT_ALLOWED
            | StatusCode::PROXY_AUTHENTICATION_REQUIRED
            | StatusCode::REQUEST_TIMEOUT
            | StatusCode::TOO_EARLY
            | StatusCode::TOO_MANY_REQUESTS => {
                Err(NotTaken { after, ..NotTaken::new(Why::Status, format!("it answers {status}")) })
            }
            _ if status.is_client_error() => {
                Err(NotTaken::new(Why::Refused, format!("it refuses this one by {status}")))
            }
            _ => Err(NotTaken { after, ..NotTaken::new(Why::Status, format!("it answers {status}")) }),
        }
    }

    fn request(&self, id: &str, unix_s: u64, body: String) -> Result<Request<Full<Bytes>>, NotTaken> {
        let mut request = Request::post(&self.target.path)
            .header(HOST, &self.target.authority)
            .header(USER_AGENT, AGENT)
            .header(CONTENT_TYPE, self.content_type)
            .header("webhook-id", id)
            .header("webhook-timestamp", unix_s);
        if let Some(secret) = &self.secret {
            request = request.header("webhook-signature", secret.sign(id, unix_s, &body));
        }
        if let Some(authorization) = &self.authorization {
            request = request.header(AUTHORIZATION, authorization);
        }
        let request = request.body(Full::new(Bytes::from(body)));
        request.map_err(|error| NotTaken::new(Why::Refused, error.to_string()))
    }

    async fn exchange(&self, request: Request<Full<Bytes>>) -> Result<Answer, NotTaken> {
        let Target { host, port, .. } = &self.target;
        let stream = TcpStream::connect((host.as_str(), *port)).await.map_err(NotTaken::unreachable)?;
        let answer = match &self.tls {
            None => outward::exchange(stream, request).await,
            Some(config) => {
                let name = ServerName::try_from(host.clone()).map_err(NotTaken::unreachable)?;
                let tls = TlsConnector::from(Arc::clone(config)).connect(name, stream).await;
                outward::exchange(tls.map_err(NotTaken::unreachable)?, request).await
            }
        };
        answer.map_err(NotTaken::unreachable)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use drived_config::testing::Folder;
    use drived_doors::{believed, config::TlsFiles, identity};
    use tokio::{
        io::{AsyncReadExt as _, AsyncWriteExt as _},
        net::TcpListener,
    };
    use tokio_rustls::{
        TlsAcceptor,
        rustls::{RootCertStore, ServerConfig, crypto},
    };

    use super::*;

    /// For localhost, of tests alone.
    const CERTIFICATE: &str = include_str!("../../drived/tests/tls/certificate.pem");
    const KEY: &str = include_str!("../../drived/tests/tls/key.pem");

    fn way(url: &str, tls: Option<Arc<ClientConfig>>) -> Way {
        Way {
            target: url.parse().unwrap(),
            tls,
            authorization: Some(HeaderValue::from_static("Bearer secret")),
            secret: Some(Secret::read("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").unwrap()),
            content_type: "application/json",
            within: Duration::from_secs(20),
        }
    }

    /// What is said of a post to a receiver that reads the request and answers this, then more of the same or nothing; and the request.
    async fn posted_to(
        answer: &'static str,
        again: bool,
        within: Duration,
    ) -> (Result<(), NotTaken>, String) {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let way = Way { within, ..way(&format!("http://{}/a?b=c", listener.local_addr().unwrap()), None) };
        let receiver = async {
            let (mut stream, _) = listener.accept().await.unwrap();
            let mut request = vec![0; 4_096];
            let mut length = 0;
            while !request[..length].ends_with(b"{\"a\":1}") {
                length += stream.read(&mut request[length..]).await.unwrap();
            }
            let _ = stream.write_all(answer.as_bytes()).await;
            while again && stream.write_all(answer.as_bytes()).await.is_ok() {}
            request.truncate(length);
            (String::from_utf8(request).unwrap(), stream)
        };
        let (told, (request, _stream)) =
            tokio::join!(way.post("north-1-2", 1_614_265_330, "{\"a\":1}".into()), receiver);
        (told, request)
    }

    const LONG: Duration = Duration::from_secs(20);

    #[tokio::test]
    async fn a_request_has_what_a_receiver_needs_and_nothing_else_than_2xx_is_taken() {
        let (told, request) = posted_to("HTTP/1.1 204 No Content\r\n\r\n", false, LONG).await;
        told.unwrap();
        let head = request.to_ascii_lowercase();
        assert!(head.starts_with("post /a?b=c http/1.1\r\nhost: 127.0.0.1:"), "{head}");
        for line in [
            "content-type: application/json",
            "content-length: 7",
            "webhook-id: north-1-2",
            "webhook-timestamp: 1614265330",
            "webhook-signature: v1,",
            "authorization: bearer secret",
        ] {
            assert!(head.contains(&format!("\r\n{line}")), "{line}\n{head}");
        }
        // By RFC 9110: what is wrong with the request stays so, the rest may be over later.
        for (answer, why, after) in [
            ("HTTP/1.1 301 Moved\r\nlocation: http://127.0.0.1:1/\r\n\r\n", Why::Status, None),
            ("HTTP/1.1 400 Bad Request\r\n\r\n", Why::Refused, None),
            ("HTTP/1.1 413 Too Large\r\n\r\n", Why::Refused, None),
            ("HTTP/1.1 401 Unauthorized\r\n\r\n", Why::Status, None),
            ("HTTP/1.1 429 Slow\r\nretry-after: 7\r\n\r\n", Why::Status, Some(7)),
            ("HTTP/1.1 503 Later\r\nretry-after: 99999\r\n\r\n", Why::Status, Some(99_999)),
            ("SSH-2.0-OpenSSH_9.2\r\n", Why::Unreachable, None),
        ] {
            let not = posted_to(answer, false, LONG).await.0.unwrap_err();
            assert_eq!((not.why, not.after), (why, after.map(Duration::from_secs)), "{answer}: {not}");
        }
    }

    #[tokio::test]
    async fn a_receiver_that_is_silent_or_never_ends_holds_up_nobody_and_fills_no_memory() {
        let silent = posted_to("", false, Duration::from_millis(50)).await.0.unwrap_err();
        assert_eq!(silent.why, Why::Timeout);
        let half = posted_to("HTTP/1.1 200 OK\r\nx: ", false, Duration::from_millis(50)).await.0.unwrap_err();
        assert_eq!(half.why, Why::Timeout);
        let endless = posted_to("HTTP/1.1 200 OK\r\nx: yyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyy", true, LONG)
            .await
            .0
            .unwrap_err();
        assert_eq!(endless.why, Why::Unreachable, "{endless}");
        // The body of an answer is not read.
        posted_to("HTTP/1.1 200 OK\r\ncontent-length: 999999999\r\n\r\n", true, LONG).await.0.unwrap();
    }

    fn client(roots: RootCertStore) -> Option<Arc<ClientConfig>> {
        let config = ClientConfig::builder_with_provider(Arc::new(crypto::ring::default_provider()));
        let config = config.with_safe_default_protocol_versions().unwrap();
        Some(Arc::new(config.with_root_certificates(roots).with_no_client_auth()))
    }

    #[tokio::test]
    async fn over_https_only_a_receiver_that_is_vouched_for_is_told_anything() {
        let folder = Folder::new("webhook-tls");
        let files = TlsFiles { certificate: folder.file("certificate.pem"), key: folder.file("key.pem") };
        fs::write(&files.certificate, CERTIFICATE).unwrap();
        fs::write(&files.key, KEY).unwrap();
        #[cfg(unix)]
        fs::set_permissions(&files.key, std::os::unix::fs::PermissionsExt::from_mode(0o600)).unwrap();
        let (chain, key) = identity(&files).unwrap();
        let server = ServerConfig::builder_with_provider(Arc::new(crypto::ring::default_provider()));
        let server = server.with_safe_default_protocol_versions().unwrap().with_no_client_auth();
        let acceptor = TlsAcceptor::from(Arc::new(server.with_single_cert(chain, key).unwrap()));
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let url = format!("https://localhost:{}/", listener.local_addr().unwrap().port());
        for (roots, is_taken) in
            [(believed(Some(&files.certificate)).unwrap(), true), (RootCertStore::empty(), false)]
        {
            let way = way(&url, client(roots));
            let receiver = async {
                let (stream, _) = listener.accept().await.unwrap();
                let Ok(mut stream) = acceptor.accept(stream).await else { return None };
                let mut request = [0; 4_096];
                let length = stream.read(&mut request).await.unwrap();
                stream.write_all(b"HTTP/1.1 200 OK\r\n\r\n").await.unwrap();
                Some((length, stream))
            };
            let (told, heard) = tokio::join!(way.post("a", 1, "{}".into()), receiver);
            assert_eq!((told.is_ok(), heard.is_some()), (is_taken, is_taken));
        }
    }
}
