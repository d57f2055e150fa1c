//! The writing half: what the daemon tells is [taken](inbox) without waiting, [gathered](archive) in memory, and written by one thread.

pub mod age;
pub mod archive;
mod captures;
mod changes;
pub mod frames;
pub mod inbox;
mod limits;
mod packs;
pub mod tidy;
pub mod writer;

pub use self::limits::Limits;
