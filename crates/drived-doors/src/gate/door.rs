//! What holds for one door, and who stands at the far end of it.

use std::net::IpAddr;

use axum::http::{HeaderMap, Version, header};

use crate::{host::Hosts, network::Network};
use drived_config::rights::{Caller, Rights};

/// What holds for one door.
#[derive(Debug, Clone)]
pub(in super::super) struct Door {
    pub(in super::super) hosts: Hosts,
    /// What is given to those who bring no token.
    pub(in super::super) freely: Rights,
    /// The same, where a proxy stands between.
    pub(in super::super) through_a_proxy: Rights,
    /// Those who say truly for whom they ask.
    pub(in super::super) proxies: Vec<Network>,
    pub(in super::super) encrypted: bool,
}

/// What a proxy adds to what it passes on.
const OF_PROXIES: [&str; 10] = [
    "forwarded",
    "x-forwarded-for",
    "x-forwarded-host",
    "x-forwarded-port",
    "x-forwarded-proto",
    "x-forwarded-server",
    "x-real-ip",
    "via",
    "cf-connecting-ip",
    "true-client-ip",
];

impl Door {
    /// Who asks, and whether through a proxy. Of one that is not named nothing is believed but that it is one.
    pub(super) fn whose(&self, peer: Peer, version: Version, headers: &HeaderMap) -> (Peer, bool) {
        let Peer::Address(address) = peer else { return (peer, false) };
        let is_named = |address: IpAddr| self.proxies.iter().any(|network| network.has(address));
        if !is_named(address) {
            // No browser and none of ours speaks the older one; proxies do where they are not told otherwise.
            let proxied =
                version == Version::HTTP_10 || OF_PROXIES.into_iter().any(|name| headers.contains_key(name));
            return (peer, proxied);
        }
        // Each proxy adds whom it heard behind what it was told: the last that is none of ours is believed.
        let all = headers.get_all("x-forwarded-for").iter().filter_map(|said| said.to_str().ok());
        let said: Vec<IpAddr> =
            all.flat_map(|said| said.split(',')).map_while(|one| one.trim().parse().ok()).collect();
        let of_them =
            said.into_iter().rev().map(|one: IpAddr| one.to_canonical()).find(|one| !is_named(*one));
        (Peer::Address(of_them.unwrap_or(address)), true)
    }
}

/// The far end of a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Peer {
    Address(IpAddr),
    /// A user of this machine on the socket.
    User(Option<u32>),
}

impl Peer {
    pub(in super::super) const fn address(self) -> Option<IpAddr> {
        match self {
            Self::Address(address) => Some(address),
            Self::User(_) => None,
        }
    }
}

/// Whoever brings no token.
pub(super) fn freely(door: &Door, peer: Peer, proxied: bool, headers: &HeaderMap) -> Caller {
    let browser = headers.contains_key("sec-fetch-site") || headers.contains_key(header::COOKIE);
    let (name, origin) = match peer {
        Peer::Address(address) => {
            ("anonymous", format!("{} {}", if browser { "page" } else { "http" }, address.to_canonical()))
        }
        Peer::User(Some(uid)) => ("local", format!("socket uid {uid}")),
        Peer::User(None) => ("local", "socket".to_owned()),
    };
    Caller::new(name, origin, if proxied { door.through_a_proxy } else { door.freely })
}
