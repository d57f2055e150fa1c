//! TLS: certificate and key from files. What is missing or cannot be read is an error, never a reason to go on in clear.

use std::{
    path::Path,
    sync::{Arc, PoisonError, RwLock},
    time::Duration,
};

use tokio::net::TcpStream;
use tokio_rustls::{
    TlsAcceptor,
    rustls::{
        CertificateError, Error, RootCertStore, ServerConfig,
        client::verify_server_cert_signed_by_trust_anchor,
        crypto::ring,
        pki_types::{CertificateDer, PrivateKeyDer, UnixTime, pem::PemObject as _},
        server::ParsedCertificate,
    },
    server::TlsStream,
};

use super::{
    config::TlsFiles,
    secret::{of, private},
};

/// How long the two sides may take to agree.
const AGREED_WITHIN: Duration = Duration::from_secs(5);

/// The certificate of the server, which another may take the place of while it serves. Cheap to clone.
#[derive(Clone)]
pub struct Tls(Arc<RwLock<Pair>>);

/// A certificate and its key that fit.
pub struct Pair {
    files: TlsFiles,
    chain: Vec<CertificateDer<'static>>,
    key: PrivateKeyDer<'static>,
    acceptor: TlsAcceptor,
}

impl Pair {
    fn read(files: &TlsFiles) -> Result<Self, String> {
        let (chain, key) = identity(files)?;
        let config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_safe_default_protocol_versions()
            .map_err(|error| error.to_string())?
            .with_no_client_auth()
            .with_single_cert(chain.clone(), key.clone_key())
            .map_err(|error| of(&files.certificate, &error))?;
        Ok(Self { files: files.clone(), chain, key, acceptor: TlsAcceptor::from(Arc::new(config)) })
    }
}

impl Tls {
    /// Reads certificate and key.
    ///
    /// # Errors
    ///
    /// One of them is missing, is none, can be read by everybody, or they do not belong together.
    pub(super) fn open(files: &TlsFiles) -> Result<Self, String> {
        Ok(Self(Arc::new(RwLock::new(Pair::read(files)?))))
    }

    /// What stands in these files, or in those of before, where that is another pair than the one that is served.
    ///
    /// # Errors
    ///
    /// As of a start: the pair that is served goes on.
    pub fn another(&self, files: Option<&TlsFiles>) -> Result<Option<Pair>, String> {
        let before = self.0.read().unwrap_or_else(PoisonError::into_inner);
        let pair = Pair::read(files.unwrap_or(&before.files))?;
        let is_same = (&pair.chain, &pair.key) == (&before.chain, &before.key);
        Ok((!is_same).then_some(pair))
    }

    /// Whoever connects from now on is served by this one.
    pub fn take(&self, pair: Pair) {
        *self.0.write().unwrap_or_else(PoisonError::into_inner) = pair;
    }

    /// What is to be said of the end of the certificate that is served.
    pub fn doubt(&self) -> Option<String> {
        let pair = self.0.read().unwrap_or_else(PoisonError::into_inner);
        ending(&pair.files.certificate, pair.chain.first()?, UnixTime::now())
    }

    /// Agrees with the far end, if it does in time.
    pub(super) async fn accept(&self, stream: TcpStream) -> Option<TlsStream<TcpStream>> {
        let acceptor = self.0.read().unwrap_or_else(PoisonError::into_inner).acceptor.clone();
        tokio::time::timeout(AGREED_WITHIN, acceptor.accept(stream)).await.ok()?.ok()
    }
}

/// So long before its end a certificate is to be renewed: whoever does it by himself has tried for weeks then.
const RENEWED_BEFORE: u64 = 14;
/// Behind the end of every certificate (RFC 5280 §4.1.2.5 ends with the year 9999).
const NEVER: Duration = Duration::from_secs(300_000_000_000);
const DAY: u64 = 86_400;

/// What is to be said of the end of the certificate in a file.
pub fn certificate_doubt(files: &TlsFiles) -> Option<String> {
    let certificate = CertificateDer::from_pem_file(&files.certificate).ok()?;
    ending(&files.certificate, &certificate, UnixTime::now())
}

