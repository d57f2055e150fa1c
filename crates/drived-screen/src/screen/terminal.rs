//! The terminal in its drawing mode. It is given back when this is dropped, and by a panic.

use std::{
    io::{self, Stdout},
    panic,
    sync::Once,
};

use crossterm::{
    cursor::{Hide, Show},
    event::{DisableBracketedPaste, EnableBracketedPaste},
    execute,
    terminal::{EnterAlternateScreen, LeaveAlternateScreen},
};
use ratatui::{Frame, backend::CrosstermBackend};

use drived_words::logging;

pub(super) struct Terminal(ratatui::Terminal<CrosstermBackend<Stdout>>);

impl Terminal {
    /// Takes the terminal. Ctrl-C and Ctrl-Z still make signals; everything else that is typed is a key, Ctrl-S too, and is
    /// not shown.
    pub(super) fn open() -> io::Result<Self> {
        static GIVEN_BACK: Once = Once::new();
        GIVEN_BACK.call_once(|| {
            let before = panic::take_hook();
            panic::set_hook(Box::new(move |info| {
                give_back();
                before(info);
            }));
        });
        let terminal = ratatui::Terminal::new(CrosstermBackend::new(io::stdout()))?;
        // What is pasted comes as a text and not as keys.
        execute!(io::stdout(), EnterAlternateScreen, EnableBracketedPaste, Hide)?;
        keys::take();
        logging::show();
        Ok(Self(terminal))
    }

    pub(super) fn draw(&mut self, picture: impl FnOnce(&mut Frame<'_>)) -> io::Result<()> {
        self.0.draw(picture).map(|_| ())
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        give_back();
    }
}

/// Gives the terminal back, once however often it is asked.
fn give_back() {
    if !logging::is_shown() {
        return;
    }
    // A terminal that is gone needs nothing.
    let _ = execute!(io::stdout(), DisableBracketedPaste, LeaveAlternateScreen, Show);
    keys::give_back();
    logging::write_again();
}

/// Whether the terminal takes nothing now: somebody marks a text on it, or nobody reads it.
#[cfg(unix)]
pub(super) fn is_held() -> bool {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let stdout = io::stdout();
    // An error is no reason to wait for it.
    poll(&mut [PollFd::new(&stdout, PollFlags::OUT)], Some(&Timespec::default())) != Ok(1)
}

#[cfg(not(unix))]
pub(super) fn is_held() -> bool {
    true
}

/// Whether what is typed is shown, kept until the end of a line, and holds up or quotes what the terminal shows.
#[cfg(unix)]
mod keys {
    use std::{
        io::stdin,
        sync::{Mutex, PoisonError},
    };

    use rustix::termios::{InputModes, LocalModes, OptionalActions, Termios, tcgetattr, tcsetattr};

    static BEFORE: Mutex<Option<Termios>> = Mutex::new(None);

    pub(super) fn take() {
        let Ok(before) = tcgetattr(stdin()) else { return };
        let mut quiet = before.clone();
        quiet.local_modes -= LocalModes::ECHO | LocalModes::ICANON | LocalModes::IEXTEN;
        // Else a key that makes a signal throws away what is on its way to the terminal, and does so behind the signal: it would be
        // what this writes at its end, by which the terminal is given back.
        quiet.local_modes |= LocalModes::NOFLSH;
        quiet.input_modes -= InputModes::IXON;
        if tcsetattr(stdin(), OptionalActions::Now, &quiet).is_ok() {
            *BEFORE.lock().unwrap_or_else(PoisonError::into_inner) = Some(before);
        }
    }

    pub(super) fn give_back() {
        if let Some(before) = BEFORE.lock().unwrap_or_else(PoisonError::into_inner).take() {
            // What was typed meanwhile is nobody's.
            let _ = tcsetattr(stdin(), OptionalActions::Flush, &before);
        }
    }
}

#[cfg(not(unix))]
mod keys {
    pub(super) fn take() {}

    pub(super) fn give_back() {}
}
