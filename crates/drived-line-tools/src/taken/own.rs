//! Captures that this program has written, or another that fills one file with frames of one protocol. One that is cut off is read as
//! far as it is whole.

use drive_bus::capture;

use super::Taken;

/// One that this program has written, which says what its line spoke and how late it was heard.
pub(super) fn read(file: &[u8]) -> Option<Taken> {
    let mut reader = capture::Reader::default();
    reader.push(file);
    let mut frames = Vec::new();
    let mut notes = Vec::new();
    loop {
        match reader.next_frame() {
            Ok(Some(frame)) => frames.push(frame),
            Ok(None) => break,
            Err(_) if frames.is_empty() => return None,
            Err(error) => {
                notes.push(format!("{error}: what stands before it is told"));
                break;
            }
        }
    }
    if frames.is_empty() {
        return None;
    }
    if notes.is_empty() && reader.finish().is_err() {
        notes.push(CUT.to_owned());
    }
    let (dissector, late) = (reader.dissector(), reader.late());
    Some(Taken { dissector, late, has_times: true, frames, notes })
}

pub(super) const CUT: &str = "the file is cut off in the middle: what stands before that is told";
