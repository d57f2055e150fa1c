//! What is wrong with the time that things take.

use std::time::Duration;

use drive_core::AnswerDelay;

use super::{Case, FEW, is_times, share};
use crate::doctor::{
    observations::{Asked, Figures},
    verdict::{Certainty, Defect, Verdict},
};
use drived_words::output;

/// A pause that is enough for every slave that needs one.
const LONG_PAUSE: Duration = Duration::from_millis(40);

/// An adapter that waits longer is told: shorter ones are as good as any.
const NOTICEABLE: Duration = Duration::from_millis(2);

/// The clocks of adapters that are looked for, in milliseconds: the pauses that are left to chance are longer than each.
const TICKS: std::ops::RangeInclusive<u64> = 8..=40;

/// So long a drive may take whose manual prints no time: several times what drives take that do nothing else.
const USUAL: Duration = Duration::from_millis(100);

/// One that misses what is asked too soon after its last answer, or after anything else on the line.
pub(super) fn needs_pause(case: &Case<'_>, slave: u8) -> Option<Verdict> {
    let since_own = |asked: &Asked| asked.since_own;
    let quiet = |asked: &Asked| asked.quiet;
    missed(case, slave, since_own, "after its own last answer")
        .or_else(|| missed(case, slave, quiet, "after anything on the line"))
}

fn missed(
    case: &Case<'_>,
    slave: u8,
    pause: impl Fn(&Asked) -> Option<Duration>,
    after_what: &str,
) -> Option<Verdict> {
    let asked: Vec<(Duration, bool)> = case
        .seen
        .of(slave)
        .filter(|asked| !asked.is_garbled())
        .filter_map(|asked| Some((pause(asked)?, asked.is_good())))
        .collect();
    let of = |is_in: &dyn Fn(Duration) -> bool| {
        let chosen = asked.iter().filter(|(pause, _)| is_in(*pause));
        chosen.fold((0, 0), |(missed, all), (_, good)| (missed + usize::from(!good), all + 1))
    };
    let shortest = asked.iter().map(|(pause, _)| *pause).min()?;
    let short = of(&|pause| pause <= shortest + Duration::from_millis(2));
    let long = of(&|pause| pause >= LONG_PAUSE);
    let is_missed = short.1 >= 8 && short.0 * 2 >= short.1 || short.1 >= 4 && short.0 == short.1;
    let is_deaf = is_missed && long.1 >= 8 && is_times(5, short, long);
    if !is_deaf {
        return None;
    }
    let longest_missed =
        asked.iter().filter(|(pause, good)| !good && *pause < LONG_PAUSE).map(|(pause, _)| *pause).max()?;
    let enough =
        asked.iter().filter(|(pause, good)| *good && *pause > longest_missed).map(|(pause, _)| *pause).min();
    let enough = enough.unwrap_or(LONG_PAUSE);
    let next = format!(
        "leave {} between its answer and the next question to it: in a master of your own by its pause between requests",
        output::bound(enough)
    );
    Some(Verdict::new(
        Defect::NeedsPause,
        &[slave],
        Certainty::Certain,
        format!(
            "{} misses questions that follow too soon {after_what}: {} of those after {}, {} of those after {} or more. It needs \
             between {} and {}",
            case.seen.name(slave),
            share(short.0, short.1),
            output::milliseconds(shortest),
            share(long.0, long.1),
            output::bound(LONG_PAUSE),
            output::milliseconds(longest_missed),
            output::milliseconds(enough)
        ),
        &[
            &next,
            "drived keeps the pause of the family's manual and asks others meanwhile: poll this drive so rarely (`running` and \
             `rest` of its periods) that it is never asked twice in a row",
        ],
    ))
}

