//! Following a command: one way for all, whether its news come from within or over a connection.

use std::{sync::Arc, time::Duration};

use tokio::time::{Instant, timeout_at};

use crate::plant::{commands::Told, views::CommandView};

/// For how long it may still be settled what became of a command: as long as it is remembered.
pub const SETTLES_FOR: Duration = Duration::from_secs(600);

/// Where news of a command come from.
pub trait Source {
    /// Waits for news; they may be the same as before.
    ///
    /// # Errors
    /// It cannot be known now, in words.
    ///
    /// # Cancellation
    /// Nothing is lost.
    fn news(&mut self) -> impl Future<Output = Result<Arc<CommandView>, Lost>> + Send;
}

/// Why nothing is known of a command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Lost {
    /// Now; the command goes on.
    ForNow(String),
    /// For good.
    ForGood(String),
}

/// What there is to tell.
#[derive(Debug, Clone, PartialEq)]
pub enum News {
    /// This is how it stands.
    Told(Arc<CommandView>),
    /// Nobody can see how it stands; it goes on.
    OutOfSight(String),
    /// Nobody will ever know.
    Gone(String),
}

/// Follows a command for as long as something may become of it.
pub struct Follower<S> {
    source: S,
    last: Arc<CommandView>,
    until: Instant,
    is_out_of_sight: bool,
    is_over: bool,
}

impl Follower<Told> {
    /// Follows a command of this program.
    pub fn new(mut told: Told) -> Self {
        let last = Arc::clone(&told.borrow_and_update());
        Self::from(told, last)
    }
}

impl<S: Source> Follower<S> {
    /// Follows a command of which this is known.
    pub fn from(source: S, last: Arc<CommandView>) -> Self {
        let until = Instant::now() + SETTLES_FOR;
        Self { source, is_over: !last.open, last, until, is_out_of_sight: false }
    }

    /// How it stood last.
    pub fn last(&self) -> Arc<CommandView> {
        Arc::clone(&self.last)
    }

    /// What is new; `None` when nothing more becomes of it, or nobody remembers it any more.
    ///
    /// # Cancellation
    /// Nothing is lost.
    pub async fn next(&mut self) -> Option<News> {
        while !self.is_over {
            match timeout_at(self.until, self.source.news()).await {
                Ok(Ok(view)) => {
                    self.is_over = !view.open;
                    let is_new = *view != *self.last || self.is_out_of_sight;
                    self.is_out_of_sight = false;
                    self.last = view;
                    if is_new {
                        return Some(News::Told(self.last()));
                    }
                }
                Ok(Err(Lost::ForNow(why))) => {
                    if !std::mem::replace(&mut self.is_out_of_sight, true) {
                        return Some(News::OutOfSight(why));
                    }
                }
                Ok(Err(Lost::ForGood(why))) => {
                    self.is_over = true;
                    return Some(News::Gone(why));
                }
                Err(_) => self.is_over = true,
            }
        }
        None
    }
}

impl Source for Told {
    async fn news(&mut self) -> Result<Arc<CommandView>, Lost> {
        match self.changed().await {
            Ok(()) => Ok(Arc::clone(&self.borrow_and_update())),
            Err(_) => Err(Lost::ForGood("the program ends".to_owned())),
        }
    }
}
