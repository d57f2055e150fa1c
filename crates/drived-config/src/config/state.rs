//! Where it is kept what has to outlive the daemon: one folder, decided here for all of it.

use std::{
    ffi::OsString,
    path::{Path, PathBuf, absolute},
};

use super::place::Source;
use crate::kept::sha256;

/// What each watchdog was before it was armed.
const WATCHDOGS: &str = "watchdogs.json";
/// The number that joins deaths to births.
const BD_SEQ: &str = "sparkplug-bd-seq";
const TOKENS: &str = "tokens";
const AUDIT: &str = "audit";

/// The files that are kept. One that the configuration names stands where it says, beside the configuration unless its path
/// is whole; the others stand in one folder.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct State {
    /// The folder; `None`: nobody has said one, and this user has none.
    pub folder: Option<PathBuf>,
    /// Whether somebody has said where tokens are kept, so that others than this machine may be let in by them.
    pub has_tokens: bool,
    /// What each watchdog was before it was armed; `None`: nothing keeps it.
    pub watchdogs: Option<PathBuf>,
    /// Who may come in.
    pub tokens: Option<PathBuf>,
    /// Who did what. Only in a folder that somebody has said it is kept without being named: a disk that fails would hold up the
    /// commands of somebody who has never asked for it.
    pub audit: Option<PathBuf>,
}

/// What the file says of it.
#[derive(Debug, Clone, Default)]
pub struct Said {
    pub state: Option<PathBuf>,
    pub watchdogs: Option<PathBuf>,
    pub tokens: Option<PathBuf>,
    pub audit: Option<PathBuf>,
}

/// What the environment says of it.
#[derive(Debug, Clone, Default)]
pub struct Environment {
    state_directory: Option<OsString>,
    xdg_state_home: Option<OsString>,
    home: Option<OsString>,
}

impl Environment {
    pub fn of_process() -> Self {
        let [state_directory, xdg_state_home, home] =
            ["STATE_DIRECTORY", "XDG_STATE_HOME", "HOME"].map(std::env::var_os);
        Self { state_directory, xdg_state_home, home }
    }

    /// The folder that systemd keeps for a service.
    fn of_service(&self) -> Option<PathBuf> {
        let folders = self.state_directory.as_ref()?;
        std::env::split_paths(folders).next().filter(|folder| folder.is_absolute())
    }

    /// The folder of this user for this configuration: those of another plant have the same names.
    fn of_user(&self, configuration: &Path) -> Option<PathBuf> {
        let whole = |folder: &Option<OsString>| {
            folder.as_ref().map(PathBuf::from).filter(|folder| folder.is_absolute())
        };
        let states = whole(&self.xdg_state_home)
            .or_else(|| whole(&self.home).map(|home| home.join(".local").join("state")))?;
        let configuration = absolute(configuration).ok()?;
        let hash = sha256(configuration.as_os_str().as_encoded_bytes());
        let mut name = configuration.file_stem().unwrap_or_default().to_owned();
        name.push("-");
        name.push(hash.get(..8).unwrap_or_default());
        Some(states.join("drived").join(name))
    }
}

impl State {
    pub fn of(source: Source<'_>, said: &Said, environment: &Environment) -> Self {
        let beside = |path: &PathBuf| source.file.parent().unwrap_or(Path::new("")).join(path);
        let of_service = said.state.as_ref().map(beside).or_else(|| environment.of_service());
        let is_said = of_service.is_some();
        let folder = of_service.or_else(|| environment.of_user(source.file));
        let file = |said: &Option<PathBuf>, name: &str| {
            said.as_ref().map(beside).or_else(|| folder.as_ref().map(|folder| folder.join(name)))
        };
        Self {
            watchdogs: file(&said.watchdogs, WATCHDOGS),
            tokens: file(&said.tokens, TOKENS),
            audit: if is_said { file(&said.audit, AUDIT) } else { said.audit.as_ref().map(beside) },
            has_tokens: is_said || said.tokens.is_some(),
            folder,
        }
    }

    /// The file of the number that joins deaths to births.
    pub fn bd_seq(&self, source: Source<'_>, said: Option<&Path>) -> Option<PathBuf> {
        match said {
            Some(said) => Some(source.file.parent().unwrap_or(Path::new("")).join(said)),
            None => self.folder.as_ref().map(|folder| folder.join(BD_SEQ)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(said: &Said, environment: &Environment) -> State {
        State::of(source(), said, environment)
    }

    fn source() -> Source<'static> {
        Source { file: Path::new("/etc/drived/drives.toml"), text: "" }
    }

    fn environment(
        state_directory: Option<&str>,
        xdg_state_home: Option<&str>,
        home: Option<&str>,
    ) -> Environment {
        let [state_directory, xdg_state_home, home] =
            [state_directory, xdg_state_home, home].map(|text| text.map(OsString::from));
        Environment { state_directory, xdg_state_home, home }
    }

    #[test]
    fn one_folder_is_decided_for_all_that_is_kept() {
        let all = environment(Some("/var/lib/drived:/other"), Some("/home/me/states"), Some("/home/me"));
        let said = Said { state: Some("kept".into()), ..Said::default() };
        let state = of(&said, &all);
        assert_eq!(state.tokens.as_deref(), Some(Path::new("/etc/drived/kept/tokens")));
        let state = of(&Said::default(), &all);
        assert_eq!(state.watchdogs.as_deref(), Some(Path::new("/var/lib/drived/watchdogs.json")));
        assert_eq!(state.tokens.as_deref(), Some(Path::new("/var/lib/drived/tokens")));
        assert_eq!(state.audit.as_deref(), Some(Path::new("/var/lib/drived/audit")));
        assert_eq!(
            state.bd_seq(source(), None).as_deref(),
            Some(Path::new("/var/lib/drived/sparkplug-bd-seq"))
        );
        // printf %s /etc/drived/drives.toml | sha256sum
        for (own, folder) in [
            (
                environment(None, Some("/home/me/states"), Some("/home/me")),
                "/home/me/states/drived/drives-633ce40a",
            ),
            (
                environment(Some("relative"), Some("relative"), Some("/home/me")),
                "/home/me/.local/state/drived/drives-633ce40a",
            ),
        ] {
            let state = of(&Said::default(), &own);
            assert_eq!(state.tokens, Some(Path::new(folder).join("tokens")));
            assert_eq!(state.audit, None, "nobody has asked for it");
        }
        let state = of(&Said::default(), &Environment::default());
        assert_eq!((state.folder, state.tokens, state.watchdogs), (None, None, None));
    }

    #[test]
    fn a_file_that_is_named_stands_where_it_did() {
        let path = Path::new;
        let said = Said {
            state: None,
            watchdogs: Some("/kept/watchdogs".into()),
            tokens: Some("tokens".into()),
            audit: Some("../log/audit".into()),
        };
        let state = of(&said, &Environment::default());
        assert_eq!(state.watchdogs.as_deref(), Some(path("/kept/watchdogs")));
        assert_eq!(state.tokens.as_deref(), Some(path("/etc/drived/tokens")));
        assert_eq!(state.audit.as_deref(), Some(path("/etc/drived/../log/audit")));
        assert_eq!(state.bd_seq(source(), Some(path("bd-seq"))).as_deref(), Some(path("/etc/drived/bd-seq")));
    }
}
