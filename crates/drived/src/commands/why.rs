//! `drived why`: the story of a moment in words.

use drived_history::story;
use drived_plant::plant::past::{Certainty, SentenceView as Sentence, StoryView as Story};
use drived_words::{
    failure::Failure,
    output::{self, JsonArgs},
};
use serde_json::json;

use super::history::{HistoryArgs, failed, moment_of, offset, said};

/// Tell what happened to a drive at a moment, and why, as far as it is known
///
/// It is told from the history: the values, the alarms, who commanded what, the other drives of the line, and what the drive says itself. What
/// is only likely is told as that, and what nobody can know from the line is said too.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The drive
    #[arg(value_name = "NAME")]
    name: String,
    /// When, to the minute or to the second: 03:12, 03:12:05, "yesterday 03:12", "2026-11-21 03:12"
    #[arg(value_name = "TIME")]
    at: String,
    #[command(flatten)]
    place: HistoryArgs,
    #[command(flatten)]
    json: JsonArgs,
}

pub(crate) async fn run(args: &Args) -> Result<(), Failure> {
    let at = moment_of(&args.at)?;
    args.place.have_written(&args.name, at).await?;
    let history = args.place.open(&args.name)?;
    let told = story::tell(&history.0, &args.name, at).map_err(failed)?;
    args.json.say(|| json!(told), || tell(&told, at))
}

fn tell(story: &Story, at: i64) -> Result<(), Failure> {
    match &story.about {
        Some(about) => {
            let time = about.time_unix_ms.unwrap_or(at);
            output::say(format_args!("{}, {} ({}): {}", story.drive, said(time), offset(time), about.text))?;
        }
        None => output::say(format_args!(
            "{}, {} ({}): nothing is recorded of it at that moment",
            story.drive,
            said(at),
            offset(at)
        ))?,
    }
    for (head, sentences) in [
        ("Why", &story.why),
        ("A moment before", &story.before),
        ("What happened", &story.course),
        ("What is not known", &story.not_known),
    ] {
        if !sentences.is_empty() {
            output::say("")?;
            output::say(format_args!("{head}:"))?;
            sentences.iter().try_for_each(one)?;
        }
    }
    Ok(())
}

fn one(sentence: &Sentence) -> Result<(), Failure> {
    let sure = match sentence.certainty {
        Certainty::Likely => "likely: ",
        Certainty::NotKnown => "not known: ",
        Certainty::Seen | Certainty::Said => "",
    };
    let time = sentence.time_unix_ms.map(|time| format!("{}  ", said(time))).unwrap_or_default();
    output::say_behind(&format!("  {time}"), &format!("{sure}{}", sentence.text))
}
