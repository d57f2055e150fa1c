//! What the sources themselves must be, read as text.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

/// The places of a source in which a value is looked up by the name of its key. To set one is none.
fn look_ups(source: &str) -> Vec<&str> {
    let code = source.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let is_look_up = |line: &&str| {
        let called = [".get(\"", ".get_mut(\"", ".pointer(\"", ".pointer_mut(\"", ".get(key)"];
        let indexed = ["[\"", "[key]"].iter().flat_map(|opened| line.match_indices(opened)).any(|(at, _)| {
            let of_something =
                line[..at].ends_with(|last: char| last.is_alphanumeric() || "_)]".contains(last));
            let behind = line[at..].split_once(']').map_or("", |(_, behind)| behind);
            of_something && !(behind.starts_with(" = "))
        });
        indexed || called.iter().any(|call| line.contains(call))
    };
    code.lines().filter(|line| !line.trim_start().starts_with("//")).filter(is_look_up).collect()
}

#[test]
fn no_tool_looks_anything_up_by_its_key_but_reads_it_as_what_it_is() {
    fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            match entry.is_dir() {
                true => sources(&entry, found),
                false => found.push(entry),
            }
        }
    }
    assert_eq!(look_ups("let age = drive[\"status\"][\"age_ms\"].as_u64();").len(), 1);
    assert_eq!(look_ups("told.get(\"reason\")").len(), 1);
    assert_eq!(look_ups("let age = drive[key].as_u64();").len(), 1);
    assert!(look_ups("body[\"setpoint\"] = json!(setpoint);\ndaemon.read(&[\"state\"])").is_empty());
    assert!(look_ups("object[key] = meaning;").is_empty());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("crates");
    let mut found =
        vec![folder.join("drived-words/src/values.rs"), folder.join("drived-doors/src/audit/show.rs")];
    for of_tools in [
        "drived-client/src",
        "drived-daemon/src/run",
        "drived/src/commands",
        "drived-line-tools/src",
        "drived-tools/src",
        "drived-screen/src/row",
    ] {
        sources(&folder.join(of_tools), &mut found);
    }
    found.retain(|path| {
        !path.ends_with("tests.rs")
            && !path.iter().any(|part| part == "tests")
            && path.extension().is_some_and(|end| end == "rs")
    });
    assert!(found.len() > 100, "{}", found.len());
    for path in found {
        let source = fs::read_to_string(&path).unwrap();
        assert_eq!(look_ups(&source), Vec::<&str>::new(), "{}", path.display());
    }
}

/// A crate's source without comments and without what only tests see, rustfmt's way of writing taken for granted.
fn plain(text: &str) -> String {
    let mut plain = String::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let indent = &line[..line.len() - line.trim_start().len()];
        if line.trim_start().starts_with("#[cfg(") && line.contains("test") {
            // The item behind it: to its semicolon, or to the brace that closes it.
            let close = format!("{indent}}}");
            let item = lines.by_ref().find(|line| !line.trim_start().starts_with("#["));
            if item.is_some_and(|item| !item.ends_with([';', ',', '}'])) {
                let _ = lines.by_ref().find(|line| line.starts_with(&close));
            }
        } else {
            plain.push_str(line.split("//").next().unwrap_or_default());
            plain.push('\n');
        }
    }
    plain
}

/// The first names of what a list of imports or a path says: `a` and `b` of `{a::{x, y}, b}`.
fn first_names(said: &str) -> Vec<String> {
    let name = |text: &str| -> String {
        text.trim_start().chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect()
    };
    let Some(list) = said.strip_prefix('{') else { return vec![name(said)] };
    let (mut names, mut depth, mut begins) = (Vec::new(), 0, true);
    for (at, letter) in list.char_indices() {
        match letter {
            '}' if depth == 0 => break,
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => begins = true,
            _ if begins && !letter.is_whitespace() => {
                names.push(name(&list[at..]));
                begins = false;
            }
            _ => {}
        }
    }
    names
}

