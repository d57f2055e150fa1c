//! Questions to the person at the drive, and the answers.

use tokio::io::{AsyncBufRead, AsyncBufReadExt as _, BufReader, Lines};

use drived_words::{failure::Failure, output, signals::Ending};

/// Who is asked.
pub(super) struct Console {
    answers: Lines<Box<dyn AsyncBufRead + Unpin + Send>>,
    /// By what the person asks to end instead of answering.
    ending: Option<Ending>,
}

impl Console {
    pub(super) fn of_terminal() -> Self {
        Self::reading(BufReader::new(tokio::io::stdin()))
    }

    pub(super) fn reading(answers: impl AsyncBufRead + Unpin + Send + 'static) -> Self {
        let answers: Box<dyn AsyncBufRead + Unpin + Send> = Box::new(answers);
        Self { answers: answers.lines(), ending: None }
    }

    /// From now on a question ends when the program is asked to end. One that hears it already goes on with what it has.
    pub(super) fn hear(&mut self, ending: Ending) {
        self.ending.get_or_insert(ending);
    }

    /// Says something that nobody has to answer.
    pub(super) fn say(&self, text: impl std::fmt::Display) -> Result<(), Failure> {
        output::say(text)
    }

    /// Asks, and gives the line that is answered.
    ///
    /// # Errors
    /// Nobody answers any more, or the program is asked to end: nothing further is done.
    pub(super) async fn ask(&mut self, question: impl std::fmt::Display) -> Result<String, Failure> {
        output::say(question)?;
        let answer = tokio::select! {
            biased;
            () = asked(self.ending.as_mut()) => return Err(asked_to_end()),
            answer = self.answers.next_line() => answer.ok().flatten(),
        };
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

/// Waits until the program is asked to end; for ever where nobody listens.
async fn asked(ending: Option<&mut Ending>) {
    match ending {
        Some(ending) => ending.asked().await,
        None => std::future::pending().await,
    }
}

/// The end of a trial by Ctrl-C, or by a terminal that is gone.
pub(super) fn asked_to_end() -> Failure {
    Failure::Drive("asked to end: the trial ends here, and nothing is signed".to_owned())
}