/// An adapter that hands over what it has heard only every so often.
pub(super) fn adapter(case: &Case<'_>) -> Option<Verdict> {
    let next = [
        "set its latency timer to 1 ms: echo 1 | sudo tee /sys/bus/usb-serial/devices/ttyUSB0/latency_timer (the name of your \
         port), by a udev rule for good; in Windows in the port's advanced settings",
        "drived sets it by itself where it may: let its user write that file, or its group open the port",
        "or take an adapter without such a timer",
    ];
    if let Some(latency) = case.seen.adapter.latency.filter(|latency| *latency >= NOTICEABLE) {
        return Some(Verdict::new(
            Defect::AdapterHoldsBack,
            &[],
            Certainty::Certain,
            format!(
                "the adapter holds back what it hears for up to {}: its latency timer says so",
                output::bound(latency)
            ),
            &next,
        ));
    }
    let dithered: Vec<&Asked> =
        case.seen.asked.iter().filter(|asked| asked.dithered && asked.is_good()).collect();
    let tick = TICKS.rev().map(Duration::from_millis).find(|tick| keeps_time(&dithered, *tick))?;
    let slaves = case.there().count();
    let certainty = match slaves {
        1 => Certainty::CannotBeToldFrom(format!(
            "a drive that looks at its line only every {}: no other drive is there to compare it with",
            output::bound(tick)
        )),
        _ => Certainty::Likely,
    };
    Some(Verdict::new(
        Defect::AdapterHoldsBack,
        &[],
        certainty,
        format!(
            "answers arrive only every {}, whenever the question was sent and whoever was asked: something between holds them \
             back",
            output::bound(tick)
        ),
        &next,
    ))
}

/// Answers with a pause inside for which masters do not wait: whoever asks takes what came before it for a damaged one.
pub(super) fn in_pieces(case: &Case<'_>, explained: &[u8]) -> Option<Verdict> {
    let usual = case.seen.config.chunk_gap;
    let is_his = |asked: &&Asked| asked.is_good() && !explained.contains(&asked.slave);
    let good: Vec<&Asked> = case.seen.asked.iter().filter(is_his).collect();
    let pauses = || good.iter().map(|asked| asked.pause).filter(|pause| *pause > usual);
    let (longest, torn) = (pauses().max()?, pauses().count());
    if torn <= FEW || torn * 50 < good.len() {
        return None;
    }
    let milliseconds = longest.as_millis() / 5 * 5 + 10;
    let chunk_gap = format!(
        "say chunk_gap = \"{milliseconds}ms\" of this line in the configuration of drived: it waits so long for the rest of an answer, and a \
         stop waits for that where one is damaged; drived plan says what the line carries then"
    );
    Some(Verdict::new(
        Defect::AnswersInPieces,
        &[],
        Certainty::Certain,
        format!(
            "{} of {} answers come with a pause inside, of up to {}: masters wait {} for what follows, and take the beginning for a \
             damaged answer",
            torn,
            good.len(),
            output::bound(longest),
            output::bound(usual)
        ),
        &[
            "take another adapter, or set this one, or the program behind which it stands, so that it hands over what it hears at once",
            &chunk_gap,
        ],
    ))
}

/// Whether nearly all of these ended at the same place of a clock that ticks so.
fn keeps_time(asked: &[&Asked], tick: Duration) -> bool {
    if asked.len() < 32 {
        return false;
    }
    let period = tick.as_nanos();
    // A busy computer notices some of them late.
    let width = (period / 6).max(2_500_000);
    let mut places: Vec<u128> = asked.iter().map(|asked| asked.ended.as_nanos() % period).collect();
    places.sort_unstable();
    let twice: Vec<u128> = places.iter().copied().chain(places.iter().map(|place| place + period)).collect();
    let most = places
        .iter()
        .enumerate()
        .map(|(index, from)| {
            twice.iter().skip(index).take(places.len()).take_while(|at| **at <= from + width).count()
        })
        .max()
        .unwrap_or_default();
    most * 20 >= asked.len() * 17
}

