//! Freeze-frames of a drive, and what a capture has heard of its line around one of them.

use std::{fs::OpenOptions, io::Write as _, path::Path};

use drived_history::read::{self, Frame, Heard, History, Reading};
use drived_plant::plant::past::FrameCaptureView;
use drived_words::{failure::Failure, output, output::counted};
use serde_json::{Value, json};

use super::{failed, said};

/// Those of a time.
pub(super) fn of(history: &History, drive: &str, time: &Reading) -> Result<Vec<Frame>, Failure> {
    let mut all = read::frames(&history.0, drive, time.from_ms, time.to_ms).map_err(failed)?;
    all.retain(|frame| time.has(frame.run, frame.steady_ms));
    Ok(all)
}

/// What is kept of one, in a sentence.
pub(super) fn in_words(frame: &Frame) -> String {
    let values = counted(frame.curves.len(), "value", "values");
    let heard = match frame.capture {
        Some(heard) => format!("; {}", heard_in_words(heard)),
        // Until then it is not known.
        None if !frame.is_whole => String::new(),
        None => "; no capture of its line ran".to_owned(),
    };
    let still = if frame.is_whole { "" } else { "; it is not whole yet" };
    format!(
        "freeze-frame of {}: {values} from {} to {}{heard}{still}",
        frame.why,
        said(frame.start_ms),
        said(frame.end_ms)
    )
}

fn heard_in_words(heard: Heard) -> String {
    let Heard { frames, left_out, is_cut, from_unix_ms, to_unix_ms } = heard;
    let more = match (left_out, is_cut) {
        (0, false) => String::new(),
        (0, true) => "; there was no room for those before".to_owned(),
        (left_out, false) => format!("; there was no room for {left_out} more"),
        (left_out, true) => format!("; there was no room for {left_out} more, and for those before"),
    };
    let frames = counted(usize::try_from(frames).unwrap_or(usize::MAX), "frame", "frames");
    format!("of its line a capture has {frames} from {} to {}{more}", said(from_unix_ms), said(to_unix_ms))
}

/// The same for a program.
pub(super) fn as_json(frame: &Frame) -> Value {
    let Frame { why, at_unix_ms, is_whole, start_ms, end_ms, capture, .. } = frame;
    let capture = capture.map(FrameCaptureView::from);
    json!({ "freeze_frame": {
        "why": why, "at_unix_ms": at_unix_ms, "from_unix_ms": start_ms, "to_unix_ms": end_ms, "is_whole": is_whole, "capture": capture,
    } })
}

/// Writes what a capture has heard around the one freeze-frame of that time that has it.
pub(super) fn write(history: &History, drive: &str, times: &[Reading], file: &Path) -> Result<(), Failure> {
    let all = times.iter().map(|time| of(history, drive, time)).collect::<Result<Vec<_>, _>>()?.concat();
    let heard: Vec<_> = all.iter().filter_map(|frame| Some((frame, frame.capture?))).collect();
    let (frame, heard) = match &heard[..] {
        [one] => *one,
        [] if all.is_empty() => {
            let text = format!(
                "{drive} did not trip then, and no stop of it was unconfirmed: there is no freeze-frame"
            );
            return Err(Failure::Input(text));
        }
        [] => return Err(Failure::Input(format!("no capture of the line of {drive} ran then"))),
        several => {
            let times: Vec<String> = several.iter().map(|(frame, _)| said(frame.at_unix_ms)).collect();
            let text = format!("there are several: {}; expected a time with one of them", times.join(", "));
            return Err(Failure::Input(text));
        }
    };
    let capture = read::capture(&history.0, drive, frame.at_unix_ms).map_err(failed)?.unwrap_or_default();
    let made = OpenOptions::new().write(true).create_new(true).open(file);
    made.and_then(|mut made| made.write_all(&capture))
        .map_err(|error| Failure::Input(format!("{}: {error}", file.display())))?;
    output::say(format_args!("{}: {}", file.display(), heard_in_words(heard)))
}
