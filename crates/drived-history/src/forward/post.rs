//! One POST, within its time, whatever the other side does.

use std::{pin::pin, time::Duration};

use bytes::Bytes;
use http_body_util::Full;
use hyper::{
    Request, StatusCode,
    client::conn::http1,
    header::{AUTHORIZATION, CONTENT_TYPE, HOST, USER_AGENT},
};
use hyper_util::rt::TokioIo;
use tokio::{net::TcpStream, time::timeout};

use super::Forward;

const WITHIN: Duration = Duration::from_secs(20);
/// The longest head of an answer; its body is not read.
const LONGEST_HEAD: usize = 16 << 10;
const AGENT: &str = concat!("drived/", env!("CARGO_PKG_VERSION"));

/// Why it was not taken, or why nobody knows.
#[derive(Debug, thiserror::Error)]
#[error("{text}")]
pub(super) struct NotTaken {
    /// Whether it will never be taken as it is.
    pub(super) is_of_content: bool,
    text: String,
}

fn not_taken(error: impl std::fmt::Display) -> NotTaken {
    NotTaken { is_of_content: false, text: error.to_string() }
}

/// Posts lines. Done is what is answered by a 2xx.
pub(super) async fn post(forward: &Forward, lines: String) -> Result<(), NotTaken> {
    let target = &forward.target;
    let mut request = Request::post(&target.path)
        .header(HOST, &target.authority)
        .header(USER_AGENT, AGENT)
        .header(CONTENT_TYPE, "text/plain; charset=utf-8");
    if let Some(file) = &forward.token {
        let token = tokio::fs::read_to_string(file).await;
        let token = token.map_err(|error| not_taken(format_args!("{}: {error}", file.display())))?;
        request = request.header(AUTHORIZATION, format!("Token {}", token.trim()));
    }
    let request = request.body(Full::new(Bytes::from(lines))).map_err(not_taken)?;
    let status = timeout(WITHIN, exchange(forward, request)).await;
    match status.map_err(|_| not_taken(format_args!("no answer in {WITHIN:?}")))?? {
        status if status.is_success() => Ok(()),
        // By the documents of both: malformed lines, and too many of them. The rest is over once somebody has seen to it.
        status @ (StatusCode::BAD_REQUEST
        | StatusCode::UNPROCESSABLE_ENTITY
        | StatusCode::PAYLOAD_TOO_LARGE) => {
            Err(NotTaken { is_of_content: true, text: format!("it answers {status}") })
        }
        status => Err(not_taken(format_args!("it answers {status}"))),
    }
}

async fn exchange(forward: &Forward, request: Request<Full<Bytes>>) -> Result<StatusCode, NotTaken> {
    let address = (forward.target.host.as_str(), forward.target.port);
    let stream = TcpStream::connect(address).await.map_err(not_taken)?;
    let mut builder = http1::Builder::new();
    let shaken = builder.max_buf_size(LONGEST_HEAD).handshake(TokioIo::new(stream)).await;
    let (mut sender, connection) = shaken.map_err(not_taken)?;
    let mut answer = pin!(sender.send_request(request));
    let answer = tokio::select! {
        biased;
        answer = &mut answer => answer,
        // With the connection the answer is known: it came, or never will.
        _ = connection => answer.await,
    };
    Ok(answer.map_err(not_taken)?.status())
}
