//! The file of tokens: for each its name, its role and the SHA-256 of it, never the token.

use std::{
    fmt,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
    time::{Duration, Instant, SystemTime},
};

use drived_config::{
    config::look_alikes::are_alike,
    kept::{Kept, Readers, Stamp, digits, sha256},
    rights::{Role, Scope},
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use subtle::ConstantTimeEq as _;

/// By which a token is known as one of ours, in a file or in a log where it should not be.
const PREFIX: &str = "drv_";
const LONGEST_NAME: usize = 64;

/// For so many days.
pub const fn of_days(days: u32) -> Duration {
    Duration::from_secs(days as u64 * 86_400)
}

/// Makes a token: 256 random bits behind its prefix.
///
/// # Errors
///
/// The system gives no random numbers.
pub fn new_secret() -> Result<String, TokenError> {
    let mut bits = [0; 32];
    getrandom::fill(&mut bits).map_err(|error| TokenError::Random(error.to_string()))?;
    Ok(format!("{PREFIX}{}", digits(&bits)))
}

/// The wall's clock.
fn wall() -> Duration {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default()
}

/// Now, in seconds since 1970: whatever the wall's clock is set back to, this program has seen the latest time that it told, and what has
/// passed since.
fn now() -> u64 {
    static SEEN: Mutex<Option<Seen>> = Mutex::new(None);
    let mut seen = SEEN.lock().unwrap_or_else(PoisonError::into_inner);
    let latest = Seen::behind(*seen, Instant::now(), wall());
    *seen = Some(latest);
    latest.wall.as_secs()
}

/// The latest time that was told, and when by a clock that is never set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Seen {
    at: Instant,
    wall: Duration,
}

impl Seen {
    fn behind(before: Option<Self>, at: Instant, wall: Duration) -> Self {
        let passed = before.map(|before| before.wall + at.saturating_duration_since(before.at));
        Self { at, wall: wall.max(passed.unwrap_or_default()) }
    }
}

/// One token.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Token {
    pub name: String,
    pub role: Role,
    /// Which drives it is for; every drive where it is not said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scope: Option<Scope>,
    /// In hexadecimal digits.
    pub(super) sha256: String,
    /// When it was made, in seconds since 1970.
    pub made: u64,
    /// When it ends by itself, in seconds since 1970; never where it is not said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expires: Option<u64>,
    /// The one before it, which is good for a while after it was replaced.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) before: Option<Before>,
}

/// A token that was replaced.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Before {
    sha256: String,
    /// In seconds since 1970.
    until: u64,
}

impl Token {
    /// Whether this is its hash now, or that of the one before it, compared in the same time whether it is right or wrong.
    fn is(&self, wanted: &str, now: u64) -> bool {
        let same = |hash: &str| bool::from(hash.as_bytes().ct_eq(wanted.as_bytes()));
        let before = self.before.as_ref().map(|before| same(&before.sha256) & (now < before.until));
        (same(&self.sha256) | before.unwrap_or_default()) & self.lasts(now)
    }

    /// Whether its time is not over.
    fn lasts(&self, now: u64) -> bool {
        self.expires.is_none_or(|expires| now < expires)
    }
}

/// By what somebody comes in with a code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Right {
    /// The token of this name as it was when the code was made, by its hash: another in its place is not meant.
    Known(String),
    /// The token of this name; where there is none when the code is used, one that may this for so many days.
    New(Role, u32),
}

/// A token as it is told.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct TokenView {
    pub name: String,
    pub role: Role,
    /// Which drives it is for; every drive where it is not said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scope: Option<Scope>,
    pub made_unix_s: u64,
    /// When it ends by itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expires_unix_s: Option<u64>,
}

#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Content {
    #[serde(default)]
    tokens: Vec<Token>,
}

/// What is wrong with the tokens.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TokenError {
    #[error("the system gives no random numbers: {0}")]
    Random(String),
    #[error("the tokens {file} cannot be {what}: {reason}", file = .file.display())]
    File { file: PathBuf, what: &'static str, reason: String },
    #[error("{file} can be read by others than its owner: chmod 600 {file}", file = .0.display())]
    Open(PathBuf),
    #[error("{0:?} is no name of a token: expected 1 to 64 letters, digits, - and _")]
    Name(String),
    #[error("{0} is the name of those who need no token: choose another")]
    Reserved(String),
    #[error("there is a token {0} already: drived token remove {0}")]
    Taken(String),
    #[error("{0} looks like {1}, which is a token already: choose another name")]
    Alike(String, String),
    #[error("there is no token {name:?}: there are {there}", there = .there.join(", "))]
    Unknown { name: String, there: Vec<String> },
}

/// The tokens of a file, read again when it has changed, so that a removed token ends at once.
#[derive(Debug)]
pub struct Tokens {
    kept: Kept,
    read: Mutex<Option<(Stamp, Vec<Token>)>>,
}

