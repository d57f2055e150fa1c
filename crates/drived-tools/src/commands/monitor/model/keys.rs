//! What a key does.

use crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use tokio::time::Instant;

use super::{super::account::Stop, Ask, Model, View};
use drived_words::json::unix;

/// All drives, and the one that is marked. Both are one byte on the wire, so that no slow connection cuts them in two, and
/// nobody types them in a word.
const STOP_ALL: char = 's';
const STOP_THIS: char = 't';

impl Model {
    /// What a key asks for. The stop keys act whatever is shown, whatever is being typed, and whatever is connected.
    pub(in super::super) fn press(&mut self, key: KeyEvent, now: Instant) -> Option<Ask> {
        if key.kind == KeyEventKind::Release {
            return None;
        }
        self.hint = None;
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            return self.command(key.code, now);
        }
        if self.help {
            self.help = false;
            return None;
        }
        if self.is_typing {
            self.type_search(key.code);
            self.mark(KeyCode::Null);
            return None;
        }
        match key.code {
            KeyCode::Char('q') => return Some(Ask::Quit),
            KeyCode::Char('?' | 'h') | KeyCode::F(1) => self.help = true,
            KeyCode::Char('/') => self.begin_search(),
            KeyCode::Char('1') => self.show(View::Fleet),
            KeyCode::Char('2') => self.show_line(0),
            KeyCode::Char('3') => self.show(View::Events),
            KeyCode::Tab => self.next_view(),
            KeyCode::Esc | KeyCode::Backspace => self.back(),
            _ => self.in_view(key.code),
        }
        None
    }

    /// What is pasted is no key: it is searched for where that is typed, and else it is nothing.
    pub(in super::super) fn paste(&mut self, text: &str) {
        if self.is_typing {
            self.search.extend(text.chars().filter(|letter| !letter.is_control()));
            self.scroll = 0;
            self.mark(KeyCode::Null);
        }
    }

    fn command(&mut self, code: KeyCode, now: Instant) -> Option<Ask> {
        let KeyCode::Char(letter) = code else { return None };
        match letter.to_ascii_lowercase() {
            STOP_ALL => Some(self.stop(Stop::All, unix(now))),
            STOP_THIS => {
                let Some(name) = self.marked() else {
                    self.refuse("No drive is marked: NOTHING WAS STOPPED. Ctrl-S stops all.");
                    return None;
                };
                Some(self.stop(Stop::One(name), unix(now)))
            }
            'c' => Some(Ask::Quit),
            _ => None,
        }
    }

    fn begin_search(&mut self) {
        if !matches!(self.view, View::Fleet | View::Events) {
            self.show(View::Fleet);
        }
        self.is_typing = true;
    }

    fn type_search(&mut self, code: KeyCode) {
        match code {
            KeyCode::Char(letter) => self.search.push(letter),
            KeyCode::Backspace => drop(self.search.pop()),
            KeyCode::Enter | KeyCode::Down | KeyCode::Up => self.is_typing = false,
            KeyCode::Esc => {
                self.search.clear();
                self.is_typing = false;
            }
            _ => {}
        }
        self.scroll = 0;
    }

    /// One step back: what was told of the stops that are settled, then the search, then the view.
    fn back(&mut self) {
        let had = self.accounts.len();
        self.accounts.retain(super::Account::is_open);
        if self.accounts.len() < had {
        } else if self.curves.is_paused() && matches!(self.view, View::Drive(_)) {
            self.curves.resume();
        } else if !self.search.is_empty() {
            self.search.clear();
        } else if self.group.is_some() && self.view == View::Fleet {
            self.group = None;
        } else if self.view == View::Fleet {
            self.selected = None;
        } else {
            self.show(View::Fleet);
        }
    }

    fn show(&mut self, view: View) {
        if self.view != view {
            self.curves = super::Curves::default();
            self.search.clear();
            (self.view, self.scroll, self.is_typing) = (view, 0, false);
        }
    }

    fn next_view(&mut self) {
        match &self.view {
            View::Fleet | View::Drive(_) => self.show_line(0),
            View::Line(_) => self.show(View::Events),
            View::Events => self.show(View::Fleet),
        }
    }

    /// The line that stands so many places behind the one that is shown, from the last to the first.
    fn show_line(&mut self, places: usize) {
        let names: Vec<&String> = self.plant.lines.keys().collect();
        let shown = match &self.view {
            View::Line(name) => names.iter().position(|known| *known == name).unwrap_or_default(),
            View::Drive(name) => {
                let line = self.plant.drive(name).map(|drive| &drive.told.line);
                names.iter().position(|known| Some(*known) == line).unwrap_or_default()
            }
            _ => 0,
        };
        if let Some(name) = names.get((shown + places) % names.len().max(1)) {
            let view = View::Line((*name).clone());
            self.show(view);
        }
    }

    fn in_view(&mut self, code: KeyCode) {
        match (&self.view, code) {
            (View::Fleet, KeyCode::Enter | KeyCode::Right) => {
                let first = || self.rows().first().map(|drive| drive.name().to_owned());
                if let Some(name) = self.marked().or_else(first) {
                    self.selected = Some(name.clone());
                    self.show(View::Drive(name));
                }
            }
            (View::Fleet, KeyCode::Char('g')) => self.next_group(),
            (View::Fleet, code) => self.mark(code),
            (View::Drive(_), KeyCode::Char(' ')) => self.curves.pause_or_resume(),
            (View::Drive(_), KeyCode::Left) => self.curves.step(-1),
            (View::Drive(_), KeyCode::Right) => self.curves.step(1),
            (View::Drive(_), KeyCode::Char('c')) => self.curves_alone = !self.curves_alone,
            (View::Drive(_), KeyCode::Char('+')) => self.curves.zoom_in(),
            (View::Drive(_), KeyCode::Char('-')) => self.curves.zoom_out(),
            (View::Line(_), KeyCode::Right) => self.show_line(1),
            (View::Line(_), KeyCode::Left) => self.show_line(self.plant.lines.len().saturating_sub(1)),
            (View::Events, KeyCode::Char('f')) => (self.kind, self.scroll) = (self.kind.next(), 0),
            (_, code) => self.scroll = moved(self.scroll, code, self.page),
        }
    }

    fn next_group(&mut self) {
        let groups = || self.plant.groups.iter().map(|(name, _)| name.clone());
        self.group = match &self.group {
            None => groups().next(),
            Some(shown) => groups().skip_while(|name| name != shown).nth(1),
        };
    }

    /// Moves the mark among the rows.
    fn mark(&mut self, code: KeyCode) {
        let names: Vec<String> = self.rows().iter().map(|drive| drive.name().to_owned()).collect();
        let at = names.iter().position(|name| Some(name) == self.selected.as_ref());
        let to = match at {
            Some(at) => moved(at, code, self.page).min(names.len().saturating_sub(1)),
            None => 0,
        };
        self.selected = names.get(to).cloned().or_else(|| self.selected.take());
    }
}

/// Where a key leads to from a line.
fn moved(from: usize, code: KeyCode, page: usize) -> usize {
    match code {
        KeyCode::Up | KeyCode::Char('k') => from.saturating_sub(1),
        KeyCode::Down | KeyCode::Char('j') => from.saturating_add(1),
        KeyCode::PageUp => from.saturating_sub(page),
        KeyCode::PageDown => from.saturating_add(page),
        KeyCode::Home => 0,
        KeyCode::End => usize::MAX,
        _ => from,
    }
}
