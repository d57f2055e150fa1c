//! Questions to the person at the drive, and the answers.

use tokio::io::{AsyncBufRead, AsyncBufReadExt as _, BufReader, Lines};

use drived_words::{failure::Failure, output};

/// Who is asked.
pub(super) struct Console {
    answers: Lines<Box<dyn AsyncBufRead + Unpin + Send>>,
}

impl Console {
    pub(super) fn of_terminal() -> Self {
        Self::reading(BufReader::new(tokio::io::stdin()))
    }

    pub(super) fn reading(answers: impl AsyncBufRead + Unpin + Send + 'static) -> Self {
        let answers: Box<dyn AsyncBufRead + Unpin + Send> = Box::new(answers);
        Self { answers: answers.lines() }
    }

    /// Says something that nobody has to answer.
    pub(super) fn say(&self, text: impl std::fmt::Display) -> Result<(), Failure> {
        output::say(text)
    }

    /// Asks, and gives the line that is answered.
    ///
    /// # Errors
    /// Nobody answers any more: nothing further is done.
    pub(super) async fn ask(&mut self, question: impl std::fmt::Display) -> Result<String, Failure> {
        output::say(question)?;
        let answer = self.answers.next_line().await.ok().flatten();
        answer.map(|answer| answer.trim().to_owned()).ok_or_else(|| {
            Failure::Input("nobody answers any more: the trial ends here, and nothing was written".to_owned())
        })
    }

    /// Asks until it is yes or no.
    pub(super) async fn agrees(&mut self, question: impl std::fmt::Display) -> Result<bool, Failure> {
        let mut answer = self.ask(format_args!("{question} (yes or no)")).await?;
        loop {
            match answer.to_ascii_lowercase().as_str() {
                "yes" | "y" => return Ok(true),
                "no" | "n" => return Ok(false),
                _ => answer = self.ask("yes or no?").await?,
            }
        }
    }
}
