//! Who asks, by what he is let in, and whoever is not.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::http::{HeaderMap, StatusCode, header, request::Parts};
use tokio::time::Instant;

use super::{Gate, Peer};
use crate::{
    audit::{Kind, Record},
    authority::Authority,
    refusal::Refusal,
    sessions,
    tokens::{Token, TokenError},
};
use drived_config::{
    kept::sha256,
    rights::{Caller, Heard, Rights, Role},
};

impl Gate {
    /// Whether what somebody was let in by is so still.
    pub(in super::super) fn holds(&self, authority: &Authority) -> bool {
        let of_hash = |hash: &str, role: Role| {
            let token = self.tokens.as_ref().and_then(|tokens| tokens.of_hash(hash).ok().flatten());
            drive_fleet::mutant!("removed-token-holds", token.is_some_and(|token| token.role == role), true)
        };
        match authority {
            Authority::Freely => true,
            Authority::Token { sha256, role } => of_hash(sha256, *role),
            Authority::Session { secret, sha256, role } => {
                let is_begun = self.sessions.token(secret, Instant::now()).as_ref() == Some(sha256);
                is_begun && of_hash(sha256, *role)
            }
        }
    }

    /// For how long somebody is heard who was let in by this.
    pub(super) fn heard(self: &Arc<Self>, authority: Authority) -> Heard {
        if authority == Authority::Freely {
            return Heard::default();
        }
        let (gate, changes) = (Arc::clone(self), self.changes.subscribe());
        Heard::until(move || {
            let gate = Arc::clone(&gate);
            authority.clone().ends(move |authority| gate.holds(authority), changes.clone())
        })
    }

    /// Who asks, and by what he is let in. A token that is wrong is never taken for none.
    pub(super) fn caller(
        &self,
        without: Caller,
        peer: Peer,
        headers: &HeaderMap,
        stops: bool,
    ) -> Result<(Caller, Authority), Refusal> {
        match self.bearer(peer, headers, stops, &without) {
            // A file of tokens that cannot be read keeps nobody from a stop that needs none.
            Err(Unlet::Unreadable(_)) if stops && without.rights.stop => Ok((without, Authority::Freely)),
            Err(Unlet::Unreadable(error)) => Err(unreadable(error)),
            Err(Unlet::Refused(refusal)) => Err(refusal),
            Ok(None) => Ok((without, Authority::Freely)),
            Ok(Some((token, authority))) => Ok((of_token(&token, without), authority)),
        }
    }

    /// The token by which somebody comes, if any.
    fn bearer(
        &self,
        peer: Peer,
        headers: &HeaderMap,
        stops: bool,
        without: &Caller,
    ) -> Result<Option<(Token, Authority)>, Unlet> {
        let Some(authorization) = headers.get(header::AUTHORIZATION) else {
            // A session that is over is no wrong token: who had it is anybody again, and the page says so.
            let Some(secret) = sessions::cookie(headers) else { return Ok(None) };
            let hash = self.sessions.token(secret, Instant::now());
            let (Some(sha256), Some(tokens)) = (hash, &self.tokens) else { return Ok(None) };
            let token = if stops { tokens.of_hash_for_stop(&sha256) } else { tokens.of_hash(&sha256) }?;
            let secret = secret.to_owned();
            return Ok(token.map(|token| {
                let role = token.role;
                (token, Authority::Session { secret, sha256, role })
            }));
        };
        // Whoever has a right token stops his motors, whatever others do at the same address.
        if drive_fleet::mutant!("guessing-keeps-a-stop-out", !stops, true) {
            self.wait(peer).map_err(Unlet::Refused)?;
        }
        let secret = authorization.to_str().ok().and_then(|text| text.split_once(' '));
        let secret = secret
            .filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"))
            .map(|(_, secret)| secret.trim());
        let find = |secret: &str| match &self.tokens {
            Some(tokens) if stops => tokens.of_hash_for_stop(&sha256(secret.as_bytes())),
            _ => self.token(secret),
        };
        match secret.map(find).transpose()?.flatten() {
            Some(token) => {
                // By that which was brought: it may end before the one that has replaced it.
                let sha256 = sha256(secret.unwrap_or_default().as_bytes());
                let authority = Authority::Token { sha256, role: token.role };
                Ok(Some((token, authority)))
            }
            None => drive_fleet::mutant!(
                "wrong-token-is-none",
                Err(Unlet::Refused(self.failed(peer, without))),
                Ok(None)
            ),
        }
    }

    pub(super) fn token(&self, secret: &str) -> Result<Option<Token>, TokenError> {
        self.tokens.as_ref().map_or(Ok(None), |tokens| tokens.find(secret))
    }

    /// Whether tokens of this address are looked at.
    pub(super) fn wait(&self, peer: Peer) -> Result<(), Refusal> {
        if peer.address().is_none() {
            return Ok(());
        }
        match lock(&self.failures).wait(&peer.address(), Instant::now()) {
            None => Ok(()),
            Some(wait) => {
                let why = "too many wrong tokens from this address";
                Err(Refusal::new(StatusCode::TOO_MANY_REQUESTS, why).after(wait))
            }
        }
    }

    /// A wrong token has come. Of many only some are told.
    pub(super) fn failed(&self, peer: Peer, caller: &Caller) -> Refusal {
        if let Some(untold) = lock(&self.failures).count(&peer.address(), Instant::now()) {
            let what = and_before("a wrong token", untold);
            tracing::warn!("{what} from {}", caller.origin);
            self.audit.record_refused(Record::new(Kind::LoginFailed, caller, what));
        }
        Refusal::unauthorized("the token is wrong")
    }

    /// Somebody has asked for what he may not do. Of many only some are told.
    pub(super) fn note_refused(&self, caller: &Caller, asked: &Parts) {
        let who = format!("{} {}", caller.name, caller.origin);
        if let Some(untold) = lock(&self.refused).count(&who, Instant::now()) {
            let what = and_before(&format!("{} {}", asked.method, asked.uri.path()), untold);
            self.audit.record_refused(Record::new(Kind::Refused, caller, what));
        }
    }
}

/// What is told, and how often it has been so without being told.
fn and_before(what: &str, untold: u64) -> String {
    match untold {
        0 => what.to_owned(),
        untold => format!("{what}, and {untold} before that were not told"),
    }
}

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(super) fn unreadable(error: TokenError) -> Refusal {
    tracing::error!(%error, "no token can be looked at");
    Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "no token can be looked at: see the log of the daemon")
}

pub(super) fn of_token(token: &Token, without: Caller) -> Caller {
    let rights = token.role.rights();
    // Nobody stops less because he has said who he is.
    let stop = rights.stop || without.rights.stop;
    let rights = Rights { stop, ..rights };
    Caller { name: token.name.clone(), rights, scope: token.scope.clone(), ..without }
}

/// Why somebody is not let in.
enum Unlet {
    Refused(Refusal),
    /// Who he is cannot be looked at.
    Unreadable(TokenError),
}

impl From<TokenError> for Unlet {
    fn from(error: TokenError) -> Self {
        Self::Unreadable(error)
    }
}
