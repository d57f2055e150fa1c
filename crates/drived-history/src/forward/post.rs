//! One POST, within its time, whatever the other side does.

use std::time::Duration;

use bytes::Bytes;
use drived_doors::outward::{self, AGENT};
use http_body_util::Full;
use hyper::{
    Request, StatusCode,
    header::{AUTHORIZATION, CONTENT_TYPE, HOST, USER_AGENT},
};
use tokio::{net::TcpStream, time::timeout};

use super::Forward;

const WITHIN: Duration = Duration::from_secs(20);

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
    let target = &forward.target.0;
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
    let target = &forward.target.0;
    let stream = TcpStream::connect((target.host.as_str(), target.port)).await.map_err(not_taken)?;
    Ok(outward::exchange(stream, request).await.map_err(not_taken)?.status)
}
