//! `[http]` and `[socket]`: who may come in, and by which door.

use std::{
    fmt,
    net::{IpAddr, SocketAddr},
    path::{Path, PathBuf},
    str::FromStr,
};

use serde::Deserialize;
use toml::Spanned;

use super::network::Network;
use drived_config::{
    config::{ConfigError, Parsed, Source, State},
    rights::{Rights, Role},
};
use drived_words::failure::Failure;

/// The doors of a daemon.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DoorsConfig {
    /// Without it there is no control socket.
    pub socket: Option<SocketConfig>,
    /// Without it there is no HTTP server.
    pub http: Option<HttpConfig>,
    /// Where tokens and the audit log are kept, and what else outlives the daemon.
    pub state: State,
}

/// The control socket.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SocketConfig {
    /// Where it is, if not where such things usually are.
    pub path: Option<PathBuf>,
    /// Who may use it: file permissions.
    pub mode: u32,
}

/// The HTTP server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HttpConfig {
    pub listen: SocketAddr,
    pub tls: Option<TlsFiles>,
    /// Whether tokens may cross a network in clear, because a proxy encrypts before.
    pub plain: bool,
    /// Names by which it may be called beside its addresses.
    pub allowed_hosts: Vec<String>,
    /// The proxies that say truly for whom they ask.
    pub proxies: Vec<Network>,
    /// What is given without login; `None`: to see and to stop for this machine, nothing for others.
    pub without_login: Option<Freely>,
    /// Whether the drives are simulated, so that everybody may move them.
    pub demo: bool,
}

impl HttpConfig {
    /// What whoever brings no token may do, here or behind a proxy.
    pub fn freely(&self, proxied: bool) -> Rights {
        match self.without_login {
            Some(Freely(role)) => role.map_or(Rights::NONE, Role::rights),
            None if proxied || !self.listen.ip().is_loopback() => Rights::NONE,
            // It is called by a name, or in clear from beyond this machine: that is a proxy, which may not say that it is one.
            None if self.proxies.is_empty() && (self.plain || !self.allowed_hosts.is_empty()) => Rights::NONE,
            None if self.demo => Role::Operate.rights(),
            None => Role::Stop.rights(),
        }
    }

    /// What is missing where others than this machine can reach it.
    fn missing(&self, has_tokens: bool) -> Option<&'static str> {
        match (self.listen.ip().is_loopback(), has_tokens, self.tls.is_some() || self.plain) {
            (true, ..) | (_, true, true) => None,
            (_, false, _) => Some(
                "others than this machine can reach it: expected tokens = \"FILE\" or state = \"FOLDER\", where drived token add keeps them",
            ),
            (_, _, false) => Some(
                "tokens would cross the network in clear: expected tls = { certificate = \"FILE\", key = \"FILE\" }, \
                 or plain = true where a proxy encrypts",
            ),
        }
    }
}

/// Certificate and key, in PEM.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TlsFiles {
    pub certificate: PathBuf,
    pub key: PathBuf,
}

/// What is given without login.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Freely(Option<Role>);

impl FromStr for Freely {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "nothing" => Ok(Self(None)),
            "view" => Ok(Self(Some(Role::View))),
            "stop" => Ok(Self(Some(Role::Stop))),
            _ => Err("expected nothing, view or stop: whatever else needs a token"),
        }
    }
}

/// Where the HTTP server listens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Http {
    At(SocketAddr),
    Off,
}

impl Default for Http {
    fn default() -> Self {
        Self::At(LISTEN)
    }
}

impl fmt::Display for Http {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::At(address) => address.fmt(f),
            Self::Off => f.write_str("off"),
        }
    }
}

/// Where it listens unless the file says otherwise.
const LISTEN: SocketAddr = SocketAddr::new(IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), 7580);
/// Who may use the socket unless the file says otherwise: its owner and its group.
const MODE: u32 = 0o660;

impl FromStr for Http {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "off" => Ok(Self::Off),
            _ => {
                text.parse().map(Self::At).map_err(|_| "expected ADDRESS:PORT such as 127.0.0.1:7580, or off")
            }
        }
    }
}

/// File permissions as chmod has them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mode(u32);

impl FromStr for Mode {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mode = u32::from_str_radix(text, 8).ok().filter(|mode| *mode <= 0o777);
        mode.map(Self).ok_or("expected permissions such as 0660")
    }
}

