//! `drived run` on a terminal: the drives and the lines as a table, the log below it.
//!
//! A thread of its own draws, for a terminal may be held for as long as somebody likes. Ctrl-C stays a signal: nothing that
//! stops a motor depends on what is drawn.

mod picture;
mod terminal;

use std::{
    sync::mpsc::{RecvTimeoutError, Sender, channel},
    thread,
    time::Duration,
};

use tokio::sync::oneshot;

use self::{picture::Picture, terminal::Terminal};
use crate::{logging, plant::Plant};

/// Between two drawings.
const FRAME: Duration = Duration::from_millis(250);
/// How long a terminal may take to be given back.
const GIVEN_BACK: Duration = Duration::from_millis(500);

/// The table, while it is shown.
pub(super) struct Screen {
    end: Sender<()>,
    ended: oneshot::Receiver<()>,
}

impl Screen {
    /// Shows a plant; `None` where stdout is no terminal that can be drawn on.
    pub(super) fn open(plant: Plant) -> Option<Self> {
        let mut terminal = Terminal::open().ok()?;
        let (end, asked) = channel();
        let (over, ended) = oneshot::channel();
        let draw = move || {
            let runs = || matches!(asked.recv_timeout(FRAME), Err(RecvTimeoutError::Timeout));
            while runs() {
                let picture = Picture::of(&plant, logging::shown());
                // A terminal that is gone says so by a signal.
                let _ = terminal.draw(|frame| picture.draw(frame));
            }
            drop(terminal);
            let _ = over.send(());
        };
        thread::Builder::new().name("screen".to_owned()).spawn(draw).ok()?;
        Some(Self { end, ended })
    }

    /// Gives the terminal back, and with it the last of the log. One that is held is not waited for.
    pub(super) async fn close(self) {
        drop(self.end);
        let _ = tokio::time::timeout(GIVEN_BACK, self.ended).await;
    }
}