impl Tokens {
    /// The tokens of a file, which need not be there yet.
    ///
    /// # Errors
    ///
    /// The file cannot be read, is none of tokens, or can be read by others than its owner.
    pub fn open(file: &Path) -> Result<Self, TokenError> {
        let tokens = Self { kept: Kept::at(file), read: Mutex::new(None) };
        tokens.all()?;
        // From here on no time is told again.
        now();
        Ok(tokens)
    }

    /// Where they are kept.
    pub fn file(&self) -> &Path {
        self.kept.path()
    }

    /// All of them.
    pub fn all(&self) -> Result<Vec<Token>, TokenError> {
        let mut read = self.read.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(stamp) = self.kept.stamp().map_err(|error| self.failed("read", error))? else {
            *read = None;
            return Ok(Vec::new());
        };
        if !stamp.is_private {
            return Err(TokenError::Open(self.file().to_owned()));
        }
        if let Some((known, tokens)) = &*read
            && *known == stamp
        {
            return Ok(tokens.clone());
        }
        let (text, stamp) = match self.kept.read().map_err(|error| self.failed("read", error))? {
            Some((text, stamp)) => (text, Some(stamp)),
            None => (Vec::new(), None),
        };
        let content: Content =
            toml::from_slice(&text).map_err(|error| self.failed("understood", error.message()))?;
        *read = stamp.map(|stamp| (stamp, content.tokens.clone()));
        Ok(content.tokens)
    }

    /// All of them, as they are told.
    pub fn views(&self) -> Result<Vec<TokenView>, TokenError> {
        let view = |Token { name, role, scope, made, expires, .. }: Token| TokenView {
            name,
            role,
            scope,
            made_unix_s: made,
            expires_unix_s: expires,
        };
        Ok(self.all()?.into_iter().map(view).collect())
    }

    /// The token that this secret is, each compared in the same time whether it is right or wrong.
    pub fn find(&self, secret: &str) -> Result<Option<Token>, TokenError> {
        self.of_hash(&sha256(secret.as_bytes()))
    }

    /// The token with this hash.
    pub(super) fn of_hash(&self, wanted: &str) -> Result<Option<Token>, TokenError> {
        Ok(of_hash(self.all()?, wanted, now()))
    }

    /// The same for a stop: while the file cannot be looked at, as where the program has no descriptor left, of those that were read last. A
    /// wall's clock that was ahead for a moment takes nobody's stop away for longer than that.
    pub(super) fn of_hash_for_stop(&self, wanted: &str) -> Result<Option<Token>, TokenError> {
        let all = self.all();
        if let Err(TokenError::File { what: "read", .. }) = all
            && let Some((_, known)) = &*self.read.lock().unwrap_or_else(PoisonError::into_inner)
        {
            return Ok(of_hash(known.clone(), wanted, wall().as_secs()));
        }
        Ok(of_hash(all?, wanted, wall().as_secs()))
    }

    /// Adds a token, for so long or for ever, and gives its secret, which nobody can ever read again.
    pub fn add(
        &self,
        name: &str,
        (role, scope): (Role, Option<Scope>),
        lasts: Option<Duration>,
    ) -> Result<String, TokenError> {
        let _lock = self.kept.lock().map_err(|error| self.failed("written", error))?;
        Ok(self.add_to(self.all()?, name, (role, scope), lasts)?.1)
    }

    /// Adds a token to these, and keeps them. Gives it with its secret.
    fn add_to(
        &self,
        mut tokens: Vec<Token>,
        name: &str,
        (role, scope): (Role, Option<Scope>),
        lasts: Option<Duration>,
    ) -> Result<(Token, String), TokenError> {
        may_be_new(&tokens, name)?;
        let secret = new_secret()?;
        let (sha256, made) = (sha256(secret.as_bytes()), now());
        let expires = lasts.map(|lasts| made.saturating_add(lasts.as_secs()));
        let token = Token { name: name.to_owned(), role, scope, sha256, made, expires, before: None };
        tokens.push(token.clone());
        self.write(tokens)?;
        Ok((token, secret))
    }

    /// The right by which a code for this name lets somebody in later: by the token that there is, else by a new one of this role.
    ///
    /// # Errors
    /// It could never let anybody in: the name is none, or looks like another's, or there is no token and no role for a new one.
    pub(super) fn right_of(&self, name: &str, new: Option<(Role, u32)>) -> Result<Right, TokenError> {
        let (tokens, at) = (self.all()?, now());
        match (tokens.iter().find(|token| token.name == name && token.lasts(at)), new) {
            (Some(token), _) => Ok(Right::Known(token.sha256.clone())),
            (None, Some((role, days))) => {
                may_be_new(&without(tokens, name), name).map(|()| Right::New(role, days))
            }
            (None, None) => Err(unknown(name, &tokens)),
        }
    }

