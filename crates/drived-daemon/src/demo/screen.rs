//! The demo on a terminal: the table, drawn ten times a second, and the keys.

use std::{collections::VecDeque, io, time::Duration};

use crossterm::event::{self, Event as Input, KeyCode, KeyModifiers};
use drive_fleet::Received;
use ratatui::DefaultTerminal;
use tokio::time::{self, Instant};

use super::{Act, Show, Why, meter::Meter, table, waited_for};
use drived_words::failure::Failure;

/// Between two drawings.
const FRAME: Duration = Duration::from_millis(100);

/// Events that a large screen can show.
const REMEMBERED: usize = 200;

pub(super) async fn run(show: Show<'_>) -> Result<Why, Failure> {
    let Show { plant, page, mut incoming, until, ending } = show;
    let mut screen = Screen::open().map_err(|error| Failure::output(&error))?;
    let began = Instant::now();
    let mut meters: Vec<Meter> = plant.lines.iter().map(|_| Meter::new()).collect();
    let mut events = VecDeque::new();
    let mut frames = time::interval(FRAME);
    let mut act = Act::Playing;
    loop {
        let asked = tokio::select! {
            Received::Event(event) = incoming.recv() => {
                events.push_front(event);
                events.truncate(REMEMBERED);
                continue;
            }
            () = ending.asked() => true,
            _ = frames.tick() => pressed_end().map_err(|error| Failure::output(&error))?,
        };
        match act {
            Act::Playing if asked => act = Act::stop(plant, Why::Asked),
            Act::Stopping(why) if asked => return Ok(why),
            Act::Playing if until.is_some_and(|until| Instant::now() >= until) => {
                act = Act::stop(plant, Why::TimeIsUp);
            }
            _ => {}
        }
        if let Some(why) = act.over(plant) {
            return Ok(why);
        }
        for (meter, line) in meters.iter_mut().zip(&plant.lines) {
            meter.look(plant, line, Instant::now());
        }
        let picture = table::Picture {
            began,
            waited_for: (act != Act::Playing).then(|| waited_for(plant)),
            page: &page,
            units: plant.units.iter().map(|unit| (unit.drive(), unit.last())).collect(),
            lines: plant.lines.iter().zip(&meters).map(|(line, meter)| meter.cells(line)).collect(),
            events: &events,
        };
        screen.terminal.draw(|frame| picture.draw(frame)).map_err(|error| Failure::output(&error))?;
    }
}

/// Whether q, Escape or Ctrl-C was pressed: in this mode the terminal makes no signal of Ctrl-C.
fn pressed_end() -> io::Result<bool> {
    while event::poll(Duration::ZERO)? {
        if let Input::Key(key) = event::read()? {
            let control_c = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
            if control_c || matches!(key.code, KeyCode::Char('q') | KeyCode::Esc) {
                return Ok(true);
            }
        }
    }
    Ok(false)
}

/// The terminal in its drawing mode. It is given back when this is dropped, and by a panic.
struct Screen {
    terminal: DefaultTerminal,
}

impl Screen {
    fn open() -> io::Result<Self> {
        Ok(Self { terminal: ratatui::try_init()? })
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        ratatui::restore();
    }
}
