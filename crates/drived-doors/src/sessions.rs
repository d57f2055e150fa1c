//! Who has logged in at the page: a cookie names a session, which ends by itself, and never a token. Cookies are no
//! secret among the programs of one host.

use std::{collections::BTreeMap, time::Duration};

use axum::http::{HeaderMap, header};
use tokio::time::Instant;

use drived_config::kept::sha256;

/// The name of the cookie.
const COOKIE: &str = "drived_session";
/// A shift and a bit.
const LASTS: Duration = Duration::from_secs(12 * 60 * 60);
/// Sessions at once; of more, the one that ends first is ended.
const SESSIONS: usize = 256;

/// The sessions by the hash of their secret, each with the hash of its token. The time is an argument.
#[derive(Debug, Default)]
pub(super) struct Sessions(BTreeMap<String, (String, Instant)>);

impl Sessions {
    pub(super) fn begin(&mut self, secret: &str, token: &str, now: Instant) {
        self.0.retain(|_, (_, ends)| *ends > now);
        if self.0.len() >= SESSIONS
            && let Some(first) = self.0.iter().min_by_key(|(_, (_, ends))| *ends).map(|(key, _)| key.clone())
        {
            self.0.remove(&first);
        }
        self.0.insert(sha256(secret.as_bytes()), (token.to_owned(), now + LASTS));
    }

    /// The hash of the token that a session was begun with.
    pub(super) fn token(&self, secret: &str, now: Instant) -> Option<&str> {
        let (token, ends) = self.0.get(&sha256(secret.as_bytes()))?;
        (*ends > now).then_some(token)
    }

    pub(super) fn end(&mut self, secret: &str) {
        self.0.remove(&sha256(secret.as_bytes()));
    }
}

/// The cookie of a session as the browser is told it; without a secret it is taken back.
pub(super) fn set_cookie(secret: Option<&str>, encrypted: bool) -> String {
    let secure = if encrypted { "; Secure" } else { "" };
    let (value, age) = secret.map_or(("", 0), |secret| (secret, LASTS.as_secs()));
    format!("{COOKIE}={value}; HttpOnly; SameSite=Strict; Path=/; Max-Age={age}{secure}")
}

/// The cookie of a session as the browser sends it.
pub(super) fn cookie(headers: &HeaderMap) -> Option<&str> {
    let all = headers.get_all(header::COOKIE).iter().filter_map(|cookies| cookies.to_str().ok());
    let mut pairs = all.flat_map(|cookies| cookies.split(';')).filter_map(|pair| pair.trim().split_once('='));
    pairs.find_map(|(name, value)| (name == COOKIE).then_some(value)).filter(|value| !value.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_ends_by_itself_and_when_it_is_ended() {
        let (start, mut sessions) = (Instant::now(), Sessions::default());
        sessions.begin("one", "panel", start);
        sessions.begin("two", "boss", start);
        sessions.end("two");
        assert_eq!(sessions.token("one", start), Some("panel"));
        assert_eq!(sessions.token("two", start), None);
        assert_eq!(sessions.token("one", start + LASTS), None);
        for number in 0..1_000 {
            sessions.begin(&number.to_string(), "panel", start);
        }
        assert_eq!(sessions.0.len(), SESSIONS);
    }

    #[test]
    fn the_cookie_of_a_session_is_found_among_others_and_no_script_reads_it() {
        let mut headers = HeaderMap::new();
        headers.insert(header::COOKIE, "a=b; drived_session=drv_1; c=d".parse().unwrap());
        assert_eq!(cookie(&headers), Some("drv_1"));
        headers.insert(header::COOKIE, "drived_session=; xdrived_session=2".parse().unwrap());
        assert_eq!(cookie(&headers), None);
        let set = set_cookie(Some("drv_1"), true);
        for word in ["drived_session=drv_1;", "HttpOnly", "SameSite=Strict", "Secure"] {
            assert!(set.contains(word), "{set}");
        }
        assert!(set_cookie(None, false).contains("Max-Age=0"));
    }
}
