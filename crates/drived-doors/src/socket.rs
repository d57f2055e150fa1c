//! The control socket: where it is, and how it is taken from a daemon that has gone without taking nobody else's place.

use std::{
    env, fs, io,
    os::{
        fd::AsFd as _,
        unix::{
            fs::{FileTypeExt as _, PermissionsExt as _},
            net::UnixStream,
        },
    },
    path::{Path, PathBuf},
};

use tokio::net::UnixListener;

/// The name of the socket in a folder for such things.
const NAME: &str = "drived.sock";

/// Where the socket is when nobody says it: the first of these for a daemon, the first that answers for its clients.
pub fn usual_places() -> Vec<PathBuf> {
    let of = |variable| env::var_os(variable).filter(|folder| !folder.is_empty());
    // systemd gives several folders with colons between.
    let runtime = of("RUNTIME_DIRECTORY").and_then(|all| env::split_paths(&all).next());
    let session = of("XDG_RUNTIME_DIR").map(PathBuf::from);
    let system = Some(PathBuf::from("/run/drived"));
    [runtime, session, system].into_iter().flatten().map(|folder| folder.join(NAME)).collect()
}

/// Why the socket cannot be bound.
#[derive(Debug, thiserror::Error)]
pub(super) enum Unbound {
    #[error(
        "another drived serves the control socket {}: end that one, or give this one its own by --socket",
        .0.display()
    )]
    Served(PathBuf),
    #[error("{} is no socket: name another place for the control socket by --socket", .0.display())]
    NoSocket(PathBuf),
    #[error("there is no control socket {path}: {error}", path = .path.display())]
    System { path: PathBuf, error: io::Error },
}

/// The bound socket; its file is removed when dropped.
pub(super) struct Socket {
    pub(super) listener: UnixListener,
    path: PathBuf,
}

impl Socket {
    /// Binds the socket. What a daemon has left behind is replaced, what is no socket never.
    ///
    /// # Errors
    ///
    /// Another daemon serves it, something else stands there, or the folder cannot be written.
    pub(super) fn bind(path: &Path, mode: u32) -> Result<Self, Unbound> {
        let of = |error: io::Error| Unbound::System { path: path.to_owned(), error };
        if let Some(folder) =
            path.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.exists())
        {
            let mut builder = fs::DirBuilder::new();
            std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o750);
            builder.create(folder).map_err(of)?;
        }
        match fs::symlink_metadata(path) {
            Ok(there) if !there.file_type().is_socket() => {
                return Err(Unbound::NoSocket(path.to_owned()));
            }
            Ok(_) => match UnixStream::connect(path) {
                Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => {
                    fs::remove_file(path).map_err(of)?;
                }
                Ok(_) => {
                    return Err(Unbound::Served(path.to_owned()));
                }
                Err(error) => return Err(of(error)),
            },
            Err(_) => {}
        }
        let listener = UnixListener::bind(path).map_err(of)?;
        let socket = Self { listener, path: path.to_owned() };
        fs::set_permissions(path, fs::Permissions::from_mode(mode)).map_err(of)?;
        Ok(socket)
    }

    /// The same, heard by the runtime in which this is called.
    pub(super) fn heard_here(mut self) -> io::Result<Self> {
        // What stands at the place stays there.
        let place = std::mem::take(&mut self.path);
        let there = self.listener.as_fd().try_clone_to_owned()?;
        let listener = UnixListener::from_std(there.into())?;
        Ok(Self { listener, path: place })
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use drived_config::testing::Folder;

    #[tokio::test]
    async fn a_socket_that_a_daemon_has_left_is_replaced_and_that_of_a_living_one_is_not() {
        let folder = Folder::new("socket");
        let path = folder.file("drived.sock");
        // As a daemon leaves it that was killed.
        drop(std::os::unix::net::UnixListener::bind(&path).unwrap());
        let socket = Socket::bind(&path, 0o660).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o660);
        let refused = Socket::bind(&path, 0o660).err().unwrap();
        assert!(matches!(refused, Unbound::Served(_)), "{refused}");
        drop(socket);
        assert!(!path.exists());
    }

    #[tokio::test]
    async fn what_is_no_socket_is_never_replaced() {
        let folder = Folder::new("no-socket");
        let path = folder.file("precious");
        fs::write(&path, "precious").unwrap();
        let refused = Socket::bind(&path, 0o660).err().unwrap();
        assert!(matches!(refused, Unbound::NoSocket(_)), "{refused}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "precious");
    }
}
