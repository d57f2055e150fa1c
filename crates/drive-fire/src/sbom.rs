//! What a program is built of, as CycloneDX 1.5 has it: every crate behind it with its version, licence and checksum, and what each
//! needs. Made of `cargo metadata` and the lock file alone, so that the same commit gives the same bytes.

use std::{
    collections::{BTreeMap, BTreeSet},
    env, fs, io,
    path::Path,
    process::{Command, Stdio},
};

use serde_json::{Value, json};

/// The bill of the program of this package, for the system that it is built on and its features by default.
///
/// # Errors
/// Cargo cannot tell, or does not know the package.
pub fn bill(root: &Path, package: &str) -> io::Result<Value> {
    let metadata = metadata(root)?;
    let lock = fs::read_to_string(root.join("Cargo.lock"))?;
    bill_of(&metadata, &checksums(&lock)?, package)
        .ok_or_else(|| io::Error::other(format!("there is no package {package}")))
}

fn metadata(root: &Path) -> io::Result<Value> {
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let version = Command::new("rustc").arg("-vV").output()?;
    let version = String::from_utf8_lossy(&version.stdout).into_owned();
    let host =
        version.lines().find_map(|line| line.strip_prefix("host: ")).unwrap_or("x86_64-unknown-linux-gnu");
    let told = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--locked", "--filter-platform", host])
        .current_dir(root)
        .stdin(Stdio::null())
        .output()?;
    if !told.status.success() {
        return Err(io::Error::other(String::from_utf8_lossy(&told.stderr).into_owned()));
    }
    serde_json::from_slice(&told.stdout).map_err(io::Error::other)
}

/// The SHA-256 of each crate that comes from a registry, by name and version.
fn checksums(lock: &str) -> io::Result<BTreeMap<(String, String), String>> {
    let lock: toml::Table = lock.parse().map_err(io::Error::other)?;
    let packages = lock.get("package").and_then(toml::Value::as_array).into_iter().flatten();
    let one = |package: &toml::Value| {
        let text = |key: &str| package.get(key)?.as_str().map(str::to_owned);
        Some(((text("name")?, text("version")?), text("checksum")?))
    };
    Ok(packages.filter_map(one).collect())
}

fn bill_of(metadata: &Value, checksums: &BTreeMap<(String, String), String>, package: &str) -> Option<Value> {
    let packages: BTreeMap<&str, &Value> = metadata["packages"]
        .as_array()?
        .iter()
        .filter_map(|package| Some((package["id"].as_str()?, package)))
        .collect();
    let nodes: BTreeMap<&str, &Value> = metadata["resolve"]["nodes"]
        .as_array()?
        .iter()
        .filter_map(|node| Some((node["id"].as_str()?, node)))
        .collect();
    let root = packages.iter().find(|(_, one)| one["name"] == package).map(|(id, _)| *id)?;
    // What is there for tests alone is in no program.
    let needs = |id: &str| -> BTreeSet<&str> {
        let deps = nodes.get(id).and_then(|node| node["deps"].as_array()).into_iter().flatten();
        let is_built = |dep: &&Value| {
            dep["dep_kinds"].as_array().is_some_and(|kinds| kinds.iter().any(|kind| kind["kind"] != "dev"))
        };
        deps.filter(is_built).filter_map(|dep| dep["pkg"].as_str()).collect()
    };
    let (mut behind, mut next) = (BTreeSet::new(), vec![root]);
    while let Some(id) = next.pop() {
        if behind.insert(id) {
            next.extend(needs(id));
        }
    }
    let reference = |id: &str| {
        let package = packages.get(id)?;
        Some(format!("pkg:cargo/{}@{}", package["name"].as_str()?, package["version"].as_str()?))
    };
    let component = |id: &str, kind: &str| {
        let package = packages.get(id)?;
        let (name, version) = (package["name"].as_str()?, package["version"].as_str()?);
        let purl = reference(id)?;
        let mut component = json!({
            "type": kind,
            "bom-ref": purl,
            "name": name,
            "version": version,
            "purl": purl,
        });
        if let Some(licence) = package["license"].as_str() {
            // The old way of saying OR.
            component["licenses"] =
                json!([{ "expression": licence.replace(" / ", " OR ").replace('/', " OR ") }]);
        }
        if let Some(hash) = checksums.get(&(name.to_owned(), version.to_owned())) {
            component["hashes"] = json!([{ "alg": "SHA-256", "content": hash }]);
        }
        if let Some(place) = package["repository"].as_str() {
            component["externalReferences"] = json!([{ "type": "vcs", "url": place }]);
        }
        Some(component)
    };
    let mut components: Vec<Value> =
        behind.iter().filter(|id| **id != root).filter_map(|id| component(id, "library")).collect();
    components.sort_by_key(|component| component["purl"].to_string());
    let mut dependencies: Vec<Value> = behind
        .iter()
        .filter_map(|id| {
            let on: BTreeSet<String> = needs(id).into_iter().filter_map(reference).collect();
            Some(json!({ "ref": reference(id)?, "dependsOn": on }))
        })
        .collect();
    dependencies.sort_by_key(|dependency| dependency["ref"].to_string());
    Some(json!({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": { "component": component(root, "application")? },
        "components": components,
        "dependencies": dependencies,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metadata() -> Value {
        let package = |name: &str, licence: &str| json!({ "id": format!("{name}#1.0.0"), "name": name, "version": "1.0.0", "license": licence });
        let dep = |name: &str, kind: Value| json!({ "pkg": format!("{name}#1.0.0"), "dep_kinds": [{ "kind": kind }] });
        json!({
            "packages": [package("drived", "MIT OR Apache-2.0"), package("tokio", "MIT"), package("bytes", "MIT/Apache-2.0"), package("criterion", "MIT")],
            "resolve": { "nodes": [
                { "id": "drived#1.0.0", "deps": [dep("tokio", Value::Null), dep("criterion", json!("dev"))] },
                { "id": "tokio#1.0.0", "deps": [dep("bytes", json!("build"))] },
                { "id": "bytes#1.0.0", "deps": [] },
                { "id": "criterion#1.0.0", "deps": [dep("bytes", Value::Null)] },
            ] },
        })
    }

    #[test]
    fn what_a_program_is_built_of_is_in_its_bill_and_what_tests_need_is_not() {
        let lock = "version = 4\n[[package]]\nname = \"tokio\"\nversion = \"1.0.0\"\nchecksum = \"ab\"\n";
        let bill = bill_of(&metadata(), &checksums(lock).unwrap(), "drived").unwrap();
        let names: Vec<&str> =
            bill["components"].as_array().unwrap().iter().filter_map(|one| one["name"].as_str()).collect();
        assert_eq!(names, ["bytes", "tokio"]);
        assert_eq!(bill["components"][1]["hashes"][0]["content"], "ab");
        assert_eq!(bill["components"][0]["licenses"][0]["expression"], "MIT OR Apache-2.0");
        assert_eq!(bill["metadata"]["component"]["purl"], "pkg:cargo/drived@1.0.0");
        assert_eq!(
            bill["dependencies"][1],
            json!({ "ref": "pkg:cargo/drived@1.0.0", "dependsOn": ["pkg:cargo/tokio@1.0.0"] })
        );
        assert!(bill_of(&metadata(), &BTreeMap::new(), "another").is_none());
    }
}
