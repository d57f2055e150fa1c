//! Where in the file something is wrong.

use std::{
    fmt,
    ops::Range,
    path::{Path, PathBuf},
};

/// What is wrong with a configuration: file, line, field, and what was expected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConfigError {
    file: PathBuf,
    line: Option<usize>,
    field: Option<String>,
    problem: String,
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if let Some(field) = &self.field {
            write!(f, ": {field}")?;
        }
        write!(f, ": {}", self.problem)
    }
}

impl std::error::Error for ConfigError {}

/// The text of the file, for finding places in it.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    pub file: &'a Path,
    pub text: &'a str,
}

impl Source<'_> {
    /// Something is wrong here.
    pub fn error(&self, at: Range<usize>, problem: impl fmt::Display) -> ConfigError {
        ConfigError {
            file: self.file.to_owned(),
            line: Some(self.line(at.start)),
            field: self.field(at.start),
            problem: problem.to_string(),
        }
    }

    /// Something is wrong with the file as a whole.
    pub fn error_of_file(&self, problem: impl fmt::Display) -> ConfigError {
        ConfigError { file: self.file.to_owned(), line: None, field: None, problem: problem.to_string() }
    }

    fn line(&self, at: usize) -> usize {
        1 + self.before(at).matches('\n').count()
    }

    fn before(&self, at: usize) -> &str {
        self.text.get(..at).unwrap_or(self.text)
    }

    /// The key or the table that a place belongs to: what stands before the last `=` in front of it, or the line itself
    /// where it is a table's head or a key.
    fn field(&self, at: usize) -> Option<String> {
        let start = self.before(at).rfind('\n').map_or(0, |newline| newline + 1);
        let line = self.text.get(start..)?.lines().next()?;
        let before = self.text.get(start..at).unwrap_or_default();
        let key = match before.rfind('=') {
            Some(equals) => before.get(..equals)?.rsplit(['{', ',', '[']).next()?,
            None => line.split('=').next()?,
        };
        let key = key.trim().trim_matches(['[', ']', '"']);
        (!key.is_empty()).then(|| key.to_owned())
    }
}
