//! `drived monitor`: the plant live on a terminal, and the key that stops it.
//!
//! A pure [`model`] takes news and keys; [`view`] draws it. Keys are read by a thread, drawing is done by another, news
//! come by tasks, and each stop has a task and a connection of its own: none waits for another.

mod account;
mod curves;
mod drive;
mod feed;
mod happening;
mod model;
mod source;
mod stopping;
mod terminal;
mod view;
mod words;

use std::{
    io::{self, IsTerminal as _},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
};

use crossterm::event::{self, Event};
use tokio::{
    sync::{mpsc, watch},
    task::JoinSet,
    time::Instant,
};

use self::{
    model::{Ask, Model},
    source::Source,
    terminal::Shows,
};
use crate::commanded::UNCONFIRMED;
use drived_client::DaemonArgs;
use drived_screen::screen::Screen;
use drived_words::{
    drive_options::OptionArgs,
    drive_spec::DriveSpec,
    failure::Failure,
    line_spec::{self, LineSpec},
    signals::{Ending, Suspending},
};

/// News that may wait for the model.
const WAITING: usize = 1_024;

/// Watch the running daemon live on the terminal: its drives with curves, its lines, what happens; stop them by one key
///
/// Ctrl-S stops all drives, in every view and while a search is typed, without a question; Ctrl-T stops the drive that is
/// marked. What becomes of a stop is counted until every drive is accounted for. It is no emergency stop. Nothing is ever
/// started. ? shows the keys. With --line and --drive a line is opened instead and only read, until somebody stops a motor
/// on it.
#[derive(Debug, clap::Args)]
pub struct Args {
    // The text has brackets that a doc comment would take for links.
    #[arg(long, value_name = "LINE", requires = "drives", conflicts_with_all = ["socket", "token_file"], help = line_spec::HELP)]
    line: Option<LineSpec>,
    /// Drives on the line, such as atv312@1-10,12; may be given several times
    #[arg(long = "drive", value_name = "FAMILY@ADDRESSES", requires = "line")]
    drives: Vec<DriveSpec>,
    #[command(flatten)]
    options: OptionArgs,
    #[command(flatten)]
    daemon: DaemonArgs,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    if !io::stdin().is_terminal() || !io::stdout().is_terminal() {
        let no_terminal =
            "monitor needs a terminal for its picture and its keys: drived watch prints what happens";
        return Err(Failure::Input(no_terminal.to_owned()));
    }
    if Shows::of(|name| std::env::var(name).ok()) == Shows::Nothing {
        let dumb = "monitor draws a picture, and TERM=dumb has none: drived watch prints what happens, or TERM=xterm drived monitor";
        return Err(Failure::Input(dumb.to_owned()));
    }
    let mut ending = Ending::listen_on_terminal()?;
    let source = Source::open(&args).await?;
    let watched = match source.is_own() {
        true => "a line of its own, only read".to_owned(),
        false => source.way.to_string(),
    };
    let model = Arc::new(Mutex::new(Model::new(watched, Instant::now())));
    let left = watching(&mut ending, &source, &model).await;
    source.close().await;
    left
}

fn shown(model: &Arc<Mutex<Model>>) -> Result<Screen, Failure> {
    let model = Arc::clone(model);
    let is_ascii = Shows::of(|name| std::env::var(name).ok()) == Shows::Ascii;
    let screen = Screen::open(move |frame| {
        view::draw(&mut locked(&model), Instant::now(), frame);
        if is_ascii {
            terminal::to_ascii(frame.buffer_mut());
        }
    });
    screen.ok_or_else(|| Failure::Input("the terminal cannot be drawn on".to_owned()))
}

/// Feeds the model until somebody ends it.
async fn watching(ending: &mut Ending, source: &Source, model: &Arc<Mutex<Model>>) -> Result<(), Failure> {
    let mut screen = shown(model)?;
    let mut suspending = Suspending::listen()?;
    let (news, mut incoming) = mpsc::channel(WAITING);
    let (told, mut of_stops) = mpsc::unbounded_channel();
    let (want, wanted) = watch::channel(None);
    let mut keys = keys();
    let mut tasks = JoinSet::new();
    tasks.spawn(feed::follow(source.way.clone(), news.clone()));
    tasks.spawn(feed::look(source.way.clone(), wanted, news));
    loop {
        tokio::select! {
            biased;
            () = ending.asked() => break,
            key = keys.recv() => {
                let Some(input) = key else { break };
                let asked = match input {
                    Event::Key(key) => locked(model).press(key, Instant::now()),
                    Event::Paste(text) => {
                        locked(model).paste(&text);
                        None
                    }
                    _ => None,
                };
                match asked {
                    Some(Ask::Stop { number, stop }) => {
                        // Whatever else is to be done, this is on its way.
                        tokio::spawn(stopping::carry_out(source.clone(), number, stop, told.clone()));
                    }
                    Some(Ask::Quit) => break,
                    None => {}
                }
            }
            () = suspending.asked() => match source.is_own() {
                true => locked(model).refuse("Not suspended: without this program the drives' watchdogs would act."),
                false => {
                    screen.close().await;
                    suspending.suspend();
                    screen = shown(model)?;
                }
            },
            Some(progress) = of_stops.recv() => locked(model).take(progress, Instant::now()),
            Some(one) = incoming.recv() => {
                locked(model).take(one, Instant::now());
                // Nobody sees each of many.
                if !incoming.is_empty() {
                    continue;
                }
            }
        }
        let now_wanted = locked(model).wanted();
        want.send_if_modified(|wanted| std::mem::replace(wanted, now_wanted.clone()) != now_wanted);
        screen.nudge();
    }
    screen.close().await;
    tasks.shutdown().await;
    let model = locked(model);
    let open: Vec<String> = model.unconfirmed_stops().map(account::Account::sentence).collect();
    match open.is_empty() {
        true => Ok(()),
        false => Err(Failure::Drive(format!("{UNCONFIRMED}. {}", open.join("; ")))),
    }
}

/// What is typed. A thread reads it: a terminal may take as long as it likes.
fn keys() -> mpsc::UnboundedReceiver<Event> {
    let (typed, keys) = mpsc::unbounded_channel();
    thread::spawn(move || {
        while let Ok(event) = event::read() {
            if typed.send(event).is_err() {
                return;
            }
        }
    });
    keys
}

fn locked(model: &Mutex<Model>) -> MutexGuard<'_, Model> {
    model.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What stands on a wide terminal when this is told.
#[cfg(any(test, feature = "testing"))]
pub fn screen_of(state: drived_plant::plant::views::StateView) -> String {
    let now = Instant::now();
    let mut model = Model::new("a test".to_owned(), now);
    model.take(model::News::State { state: Box::new(state), recent: Vec::new(), kept: Vec::new() }, now);
    let backend = ratatui::backend::TestBackend::new(400, 24);
    let mut terminal = ratatui::Terminal::new(backend).expect("it has a size");
    terminal.draw(|frame| view::draw(&mut model, now, frame)).expect("it is drawn");
    terminal.backend().to_string()
}
