//! `drived scan`: who answers on a line, at which speed and format, and which family is likely there.

mod answer;
mod feeding;
mod found;
mod look;
mod plan;
mod save;
mod sweep;
#[cfg(test)]
mod tests;
pub mod told;

use std::{path::PathBuf, time::Duration};

use drive_bus::{
    LineConfig, Protocol,
    config::baud_of,
    listen::{Listener, Role},
};
use drive_core::serial::CharacterFormat;
use tokio::time::Instant;

use self::{
    found::Finds,
    plan::{Others, Plan, Trial},
    sweep::{Sweep, Told},
};
use drived_client::own_line;
use drived_words::{
    drive_spec::Addresses,
    duration::Time,
    failure::Failure,
    line_spec::{self, LineSpec},
    output::{self, Progress},
    signals::Ending,
};

pub use self::save::Save;

/// Why nobody may scan at other speeds while motors run.
const WARNING: &str = "every motor on this line has to stand until the scan has ended: frames at another speed than theirs are \
     noise to drives that run, and a drive whose watchdog is armed begins to count by the first message that it hears";

/// How long the line is listened to before anything is asked: a panel or a PLC asks once a second or more often.
const LISTENING: Duration = Duration::from_secs(2);

/// Find out who answers on a line, at which speed and format, and which family is likely there; nothing is written
///
/// Each address is asked for one register; whoever answers, even by refusing, is read as each family would be. Speed and
/// format are those of --line; with --standstill all others are tried too that a family can be set to, the likeliest first.
///
/// Take care: a drive whose communication watchdog is armed may begin to expect messages by the first one that it hears. Whoever has
/// answered is asked again and again until the scan ends, as often as its watchdog wants, and may trip after that. Scan while
/// the motors stand. Exit code 1 when nobody answers.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    what: What,
    /// Write what was found as a configuration; a file that is there is not touched
    #[arg(long, value_name = "FILE")]
    save: Option<PathBuf>,
    /// Print one JSON object for each find, and one for the whole
    #[arg(long)]
    json: bool,
}

/// What is scanned.
#[derive(Debug, clap::Args)]
#[group(skip)]
pub struct What {
    // The text has brackets that a doc comment would take for links.
    #[arg(long, value_name = "LINE", help = line_spec::HELP)]
    line: LineSpec,
    /// The addresses to ask, such as 1-31,40
    #[arg(long, value_name = "ADDRESSES", default_value = "1-247")]
    addresses: Addresses,
    /// How long to wait for each answer
    #[arg(long, value_name = "TIME", default_value = "100ms")]
    wait: Time,
    /// All motors on this line stand, and will until the scan has ended: try other speeds, formats and protocols too
    #[arg(long)]
    standstill: bool,
    /// Of the other speeds only these, such as 9600,19200
    #[arg(long, value_name = "SPEEDS", value_delimiter = ',', value_parser = baud_of)]
    speeds: Vec<u32>,
    /// Of the other formats only these, such as 8E1,8N1
    #[arg(long, value_name = "FORMATS", value_delimiter = ',')]
    formats: Vec<CharacterFormat>,
    /// Of the protocols only these: rtu, ascii, unitelway
    #[arg(long, value_name = "PROTOCOLS", value_delimiter = ',')]
    protocols: Vec<Protocol>,
    /// End with the first speed and format at which somebody answers, when all addresses have been asked there
    #[arg(long)]
    first: bool,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let Args { what, save, json } = args;
    scan(&what, save.map(|file| Save { file, name: "main".to_owned(), option: "--save" }), json).await
}

/// Scans, tells who is there, and writes a configuration where one is wanted.
pub async fn scan(what: &What, save: Option<Save>, is_json: bool) -> Result<(), Failure> {
    save.as_ref().map_or(Ok(()), Save::check)?;
    let (line, plan) = what.plan()?;
    let mut ending = Ending::listen()?;
    // A port that is not there is told before anything is said of it.
    let began = Instant::now();
    own_line::close(&own_line::open_line(line.clone()).await?).await;
    let plan = plan.switching_in(began.elapsed());
    let mut sweep = Sweep::new(&plan, line.clone(), what.wait.0, own_line::open_line);
    what.announce(&line, &plan, is_json)?;
    tokio::select! {
        heard = listen_first(&line) => {
            sweep.is_shared = heard.is_some();
            heard.into_iter().for_each(output::complain);
        }
        () = ending.asked() => return Ok(()),
    }
    let began = Instant::now();
    let mut finds = Finds::on(line, is_json);
    let whole = {
        let mut progress = Progress::of("scan", plan.steps.len());
        let (mut asked, mut only) = (0, None);
        let (first, trials) = (what.first, &plan.trials);
        let scan = sweep.run(
            |step, found| {
                only = only.or(found.filter(|_| first));
                only.is_none_or(|only| only == step.trial)
            },
            |told| match told {
                Told::At { done, step } => {
                    asked += 1;
                    if let Some(trial) = trials.get(step.trial) {
                        progress.note(format_args!(
                            "{} {}, address {}",
                            trial.serial,
                            trial.protocol.name(),
                            step.slave
                        ));
                    }
                    progress.at(done);
                    Ok(())
                }
                Told::Found(find) => finds.note(&plan, find),
            },
        );
        let ended = tokio::select! {
            ended = scan => ended.map(|()| true),
            () = ending.asked() => Ok(false),
        };
        ended.map(|is_whole| (is_whole, asked))
    };
    // Whoever asks it to end waits for nothing more.
    let tripped = match whole {
        Ok((true, _)) => tokio::select! {
            tripped = sweep.tripped() => tripped.unwrap_or_default(),
            () = ending.asked() => Vec::new(),
        },
        _ => Vec::new(),
    };
    let findings = sweep.findings();
    sweep.close().await;
    let (is_whole, asked) = whole?;
    findings.into_iter().for_each(output::complain);
    finds.conclude(asked, what.addresses.0.len(), (began.elapsed(), is_whole), &tripped)?;
    match save {
        Some(save) if is_json => save.write(&finds, is_whole).map(drop),
        Some(save) => output::say(save.write(&finds, is_whole)?),
        None => Ok(()),
    }
}

