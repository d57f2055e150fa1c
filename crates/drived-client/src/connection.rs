//! A connection to the daemon, and its answers.

use std::{
    fmt, io,
    path::{Path, PathBuf},
    time::Duration,
};

use axum::{
    Router,
    body::Bytes,
    http::{Request, Response, StatusCode, header},
};
use http_body_util::{BodyExt as _, Full, Limited};
use hyper::{
    body::Incoming,
    client::conn::http1::{self, SendRequest},
    server::conn::http1 as server,
};
use hyper_util::{rt::TokioIo, service::TowerToHyperService};
use serde::{Deserialize, de::DeserializeOwned};
use serde_json::Value;
use tokio::{
    io::{AsyncRead, AsyncWrite},
    time::timeout,
};

use super::path_of;
use drived_plant::plant::views::{CommandView, StateView};
use drived_words::failure::Failure;

/// How long the daemon may take to begin an answer: it waits itself for what it is asked to.
const ANSWERED_WITHIN: Duration = Duration::from_secs(40);
/// How much of what this program serves itself waits for its reader.
const PIPE: usize = 64 << 10;

/// How long an answer that has begun may take.
const READ_WITHIN: Duration = Duration::from_secs(20);
/// The longest answer that is read; the state of 200 drives has a hundredth of it.
const LONGEST: usize = 32 << 20;

/// A connection to the daemon.
pub struct Daemon {
    sender: SendRequest<Full<Bytes>>,
    pid: Option<i32>,
    way: Way,
}

/// The way to a daemon, for one connection after the other.
#[derive(Clone)]
pub struct Way {
    place: Place,
    token: Option<String>,
}

#[derive(Clone)]
enum Place {
    Socket(PathBuf),
    /// This program itself.
    Here(Router),
}

/// What the daemon answered.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    pub status: StatusCode,
    pub body: Value,
}

/// What a problem document says.
#[derive(Default, Deserialize)]
#[serde(default)]
struct Problem {
    title: Option<String>,
    detail: Option<String>,
    text: Option<String>,
    reason: Option<String>,
    drive_status: Option<Value>,
}

impl Answer {
    /// The body, if that is what was asked for.
    pub fn done<T: DeserializeOwned>(self) -> Result<T, Failure> {
        if !self.status.is_success() {
            return Err(self.failure());
        }
        let other = |error| Failure::Drive(format!("the daemon answers something else: {error}"));
        serde_json::from_value(self.body).map_err(other)
    }

    /// The command that it tells of, however that has ended.
    pub fn command(&self) -> Option<CommandView> {
        let mut members = self.body.as_object()?.clone();
        if !self.status.is_success() {
            // The status of a problem document is that of the answer.
            members.remove("status");
            members.extend(self.problem().drive_status.map(|shown| ("status".to_owned(), shown)));
        }
        serde_json::from_value(Value::Object(members)).ok()
    }

    /// Why it is refused, in one word.
    pub fn reason(&self) -> Option<String> {
        self.problem().reason
    }

    fn problem(&self) -> Problem {
        serde_json::from_value(self.body.clone()).unwrap_or_default()
    }

    /// Why it is not what was asked for.
    pub fn failure(&self) -> Failure {
        let Problem { title, detail, text, .. } = self.problem();
        let text = detail.or(text).or(title);
        let text = text.unwrap_or_else(|| format!("the daemon answers {}", self.status));
        match self.status {
            StatusCode::BAD_REQUEST
            | StatusCode::UNAUTHORIZED
            | StatusCode::FORBIDDEN
            | StatusCode::NOT_FOUND
            | StatusCode::PAYLOAD_TOO_LARGE
            | StatusCode::UNPROCESSABLE_ENTITY
            | StatusCode::NOT_IMPLEMENTED => Failure::Input(text),
            _ => Failure::Drive(text),
        }
    }
}

