//! Who has logged in at the page: a cookie names a session, which ends by itself, and never a token. Cookies are no
//! secret among the programs of one host.

use std::{
    collections::BTreeMap,
    path::Path,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use axum::http::{HeaderMap, header};
use drived_words::json::{milliseconds, unix};
use tokio::{runtime::Handle, time::Instant};

use drived_config::kept::{Kept, Readers, sha256};

/// The name of the cookie.
const COOKIE: &str = "drived_session";
/// A shift and a bit.
const LASTS: Duration = Duration::from_secs(12 * 60 * 60);
/// Sessions at once; of more, the one that ends first is ended.
const SESSIONS: usize = 256;
/// The file of the state folder.
const FILE: &str = "sessions.json";

/// The sessions by the hash of their secret, each with the hash of its token. A restart of the program ends none: they are kept in the
/// state folder, as hashes alone, and end by the wall's clock there. The time is an argument.
#[derive(Debug, Clone, Default)]
pub(super) struct Sessions(Arc<Inner>);

#[derive(Debug, Default)]
struct Inner {
    open: Mutex<BTreeMap<String, (String, Instant)>>,
    file: Option<Kept>,
    /// Held by whoever writes the file, so that what is newer is written later.
    writing: Mutex<()>,
}

impl Sessions {
    /// Those that this state folder keeps; without one they live as long as the program.
    pub(super) fn in_folder(folder: Option<&Path>, now: Instant) -> Self {
        let file = folder.map(|folder| Kept::at(&folder.join(FILE)));
        let known = file.as_ref().map(read).unwrap_or_default();
        let ends = |at: u64| Duration::from_millis(at.saturating_sub(unix(now))).min(LASTS);
        let open = known.into_iter().map(|(secret, (token, at))| (secret, (token, now + ends(at))));
        let open = open.filter(|(_, (_, ends))| *ends > now).take(SESSIONS).collect();
        Self(Arc::new(Inner { open: Mutex::new(open), file, writing: Mutex::default() }))
    }

    pub(super) fn begin(&self, secret: &str, token: &str, now: Instant) {
        let mut open = lock(&self.0.open);
        open.retain(|_, (_, ends)| *ends > now);
        if open.len() >= SESSIONS
            && let Some(first) = open.iter().min_by_key(|(_, (_, ends))| *ends).map(|(key, _)| key.clone())
        {
            open.remove(&first);
        }
        open.insert(sha256(secret.as_bytes()), (token.to_owned(), now + LASTS));
        drop(open);
        self.keep();
    }

    /// The hash of the token that a session was begun with.
    pub(super) fn token(&self, secret: &str, now: Instant) -> Option<String> {
        let open = lock(&self.0.open);
        let (token, ends) = open.get(&sha256(secret.as_bytes()))?;
        (*ends > now).then(|| token.clone())
    }

    /// Ends a session; gives whether there was one.
    pub(super) fn end(&self, secret: &str) -> bool {
        let was = lock(&self.0.open).remove(&sha256(secret.as_bytes())).is_some();
        if was {
            self.keep();
        }
        was
    }

    /// Has them written, and waits for no disk: a stop looks for its session meanwhile.
    fn keep(&self) {
        if let (Some(_), Ok(runtime)) = (&self.0.file, Handle::try_current()) {
            let sessions = self.clone();
            drop(runtime.spawn_blocking(move || sessions.write()));
        }
    }

    fn write(&self) {
        let Some(file) = &self.0.file else { return };
        let _writing = lock(&self.0.writing);
        let now = Instant::now();
        let at = |ends: Instant| unix(now) + milliseconds(ends.saturating_duration_since(now));
        let known: BTreeMap<String, (String, u64)> = lock(&self.0.open)
            .iter()
            .map(|(secret, (token, ends))| (secret.clone(), (token.clone(), at(*ends))))
            .collect();
        let written = serde_json::to_vec(&known).map_err(Into::into);
        if let Err(error) = written.and_then(|content| file.replace(&content, Readers::Owner)) {
            // Who has logged out does not come back by what stood there before.
            let _ = std::fs::remove_file(file.path());
            tracing::warn!("{}: {error}: a restart ends all sessions", file.path().display());
        }
    }
}

fn read(file: &Kept) -> BTreeMap<String, (String, u64)> {
    let content = file.read().map(|content| content.map(|(content, _)| content));
    let known = content.and_then(|content| match content {
        Some(content) => serde_json::from_slice(&content).map_err(Into::into),
        None => Ok(BTreeMap::new()),
    });
    known.unwrap_or_else(|error: std::io::Error| {
        tracing::warn!("{}: {error}: everybody logs in again", file.path().display());
        BTreeMap::new()
    })
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
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
    use drived_config::testing::Folder;

    #[test]
    fn a_session_ends_by_itself_and_when_it_is_ended() {
        let (start, sessions) = (Instant::now(), Sessions::default());
        sessions.begin("one", "panel", start);
        sessions.begin("two", "boss", start);
        sessions.end("two");
        assert_eq!(sessions.token("one", start), Some("panel".to_owned()));
        assert_eq!(sessions.token("two", start), None);
        assert_eq!(sessions.token("one", start + LASTS), None);
        for number in 0..1_000 {
            sessions.begin(&number.to_string(), "panel", start);
        }
        assert_eq!(lock(&sessions.0.open).len(), SESSIONS);
    }

    #[test]
    fn a_session_outlives_the_program_by_its_hash_alone_and_no_longer_than_it_lasts() {
        let folder = Folder::new("sessions");
        let path = folder.file("");
        let now = Instant::now();
        let sessions = Sessions::in_folder(Some(&path), now);
        sessions.begin("drv_secret", "hash of anna's", now);
        sessions.begin("drv_other", "hash of bob's", now);
        sessions.end("drv_other");
        sessions.write();
        let written = std::fs::read_to_string(folder.file(FILE)).unwrap();
        assert!(!written.contains("drv_"), "{written}");
        let again = Sessions::in_folder(Some(&path), now);
        assert_eq!(again.token("drv_secret", now), Some("hash of anna's".to_owned()));
        assert_eq!(again.token("drv_other", now), None);
        assert_eq!(again.token("drv_secret", now + LASTS), None);
        // What nobody can read, or claims to last longer, lets nobody in for longer.
        let forged = format!("{{\"{}\": [\"hash\", {}]}}", sha256(b"drv_long"), u64::MAX);
        std::fs::write(folder.file(FILE), forged).unwrap();
        let forged = Sessions::in_folder(Some(&path), now);
        assert_eq!(forged.token("drv_long", now + LASTS), None);
        std::fs::write(folder.file(FILE), "{").unwrap();
        assert_eq!(Sessions::in_folder(Some(&path), now).token("drv_long", now), None);
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
