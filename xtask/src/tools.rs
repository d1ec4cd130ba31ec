//! What the commands need: where it is looked for, and how it is installed when missing.
//!
//! Programs from crates.io go to a folder of their own in the user's cache, shared by all checkouts, so
//! that no other version a user has is replaced. A program already on PATH with the right version is
//! preferred. System packages come from apt; on another system one sentence says what to install.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use crate::steps::say;
use crate::{Failure, program, root, run, run_command};

const TRUNK: &str = "0.21.14";
const WASM_PACK: &str = "0.15.1";
const CARGO_DENY: &str = "0.20.2";
const CARGO_FUZZ: &str = "0.13.2";

#[derive(Clone, Copy)]
pub enum Tool {
    RustComponents,
    WasmTarget,
    Trunk,
    WasmBindgen,
    WasmPack,
    CargoFuzz,
    WasmOpt,
    CargoDeny,
    Chromium,
    Node,
    NodePackages,
    Valgrind,
    Python,
}

/// What building and serving the page needs.
pub const PAGE: [Tool; 3] = [Tool::WasmTarget, Tool::Trunk, Tool::WasmBindgen];

/// What building for publishing and the tests need.
pub const ALL: [Tool; 10] = [
    Tool::RustComponents,
    Tool::CargoDeny,
    Tool::WasmTarget,
    Tool::Trunk,
    Tool::WasmBindgen,
    Tool::WasmPack,
    Tool::WasmOpt,
    Tool::Chromium,
    Tool::Node,
    Tool::NodePackages,
];

pub fn install(tools: &[Tool]) -> Result<(), Failure> {
    tools.iter().try_for_each(|tool| match tool {
        Tool::RustComponents => rust_components(),
        Tool::WasmTarget => wasm_target(),
        Tool::Trunk => cargo_program("trunk", "trunk", TRUNK, true, "4 minutes"),
        // Without --locked: the lock file it was published with names a withdrawn crate.
        Tool::WasmBindgen => {
            cargo_program("wasm-bindgen-cli", "wasm-bindgen", &locked_wasm_bindgen()?, false, "2 minutes")
        }
        Tool::WasmPack => cargo_program("wasm-pack", "wasm-pack", WASM_PACK, true, "1 minute"),
        Tool::CargoFuzz => cargo_program("cargo-fuzz", "cargo-fuzz", CARGO_FUZZ, true, "1 minute"),
        Tool::WasmOpt => {
            node()?;
            npm_ci("web")
        }
        Tool::CargoDeny => cargo_program("cargo-deny", "cargo-deny", CARGO_DENY, true, "2 minutes"),
        Tool::Chromium => chromium_and_driver(),
        Tool::Node => node(),
        Tool::NodePackages => npm_ci("tests/e2e"),
        Tool::Valgrind if find("valgrind").is_some() => Ok(()),
        Tool::Valgrind => apt(&["valgrind"], "counting instructions needs valgrind"),
        Tool::Python => python(),
    })
}

/// Where our own copies of cargo programs live.
fn home() -> PathBuf {
    let cache = std::env::var_os("XDG_CACHE_HOME").filter(|folder| !folder.is_empty()).map(PathBuf::from);
    let user = std::env::var_os("HOME").or_else(|| std::env::var_os("USERPROFILE")).map(PathBuf::from);
    cache.or(user.map(|user| user.join(".cache"))).unwrap_or_else(|| root().join("target")).join("ape-lab")
}

/// PATH with our own programs first.
pub fn path() -> OsString {
    let old = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::iter::once(home().join("bin")).chain(std::env::split_paths(&old));
    std::env::join_paths(folders).unwrap_or(old)
}

fn find(name: &str) -> Option<PathBuf> {
    std::env::split_paths(&path()).map(|folder| folder.join(name)).find(|file| file.is_file())
}

