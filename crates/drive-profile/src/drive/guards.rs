//! Guards and fingerprints: what has to read so before anything but a stop is written.

use drive_core::{Class, Command, Error, Identity, Port, RawWord, Refusal, Result, interned};

use super::{Owner, ProfileDrive, Words, sight::FullScale};
use crate::{format::Guard, profile::Profile};

/// What the guards of a drive were found to say.
#[derive(Debug, Clone, Default)]
pub(super) struct Guarded {
    /// They were read since the last reconnect, and hold.
    pub(super) hold: bool,
    /// They have held since this value was made: the drive is the one of its profile.
    pub(super) have_held: bool,
    /// What was found otherwise at the last reading.
    pub(super) otherwise: Option<&'static str>,
    /// Which setting has to be made at the drive, where a guard was found otherwise and every fingerprint as it has to be: it is the
    /// drive of its profile then, set up for something else.
    setting: Option<&'static str>,
    /// A run command of this side went out where they held: it may stand in the drive, whatever is read there since.
    pub(super) started: bool,
}

impl Guarded {
    /// A drive without guards has nothing to show.
    pub(super) fn of(profile: &Profile, owner: &Owner) -> Self {
        let none = is_unguarded(profile, owner);
        Self { hold: none, have_held: none, otherwise: None, setting: None, started: false }
    }
}

fn all(profile: &Profile) -> impl Iterator<Item = &Guard> {
    let who = &profile.file().who;
    let lists = [&who.fingerprints, &who.guards].into_iter().filter_map(|list| list.given());
    lists.flatten().map(crate::format::Spanned::get_ref)
}

/// The register that holds what 100 % is, where its owner has said it as well: they have to be one.
fn said_twice<'a>(profile: &'a Profile, owner: &Owner) -> Option<&'a str> {
    profile.file().full_scale().filter(|_| owner.full_scale.is_some())
}

fn is_unguarded(profile: &Profile, owner: &Owner) -> bool {
    all(profile).next().is_none() && said_twice(profile, owner).is_none()
}

/// What has to be set at the drive, with what was read.
fn is_to_be_set(guard: &Guard, read: u16) -> String {
    let name = guard.register.get_ref();
    let words = |all: &[u16]| all.iter().map(u16::to_string).collect::<Vec<_>>().join(" or ");
    let mask = guard.mask.unwrap_or(u16::MAX);
    let of = if mask == u16::MAX { name.clone() } else { format!("{name} & {mask:04X}h") };
    let to = match (&guard.is, &guard.is_not) {
        (Some(is), _) => format!("to {}", words(is)),
        (None, is_not) => format!("to something else than {}", words(is_not.as_deref().unwrap_or_default())),
    };
    format!("this does not hold: {} ({of} reads {}): set {of} {to} at the drive", guard.what, read & mask)
}

fn holds(guard: &Guard, word: u16) -> bool {
    let word = word & guard.mask.unwrap_or(u16::MAX);
    guard.is.as_ref().is_none_or(|is| is.contains(&word))
        && guard.is_not.as_ref().is_none_or(|is_not| !is_not.contains(&word))
}

/// What does not hold, with what was read and what was wanted.
fn is_otherwise(guard: &Guard, read: Option<u16>) -> String {
    let words = |all: &[u16]| all.iter().map(|word| format!("{word:04X}h")).collect::<Vec<_>>().join(" or ");
    let wanted = match (&guard.is, &guard.is_not) {
        (Some(is), _) => format!("not {}", words(is)),
        (None, is_not) => format!("may not be {}", words(is_not.as_deref().unwrap_or_default())),
    };
    let mask = guard.mask.unwrap_or(u16::MAX);
    let masked = if mask == u16::MAX { String::new() } else { format!(" & {mask:04X}h") };
    let read = read.map_or_else(|| "was not read".to_owned(), |word| format!("reads {:04X}h", word & mask));
    format!(
        "none of which this holds: {} ({}{masked} {read}, and {wanted})",
        guard.what,
        guard.register.get_ref()
    )
}

impl<P: Port> ProfileDrive<P> {
    /// Reads the guards anew, and gives the words of the fingerprints that have one value: they are the same each time it is asked.
    pub(super) async fn read_fingerprints(&mut self) -> Result<Identity> {
        self.guarded.hold = false;
        let words = self.read_guards(Class::Background).await?;
        let profile = self.profile.clone();
        let told = profile
            .file()
            .who
            .fingerprints
            .given()
            .into_iter()
            .flatten()
            .map(crate::format::Spanned::get_ref);
        let constant = told.filter(|guard| guard.is.as_ref().is_some_and(|is| is.len() == 1));
        let code = |guard: &Guard| {
            let name = guard.register.get_ref();
            let register = profile.file().named(name)?;
            let (_, address) = profile.file().place(register)?;
            let value = profile.word(&words, name)? & guard.mask.unwrap_or(u16::MAX);
            Some(RawWord { address, code: interned::text(name), value })
        };
        Ok(Identity { codes: constant.filter_map(code).collect(), ..Identity::default() })
    }

