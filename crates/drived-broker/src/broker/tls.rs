//! TLS to a broker. Its certificate is always verified: there is no switch for that.

use std::{path::Path, sync::Arc};

use tokio_rustls::rustls::{
    ClientConfig, RootCertStore,
    crypto::ring,
    pki_types::{CertificateDer, pem::PemObject as _},
};

use drived_doors::config::TlsFiles;

/// Whom to believe, and who we are.
#[derive(Clone)]
pub struct Secured(pub(super) Arc<ClientConfig>);

impl Secured {
    /// Reads the files.
    ///
    /// # Arguments
    /// * `authorities`: the certificates, in PEM, of those who vouch for the broker; `None`: those of the system.
    /// * `client`: certificate and key by which the broker knows us.
    ///
    /// # Errors
    /// One of them is missing, is none, or is a key that everybody can read.
    pub fn open(authorities: Option<&Path>, client: Option<&TlsFiles>) -> Result<Self, String> {
        let mut roots = RootCertStore::empty();
        match authorities {
            Some(file) => {
                let of = |error: &dyn std::fmt::Display| format!("{}: {error}", file.display());
                for certificate in CertificateDer::pem_file_iter(file).map_err(|error| of(&error))? {
                    let certificate = certificate.map_err(|error| of(&error))?;
                    roots.add(certificate).map_err(|error| of(&error))?;
                }
                if roots.is_empty() {
                    return Err(of(&"there is no certificate in it: expected PEM"));
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
        let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_safe_default_protocol_versions()
            .map_err(|error| error.to_string())?
            .with_root_certificates(roots);
        let config = match client {
            None => config.with_no_client_auth(),
            Some(files) => {
                let (chain, key) = drived_doors::identity(files)?;
                let of = |error| format!("{}: {error}", files.certificate.display());
                config.with_client_auth_cert(chain, key).map_err(of)?
            }
        };
        Ok(Self(Arc::new(config)))
    }
}
