//! `[history]`: what is kept, for how long, and where.

use std::path::{Path, PathBuf};

use drived_config::config::{Entry as _, settings, within};
use drived_face::{ConfigError, Site, Source};

use crate::{
    forecast::Forecast,
    forward::{Forward, Target},
    maintenance::Maintained,
    write::Limits,
};

/// The file of the state folder.
const FILE: &str = "history.sqlite";

/// The black box of a configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HistoryConfig {
    /// Where; `None`: nothing is kept.
    pub file: Option<PathBuf>,
    pub limits: Limits,
    pub forecast: Forecast,
    /// Where it is sent on to; `None`: it stays here.
    pub forward: Option<Forward>,
    /// What is to be seen to of its drives.
    pub maintained: Vec<Maintained>,
}

/// What is said, while it is read.
#[allow(unreachable_pub, reason = "the table that sets it is declared as public")]
#[derive(Debug, Clone)]
pub struct Draft {
    is_on: bool,
    file: Option<PathBuf>,
    polled_hours: u32,
    minute_days: u32,
    years: u32,
    megabytes: u32,
    forward: Option<Target>,
    forward_token: Option<PathBuf>,
    maintained: Vec<Maintained>,
}

settings! {
    /// `[history]`.
    HistoryEntry sets Draft;

    /// `false`: nothing is kept
    on: bool = "`true`, where there is a state folder", |to, said| to.is_on = *said;
    /// another file; beside the configuration unless the path is whole
    file: PathBuf = "`history.sqlite` in the state folder", |to, said| to.file = Some(said.clone());
    /// how many hours values are kept as they were read, 1 to 8760
    polled_hours: u32 = "`48`", |to, said| to.polled_hours = within(*said, 1..=8_760, "")?;
    /// how many days their least, mean and greatest of each minute are kept, 1 to 3660
    minute_days: u32 = "`90`", |to, said| to.minute_days = within(*said, 1..=3_660, "")?;
    /// how many years those of each hour, events, alarms and commands are kept, 1 to 50
    years: u32 = "`10`", |to, said| to.years = within(*said, 1..=50, "")?;
    /// how large the file may become, in MiB, 16 to 1048576; what is finest goes first then, and the oldest words where those take half of it
    size_mib: u32 = "`2048`", |to, said| to.megabytes = within(*said, 16..=1_048_576, "")?;
    /// where every value is sent on to, as lines of Influx: `http://127.0.0.1:8428/write` for VictoriaMetrics, `http://127.0.0.1:8086/write?db=plant` or `…/api/v2/write?org=ORG&bucket=BUCKET` for InfluxDB; what could not be sent follows when that is back
    forward: String = "nowhere", |to, said| to.forward = Some(said.parse().map_err(str::to_owned)?);
    /// the file of the token that it wants; beside the configuration unless the path is whole
    forward_token_file: PathBuf = "none", |to, said| to.forward_token = Some(said.clone());
    /// what of a drive is to be seen to after so many hours of running or so many starts: `[{ drive = "pump", part = "bearings", hours = 20000 }]`, with `starts` instead or besides; it becomes an alarm, `drived alarms done NUMBER` has it counted anew, and what ran before the history began is not in it
    maintenance: Vec<Maintained> = "nothing", |to, said| to.maintained = checked(said)?;
}

impl Default for Draft {
    fn default() -> Self {
        Self {
            is_on: true,
            file: None,
            polled_hours: 48,
            minute_days: 90,
            years: 10,
            megabytes: 2_048,
            forward: None,
            forward_token: None,
            maintained: Vec::new(),
        }
    }
}

impl HistoryConfig {
    /// What holds where the file says nothing.
    #[must_use]
    pub fn unsaid(site: &Site<'_>) -> Self {
        Self::from(Draft::default(), None, site)
    }

    /// What the file says.
    ///
    /// # Errors
    /// A key says what cannot be.
    pub fn read(source: Source<'_>, entry: &HistoryEntry, site: &Site<'_>) -> Result<Self, ConfigError> {
        let mut draft = Draft::default();
        entry.set(source, &mut draft)?;
        let is_unknown = |one: &&Maintained| !site.drives().any(|drive| drive == one.drive);
        if let Some(said) = &entry.maintenance
            && let Some(one) = said.get_ref().iter().find(is_unknown)
        {
            return Err(source.error(said.span(), format!("no drive is called {:?}", one.drive)));
        }
        Ok(Self::from(draft, source.file.parent(), site))
    }

    fn from(draft: Draft, beside: Option<&Path>, site: &Site<'_>) -> Self {
        let Draft {
            is_on,
            file,
            polled_hours,
            minute_days,
            years,
            megabytes,
            forward,
            forward_token,
            maintained,
        } = draft;
        let said = file.map(|file| beside.unwrap_or(Path::new("")).join(file));
        let file = said.or_else(|| site.state.folder.as_ref().map(|folder| folder.join(FILE)));
        let limits = Limits::of(polled_hours, minute_days, years, megabytes);
        let token = forward_token.map(|file| beside.unwrap_or(Path::new("")).join(file));
        let forward = forward.map(|target| Forward { target, token });
        let forecast = Forecast::of(site, &limits);
        Self { file: file.filter(|_| is_on), limits, forecast, forward, maintained }
    }
}

/// What is to be maintained, each part of a drive once.
fn checked(said: &[Maintained]) -> Result<Vec<Maintained>, String> {
    for (place, one) in said.iter().enumerate() {
        let name = format!("{:?} of {:?}", one.part, one.drive);
        if one.part.trim().is_empty() || one.part.chars().count() > 60 {
            return Err(format!("{name}: expected a part of 1 to 60 characters"));
        }
        if !matches!((one.hours, one.starts), (Some(1..), None | Some(1..)) | (None, Some(1..))) {
            return Err(format!("{name}: expected hours or starts, of 1 or more"));
        }
        if said[..place].iter().any(|other| (&other.drive, &other.part) == (&one.drive, &one.part)) {
            return Err(format!("{name} is there twice"));
        }
    }
    Ok(said.to_vec())
}
