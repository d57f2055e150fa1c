//! `[http]`: where the page and the API are served.

use serde::Deserialize;

use super::values::Parsed;
use crate::doors::Http;

/// The section as it is written.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HttpEntry {
    /// An address and a port, or `off`.
    pub(super) listen: Option<Parsed<Http>>,
}