impl Daemon {
    /// Connects to the daemon of a socket, or of the first that answers where they usually are.
    pub async fn connect(socket: Option<&Path>, token_file: Option<&Path>) -> Result<Self, Failure> {
        let token = token_file.map(|file| {
            let token = std::fs::read_to_string(file);
            let token = token.map_err(|error| Failure::Input(format!("{}: {error}", file.display())))?;
            Ok(token.trim().to_owned())
        });
        let token = token.transpose()?;
        let places = socket.map_or_else(drived_doors::usual_places, |socket| vec![socket.to_owned()]);
        let mut why = None;
        for place in places {
            let way = Way { place: Place::Socket(place.clone()), token: token.clone() };
            match open(&way.place).await {
                Ok((sender, pid)) => return Ok(Self { sender, pid, way }),
                // The one that was expected first says why.
                Err(error) => why = why.or(Some((place, error))),
            }
        }
        let (place, error) = why.unwrap_or_else(|| (PathBuf::new(), io::ErrorKind::NotFound.into()));
        let what_to_do =
            "start one by drived run --config FILE, or go to a drive directly by --line and --drive";
        Err(Failure::Input(match error.kind() {
            io::ErrorKind::PermissionDenied => {
                format!(
                    "{}: you may not use the control socket of the daemon: become root, or one of its group",
                    place.display()
                )
            }
            io::ErrorKind::NotFound | io::ErrorKind::ConnectionRefused => {
                format!("no daemon serves {}: {what_to_do}", place.display())
            }
            _ => format!("no daemon can be reached at {}: {error}: {what_to_do}", place.display()),
        }))
    }

    /// The way to it.
    pub const fn way(&self) -> &Way {
        &self.way
    }

    /// Whose it is, as the system knows.
    pub const fn pid(&self) -> Option<i32> {
        self.pid
    }

    /// Reads something.
    pub async fn get(&mut self, path: &str) -> Result<Answer, Failure> {
        self.ask("GET", path, None).await
    }

    /// Reads something as what it is.
    pub async fn read<T: DeserializeOwned>(&mut self, parts: &[&str]) -> Result<T, Failure> {
        self.get(&path_of(parts)).await?.done()
    }

    /// The state of the whole plant.
    pub async fn state(&mut self) -> Result<StateView, Failure> {
        self.read(&["state"]).await
    }

    /// Asks for something to be done.
    pub async fn post(&mut self, path: &str, body: &Value) -> Result<Answer, Failure> {
        self.ask("POST", path, Some(body)).await
    }

    /// Asks for something to be written.
    pub async fn put(&mut self, path: &str, body: &Value) -> Result<Answer, Failure> {
        self.ask("PUT", path, Some(body)).await
    }

    /// Asks for something to be removed.
    pub async fn delete(&mut self, path: &str) -> Result<Answer, Failure> {
        self.ask("DELETE", path, Some(&Value::Null)).await
    }

    async fn ask(&mut self, method: &str, path: &str, body: Option<&Value>) -> Result<Answer, Failure> {
        let (parts, body) = self.send(method, path, body).await?.into_parts();
        let read = timeout(READ_WITHIN, Limited::new(body, LONGEST).collect()).await;
        let read = read.map_err(|_| self.silent("did not end its answer in time"))?;
        let body = read.map_err(|error| self.lost(&error))?.to_bytes();
        let body = serde_json::from_slice(&body)
            .unwrap_or_else(|_| Value::String(String::from_utf8_lossy(&body).into_owned()));
        Ok(Answer { status: parts.status, body })
    }

    /// Sends a request, and gives the answer as it begins.
    pub async fn send(
        &mut self,
        method: &str,
        path: &str,
        body: Option<&Value>,
    ) -> Result<Response<Incoming>, Failure> {
        let mut request = Request::builder().method(method).uri(path).header(header::HOST, "localhost");
        if body.is_some() {
            request = request.header(header::CONTENT_TYPE, "application/json");
        }
        if let Some(token) = &self.way.token {
            request = request.header(header::AUTHORIZATION, format!("Bearer {token}"));
        }
        let body = body.map(Value::to_string).unwrap_or_default();
        let request = request.body(Full::new(Bytes::from(body)));
        let request = request.map_err(|error| Failure::Input(error.to_string()))?;
        // The connection may have been idle for as long as the daemon allows.
        if self.sender.ready().await.is_err() {
            let opened = open(&self.way.place).await;
            (self.sender, self.pid) = opened.map_err(|error| self.lost(&error))?;
        }
        match timeout(ANSWERED_WITHIN, self.sender.send_request(request)).await {
            Ok(answer) => answer.map_err(|error| self.lost(&error)),
            Err(_) => Err(self.silent("gave no answer in time")),
        }
    }

    fn silent(&self, what: &str) -> Failure {
        Failure::Drive(format!("{} {what}: nobody knows what became of it", self.way))
    }

    fn lost(&self, error: &dyn std::fmt::Display) -> Failure {
        Failure::Drive(format!("{} has gone: {error}: read the state before you ask again", self.way))
    }
}

impl Way {
    /// The way to what this program itself serves.
    pub const fn here(router: Router) -> Self {
        Self { place: Place::Here(router), token: None }
    }