/// `[http]`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HttpEntry {
    listen: Option<Spanned<Parsed<Http>>>,
    tls: Option<TlsFiles>,
    #[serde(default)]
    plain: bool,
    #[serde(default)]
    allowed_hosts: Vec<Spanned<String>>,
    #[serde(default)]
    proxies: Vec<Parsed<Network>>,
    without_login: Option<Parsed<Freely>>,
}

/// `[socket]`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SocketEntry {
    path: Option<PathBuf>,
    mode: Option<Parsed<Mode>>,
}

impl HttpConfig {
    /// A server without anything that has to be configured.
    fn at(listen: SocketAddr) -> Self {
        Self {
            listen,
            tls: None,
            plain: false,
            allowed_hosts: Vec::new(),
            proxies: Vec::new(),
            without_login: None,
            demo: false,
        }
    }
}

impl DoorsConfig {
    /// The doors that a file describes. Files that it names stand beside it, where their paths are not whole.
    pub fn read(
        source: Source<'_>,
        http: Option<&HttpEntry>,
        socket: Option<&SocketEntry>,
        state: State,
    ) -> Result<Self, ConfigError> {
        let folder = source.file.parent().unwrap_or(Path::new(""));
        let socket = SocketConfig {
            path: socket.and_then(|socket| socket.path.as_deref()).map(|path| folder.join(path)),
            mode: socket.and_then(|socket| socket.mode).map_or(MODE, |mode| mode.0.0),
        };
        let http = match http {
            None => Some(HttpConfig::at(LISTEN)),
            Some(http) => http.checked(source, folder, state.has_tokens)?,
        };
        Ok(Self { socket: Some(socket), http, state })
    }

    /// The doors of a demo: everybody who is on this machine may move its simulated drives.
    pub fn of_demo(socket: Option<PathBuf>) -> Self {
        let http = HttpConfig { demo: true, ..HttpConfig::at(LISTEN) };
        let socket = socket.map(|path| SocketConfig { path: Some(path), mode: MODE });
        Self { socket, http: Some(http), state: State::default() }
    }

    /// The same with what the command line says instead.
    pub fn with(self, http: Option<Http>, socket: Option<PathBuf>) -> Result<Self, Failure> {
        let http = match http {
            None => self.http,
            Some(Http::Off) => None,
            Some(Http::At(listen)) => {
                let http = self.http.unwrap_or_else(|| HttpConfig::at(listen));
                let http = HttpConfig { listen, ..http };
                if let Some(missing) = http.missing(self.state.has_tokens) {
                    return Err(Failure::Input(format!("--http {listen}: {missing}")));
                }
                Some(http)
            }
        };
        let socket = match (self.socket, socket) {
            (socket, None) => socket,
            (socket, path @ Some(_)) => {
                Some(SocketConfig { path, mode: socket.map_or(MODE, |socket| socket.mode) })
            }
        };
        Ok(Self { http, socket, ..self })
    }
}

impl HttpEntry {
    fn checked(
        &self,
        source: Source<'_>,
        folder: &Path,
        has_tokens: bool,
    ) -> Result<Option<HttpConfig>, ConfigError> {
        let said = self.listen.as_ref();
        let Http::At(listen) = said.map_or_else(Http::default, |listen| listen.get_ref().0) else {
            return Ok(None);
        };
        for host in &self.allowed_hosts {
            let name = host.get_ref();
            let allowed = |character: char| character.is_ascii_alphanumeric() || ".-_[]:".contains(character);
            let port =
                name.rsplit_once(':').is_some_and(|(rest, _)| !rest.contains(':') || rest.ends_with(']'));
            if name.is_empty() || port || !name.chars().all(allowed) {
                let problem = format_args!("{name:?}: expected a name or an address without a port");
                return Err(source.error(host.span(), problem));
            }
        }
        let tls = self.tls.as_ref().map(|TlsFiles { certificate, key }| TlsFiles {
            certificate: folder.join(certificate),
            key: folder.join(key),
        });
        let http = HttpConfig {
            listen,
            tls,
            plain: self.plain,
            allowed_hosts: self.allowed_hosts.iter().map(|host| host.get_ref().clone()).collect(),
            proxies: self.proxies.iter().map(|network| network.0).collect(),
            without_login: self.without_login.map(|freely| freely.0),
            demo: false,
        };
        match http.missing(has_tokens) {
            None => Ok(Some(http)),
            Some(missing) => {
                let place = said.map(Spanned::span).unwrap_or_default();
                Err(source.error(place, format_args!("{listen}: {missing}")))
            }
        }
    }
}
