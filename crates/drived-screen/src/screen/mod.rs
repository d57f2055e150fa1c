//! A picture on the terminal, drawn again and again: the table of `drived run`, and `drived monitor`.
//!
//! A thread of its own draws, for a terminal may be held for as long as somebody likes. Ctrl-C stays a signal: nothing that
//! stops a motor depends on what is drawn.

mod terminal;

use std::{
    sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel},
    thread,
    time::Duration,
};

use ratatui::Frame;
use tokio::sync::oneshot;

use self::terminal::Terminal;

/// Between two drawings at the most.
const FRAME: Duration = Duration::from_millis(250);
/// How long a terminal may take to be given back.
const GIVEN_BACK: Duration = Duration::from_millis(500);

/// The picture, while it is shown.
pub struct Screen {
    nudge: SyncSender<()>,
    ended: oneshot::Receiver<()>,
}

impl Screen {
    /// Shows what `draw` draws; `None` where stdout is no terminal that can be drawn on.
    pub fn open(mut draw: impl FnMut(&mut Frame<'_>) + Send + 'static) -> Option<Self> {
        let mut terminal = Terminal::open().ok()?;
        let (nudge, nudged) = sync_channel(1);
        let (over, ended) = oneshot::channel();
        let drawing = move || {
            while nudged.recv_timeout(FRAME) != Err(RecvTimeoutError::Disconnected) {
                // A terminal that is gone says so by a signal.
                let _ = terminal.draw(&mut draw);
            }
            drop(terminal);
            let _ = over.send(());
        };
        thread::Builder::new().name("screen".to_owned()).spawn(drawing).ok()?;
        Some(Self { nudge, ended })
    }

    /// There is something new to draw. Nobody waits for that.
    pub fn nudge(&self) {
        // One that is due already draws this too.
        let _ = self.nudge.try_send(());
    }

    /// Gives the terminal back, and with it the last of the log. One that is held is not waited for.
    pub async fn close(self) {
        drop(self.nudge);
        let _ = tokio::time::timeout(GIVEN_BACK, self.ended).await;
    }
}
