//! The page's modules as two scripts, so that a browser far away asks once and not forty times: what the first look needs, and the
//! views that somebody opens afterwards.
//!
//! A module is put into a function that gives its exports, and an import becomes a call of it. That is all that our own
//! modules ask for, and what they may use: imports by name on one line, exports before `function`, `const` and `class`, and
//! `import('./view.js')` for a view of the second script.

use std::fmt::Write as _;

/// What gives a module's exports, and makes the module when it is asked for the first time; and what brings the second script.
const BEGIN: &str = "'use strict';\n(() => {\nconst made = {};\nconst use = name => made[name] ??= modules[name](use, later);\n\
    let more;\nconst later = name => (more ??= new Promise((done, failed) => {\n\
    const script = document.createElement('script');\n\
    Object.assign(script, { src: 'more.js', onload: done, onerror: () => { more = undefined; failed(new Error('more.js')); } });\n\
    document.head.append(script);\n})).then(() => use(name));\nconst modules = window.pageModules = {\n";

/// The script of the first look: of these modules, each with its name, beginning with the one named `first`.
pub(super) fn of(modules: &[(&str, &str)], first: &str) -> String {
    let mut script = BEGIN.to_owned();
    put_all(&mut script, modules);
    let _ = writeln!(script, "}};\nuse('{first}');\n}})();");
    script
}

/// The script of the modules that come later: it adds them to those of the first.
pub(super) fn more(modules: &[(&str, &str)]) -> String {
    let mut script = "'use strict';\nObject.assign(window.pageModules, {\n".to_owned();
    put_all(&mut script, modules);
    script += "});\n";
    script
}

fn put_all(script: &mut String, modules: &[(&str, &str)]) {
    for (name, text) in modules {
        let _ = writeln!(script, "'{name}': (use, later) => {{");
        put(script, text);
        *script += "},\n";
    }
}

/// One module: what stands before its name in `export` is taken away, and what it exports is given at its end.
fn put(script: &mut String, text: &str) {
    let mut exports = Vec::new();
    for line in text.lines().map(str::trim_start) {
        // What is told to a reader of the source is not sent.
        if line.is_empty() || ["//", "/**", "* ", "*/"].iter().any(|comment| line.starts_with(comment)) {
            continue;
        }
        if let Some((names, file)) = imported(line) {
            let _ = writeln!(script, "const {names} = use('{file}');");
            continue;
        }
        let own = line.strip_prefix("export ").inspect(|own| exports.push(exported(own))).unwrap_or(line);
        // What is served by itself is imported by the browser.
        let is_served = own.contains("_fr.js')");
        script.push_str(&if is_served { own.to_owned() } else { own.replace("import('./", "later('") });
        script.push('\n');
    }
    let _ = writeln!(script, "return {{ {} }};", exports.join(", "));
}

/// The names and the file of an import; those of another name are called so in a destructuring, too.
fn imported(line: &str) -> Option<(String, &str)> {
    let (names, file) = line.strip_prefix("import ")?.split_once(" from './")?;
    Some((names.replace(" as ", ": "), file.trim_end_matches("';")))
}

/// The name that an export declares.
fn exported(declared: &str) -> &str {
    let name = ["async function ", "function ", "const ", "class "]
        .into_iter()
        .find_map(|kind| declared.strip_prefix(kind));
    let name = name.unwrap_or_default();
    name.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_').next().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modules_become_functions_that_give_their_exports_and_imports_become_calls() {
        let script = of(
            &[
                (
                    "a.js",
                    "// A word.\nimport { b, c as d } from './b.js';\n\nexport async function a() {\n  d(b);\n}\n",
                ),
                ("b.js", "export const b = 1;\nexport class C {}\nexport function c(b) {}\nconst own = 2;"),
            ],
            "a.js",
        );
        let expected = "'a.js': (use, later) => {\nconst { b, c: d } = use('b.js');\nasync function a() {\nd(b);\n}\nreturn { a };\n},\n\
            'b.js': (use, later) => {\nconst b = 1;\nclass C {}\nfunction c(b) {}\nconst own = 2;\nreturn { b, C, c };\n},\n};\nuse('a.js');\n})();\n";
        assert_eq!(script, format!("{BEGIN}{expected}"));
    }
}
