//! Where TLS is not built in: whoever asks for it is told so, and nothing goes on in clear.

use tokio::net::TcpStream;

use super::config::TlsFiles;

/// There is none.
#[derive(Clone)]
pub(super) enum Tls {}

impl Tls {
    pub(super) fn open(_: &TlsFiles) -> Result<Self, String> {
        Err("this program was built without TLS: cargo build --bin drived builds it in".to_owned())
    }

    pub(super) async fn accept(&self, _: TcpStream) -> Option<TcpStream> {
        match *self {}
    }
}