/// Answers that come after what masters usually wait.
pub(super) fn late(case: &Case<'_>, explained: &[u8]) -> Option<Verdict> {
    let is_late = |figures: &&Figures| {
        figures.late >= 2 && figures.late * 50 >= figures.asked && !explained.contains(&figures.slave)
    };
    let late: Vec<&Figures> = case.there().filter(is_late).collect();
    let slaves: Vec<u8> = late.iter().map(|figures| figures.slave).collect();
    if slaves.is_empty() {
        return None;
    }
    let usual = case.seen.config.response_timeout;
    let of_one = |figures: &&Figures| {
        let longest = figures.times.last().copied().unwrap_or_default().max(usual);
        let too_late = match longest.checked_sub(usual).filter(|by| !by.is_zero()) {
            Some(by) => format!("by up to {}", output::bound(by)),
            None => "after we had given them up".to_owned(),
        };
        format!(
            "{}: {} of {} answers came {too_late} too late",
            case.seen.name(figures.slave),
            figures.late,
            figures.answered.max(figures.late)
        )
    };
    let told: Vec<String> = late.iter().map(of_one).collect();
    let longest = late.iter().filter_map(|figures| figures.times.last()).max().copied().unwrap_or(usual);
    let wait = format!(
        "wait longer for it: `response_timeout` of the line in the configuration of drived, {} or more",
        output::bound(longest + longest / 2)
    );
    Some(Verdict::new(
        Defect::LateAnswers,
        &slaves,
        Certainty::Certain,
        format!("later than the {} that a master usually waits: {}", output::bound(usual), told.join("; ")),
        &[
            &wait,
            "if something stands between (a radio link, a serial server, a gateway), see what it adds",
            "a master that does not wait takes such an answer for that to its next question",
        ],
    ))
}

/// Drives that take longer than their manual says, or than drives usually do.
pub(super) fn slow(case: &Case<'_>, is_held: bool) -> Option<Verdict> {
    let slack = if is_held { Duration::from_millis(40) } else { Duration::from_millis(10) };
    let mut slow = Vec::new();
    for figures in case.there().filter(|figures| figures.times.len() >= 8) {
        let median = figures.quantile(50).unwrap_or_default();
        if median > case.seen.config.response_timeout {
            continue;
        }
        let printed = printed(case, figures.slave);
        let limit = match &printed {
            Some((time, _)) => *time + slack,
            None => USUAL,
        };
        if median > limit {
            let compared = match printed {
                Some((time, page)) => format!("its manual says {} ({page})", output::milliseconds(time)),
                None => format!(
                    "its manual prints no time, drives usually take less than {}",
                    output::bound(USUAL)
                ),
            };
            let text = format!(
                "{} takes {}: {compared}",
                case.seen.name(figures.slave),
                output::milliseconds(median)
            );
            slow.push((figures.slave, text, limit));
        }
    }
    let slaves: Vec<u8> = slow.iter().map(|(slave, ..)| *slave).collect();
    if slaves.is_empty() {
        return None;
    }
    let told: Vec<&str> = slow.iter().map(|(_, text, _)| text.as_str()).collect();
    let is_all = slaves.len() == case.there().count() && slaves.len() > 1;
    let certainty = if is_all {
        Certainty::CannotBeToldFrom(
            "something between that delays all answers alike: a serial server, a radio link".to_owned(),
        )
    } else {
        Certainty::Likely
    };
    Some(Verdict::new(
        Defect::SlowDrive,
        &slaves,
        certainty,
        told.join("; "),
        &[
            "see what the drive is busy with: its EEPROM being written again and again, a keypad, an option card",
            "on a 3G3EV lower n65, which is the time that it waits before it answers",
            "a slow drive holds up the others' polls: drived plan tells by how much",
        ],
    ))
}

/// The longest time that a drive takes before it answers, by its manual, and where that stands.
fn printed(case: &Case<'_>, slave: u8) -> Option<(Duration, String)> {
    let family = case.seen.expected.iter().find(|name| name.slave.number() == slave)?.family;
    let delay = family.capabilities().answer_delay?;
    let set = case.seen.own_waits.iter().find(|(of, _)| *of == slave).map(|(_, wait)| *wait);
    let AnswerDelay { code, longest, bits, source } = delay;
    let why = match set {
        Some(_) => format!("{bits} bits and its {code}, {source}"),
        None => format!("{bits} bits and {code} of at most {longest:?}, {source}"),
    };
    Some((delay.of(case.seen.config.serial, set), why))
}