/// Hears whether somebody else asks on this line before anything is asked, and says so: his questions and ours would destroy each
/// other.
async fn listen_first(line: &LineConfig) -> Option<String> {
    if !line.protocol.is_paced() {
        return None;
    }
    // A port that cannot be listened to is told of when it is asked.
    let mut listener = Listener::open(line).await.ok()?;
    let mut requests = 0_u32;
    let listening = async {
        while let Ok(Some(heard)) = listener.next().await {
            requests += u32::from(matches!(heard.role, Role::Request | Role::Either));
        }
        std::future::pending::<()>().await;
    };
    let _ = tokio::time::timeout(LISTENING, listening).await;
    (requests > 0).then(|| {
        format!(
            "somebody else asks on this line: {requests} requests in {LISTENING:?}. This scan disturbs him, and he it: end his \
             asking first, then scan again"
        )
    })
}

impl What {
    /// The port, and what is asked on it.
    fn plan(&self) -> Result<(LineConfig, Plan), Failure> {
        let input = |error: &dyn std::fmt::Display| Failure::Input(error.to_string());
        if self.wait.0.is_zero() {
            return Err(input(&"--wait 0: expected how long to wait for each answer"));
        }
        let lists = !(self.speeds.is_empty() && self.formats.is_empty() && self.protocols.is_empty());
        if lists && !self.standstill {
            return Err(Failure::Input(format!(
                "other speeds, formats and protocols are tried with --standstill: {WARNING}"
            )));
        }
        let (line, named) = match self.line.port().filter(|(_, is_said)| self.standstill && !is_said) {
            Some((line, _)) => (line, None),
            None => {
                let line = self.line.config(&[]).map_err(|error| input(&error))?;
                let named = Trial::named(line.serial, line.protocol);
                (line, Some(named))
            }
        };
        if self.standstill && self.line.port().is_none() {
            return Err(input(
                &"--standstill is for serial ports: the speed behind a server is set at the server",
            ));
        }
        let Self { speeds, formats, protocols, .. } = self;
        let others =
            Others { speeds: speeds.clone(), formats: formats.clone(), protocols: protocols.clone() };
        let trials = if self.standstill { others.trials(named) } else { named.into_iter().collect() };
        if trials.is_empty() {
            return Err(input(
                &"no family of drives can be set so: drived families lists what each can be set to",
            ));
        }
        Ok((line, Plan::new(trials, &self.addresses.0, self.wait.0)))
    }

    /// Says how long it will take, before anything is sent.
    fn announce(&self, line: &LineConfig, plan: &Plan, is_json: bool) -> Result<(), Failure> {
        if self.standstill {
            output::complain(WARNING);
        }
        if is_json {
            return Ok(());
        }
        let addresses = output::counted(self.addresses.0.len(), "address", "addresses");
        let on = match &plan.trials[..] {
            [only] => line_spec::describe(&only.config(line.clone(), self.wait.0)),
            several => {
                format!("{} at {} speeds, formats and protocols", line_spec::port(line), several.len())
            }
        };
        output::say(format_args!(
            "asking {addresses} on {on}: {} if none answers, up to about {} more for each that does; only reads",
            long(plan.time()),
            long(plan.one_more()),
        ))?;
        if line.protocol.is_paced() {
            output::say(format_args!(
                "before that it listens for {LISTENING:?}. What it disturbs: another master on this line, and drives whose watchdog is \
                 armed, which count from the first message that they hear"
            ))?;
        }
        Ok(())
    }
}

/// A time that somebody waits for.
fn long(time: Duration) -> String {
    match time.as_secs() {
        0..120 => output::bound(time),
        seconds => format!("{} min {} s", seconds / 60, seconds % 60),
    }
}
