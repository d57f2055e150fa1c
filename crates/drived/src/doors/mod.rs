//! Who comes in, and by which door.

mod rights;

use std::{fmt, net::SocketAddr, str::FromStr};

use axum::{Extension, Router};
use tokio::{net::TcpListener, task::JoinHandle};

pub(crate) use self::rights::Rights;

/// Who asks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Caller {
    /// The name of his token, `local` on the socket, or `anonymous`.
    pub(crate) name: String,
    /// Where he comes from, such as `page 127.0.0.1`.
    pub(crate) origin: String,
    pub(crate) rights: Rights,
}

/// Where the page and the API are served.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Http {
    At(SocketAddr),
    Off,
}

impl Default for Http {
    /// 127.0.0.1:7580.
    fn default() -> Self {
        Self::At(SocketAddr::from(([127, 0, 0, 1], 7580)))
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

impl FromStr for Http {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "off" => Ok(Self::Off),
            _ => text.parse().map(Self::At).map_err(|_| "expected an address such as 127.0.0.1:7580, or off"),
        }
    }
}

/// An open door.
pub(crate) struct Doors(Option<JoinHandle<()>>);

impl Doors {
    /// Serves a router to whoever comes; what cannot be opened is told and left.
    pub(crate) async fn open(http: Http, rights: Rights, router: Router) -> Self {
        let Http::At(address) = http else { return Self(None) };
        let listener = match TcpListener::bind(address).await {
            Ok(listener) => listener,
            Err(error) => {
                tracing::warn!("the page cannot be served at {address}: {error}");
                return Self(None);
            }
        };
        let caller = Caller { name: "anonymous".to_owned(), origin: "page".to_owned(), rights };
        let router = router.layer(Extension(caller));
        Self(Some(tokio::spawn(async move {
            let _ = axum::serve(listener, router).await;
        })))
    }

    /// Lets nobody in any more.
    pub(crate) fn close(self) {
        if let Self(Some(door)) = self {
            door.abort();
        }
    }
}
