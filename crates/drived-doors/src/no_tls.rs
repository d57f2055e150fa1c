//! Where TLS is not built in: whoever asks for it is told so, and nothing goes on in clear.

use tokio::net::TcpStream;

use super::config::TlsFiles;

/// There is none.
#[derive(Clone)]
pub enum Tls {}

/// Nor one that could take its place.
pub enum Pair {}

impl Tls {
    pub(super) fn open(_: &TlsFiles) -> Result<Self, String> {
        Err("this program was built without TLS: cargo build --bin drived builds it in".to_owned())
    }

    pub fn another(&self, _: Option<&TlsFiles>) -> Result<Option<Pair>, String> {
        match *self {}
    }

    pub fn take(&self, _: Pair) {
        match *self {}
    }

    pub fn doubt(&self) -> Option<String> {
        match *self {}
    }

    pub(super) async fn accept(&self, _: TcpStream) -> Option<TcpStream> {
        match *self {}
    }
}

pub fn certificate_doubt(_: &TlsFiles) -> Option<String> {
    None
}