    /// The token of this name by this right, and whether it was made for it; one whose time is over is none, and makes room for its
    /// successor. Of one that is made nobody knows the secret: it is good for sessions alone.
    pub(super) fn for_session(&self, name: &str, right: &Right) -> Result<(Token, bool), TokenError> {
        let _lock = self.kept.lock().map_err(|error| self.failed("written", error))?;
        let (tokens, at) = (self.all()?, now());
        let known = tokens.iter().find(|token| token.name == name && token.lasts(at));
        match (known, right) {
            (Some(token), Right::Known(hash)) if token.sha256 == *hash => Ok((token.clone(), false)),
            (Some(token), Right::New(..)) => Ok((token.clone(), false)),
            (None, Right::New(role, days)) => {
                let lasts = Some(of_days(*days));
                self.add_to(without(tokens, name), name, (*role, None), lasts).map(|(token, _)| (token, true))
            }
            (_, Right::Known(_)) => Err(unknown(name, &tokens)),
        }
    }

    /// Gives a token of this name another secret. That which it had is good for `overlap` yet, so that whoever uses it can be
    /// told the new one without being shut out; the times that it ends by itself stays.
    pub fn rotate(&self, name: &str, overlap: Duration) -> Result<(Token, String), TokenError> {
        let _lock = self.kept.lock().map_err(|error| self.failed("written", error))?;
        let mut tokens = self.all()?;
        let Some(token) = tokens.iter_mut().find(|token| token.name == name) else {
            return Err(unknown(name, &tokens));
        };
        let secret = new_secret()?;
        let until = now().saturating_add(overlap.as_secs());
        let replaced = std::mem::replace(&mut token.sha256, sha256(secret.as_bytes()));
        token.before = Some(Before { sha256: replaced, until }).filter(|_| !overlap.is_zero());
        let token = token.clone();
        self.write(tokens)?;
        Ok((token, secret))
    }

    /// Removes a token; whoever uses it is refused from now on.
    pub fn remove(&self, name: &str) -> Result<(), TokenError> {
        let _lock = self.kept.lock().map_err(|error| self.failed("written", error))?;
        let tokens = self.all()?;
        match tokens.iter().any(|token| token.name == name) {
            true => self.write(without(tokens, name)),
            false => Err(unknown(name, &tokens)),
        }
    }

    fn write(&self, tokens: Vec<Token>) -> Result<(), TokenError> {
        let text = toml::to_string(&Content { tokens }).map_err(|error| self.failed("written", error))?;
        let written = self.kept.replace(text.as_bytes(), Readers::Owner);
        written.map_err(|error| self.failed("written", error))
    }

    fn failed(&self, what: &'static str, reason: impl fmt::Display) -> TokenError {
        TokenError::File { file: self.file().to_owned(), what, reason: reason.to_string() }
    }
}

/// Each is compared, whichever it is.
fn of_hash(tokens: Vec<Token>, wanted: &str, now: u64) -> Option<Token> {
    tokens.into_iter().fold(None, |found, token| if token.is(wanted, now) { Some(token) } else { found })
}

/// Whether a token of this name may be added to these.
fn may_be_new(tokens: &[Token], name: &str) -> Result<(), TokenError> {
    let allowed = |character: char| character.is_ascii_alphanumeric() || matches!(character, '-' | '_');
    if name.is_empty() || name.len() > LONGEST_NAME || !name.chars().all(allowed) {
        return Err(TokenError::Name(name.to_owned()));
    }
    if ["local", "anonymous"].contains(&name) {
        return Err(TokenError::Reserved(name.to_owned()));
    }
    match tokens.iter().find(|token| are_alike(&token.name, name)) {
        Some(taken) if taken.name == name => Err(TokenError::Taken(name.to_owned())),
        Some(taken) => Err(TokenError::Alike(name.to_owned(), taken.name.clone())),
        None => Ok(()),
    }
}

fn without(mut tokens: Vec<Token>, name: &str) -> Vec<Token> {
    tokens.retain(|token| token.name != name);
    tokens
}

