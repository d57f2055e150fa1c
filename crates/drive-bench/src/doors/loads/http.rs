//! Answers of HTTP/1.1 as they come, whole or in pieces.

/// What has come and was not taken yet.
#[derive(Debug, Default)]
pub(super) struct Answers(Vec<u8>);

/// One answer.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Answer {
    pub(super) status: u16,
    /// Why, in one word, where it says so.
    pub(super) reason: Option<String>,
    /// The name of the command that it is about.
    pub(super) id: Option<String>,
}

impl Answer {
    /// As it is counted.
    pub(super) fn name(&self) -> String {
        match &self.reason {
            Some(reason) => format!("{} {reason}", self.status),
            None => self.status.to_string(),
        }
    }
}

impl Answers {
    pub(super) const fn of(heard: Vec<u8>) -> Self {
        Self(heard)
    }

    /// What is not whole yet.
    pub(super) fn rest(self) -> Vec<u8> {
        self.0
    }

    pub(super) fn hear(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    /// The next that is there whole. One without a length, such as a stream, is there when its head is.
    pub(super) fn next(&mut self) -> Option<Answer> {
        let end = self.0.windows(4).position(|end| end == b"\r\n\r\n")? + 4;
        let head = String::from_utf8_lossy(self.0.get(..end)?).to_ascii_lowercase();
        let status = head.split(' ').nth(1)?.parse().ok()?;
        let length = head.lines().find_map(|line| line.strip_prefix("content-length:")?.trim().parse().ok());
        let whole = end + length.unwrap_or(0_usize);
        let body = String::from_utf8_lossy(self.0.get(end..whole)?).into_owned();
        let said = |name: &str| {
            let (_, rest) = body.split_once(&format!("\"{name}\":\""))?;
            rest.split('"').next().map(str::to_owned)
        };
        let answer = Answer { status, reason: said("reason"), id: said("id") };
        self.0.drain(..whole);
        Some(answer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_in_pieces_are_taken_one_by_one_when_they_are_whole() {
        let mut answers = Answers::default();
        answers.hear(b"HTTP/1.1 202 Accepted\r\ncontent-length: 2\r\n\r\n{}HTTP/1.1 429 Too");
        assert_eq!(answers.next(), Some(Answer { status: 202, reason: None, id: None }));
        assert_eq!(answers.next(), None);
        answers.hear(b" Many\r\nContent-Length: 17\r\n\r\n{\"reason\":\"");
        assert_eq!(answers.next(), None);
        answers.hear(b"slow\"}");
        assert_eq!(answers.next().unwrap().name(), "429 slow");
    }
}