/// What a program prints, or nothing when it cannot be run.
pub fn output(name: &str, arguments: &[&str]) -> Option<String> {
    let output = program(name, arguments).stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// The formatter and the linter, which rustup's smallest profile leaves out.
fn rust_components() -> Result<(), Failure> {
    if ["fmt", "clippy"].iter().all(|name| output("cargo", &[name, "--version"]).is_some()) {
        return Ok(());
    }
    say("adding rustfmt and clippy to Rust (seconds)");
    run("rustup", &["component", "add", "rustfmt", "clippy"])
        .map_err(|failure| format!("{failure}; without rustup, install rustfmt and clippy of your Rust by hand"))
}

/// Whether cargo-deny has fetched the database of known faults at some time.
pub fn has_advisories() -> bool {
    let user = || std::env::var_os("HOME").or_else(|| std::env::var_os("USERPROFILE"));
    let cargo =
        std::env::var_os("CARGO_HOME").map(PathBuf::from).or(user().map(|user| Path::new(&user).join(".cargo")));
    let entries = cargo.and_then(|cargo| std::fs::read_dir(cargo.join("advisory-dbs")).ok());
    entries.is_some_and(|entries| entries.flatten().any(|entry| entry.path().join("crates").is_dir()))
}

fn wasm_target() -> Result<(), Failure> {
    const TARGET: &str = "wasm32-unknown-unknown";
    let sysroot =
        output("rustc", &["--print", "sysroot"]).ok_or("rustc is missing: install Rust from https://rustup.rs")?;
    if Path::new(&sysroot).join("lib/rustlib").join(TARGET).is_dir() {
        return Ok(());
    }
    say("adding the wasm target to Rust (seconds)");
    run("rustup", &["target", "add", TARGET])
        .map_err(|failure| format!("{failure}; without rustup, install the {TARGET} target of your Rust by hand"))
}

/// The version of wasm-bindgen in Cargo.lock: the command must be the very same.
fn locked_wasm_bindgen() -> Result<String, Failure> {
    let lock = std::fs::read_to_string(root().join("Cargo.lock")).map_err(|error| format!("Cargo.lock: {error}"))?;
    let mut lines = lock.lines();
    lines
        .find(|line| *line == "name = \"wasm-bindgen\"")
        .and_then(|_| lines.next()?.strip_prefix("version = \"")?.strip_suffix('"'))
        .map(str::to_owned)
        .ok_or_else(|| "Cargo.lock does not name the version of wasm-bindgen".to_owned())
}

fn cargo_program(package: &str, name: &str, version: &str, locked: bool, usual: &str) -> Result<(), Failure> {
    let is_there =
        || output(name, &["--version"]).is_some_and(|line| line.split_whitespace().any(|word| word == version));
    if is_there() {
        return Ok(());
    }
    let wanted = format!("{package}@{version}");
    let home = home();
    let home_text = home.to_string_lossy();
    let start = Instant::now();
    if find("cargo-binstall").is_some() {
        say(&format!("installing {wanted} with cargo binstall (seconds)"));
        if run("cargo", &["binstall", "--no-confirm", "--root", &home_text, &wanted]).is_ok() && is_there() {
            return Ok(());
        }
    }
    say(&format!("compiling {wanted} into {home_text} (about {usual} on two cores, once)"));
    let mut arguments = vec!["install", "--quiet", "--root", &home_text, &wanted];
    if locked {
        arguments.push("--locked");
    }
    let mut command = program("cargo", &arguments);
    // One target folder for all of them: what they have in common is compiled once. Little optimised, as
    // they are used for seconds and compiled for minutes.
    command
        .env("CARGO_TARGET_DIR", home.join("build"))
        .env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "1")
        .env("CARGO_PROFILE_RELEASE_LTO", "off")
        .env("CARGO_PROFILE_RELEASE_CODEGEN_UNITS", "16");
    run_command(command).map_err(|failure| format!("{failure}; by hand: cargo install {wanted}"))?;
    println!("{wanted} took {:.0} s", start.elapsed().as_secs_f64());
    if is_there() { Ok(()) } else { Err(format!("{name} was installed but does not say it is {version}")) }
}

