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
/// How often it is asked whether the terminal has been given back.
const LOOK: Duration = Duration::from_millis(100);
/// So many looks in a row at a terminal that takes nothing: somebody holds it.
const HELD_LOOKS: u32 = 5;
/// So many looks at one that takes what it is given, on a machine that has no time for it.
const LOOKS: u32 = 100;

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

    /// Gives the terminal back, and with it the last of the log. One that is held is not waited for; a machine that is slow is.
    pub async fn close(mut self) {
        drop(self.nudge);
        let mut held = 0;
        for _ in 0..LOOKS {
            if tokio::time::timeout(LOOK, &mut self.ended).await.is_ok() {
                return;
            }
            held = if terminal::is_held() { held + 1 } else { 0 };
            if held == HELD_LOOKS {
                return;
            }
        }
    }
}
