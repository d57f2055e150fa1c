//! A scan for whoever shows it elsewhere than on stdout: told as it goes, and given up when that is wished.

use std::time::Duration;

use drive_bus::LineConfig;
use drive_families::Family;

use super::{
    What, listen_first,
    plan::{Plan, Trial},
    sweep::{Find, Sweep, Told},
};
use drived_client::own_line;
use drived_words::{drive_spec::Addresses, duration::Time, failure::Failure, line_spec::LineSpec};

/// How long each address is waited for: as `drived scan` does.
const WAIT: Duration = Duration::from_millis(100);

/// What is scanned.
#[derive(Debug)]
pub struct Wanted {
    pub line: LineSpec,
    pub addresses: Addresses,
    /// All motors on this line stand: the other speeds, formats and protocols are tried too, up to the first at which somebody
    /// answers.
    pub standstill: bool,
}

/// How a scan goes on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum News {
    /// The line is listened to, before anything is asked; then it takes so many steps, and so long if nobody answers.
    Begins {
        steps: usize,
        takes: Duration,
    },
    /// It asks there, after so many steps.
    At {
        done: usize,
        setting: String,
        address: u8,
    },
    Found(Found),
    /// Something that a person has to know: another master, or what is wrong with the line.
    Doubt(String),
}

/// Somebody who answers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    pub address: u8,
    /// The line with the settings at which he answers, as `--line` takes it.
    pub line: String,
    /// The same for a person: `19200 8E1 rtu`.
    pub setting: String,
    /// `drive`, `unknown_slave`, `damaged`, or what makes two of one: only a drive can be taken up.
    pub verdict: String,
    /// Which families it can be of; a single one that is certain has said so itself.
    pub families: Vec<Alike>,
    /// In words.
    pub text: String,
    /// How often it has to hear something from its first message on: who takes it up no sooner than that may trip it.
    pub fed_every: Option<Duration>,
}

/// A family that somebody can be of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Alike {
    pub family: Family,
    pub is_certain: bool,
    /// What it says it is.
    pub says: Option<String>,
}

/// Scans until every address was asked or `given_up` ends; gives whether every address was asked. Nothing is written.
///
/// # Errors
/// The port cannot be opened, or what is wanted cannot be scanned. Another master is heard: before anything is asked, or behind it, and
/// nothing more is asked then.
pub async fn told(
    wanted: Wanted,
    mut tell: impl FnMut(News),
    given_up: impl Future<Output = ()>,
) -> Result<bool, Failure> {
    let Wanted { line, addresses, standstill } = wanted;
    let what = What {
        line,
        addresses,
        wait: Time(WAIT),
        standstill,
        speeds: Vec::new(),
        formats: Vec::new(),
        protocols: Vec::new(),
        first: standstill,
    };
    let (line, plan) = what.plan()?;
    // A port that is not there is told before anything is said of it.
    own_line::close(&own_line::open_line(line.clone()).await?).await;
    tell(News::Begins { steps: plan.steps.len(), takes: plan.time() });
    let mut given_up = std::pin::pin!(given_up);
    let mut sweep = Sweep::new(&plan, line.clone(), WAIT, own_line::open_line);
    sweep.ends_at_another = true;
    tokio::select! {
        // Nobody stands beside it with a hand at the key: into another master's questions nothing is asked.
        heard = listen_first(&line) => if let Some(another) = heard {
            sweep.close().await;
            return Err(Failure::Input(another));
        },
        () = &mut given_up => return Ok(false),
    }
    let mut only = None;
    let scan = sweep.run(
        |step, found| {
            only = only.or(found.filter(|_| standstill));
            only.is_none_or(|only| only == step.trial)
        },
        |told| {
            if let Some(news) = news(&plan, &line, told) {
                tell(news);
            }
            Ok(())
        },
    );
    let ended = tokio::select! {
        ended = scan => ended.map(|()| true),
        () = &mut given_up => Ok(false),
    };
    sweep.findings().into_iter().map(News::Doubt).for_each(&mut tell);
    sweep.close().await;
    ended
}

fn news(plan: &Plan, line: &LineConfig, told: Told) -> Option<News> {
    let setting = |trial: &Trial| format!("{} {}", trial.serial, trial.protocol.name());
    Some(match told {
        Told::At { done, step } => {
            News::At { done, setting: setting(plan.trials.get(step.trial)?), address: step.slave.number() }
        }
        Told::Found(Find { step, answer, found }) => {
            let trial = plan.trials.get(step.trial)?;
            let alike = answer.alike().iter().map(|likeness| Alike {
                family: likeness.family,
                is_certain: likeness.certain,
                says: likeness.says(),
            });
            News::Found(Found {
                address: step.slave.number(),
                line: trial.config(line.clone(), Duration::ZERO).to_string(),
                setting: setting(trial),
                verdict: answer.verdict().to_owned(),
                families: alike.collect(),
                text: answer.words(),
                fed_every: found.interval,
            })
        }
    })
}
