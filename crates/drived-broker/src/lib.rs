//! The faces of `drived` on a message broker: MQTT for everybody and for Home Assistant ([`mqtt`]), and an edge node of Sparkplug B
//! ([`sparkplug`]). Both stand on one connection to a broker ([`broker`]) and take commands at one desk ([`desk`]).

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

#[allow(dead_code, reason = "a Sparkplug node stands on the rest of it")]
pub mod broker;
pub mod desk;
mod face;
pub mod mqtt;
pub mod sparkplug;

pub use self::face::{FACE, OnBroker};
