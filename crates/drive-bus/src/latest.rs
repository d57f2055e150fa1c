//! [`Latest`]: a value that changes, for readers who can hold up nobody.

use tokio::sync::watch;

/// The latest of a value that changes, and a notice of every change. A reader that is slow sees the latest.
///
/// Each reader gets a value of its own. One who could look into that of the teller, as into a borrow of tokio's
/// [`watch`](tokio::sync::watch), would stand everybody still for as long as he looks: the teller, who is the task of a line or of a drive,
/// whatever runs on its thread, and whoever reads behind it.
#[derive(Debug, Clone)]
pub struct Latest<T>(watch::Receiver<T>);

/// Whoever told it has ended: what was told last stays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("whoever told it has ended")]
pub struct Ended;

impl<T: Clone> Latest<T> {
    /// The value as it is now. What this reader has [seen](Self::look) stays as it is.
    #[must_use]
    pub fn now(&self) -> T {
        self.0.borrow().clone()
    }

    /// The value as it is now, which this reader has seen by this.
    pub fn look(&mut self) -> T {
        self.0.borrow_and_update().clone()
    }

    /// Whether it was told anew since this reader has seen it.
    ///
    /// # Errors
    /// [`Ended`].
    pub fn has_changed(&self) -> Result<bool, Ended> {
        self.0.has_changed().map_err(|_| Ended)
    }

    /// Waits until it is told anew, and counts that as seen.
    ///
    /// # Errors
    /// [`Ended`], once what was told last has been seen.
    ///
    /// # Cancellation
    /// Safe to drop: nothing is missed.
    pub async fn changed(&mut self) -> Result<(), Ended> {
        self.0.changed().await.map_err(|_| Ended)
    }

    /// Waits until it is so, and gives it. Between two looks values may go by.
    ///
    /// # Errors
    /// [`Ended`], where it is not so at the end either.
    ///
    /// # Cancellation
    /// Safe to drop.
    pub async fn until(&mut self, mut is_so: impl FnMut(&T) -> bool) -> Result<T, Ended> {
        loop {
            let value = self.look();
            if is_so(&value) {
                return Ok(value);
            }
            self.changed().await?;
        }
    }
}

impl<T> From<watch::Receiver<T>> for Latest<T> {
    fn from(told: watch::Receiver<T>) -> Self {
        Self(told)
    }
}