fn is_root() -> bool {
    output("id", &["-u"]).as_deref() == Some("0")
}

/// Installs Debian packages, or says in one sentence what is missing.
fn apt(packages: &[&str], why: &str) -> Result<(), Failure> {
    let by_hand = format!("{why}; by hand: apt-get install {}", packages.join(" "));
    if find("apt-get").is_none() {
        let packages = packages.join(" and ");
        return Err(format!("{why}, and this system has no apt-get: install {packages} the way your system does"));
    }
    say(&format!("installing {} with apt-get (about 15 seconds)", packages.join(", ")));
    let apt = |arguments: &[&str]| {
        let mut command = if is_root() {
            program("apt-get", arguments)
        } else {
            program("sudo", &[&["apt-get"], arguments].concat())
        };
        command.env("DEBIAN_FRONTEND", "noninteractive");
        run_command(command).map_err(|failure| format!("{failure}: {by_hand}"))
    };
    apt(&["update", "-qq"])?;
    apt(&[&["install", "-y", "-qq", "--no-install-recommends"], packages].concat())
}

/// Names and places of Chromium and Chrome.
const CHROMIUM: [&str; 5] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
];

/// The program that an environment variable names, or else the first of `names` that is there.
fn named_or_found(variable: &str, names: &[&str]) -> Result<PathBuf, Failure> {
    let named = std::env::var_os(variable).map(PathBuf::from);
    let found = || names.iter().find_map(|name| find(name));
    named.or_else(found).ok_or_else(|| format!("{} is missing; the variable {variable} can name it", names[0]))
}

pub fn chromium() -> Result<PathBuf, Failure> {
    named_or_found("CHROMIUM", &CHROMIUM)
}

pub fn chromedriver() -> Result<PathBuf, Failure> {
    named_or_found("CHROMEDRIVER", &["chromedriver"])
}

fn chromium_and_driver() -> Result<(), Failure> {
    if chromium().is_ok() && chromedriver().is_ok() {
        return Ok(());
    }
    let why = "the browser tests need Chromium or Chrome and its driver, on PATH or named by CHROMIUM and CHROMEDRIVER";
    apt(&["chromium", "chromium-driver"], why)
}

fn node() -> Result<(), Failure> {
    // The first versions with --test-concurrency.
    let why = "the browser tests need Node.js 18.19, 20.10 or later and npm";
    let is_there = || {
        let version = output("node", &["--version"]).unwrap_or_default();
        let mut parts = version.trim_start_matches('v').split('.').map_while(|part| part.parse::<u32>().ok());
        let version = (parts.next().unwrap_or(0), parts.next().unwrap_or(0));
        let is_new = version >= (20, 10) || ((18, 19)..(19, 0)).contains(&version);
        is_new && find("npm").is_some()
    };
    if is_there() {
        return Ok(());
    }
    apt(&["nodejs", "npm"], why)?;
    if is_there() { Ok(()) } else { Err(format!("{why}; what apt-get has is older")) }
}

/// Python with what makes virtual environments: Debian has that in a package of its own.
fn python() -> Result<(), Failure> {
    if output("python3", &["-c", "import ensurepip, venv"]).is_some() {
        return Ok(());
    }
    apt(&["python3", "python3-venv"], "the peers need Python 3 and its module venv")
}

/// Node packages as a lock file names them, installed again when the lock file changed.
fn npm_ci(folder: &str) -> Result<(), Failure> {
    let folder = root().join(folder);
    let modified = |file: &str| std::fs::metadata(folder.join(file)).and_then(|data| data.modified()).ok();
    if modified("node_modules/.package-lock.json") >= modified("package-lock.json") {
        return Ok(());
    }
    say(&format!("installing the node packages of {} (seconds)", folder.display()));
    let mut command = Command::new("npm");
    command.args(["ci", "--no-audit", "--no-fund", "--loglevel=error"]).current_dir(&folder).env("PATH", path());
    run_command(command)
}