fn unknown(name: &str, tokens: &[Token]) -> TokenError {
    let there = tokens.iter().map(|token| token.name.clone()).collect();
    TokenError::Unknown { name: name.to_owned(), there }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_token_is_found_by_its_secret_until_it_is_removed_and_the_secret_is_nowhere() {
        let folder = drived_config::testing::Folder::new("tokens");
        let tokens = Tokens::open(&folder.file("tokens")).unwrap();
        assert_eq!(tokens.find("drv_0"), Ok(None));
        let secret = tokens.add("panel-1", (Role::Operate, None), None).unwrap();
        assert!(secret.starts_with("drv_") && secret.len() == 68, "256 bits");
        let found = tokens.find(&secret).unwrap().unwrap();
        assert_eq!((found.name.as_str(), found.role), ("panel-1", Role::Operate));
        assert_eq!(tokens.find(&secret[..67]), Ok(None));
        assert_eq!(
            tokens.add("panel-1", (Role::View, None), None),
            Err(TokenError::Taken("panel-1".to_owned()))
        );
        let text = fs::read_to_string(folder.file("tokens")).unwrap();
        assert!(!text.contains(&secret[4..]), "{text}");
        // Another program removes it.
        Tokens::open(&folder.file("tokens")).unwrap().remove("panel-1").unwrap();
        assert_eq!(tokens.find(&secret), Ok(None));
    }

    #[test]
    fn a_token_ends_when_its_time_is_over_and_one_that_was_replaced_when_its_overlap_is() {
        let folder = drived_config::testing::Folder::new("lasting");
        let tokens = Tokens::open(&folder.file("tokens")).unwrap();
        let hour = Duration::from_secs(3_600);
        let first = tokens.add("scada", (Role::Operate, None), Some(hour)).unwrap();
        let (rotated, second) = tokens.rotate("scada", Duration::from_secs(60)).unwrap();
        assert_eq!(rotated.role, Role::Operate);
        let token = tokens.find(&first).unwrap().expect("it is good for a while yet");
        assert_eq!(tokens.find(&second), Ok(Some(token.clone())));
        let [first, second] = [&first, &second].map(|secret| sha256(secret.as_bytes()));
        assert!(token.is(&first, token.made + 58) && !token.is(&first, token.made + 62));
        assert!(token.is(&second, token.made + 3_599) && !token.is(&second, token.made + 3_600));
        assert!(matches!(tokens.rotate("gone", hour), Err(TokenError::Unknown { .. })));
    }

    #[test]
    fn a_time_that_was_told_is_not_told_again_by_a_clock_that_is_set_back() {
        let (begun, seconds) = (Instant::now(), Duration::from_secs);
        let look =
            |seen: Option<Seen>, after, wall| Seen::behind(seen, begun + seconds(after), seconds(wall));
        let first = look(None, 0, 10_000);
        // It ran on unseen for an hour, and was set back by two then.
        let back = look(Some(first), 3_600, 10_000 - 3_600);
        assert_eq!(back.wall, seconds(13_600));
        assert_eq!(look(Some(back), 3_601, 20_000).wall, seconds(20_000), "ahead is ahead");
        assert_eq!(look(Some(back), 3_610, 0).wall, seconds(13_610));
    }

    #[test]
    fn a_name_that_nobody_could_tell_apart_is_refused() {
        let folder = drived_config::testing::Folder::new("token-names");
        let tokens = Tokens::open(&folder.file("tokens")).unwrap();
        for name in ["", "local", "anonymous", "a b", "päuse", "line\nbreak", &"x".repeat(65)] {
            assert!(tokens.add(name, (Role::View, None), None).is_err(), "{name:?}");
        }
        tokens.add("panel-1", (Role::View, None), None).unwrap();
        for name in ["panel-l", "Panel-1"] {
            let alike = Err(TokenError::Alike(name.to_owned(), "panel-1".to_owned()));
            assert_eq!(tokens.add(name, (Role::View, None), None), alike);
        }
        assert!(matches!(tokens.remove("gone"), Err(TokenError::Unknown { .. })));
    }

    /// As the user of a service would set a trap for root, who adds a token in the folder of the service.
    #[cfg(unix)]
    #[test]
    fn no_link_in_their_folder_is_followed() {
        use std::os::unix::fs::symlink;
        let folder = drived_config::testing::Folder::new("links");
        let (file, precious) = (folder.file("tokens"), folder.file("precious"));
        fs::write(&precious, "precious").unwrap();
        for name in ["tokens.new", ".tokens.new"] {
            symlink(&precious, folder.file(name)).unwrap();
        }
        Tokens::open(&file).unwrap().add("panel", (Role::View, None), None).unwrap();
        assert_eq!(fs::read_to_string(&precious).unwrap(), "precious");
        assert!(fs::symlink_metadata(&file).unwrap().is_file());
        fs::remove_file(&file).unwrap();
        symlink(&precious, &file).unwrap();
        let told = Tokens::open(&file).unwrap_err().to_string();
        assert!(told.contains("is a link") && told.contains("precious"), "{told}");
    }

    #[cfg(unix)]
    #[test]
    fn tokens_that_others_can_read_are_refused() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = drived_config::testing::Folder::new("open-tokens");
        let file = folder.file("tokens");
        Tokens::open(&file).unwrap().add("panel", (Role::View, None), None).unwrap();
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
        fs::set_permissions(&file, fs::Permissions::from_mode(0o644)).unwrap();
        assert_eq!(Tokens::open(&file).unwrap_err(), TokenError::Open(file));
    }
}
