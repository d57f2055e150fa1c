//! The terminal in its drawing mode. It is given back when this is dropped, and by a panic.

use std::{
    io::{self, Stdout},
    panic,
    sync::Once,
};

use crossterm::{
    cursor::{Hide, Show},
    execute,
    terminal::{EnterAlternateScreen, LeaveAlternateScreen},
};
use ratatui::{Frame, backend::CrosstermBackend};

use crate::logging;

pub(super) struct Terminal(ratatui::Terminal<CrosstermBackend<Stdout>>);

impl Terminal {
    /// Takes the terminal. What is typed still makes signals, and is not shown.
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
        execute!(io::stdout(), EnterAlternateScreen, Hide)?;
        echo::off();
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
    let _ = execute!(io::stdout(), LeaveAlternateScreen, Show);
    echo::on();
    logging::write_again();
}

/// Whether the terminal shows what is typed.
#[cfg(unix)]
mod echo {
    use std::{
        io::stdin,
        sync::{Mutex, PoisonError},
    };

    use rustix::termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcsetattr};

    static BEFORE: Mutex<Option<Termios>> = Mutex::new(None);

    pub(super) fn off() {
        let Ok(before) = tcgetattr(stdin()) else { return };
        let mut quiet = before.clone();
        quiet.local_modes -= LocalModes::ECHO | LocalModes::ICANON;
        if tcsetattr(stdin(), OptionalActions::Now, &quiet).is_ok() {
            *BEFORE.lock().unwrap_or_else(PoisonError::into_inner) = Some(before);
        }
    }

    pub(super) fn on() {
        if let Some(before) = BEFORE.lock().unwrap_or_else(PoisonError::into_inner).take() {
            // What was typed meanwhile is nobody's.
            let _ = tcsetattr(stdin(), OptionalActions::Flush, &before);
        }
    }
}

#[cfg(not(unix))]
mod echo {
    pub(super) fn off() {}

    pub(super) fn on() {}
}