/// What a module at this depth below its crate names of the crate's root.
fn named(code: &str, depth: usize) -> Vec<String> {
    let up = "super::".repeat(depth);
    let of_root = |path: &str| -> Vec<String> {
        let starts = code.match_indices(path).filter(|(at, _)| {
            let before = code[..*at].chars().next_back();
            before.is_none_or(|before| !before.is_alphanumeric() && !"_:$".contains(before))
        });
        starts.flat_map(|(at, _)| first_names(&code[at + path.len()..])).collect()
    };
    [of_root("crate::"), of_root(&up)].concat()
}

/// Which top-level modules of a crate each of them names.
#[derive(Default)]
struct Modules(BTreeMap<String, BTreeSet<String>>);

impl Modules {
    fn of(source: &Path) -> Self {
        let mut all = Self::default();
        let root =
            ["lib.rs", "main.rs"].map(|name| source.join(name)).into_iter().find(|path| path.is_file());
        all.read(&root.expect("a crate has a root"), &[]);
        let known: BTreeSet<String> = all.0.keys().cloned().collect();
        for (name, uses) in &mut all.0 {
            uses.retain(|other| other != name && known.contains(other));
        }
        all
    }

    /// Reads a file and the modules below it.
    fn read(&mut self, file: &Path, path: &[&str]) {
        let text = fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let code = plain(&text);
        if let [top, ..] = path {
            self.0.entry((*top).to_owned()).or_default().extend(named(&code, path.len()));
        }
        let folder = file.parent().expect("it is in a folder");
        let stem = file.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let below =
            if ["lib", "main", "mod"].contains(&stem) { folder.to_owned() } else { folder.join(stem) };
        let mut placed = None;
        for line in code.lines().map(str::trim) {
            if let Some(place) = line.strip_prefix("#[path = \"") {
                placed = place.split('"').next().map(|place| folder.join(place));
            }
            let Some((visible, name)) = line.strip_suffix(';').and_then(|line| line.split_once("mod "))
            else {
                continue;
            };
            if !(visible.is_empty() || visible.starts_with("pub")) {
                continue;
            }
            let places = [below.join(format!("{name}.rs")), below.join(name).join("mod.rs")];
            let place = placed.take().or_else(|| places.into_iter().find(|place| place.is_file()));
            let place = place.unwrap_or_else(|| panic!("{}: no file of {name}", file.display()));
            self.read(&place, &[path, &[name]].concat());
        }
    }

    /// A way from a module back to itself.
    fn circle(&self) -> Option<Vec<&str>> {
        fn walk<'a>(all: &'a Modules, way: &mut Vec<&'a str>, done: &mut BTreeSet<&'a str>) -> bool {
            let Some(&last) = way.last() else { return false };
            for next in &all.0[last] {
                if let Some(at) = way.iter().position(|name| name == next) {
                    way.drain(..at);
                    return true;
                }
                if !done.contains(next.as_str()) {
                    way.push(next);
                    if walk(all, way, done) {
                        return true;
                    }
                }
            }
            done.insert(last);
            way.pop();
            false
        }
        let mut done = BTreeSet::new();
        self.0.keys().find_map(|name| {
            let mut way = vec![name.as_str()];
            (!done.contains(name.as_str()) && walk(self, &mut way, &mut done)).then_some(way)
        })
    }
}

#[test]
fn no_crate_has_a_circle_of_modules() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("crates");
    let mut sources: Vec<PathBuf> =
        fs::read_dir(crates).unwrap().map(|entry| entry.unwrap().path().join("src")).collect();
    sources.sort();
    assert!(sources.len() > 25, "{sources:?}");
    let circles: Vec<String> = sources
        .iter()
        .filter_map(|source| {
            let modules = Modules::of(source);
            modules.circle().map(|circle| format!("{}: {}", source.display(), circle.join(" → ")))
        })
        .collect();
    assert!(circles.is_empty(), "{}", circles.join("\n"));
}