/// That it ends within 14 days, or has ended.
fn ending(file: &Path, certificate: &CertificateDer<'_>, now: UnixTime) -> Option<String> {
    let (end, now) = (ends(certificate)?, now.as_secs());
    let days = |seconds: u64| match seconds / DAY {
        0 => "less than a day".to_owned(),
        1 => "1 day".to_owned(),
        days => format!("{days} days"),
    };
    let file = file.display();
    match end.checked_sub(now) {
        None => Some(format!(
            "the certificate {file} has ended, {} ago: no browser comes in any more",
            days(now - end)
        )),
        Some(left) if left / DAY < RENEWED_BEFORE => {
            Some(format!("the certificate {file} ends in {}: no browser comes in then", days(left)))
        }
        Some(_) => None,
    }
}

/// When a certificate ends, in seconds since 1970, as whoever verifies it says at a time behind every end: that is looked at before who vouches
/// for it. `None`: it says no end that can be read.
fn ends(certificate: &CertificateDer<'_>) -> Option<u64> {
    let parsed = ParsedCertificate::try_from(certificate).ok()?;
    let algorithms = ring::default_provider().signature_verification_algorithms.all;
    let never = UnixTime::since_unix_epoch(NEVER);
    let verified =
        verify_server_cert_signed_by_trust_anchor(&parsed, &RootCertStore::empty(), &[], never, algorithms);
    match verified {
        Err(Error::InvalidCertificate(CertificateError::ExpiredContext { not_after, .. })) => {
            Some(not_after.as_secs())
        }
        _ => None,
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

    /// Another certificate for localhost, for these days alone, with its key.
    fn made(folder: &Folder, days: i64) -> Option<(Vec<u8>, Vec<u8>)> {
        let (certificate, key) = (folder.file("made.pem"), folder.file("made-key.pem"));
        let made = std::process::Command::new("openssl")
            .args(["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=localhost", "-days"])
            .args([&days.to_string(), "-keyout"])
            .arg(&key)
            .arg("-out")
            .arg(&certificate)
            .output();
        made.ok().filter(|made| made.status.success())?;
        Some((fs::read(certificate).unwrap(), fs::read(key).unwrap()))
    }

    #[test]
    fn a_pair_that_has_changed_in_its_files_is_taken_and_one_that_does_not_fit_is_refused() {
        let folder = Folder::new("tls-renewed");
        let files = files(&folder);
        let tls = Tls::open(&files).unwrap();
        assert!(tls.another(None).unwrap().is_none(), "nothing has changed");
        let Some((certificate, key)) = made(&folder, 5) else { return };
        fs::write(&files.certificate, &certificate).unwrap();
        assert!(tls.another(None).is_err(), "its key is another one's");
        fs::write(&files.key, &key).unwrap();
        let pair = tls.another(None).unwrap().expect("it has changed");
        assert_eq!(tls.doubt(), None, "the old one goes on");
        tls.take(pair);
        let doubt = tls.doubt().expect("it ends soon");
        assert!(doubt.contains("ends in 4 days") || doubt.contains("ends in 5 days"), "{doubt}");
        assert_eq!(certificate_doubt(&files), Some(doubt));
        assert!(tls.another(Some(&files)).unwrap().is_none());
    }

    #[test]
    fn a_certificate_that_ends_within_14_days_or_has_ended_is_told() {
        let certificate = CertificateDer::from_pem_slice(CERTIFICATE.as_bytes()).unwrap();
        // As openssl says: Oct 29 00:02:55 2126 GMT.
        let end = 4_948_905_775;
        assert_eq!(ends(&certificate), Some(end));
        let told = |now| {
            let now = UnixTime::since_unix_epoch(Duration::from_secs(now));
            ending(Path::new("c.pem"), &certificate, now)
        };
        assert_eq!(told(end - RENEWED_BEFORE * DAY), None);
        let text = "the certificate c.pem ends in 13 days: no browser comes in then";
        assert_eq!(told(end - RENEWED_BEFORE * DAY + 1).as_deref(), Some(text));
        assert!(told(end).unwrap().contains("in less than a day"));
        let text = "the certificate c.pem has ended, 1 day ago: no browser comes in any more";
        assert_eq!(told(end + DAY).as_deref(), Some(text));
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
