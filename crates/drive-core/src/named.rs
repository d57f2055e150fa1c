//! Enums whose variants have names: how they are printed, and how they are read.

/// A word of a manual. Derived code that reads it must not take its lifetime for that of what is read, which it does where
/// it sees the reference.
pub(crate) type Word = &'static str;

/// A text that is none of the names that were expected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("expected one of {}", .0.join(", "))]
pub struct NameError(#[doc(hidden)] pub &'static [&'static str]);

/// Whether a text is this name, whatever its case, with spaces, hyphens or underscores between its words.
#[doc(hidden)]
#[must_use]
pub fn is_name(text: &str, name: &str) -> bool {
    let plain = |byte: u8| match byte {
        b'-' | b'_' => b' ',
        byte => byte.to_ascii_lowercase(),
    };
    text.trim().bytes().map(plain).eq(name.bytes().map(plain))
}

/// Gives an enum `ALL`, `Display` and `FromStr` by the names of its variants.
#[doc(hidden)]
#[macro_export]
macro_rules! named {
    ($type:ident { $($variant:ident => $name:literal),+ $(,)? }) => {
        #[allow(dead_code, reason = "not each is gone through")]
        impl $type {
            /// All of them, in their order.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$variant),+];
        }

        impl ::std::fmt::Display for $type {
            fn fmt(&self, f: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                f.pad(match self {
                    $(Self::$variant => $name,)+
                })
            }
        }

        /// Reads its name, whatever its case, with spaces, hyphens or underscores between its words.
        impl ::std::str::FromStr for $type {
            type Err = $crate::NameError;

            fn from_str(text: &str) -> ::std::result::Result<Self, $crate::NameError> {
                let named = [$(($name, Self::$variant)),+].into_iter().find(|(name, _)| $crate::is_name(text, name));
                named.map(|(_, value)| value).ok_or($crate::NameError(&[$($name),+]))
            }
        }
    };
}