    /// Reads the guards, unless they were read since the last reconnect and held at the last look.
    pub(super) async fn see_guards(&mut self, class: Class) -> Result<()> {
        if !self.guarded.hold || self.guarded.otherwise.is_some() {
            self.read_guards(class).await?;
        }
        Ok(())
    }

    /// What was read of them proves nothing any more: the line was lost, and the drive may be another one, or set up otherwise.
    pub(super) fn forget_guards(&mut self) {
        self.guarded.hold = is_unguarded(&self.profile, &self.owner);
    }

    /// Whether there is anything to be watched.
    pub(super) fn is_guarded(&self) -> bool {
        !is_unguarded(&self.profile, &self.owner)
    }

    /// What was found otherwise at the last look, as a start would be refused for it.
    pub(super) fn found_otherwise(&self) -> Option<Refusal> {
        self.guarded.otherwise.map(|what| self.why_not(what))
    }

    pub(super) async fn read_guards(&mut self, class: Class) -> Result<Words> {
        let words = self.guard_words(class).await?;
        (self.guarded.otherwise, self.guarded.setting) = self.found(&words);
        if self.guarded.otherwise.is_none() {
            (self.guarded.hold, self.guarded.have_held) = (true, true);
        }
        Ok(words)
    }

    async fn guard_words(&mut self, class: Class) -> Result<Words> {
        let profile = self.profile.clone();
        let mut words = Words::default();
        for block in profile.guards() {
            let read = self.read_block(class, block).await?;
            words.keep(block, read);
        }
        Ok(words)
    }

    /// What these words say otherwise, and which setting has to be made for it.
    fn found(&self, words: &Words) -> (Option<&'static str>, Option<&'static str>) {
        let profile = &self.profile;
        let read = |guard: &Guard| profile.word(words, guard.register.get_ref());
        let fails = |guard: &&Guard| read(guard).is_none_or(|word| !holds(guard, word));
        let scale = self.scale_is_otherwise(words);
        let found = all(profile).find(fails).map(|guard| interned::text(&is_otherwise(guard, read(guard))));
        let guards = profile.file().who.guards.given().into_iter().flatten();
        let failing = all(profile).filter(|guard| fails(guard)).count();
        let mut unset = guards.map(crate::format::Spanned::get_ref).filter(fails);
        // A fingerprint that fails is no setting that anybody can make.
        let setting = (unset.clone().count() == failing)
            .then(|| {
                unset.find_map(|guard| Some(interned::text(&is_to_be_set(guard, read(guard)?)))).or(scale)
            })
            .flatten();
        (found.or(scale), setting)
    }

    /// What is found otherwise of a drive that has refused a stop, where it can be read. It is only told: no later stop is held back for it.
    pub(super) async fn why_denied(&mut self) -> Option<Refusal> {
        let words = self.guard_words(Class::Command).await.ok()?;
        let (otherwise, setting) = self.found(&words);
        otherwise.map(|otherwise| setting.map_or(Refusal::AnotherDrive(otherwise), Refusal::Settings))
    }

    /// That the drive holds another full scale than its owner has said.
    fn scale_is_otherwise(&self, words: &Words) -> Option<&'static str> {
        let (name, said) = said_twice(&self.profile, &self.owner).zip(self.owner.full_scale)?;
        let held = match &self.sight.full_scale {
            Some(FullScale::Register(cell)) => self.frequency(words, *cell),
            _ => None,
        };
        let reads = match held {
            Some(held) if held == said => return None,
            Some(held) => format!("reads {held}"),
            None => "was not read".to_owned(),
        };
        Some(interned::text(&format!(
            "this does not hold: 100 % is {said}, as its owner says ({name} {reads}): set it at the drive, or say what it is by full-scale"
        )))
    }

    /// Before anything but a stop is written.
    pub(super) async fn guard(&mut self, command: Command) -> Result<()> {
        self.see_guards(Class::Command).await?;
        match self.guarded.otherwise {
            Some(what) => Err(self.refused(command, self.why_not(what))),
            None => Ok(()),
        }
    }

    /// Why nothing is written to a drive of which this was found.
    fn why_not(&self, otherwise: &'static str) -> Refusal {
        self.guarded.setting.map_or(Refusal::AnotherDrive(otherwise), Refusal::Settings)
    }

    /// What was found otherwise, of a drive that no run command of this side ever went to: it is another one. Once one did, it may stand
    /// there, and act when whatever is otherwise is as before again: a stop and a withdrawal go out, whatever is read.
    pub(super) fn is_another(&self) -> Option<&'static str> {
        let is_ours = self.guarded.started || self.watch.run.lease().is_some();
        self.guarded.otherwise.filter(|_| !self.guarded.hold && !is_ours)
    }

    /// A stop does not go to a drive that was found to be another one: its stop word may be that one's run word. Nothing was sent.
    pub(super) fn stop_is_barred(&self, command: Command) -> Option<Error> {
        self.is_another().map(|what| self.refused(command, self.why_not(what)))
    }
}
