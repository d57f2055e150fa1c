//! The profiles that are shipped, and their texts.

use std::sync::LazyLock;

use crate::{check::read, profile::Profile};

/// A text for each, as it stands in `profiles/`.
pub const TEXTS: &[(&str, &str)] = &[
    ("abb/acs550", include_str!("../profiles/abb/acs550.toml")),
    ("automationdirect/gs4", include_str!("../profiles/automationdirect/gs4.toml")),
    ("bosch/efc5610", include_str!("../profiles/bosch/efc5610.toml")),
    ("danfoss/danfoss-fc", include_str!("../profiles/danfoss/danfoss-fc.toml")),
    ("danfoss/danfoss-fc51", include_str!("../profiles/danfoss/danfoss-fc51.toml")),
    ("delta/ms300", include_str!("../profiles/delta/ms300.toml")),
    ("fuji/frenic", include_str!("../profiles/fuji/frenic.toml")),
    ("hitachi/wj200", include_str!("../profiles/hitachi/wj200.toml")),
    ("huanyang/gt", include_str!("../profiles/huanyang/gt.toml")),
    ("invertek/optidrive-eco", include_str!("../profiles/invertek/optidrive-eco.toml")),
    ("invt/goodrive", include_str!("../profiles/invt/goodrive.toml")),
    ("ls/ig5a", include_str!("../profiles/ls/ig5a.toml")),
    ("md380/md380", include_str!("../profiles/md380/md380.toml")),
    ("mitsubishi/fr-d700", include_str!("../profiles/mitsubishi/fr-d700.toml")),
    ("omron/mx2", include_str!("../profiles/omron/mx2.toml")),
    ("schneider/altivar", include_str!("../profiles/schneider/altivar.toml")),
    ("siemens/g120", include_str!("../profiles/siemens/g120.toml")),
    ("siemens/v20", include_str!("../profiles/siemens/v20.toml")),
    ("toshiba/vfs15", include_str!("../profiles/toshiba/vfs15.toml")),
    ("yaskawa/a1000", include_str!("../profiles/yaskawa/a1000.toml")),
];

/// All of them. A text that is none is left out; the tests of this crate read each.
static ALL: LazyLock<Vec<Profile>> =
    LazyLock::new(|| TEXTS.iter().filter_map(|(_, text)| read(text).ok()).collect());

/// The profiles that are shipped, by maker and drive.
#[must_use]
pub fn all() -> &'static [Profile] {
    &ALL
}

/// The one of this key.
#[must_use]
pub fn find(key: &str) -> Option<&'static Profile> {
    all().iter().find(|profile| profile.key() == key)
}
