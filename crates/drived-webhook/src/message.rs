//! What is posted: [`Form`].

use serde_json::json;

use crate::{outbox::Message, template::Template};

/// How a message is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Form {
    pub(crate) host: String,
    pub(crate) text: Template,
    pub(crate) body: Body,
}

/// What a body has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Body {
    /// All that is known, as JSON.
    Alarm,
    /// The text and nothing else.
    Text,
    /// A JSON object with the text in this field and nothing else.
    Field(String),
}

impl Form {
    pub(crate) const fn content_type(&self) -> &'static str {
        match self.body {
            Body::Alarm | Body::Field(_) => "application/json",
            Body::Text => "text/plain; charset=utf-8",
        }
    }

    /// A message, and how many were lost before it.
    pub(crate) fn write(&self, message: &Message, lost: u64) -> String {
        let Message { id, view, skipped, .. } = message;
        let mut text = self.text.fill(&self.host, view);
        if lost > 0 {
            text.push_str(&format!(" ({lost} messages before it were lost)"));
        }
        match &self.body {
            Body::Alarm => {
                let host = &self.host;
                json!({ "id": id, "host": host, "text": text, "skipped": skipped, "lost": lost, "alarm": view }).to_string()
            }
            Body::Text => text,
            Body::Field(field) => json!({ field: text }).to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::{template::USUAL, tests::view};

    fn written(body: Body, lost: u64) -> String {
        let form = Form { host: "north".to_owned(), text: USUAL.parse().unwrap(), body };
        let message = Message::new("north-7-9", view(7, "unacknowledged"), 2);
        form.write(&message, lost)
    }

    #[test]
    fn an_alarm_is_told_as_the_api_tells_it_with_what_a_receiver_has_to_know_besides() {
        let told: Value = serde_json::from_str(&written(Body::Alarm, 4)).unwrap();
        assert_eq!(told["id"], "north-7-9");
        assert_eq!((&told["skipped"], &told["lost"]), (&json!(2), &json!(4)));
        assert_eq!(told["alarm"], serde_json::to_value(view(7, "unacknowledged")).unwrap());
        assert!(told["text"].as_str().unwrap().ends_with("(4 messages before it were lost)"));
    }

    #[test]
    fn a_chat_gets_its_one_field_and_a_pager_the_text_alone() {
        let text = "pump 1: tripped: OCF (unacknowledged). look at it";
        assert_eq!(written(Body::Field("content".to_owned()), 0), json!({ "content": text }).to_string());
        assert_eq!(written(Body::Text, 0), text);
    }
}
