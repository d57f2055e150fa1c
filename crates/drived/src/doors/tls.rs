//! TLS: certificate and key from files. What is missing or cannot be read is an error, never a reason to go on in clear.

use std::{path::Path, sync::Arc, time::Duration};

use tokio::net::TcpStream;
use tokio_rustls::{
    TlsAcceptor,
    rustls::{
        ServerConfig,
        crypto::ring,
        pki_types::{CertificateDer, PrivateKeyDer, pem::PemObject as _},
    },
    server::TlsStream,
};

use crate::config::TlsFiles;

/// How long the two sides may take to agree.
const AGREED_WITHIN: Duration = Duration::from_secs(5);

/// The certificate of the server.
#[derive(Clone)]
pub(super) struct Tls(TlsAcceptor);

impl Tls {
    /// Reads certificate and key.
    ///
    /// # Errors
    ///
    /// One of them is missing, is none, can be read by everybody, or they do not belong together.
    pub(super) fn open(files: &TlsFiles) -> Result<Self, String> {
        let TlsFiles { certificate, key } = files;
        let of = |file: &Path, error: &dyn std::fmt::Display| format!("{}: {error}", file.display());
        let chain = CertificateDer::pem_file_iter(certificate).map_err(|error| of(certificate, &error))?;
        let chain = chain.collect::<Result<Vec<_>, _>>().map_err(|error| of(certificate, &error))?;
        if chain.is_empty() {
            return Err(of(certificate, &"there is no certificate in it: expected PEM"));
        }
        let secret = PrivateKeyDer::from_pem_file(key).map_err(|error| of(key, &error))?;
        #[cfg(unix)]
        if std::fs::metadata(key)
            .is_ok_and(|known| std::os::unix::fs::PermissionsExt::mode(&known.permissions()) & 0o007 != 0)
        {
            return Err(of(key, &format_args!("everybody can read the key: chmod o= {}", key.display())));
        }
        let config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_safe_default_protocol_versions()
            .map_err(|error| error.to_string())?
            .with_no_client_auth()
            .with_single_cert(chain, secret)
            .map_err(|error| of(certificate, &error))?;
        Ok(Self(TlsAcceptor::from(Arc::new(config))))
    }

    /// Agrees with the far end, if it does in time.
    pub(super) async fn accept(&self, stream: TcpStream) -> Option<TlsStream<TcpStream>> {
        tokio::time::timeout(AGREED_WITHIN, self.0.accept(stream)).await.ok()?.ok()
    }
}
