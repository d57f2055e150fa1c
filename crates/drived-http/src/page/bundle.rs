//! The page's modules as one script, so that a browser far away asks once and not twenty times.
//!
//! A module is put into a function that gives its exports, and an import becomes a call of it. That is all that our own
//! modules ask for, and what they may use: imports by name on one line, and exports before `function`, `const` and `class`.

use std::fmt::Write as _;

/// What gives a module's exports, and makes the module when it is asked for the first time.
const BEGIN: &str = "'use strict';\n(() => {\nconst made = {};\nconst use = name => made[name] ??= modules[name]();\nconst modules = {\n";

/// One script of these modules, each with its name, which begins with the one named `first`.
pub(super) fn of(modules: &[(&str, &str)], first: &str) -> String {
    let mut script = BEGIN.to_owned();
    for (name, text) in modules {
        let _ = writeln!(script, "'{name}': () => {{");
        put(&mut script, text);
        script += "},\n";
    }
    let _ = writeln!(script, "}};\nuse('{first}');\n}})();");
    script
}

/// One module: what stands before its name in `export` is taken away, and what it exports is given at its end.
fn put(script: &mut String, text: &str) {
    let mut exports = Vec::new();
    for line in text.lines() {
        if line.starts_with("//") || line.starts_with("/**") && line.ends_with("*/") {
            continue;
        }
        if let Some((names, file)) = imported(line) {
            let _ = writeln!(script, "const {names} = use('{file}');");
            continue;
        }
        let own = line.strip_prefix("export ").inspect(|own| exports.push(exported(own))).unwrap_or(line);
        script.push_str(own);
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
        let expected = "'a.js': () => {\nconst { b, c: d } = use('b.js');\n\nasync function a() {\n  d(b);\n}\nreturn { a };\n},\n\
            'b.js': () => {\nconst b = 1;\nclass C {}\nfunction c(b) {}\nconst own = 2;\nreturn { b, C, c };\n},\n};\nuse('a.js');\n})();\n";
        assert_eq!(script, format!("{BEGIN}{expected}"));
    }
}
