//! TLS: certificate and key from files. What is missing or cannot be read is an error, never a reason to go on in clear.

use std::{path::Path, sync::Arc, time::Duration};

use tokio::net::TcpStream;
use tokio_rustls::{
    TlsAcceptor,
    rustls::{
        RootCertStore, ServerConfig,
        crypto::ring,
        pki_types::{CertificateDer, PrivateKeyDer, pem::PemObject as _},
    },
    server::TlsStream,
};

use super::{
    config::TlsFiles,
    secret::{of, private},
};

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
        let (chain, secret) = identity(files)?;
        let config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_safe_default_protocol_versions()
            .map_err(|error| error.to_string())?
            .with_no_client_auth()
            .with_single_cert(chain, secret)
            .map_err(|error| of(&files.certificate, &error))?;
        Ok(Self(TlsAcceptor::from(Arc::new(config))))
    }

    /// Agrees with the far end, if it does in time.
    pub(super) async fn accept(&self, stream: TcpStream) -> Option<TlsStream<TcpStream>> {
        tokio::time::timeout(AGREED_WITHIN, self.0.accept(stream)).await.ok()?.ok()
    }
}

/// A certificate with those who vouch for it, and its key.
///
/// # Errors
///
/// One of them is missing, is none, or can be read by everybody.
pub fn identity(files: &TlsFiles) -> Result<(Vec<CertificateDer<'static>>, PrivateKeyDer<'static>), String> {
    let TlsFiles { certificate, key } = files;
    let chain = CertificateDer::pem_file_iter(certificate).map_err(|error| of(certificate, &error))?;
    let chain = chain.collect::<Result<Vec<_>, _>>().map_err(|error| of(certificate, &error))?;
    if chain.is_empty() {
        return Err(of(certificate, &"there is no certificate in it: expected PEM"));
    }
    let secret = PrivateKeyDer::from_pem_file(key).map_err(|error| of(key, &error))?;
    private(key)?;
    Ok((chain, secret))
}

/// Those who are believed: the certificates of a file, in PEM, or without one those of the system.
///
/// # Errors
///
/// The file is missing or has none in it, or this system believes nobody.
pub fn believed(authorities: Option<&Path>) -> Result<RootCertStore, String> {
    let mut roots = RootCertStore::empty();
    match authorities {
        Some(file) => {
            for certificate in CertificateDer::pem_file_iter(file).map_err(|error| of(file, &error))? {
                let certificate = certificate.map_err(|error| of(file, &error))?;
                roots.add(certificate).map_err(|error| of(file, &error))?;
            }
            if roots.is_empty() {
                return Err(of(file, &"there is no certificate in it: expected PEM"));
            }
        }
        None => {
            // A certificate of the system that cannot be used is no reason to believe nobody.
            roots.add_parsable_certificates(rustls_native_certs::load_native_certs().certs);
            if roots.is_empty() {
                return Err("this system believes nobody: expected authorities = \"FILE\"".to_owned());
            }
        }
    }
    Ok(roots)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use tokio::{io::AsyncReadExt as _, net::TcpListener};
    use tokio_rustls::{
        TlsConnector,
        rustls::{ClientConfig, RootCertStore},
    };

    use super::*;
    use drived_config::testing::Folder;

    /// A certificate for localhost and its key, of these tests alone.
    const CERTIFICATE: &str = include_str!("../../drived/tests/tls/certificate.pem");
    const KEY: &str = include_str!("../../drived/tests/tls/key.pem");

    fn files(folder: &Folder) -> TlsFiles {
        let files = TlsFiles { certificate: folder.file("certificate.pem"), key: folder.file("key.pem") };
        fs::write(&files.certificate, CERTIFICATE).unwrap();
        fs::write(&files.key, KEY).unwrap();
        #[cfg(unix)]
        fs::set_permissions(&files.key, std::os::unix::fs::PermissionsExt::from_mode(0o600)).unwrap();
        files
    }

    #[tokio::test]
    async fn whoever_trusts_the_certificate_is_served_and_whoever_speaks_in_clear_is_not() {
        let folder = Folder::new("tls");
        let tls = Tls::open(&files(&folder)).unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let server = tokio::spawn(async move {
            let mut served = Vec::new();
            for _ in 0..2 {
                let stream = listener.accept().await.unwrap().0;
                served.push(tls.accept(stream).await.is_some());
            }
            served
        });
        let mut roots = RootCertStore::empty();
        roots.add(CertificateDer::from_pem_slice(CERTIFICATE.as_bytes()).unwrap()).unwrap();
        let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_safe_default_protocol_versions()
            .unwrap()
            .with_root_certificates(roots)
            .with_no_client_auth();
        let stream = TcpStream::connect(address).await.unwrap();
        let connector = TlsConnector::from(Arc::new(config));
        connector.connect("localhost".try_into().unwrap(), stream).await.unwrap();
        let mut clear = TcpStream::connect(address).await.unwrap();
        tokio::io::AsyncWriteExt::write_all(&mut clear, b"GET / HTTP/1.1\r\n\r\n").await.unwrap();
        let mut answer = Vec::new();
        let _ = clear.read_to_end(&mut answer).await;
        assert!(!answer.starts_with(b"HTTP"), "{answer:?}");
        assert_eq!(server.await.unwrap(), [true, false]);
    }

    #[cfg(unix)]
    #[test]
    fn a_key_that_everybody_can_read_or_that_is_another_certificates_is_refused() {
        let folder = Folder::new("open-key");
        let files = files(&folder);
        fs::set_permissions(&files.key, std::os::unix::fs::PermissionsExt::from_mode(0o644)).unwrap();
        let refused = |files: &TlsFiles| Tls::open(files).err().unwrap();
        assert!(refused(&files).contains("everybody can read it"));
        for (certificate, key) in [(CERTIFICATE, "no key"), ("no certificate", KEY)] {
            fs::set_permissions(&files.key, std::os::unix::fs::PermissionsExt::from_mode(0o600)).unwrap();
            fs::write(&files.certificate, certificate).unwrap();
            fs::write(&files.key, key).unwrap();
            assert!(refused(&files).contains(".pem: "), "{}", refused(&files));
        }
    }
}
