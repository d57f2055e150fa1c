//! `drived profile list`.

use drive_profile::Profile;
use serde_json::json;

use drived_config::profiles;
use drived_words::{
    failure::Failure,
    output::{self, JsonArgs, Table},
};

/// List the drives from files, each with the level that it reaches
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    json: JsonArgs,
}

pub(crate) fn run(args: Args) -> Result<(), Failure> {
    let all = profiles::all();
    if args.json.is_json() {
        return all.iter().try_for_each(|(profile, file)| {
            output::say_as_it_is(json!({
                "profile": profile.key(),
                "name": profile.name(),
                "level": profile.level().to_string(),
                "keeps_from_the_next": next(profile),
                "sha256": profile.digest(),
                "file": file,
            }))
        });
    }
    let mut table = Table::new(["profile", "drive", "level", "keeps it from the next", "from"]);
    for (profile, file) in &all {
        let from = file.as_ref().map_or_else(|| "shipped".to_owned(), |file| file.display().to_string());
        let keeps = next(profile).unwrap_or_else(|| "-".to_owned());
        table.row([
            profile.key().to_owned(),
            profile.name().to_owned(),
            profile.level().to_string(),
            keeps,
            from,
        ]);
    }
    output::say_table(table)
}

/// What keeps it from the next level.
fn next(profile: &Profile) -> Option<String> {
    let gap = profile.gaps().iter().find(|gap| gap.keeps_from.is_some())?;
    Some(gap.what.clone())
}
