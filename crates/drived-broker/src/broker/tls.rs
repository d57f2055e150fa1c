//! TLS to a broker. Its certificate is always verified: there is no switch for that.

use std::{path::Path, sync::Arc};

use tokio_rustls::rustls::{ClientConfig, crypto::ring};

use drived_doors::{believed, config::TlsFiles};

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
        let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_safe_default_protocol_versions()
            .map_err(|error| error.to_string())?
            .with_root_certificates(believed(authorities)?);
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
