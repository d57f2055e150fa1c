//! What a table of the file takes, each key declared once: what it means, its default, how it is read, what it sets, and what
//! it comes to. The form that is read, the checks of single keys, the answers of `drived check`, the manual's page and the
//! manual's table follow from the declaration.

use std::{fmt, ops::Range, ops::RangeInclusive};

use super::{ConfigError, DrivePart, place::Source};

/// A key of a table.
#[derive(Debug)]
pub struct Key {
    /// As the documents write it.
    pub name: &'static str,
    /// What it means, in lines of Markdown.
    pub meaning: &'static [&'static str],
    /// What holds without it.
    pub default: &'static str,
    /// Whether something is done to a drive by it, so that it needs one under control.
    pub acts: bool,
    /// What it comes to for a drive.
    pub tells: &'static [Tells],
}

/// What a key comes to for a drive, which has a say of its own; `None`: nothing.
#[derive(Debug)]
pub struct Tells {
    pub label: &'static str,
    pub text: fn(&DrivePart) -> Option<String>,
}

impl Key {
    /// A table of the file: its head as documents write it, what it is for, and what holds without it.
    pub const fn of_table(
        name: &'static str,
        meaning: &'static [&'static str],
        default: &'static str,
    ) -> Self {
        Self { name, meaning, default, acts: false, tells: &[] }
    }

    /// What it means, in one line.
    fn meaning(&self) -> String {
        self.meaning.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" ")
    }

    /// What it means and what holds without it.
    pub fn sentence(&self) -> String {
        format!("{}. Without it: {}", self.meaning(), self.default)
    }

    /// What holds without it, in Markdown.
    pub const fn default(&self) -> &'static str {
        self.default
    }

    /// Its row in the manual of `drived`.
    pub fn row(&self) -> String {
        format!("| `{}` | {} | {} |", self.name, self.meaning(), self.default)
    }
}

/// A key that is written in the file.
pub struct Said {
    pub key: &'static str,
    pub at: Range<usize>,
    /// Whether something is done to a drive by what it says.
    pub acts: bool,
}

/// A table as it is written.
pub trait Entry {
    /// What its keys set, one after the other.
    type Draft;
    /// Every key that it takes.
    const KEYS: &'static [Key];

    /// The keys that it has.
    fn said(&self) -> Vec<Said>;

    /// Sets what it says, and leaves the rest.
    fn set(&self, source: Source<'_>, draft: &mut Self::Draft) -> Result<(), ConfigError>;

    /// Where a key is written.
    fn place(&self, key: &str) -> Option<Range<usize>> {
        self.said().into_iter().find(|said| said.key == key).map(|said| said.at)
    }
}

/// Declares a table of the file, one entry a key:
///
/// ```text
/// /// what it means, as the manual says it
/// key: TypeThatIsRead = "what holds without it",
///     acts(PATTERN), // that which is said only has a meaning for a drive under control
///     |draft, said| what_it_sets?, // where it sets something by itself
///     tells "label" |drive| what_it_comes_to; // in `drived check`
/// ```
#[macro_export]
macro_rules! settings {
    (
        $(#[doc = $about:literal])+
        $entry:ident sets $draft:ty;
        $(
            $(#[doc = $meaning:literal])+
            $key:ident $(as $shown:literal)?: $value:ty = $default:literal
            $(, acts($acts:pat))?
            $(, |$to:ident, $said:ident| $set:expr)?
            $(, tells $label:literal $text:expr)?;
        )+
    ) => {
        $(#[doc = $about])+
        #[derive(Debug, Default, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $entry {
            $($(#[doc = $meaning])+ pub $key: Option<toml::Spanned<$value>>,)+
        }

        impl $crate::config::Entry for $entry {
            type Draft = $draft;

            const KEYS: &'static [$crate::config::Key] = &[$($crate::config::Key {
                name: $crate::config::shown(&[$($shown,)? stringify!($key)]),
                meaning: &[$($meaning),+],
                default: $default,
                acts: !<[&str]>::is_empty(&[$(stringify!($acts))?]),
                tells: &[$($crate::config::Tells { label: $label, text: $text })?],
            }),+];

            fn said(&self) -> Vec<$crate::config::Said> {
                let keys = [$(self.$key.as_ref().map(|said| $crate::config::Said {
                    key: stringify!($key),
                    at: said.span(),
                    acts: [$(matches!(said.get_ref(), $acts))?].contains(&true),
                })),+];
                keys.into_iter().flatten().collect()
            }

            fn set(
                &self,
                source: $crate::config::Source<'_>,
                draft: &mut $draft,
            ) -> Result<(), $crate::config::ConfigError> {
                $($(
                    if let Some(said) = &self.$key {
                        let set: fn(&mut $draft, &$value) -> Result<(), String> = |$to, $said| {
                            $set;
                            Ok(())
                        };
                        set(draft, said.get_ref()).map_err(|problem| source.error(said.span(), problem))?;
                    }
                )?)+
                Ok(())
            }
        }
    };
}

pub use settings;

/// The name that a key has in documents, or else in the file.
pub const fn shown(names: &[&'static str]) -> &'static str {
    match names {
        [shown, ..] => shown,
        [] => "",
    }
}

/// A value within its range; else the error says which that is, and `why`.
pub fn within<T: Copy + PartialOrd + fmt::Debug>(
    value: T,
    range: RangeInclusive<T>,
    why: &str,
) -> Result<T, String> {
    match range.contains(&value) {
        true => Ok(value),
        false => Err(format!("{value:?}: expected {:?} to {:?}{why}", range.start(), range.end())),
    }
}