    /// Connects once more.
    pub async fn connect(&self) -> Result<Daemon, Failure> {
        match open(&self.place).await {
            Ok((sender, pid)) => Ok(Daemon { sender, pid, way: self.clone() }),
            Err(error) => Err(Failure::Drive(format!("{self} cannot be reached: {error}"))),
        }
    }
}

impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            Place::Socket(socket) => write!(f, "the daemon at {}", socket.display()),
            Place::Here(_) => f.write_str("this program"),
        }
    }
}

async fn open(place: &Place) -> io::Result<(SendRequest<Full<Bytes>>, Option<i32>)> {
    match place {
        Place::Socket(socket) => open_socket(socket).await,
        Place::Here(router) => {
            let (ours, theirs) = tokio::io::duplex(PIPE);
            let service = TowerToHyperService::new(router.clone());
            tokio::spawn(server::Builder::new().serve_connection(TokioIo::new(theirs), service));
            Ok((over(ours).await?, None))
        }
    }
}

#[cfg(unix)]
async fn open_socket(socket: &Path) -> io::Result<(SendRequest<Full<Bytes>>, Option<i32>)> {
    let stream = tokio::net::UnixStream::connect(socket).await?;
    let pid = stream.peer_cred().ok().and_then(|daemon| daemon.pid());
    Ok((over(stream).await?, pid))
}

#[cfg(not(unix))]
async fn open_socket(_: &Path) -> io::Result<(SendRequest<Full<Bytes>>, Option<i32>)> {
    Err(io::Error::from(io::ErrorKind::NotFound))
}

async fn over(
    stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static,
) -> io::Result<SendRequest<Full<Bytes>>> {
    let (sender, connection) = http1::handshake(TokioIo::new(stream)).await.map_err(io::Error::other)?;
    tokio::spawn(connection);
    Ok(sender)
}

#[cfg(all(test, unix))]
mod tests {
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_daemon_that_is_stalled_is_said_to_be_and_nobody_waits_for_ever() {
        let path = std::env::temp_dir().join(format!("drived-stalled-{}.sock", std::process::id()));
        // It is connected to, and never says anything.
        let stalled = tokio::net::UnixListener::bind(&path).unwrap();
        let mut daemon = Daemon::connect(Some(&path), None).await.unwrap();
        for _ in 0..2 {
            let failed = daemon.state().await.unwrap_err();
            assert!(matches!(failed, Failure::Drive(_)));
            assert!(failed.to_string().contains("gave no answer in time"), "{failed}");
        }
        drop(stalled);
        std::fs::remove_file(&path).unwrap();
    }

    /// What is told of a daemon that begins an answer like this, and then says the same again and again, or nothing.
    async fn told_of(name: &str, head: &'static str, then: Option<&'static [u8]>) -> Failure {
        let path = std::env::temp_dir().join(format!("drived-{name}-{}.sock", std::process::id()));
        let listener = tokio::net::UnixListener::bind(&path).unwrap();
        let daemon = tokio::spawn(async move {
            let (mut stream, _) = listener.accept().await.unwrap();
            let mut request = [0; 4096];
            assert!(stream.read(&mut request).await.unwrap() > 0);
            stream.write_all(head.as_bytes()).await.unwrap();
            match then {
                // Whoever has read enough goes away.
                Some(more) => while stream.write_all(more).await.is_ok() {},
                None => std::future::pending().await,
            }
        });
        let mut client = Daemon::connect(Some(&path), None).await.unwrap();
        let failed = timeout(Duration::from_secs(3600), client.state()).await;
        daemon.abort();
        std::fs::remove_file(&path).unwrap();
        failed.expect("nobody waits for ever").unwrap_err()
    }

    #[tokio::test(start_paused = true)]
    async fn a_daemon_that_stalls_in_the_middle_of_its_answer_is_said_to() {
        let head =
            "HTTP/1.1 200 OK\r\ncontent-type: application/json\r\ncontent-length: 100\r\n\r\n{\"drives\":";
        let failed = told_of("half", head, None).await;
        assert!(failed.to_string().contains("did not end its answer in time"), "{failed}");
    }

    #[tokio::test]
    async fn an_answer_without_end_is_not_read_without_end() {
        let head = "HTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\n";
        let chunk = [&b"10000\r\n"[..], &[b' '; 0x10000], b"\r\n"].concat();
        let failed = told_of("endless", head, Some(chunk.leak())).await;
        assert!(failed.to_string().contains("length limit exceeded"), "{failed}");
    }
}
