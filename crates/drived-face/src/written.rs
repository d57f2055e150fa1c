//! The table of a face as it is written.

use std::ops::Range;

use serde::Deserialize;
use toml::{
    Spanned,
    de::{DeValue, ValueDeserializer},
};

use crate::{ConfigError, Source};

/// A table of the file that is a face's.
pub struct Written<'a> {
    source: Source<'a>,
    value: Spanned<DeValue<'a>>,
}

impl<'a> Written<'a> {
    /// What stands in this file.
    #[must_use]
    pub const fn new(source: Source<'a>, value: Spanned<DeValue<'a>>) -> Self {
        Self { source, value }
    }

    /// The file, for finding places in it.
    #[must_use]
    pub const fn source(&self) -> Source<'a> {
        self.source
    }

    /// Where it stands.
    #[must_use]
    pub fn span(&self) -> Range<usize> {
        self.value.span()
    }

    /// Reads it as this type, with keys that are none of it refused where the type says so (`serde(deny_unknown_fields)`).
    ///
    /// # Errors
    /// It is none, with the place where.
    pub fn read<T: Deserialize<'a>>(self) -> Result<T, ConfigError> {
        let (source, whole) = (self.source, self.value.span());
        T::deserialize(ValueDeserializer::from(self.value))
            .map_err(|error| source.error(error.span().unwrap_or(whole), error.message()))
    }
}
