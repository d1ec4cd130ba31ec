//! The commands of this repository: `cargo xtask serve`, `build`, `test`, `results`, `bench`, `fuzz`, `tools`, `offline`.
//!
//! Everything a command needs and does not find, it installs first, saying what it does and how long
//! that takes. `tools` says what is needed and gets it, `steps` runs one command after another and sums
//! up, `bench` measures, `fuzz` makes input up, `offline` lists the page's files for its service worker, `server` serves
//! them. Little but the standard library is used, so that this program itself builds in a moment.

mod bench;
mod fuzz;
mod offline;
mod server;
mod steps;
mod tools;

use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Duration;

use steps::Steps;
use tools::Tool;

pub const USAGE: &str = "\
usage: cargo xtask COMMAND

  serve [--port N]   install what is missing, build the page, serve it on 127.0.0.1
  serve --dist [FOLDER] [--port N]
                     serve dist/, or another folder with a built page, as it is: nothing is built or fetched
  build              the same page made small for publishing, in dist/
  test [STEP ...]    install what tests need, run everything (or the named steps), sum up;
                     with --long the step fuzz too
  results            make docs/RESULTS.md and its pictures anew (2 to 3 minutes on two cores)
  bench [PART ...]   measure native, counts and browser, or the named parts; write docs/PERFORMANCE.md.
                     Parts: native (3 minutes), counts (1), browser, peers (JAX and PyTorch beside it),
                     and document, which measures nothing
  fuzz [SECONDS]     hand made-up input to everything that reads some, 60 s each (docs/TESTING.md)
  tools              only install what the other commands need
  offline [FOLDER]   write the service worker of a built page (trunk runs this after each build)
";

/// Why a command ended early: one sentence for the user.
pub type Failure = String;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let rest: Vec<&str> = arguments.iter().skip(1).map(String::as_str).collect();
    let outcome = match arguments.first().map(String::as_str) {
        Some("serve") => serve(&rest),
        Some("build") => build(),
        Some("test") => test(&rest),
        Some("results") => results(),
        Some("bench") => bench::bench(&rest),
        Some("fuzz") => fuzz::fuzz(&rest),
        Some("tools") => tools::install(&tools::ALL),
        Some("offline") => offline(&rest),
        Some("help" | "--help" | "-h") => {
            print!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        _ => Err(USAGE.trim_end().to_owned()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(sentence) => {
            eprintln!("{sentence}");
            ExitCode::FAILURE
        }
    }
}

/// The repository's root, wherever the command was called from.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().expect("xtask/ lies in the repository").to_owned()
}

/// A program run from the root with the installed tools first on PATH.
pub fn program(name: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(name);
    command.args(arguments).current_dir(root()).env("PATH", tools::path());
    command
}

/// Runs a program to its end; its output goes to the terminal.
pub fn run(name: &str, arguments: &[&str]) -> Result<(), Failure> {
    run_command(program(name, arguments))
}

pub fn run_command(mut command: Command) -> Result<(), Failure> {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    let shown = words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ");
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`{shown}` ended with {status}")),
        Err(error) => Err(format!("`{shown}` could not be started: {error}")),
    }
}

const TRUNK: [&str; 2] = ["--config", "trunk.toml"];

fn serve(arguments: &[&str]) -> Result<(), Failure> {
    let (mut wanted, mut built) = (None, None);
    let mut rest = arguments.iter().copied().peekable();
    while let Some(flag) = rest.next() {
        match flag {
            "--port" => {
                let port = rest.next().unwrap_or_default();
                wanted =
                    Some(port.parse::<u16>().map_err(|_| format!("--port {port}: expected a number from 1 to 65535"))?);
            }
            "--dist" => built = Some(rest.next_if(|next| !next.starts_with("--")).map_or_else(dist, PathBuf::from)),
            _ => return Err(USAGE.trim_end().to_owned()),
        }
    }
    let port = free_port(wanted)?;
    match built {
        Some(folder) => server::Site::open(&folder)?.serve(port),
        None => build_and_serve(port),
    }
}

fn free_port(wanted: Option<u16>) -> Result<u16, Failure> {
    let is_free = |port: &u16| TcpListener::bind((Ipv4Addr::LOCALHOST, *port)).is_ok();
    match wanted {
        Some(port) if port > 0 && is_free(&port) => Ok(port),
        Some(port) => Err(format!("port {port} is not to be had: choose another with --port")),
        None => (8080..8180)
            .find(is_free)
            .ok_or_else(|| "ports 8080 to 8179 are all taken: choose one with --port".to_owned()),
    }
}

fn build_and_serve(port: u16) -> Result<(), Failure> {
    tools::install(&tools::PAGE)?;
    // trunk serves also what it could not build: so first build, then serve.
    build_page()?;
    let number = port.to_string();
    let mut trunk =
        program("trunk", &["serve", TRUNK[0], TRUNK[1], "--release", "--address", "127.0.0.1", "--port", &number])
            .spawn()
            .map_err(|error| format!("trunk could not be started: {error}"))?;
    while TcpStream::connect((Ipv4Addr::LOCALHOST, port)).is_err() {
        if let Some(status) = trunk.try_wait().map_err(|error| error.to_string())? {
            return Err(format!("trunk stopped before it served the page ({status}); what it printed above says why"));
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    println!("\n  ape-lab is at http://127.0.0.1:{port}/ (Ctrl-C stops it)\n");
    let status = trunk.wait().map_err(|error| error.to_string())?;
    if status.success() { Ok(()) } else { Err(format!("trunk ended with {status}")) }
}

fn build_page() -> Result<(), Failure> {
    steps::say("building the page (the first time about 2 minutes on two cores, then seconds)");
    run("trunk", &["build", TRUNK[0], TRUNK[1], "--release"])
}

fn results() -> Result<(), Failure> {
    steps::say("making every table and picture of docs/RESULTS.md (2 to 3 minutes on two cores)");
    let ape = ["run", "--release", "--no-default-features", "--features", "cli", "--bin", "ape"];
    run("cargo", &[&ape[..], &["--", "results", "docs"]].concat())
}

/// The page for publishing: built, then each wasm file made smaller.
fn build() -> Result<(), Failure> {
    tools::install(&tools::PAGE)?;
    tools::install(&[Tool::WasmOpt])?;
    build_page()?;
    // It lists what changes now: who stops here has a page without one, not with a wrong one.
    let list = dist().join(offline::NAME);
    std::fs::remove_file(&list).map_err(|error| format!("{}: {error}", list.display()))?;
    for file in wasm_files()? {
        let name = file.to_string_lossy();
        steps::say(&format!("wasm-opt on {name} (under a minute)"));
        let before = size(&file)?;
        // The worker is small and must be fast.
        let level = if name.contains("worker") { "-O3" } else { "-Oz" };
        run("node", &["web/node_modules/binaryen/bin/wasm-opt", level, &name, "-o", &name])?;
        println!("{before} bytes before, {} after", size(&file)?);
    }
    // The files are no longer those that trunk's hook has seen.
    offline::write(&dist())?;
    println!("dist/ holds the page: any static file server can publish it");
    Ok(())
}

/// The service worker of the page in a folder: one that is named, the one trunk is building, or `dist/`.
fn offline(arguments: &[&str]) -> Result<(), Failure> {
    let folder = match arguments {
        [] => std::env::var_os("TRUNK_STAGING_DIR").map_or_else(dist, PathBuf::from),
        [folder] => PathBuf::from(folder),
        _ => return Err(USAGE.trim_end().to_owned()),
    };
    offline::write(&folder)
}

fn dist() -> PathBuf {
    root().join("dist")
}

fn wasm_files() -> Result<Vec<PathBuf>, Failure> {
    let dist = dist();
    let entries = std::fs::read_dir(&dist).map_err(|error| format!("{}: {error}", dist.display()))?;
    Ok(entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "wasm"))
        .collect())
}

fn size(file: &Path) -> Result<u64, Failure> {
    Ok(std::fs::metadata(file).map_err(|error| format!("{}: {error}", file.display()))?.len())
}

/// The files with end-to-end tests. They are named one by one: what node makes of a folder depends on its version.
fn end_to_end_tests() -> Result<Vec<PathBuf>, Failure> {
    let folder = root().join("tests/e2e");
    let entries = std::fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.to_string_lossy().ends_with(".test.mjs"))
        .collect();
    files.sort();
    Ok(files)
}

/// Looks for known faults of the crates. The database of them is not among the crates: where it can be neither fetched nor
/// found as it was fetched before, the tests say so and go on.
fn advisories() -> Result<(), Failure> {
    let is_fetched = tools::output("cargo", &["deny", "fetch", "db"]).is_some();
    match is_fetched {
        true => run("cargo", &["deny", "check", "--hide-inclusion-graph", "advisories"]),
        false if tools::has_advisories() => {
            println!("The database of advisories, RustSec's on GitHub, could not be fetched: an older one is used.");
            run("cargo", &["deny", "--offline", "check", "--hide-inclusion-graph", "advisories"])
        }
        false => {
            println!("Advisories were not checked: their database, RustSec's on GitHub, could not be fetched.");
            Ok(())
        }
    }
}

fn test(arguments: &[&str]) -> Result<(), Failure> {
    const WASM: [&str; 2] = ["--target", "wasm32-unknown-unknown"];
    const DENY: [&str; 3] = ["--", "-D", "warnings"];
    let is_long = arguments.contains(&"--long");
    let only: Vec<&str> = arguments.iter().copied().filter(|argument| *argument != "--long").collect();
    let mut steps = Steps::new(&only);
    steps.step("fmt", "seconds", &[Tool::RustComponents], || run("cargo", &["fmt", "--all", "--check"]));
    steps.step("clippy", "2 minutes at first", &[Tool::RustComponents], || {
        run("cargo", &[&["clippy", "--workspace", "--all-targets"][..], &DENY].concat())
    });
    steps.step("clippy-wasm", "2 minutes at first", &[Tool::RustComponents, Tool::WasmTarget], || {
        let page = ["clippy", "--no-default-features", "--features", "page", "--tests", "--lib", "--bins"];
        run("cargo", &[&page[..], &WASM, &DENY].concat())
    });
    steps.step("fuzz-check", "2 minutes at first", &[Tool::RustComponents], fuzz::check);
    // The core must stand without the page: neither egui nor the command line.
    steps.step("core-alone", "a minute at first", &[], || run("cargo", &["check", "--lib", "--no-default-features"]));
    steps.step("doc", "2 minutes at first", &[], || {
        let mut command = program("cargo", &["doc", "--workspace", "--no-deps", "--document-private-items"]);
        command.env("RUSTDOCFLAGS", "-D warnings");
        run_command(command)
    });
    steps.step("deny", "seconds", &[Tool::CargoDeny], || {
        run("cargo", &["deny", "check", "--hide-inclusion-graph", "licenses", "bans", "sources"])?;
        advisories()
    });
    steps.step("native", "4 minutes at first", &[], || run("cargo", &["test", "--workspace"]));
    // The digests, which the step before has compared in a build with all checks.
    steps.step("release", "3 minutes at first", &[], || {
        run("cargo", &["test", "--release", "--no-default-features", "--test", "golden_native"])
    });
    let wasm = [Tool::WasmTarget, Tool::WasmBindgen, Tool::WasmPack];
    let in_node = [&wasm[..], &[Tool::Node]].concat();
    let in_chrome = [&wasm[..], &[Tool::Chromium]].concat();
    let wasm_pack = |flags: &[&str], file: &str| {
        let cargo = ["--", "--no-default-features", "--test", file];
        run("wasm-pack", &[&["test", "--release"][..], flags, &cargo].concat())
    };
    steps.step("wasm-node", "a minute at first", &in_node, || wasm_pack(&["--node"], "wasm_node"));
    for (name, file) in [("wasm-chrome", "wasm_page"), ("wasm-worker", "wasm_worker")] {
        steps.step(name, "seconds", &in_chrome, || {
            let driver = tools::chromedriver()?;
            wasm_pack(&["--headless", "--chrome", "--chromedriver", &driver.to_string_lossy()], file)
        });
    }
    // What is published is what is tested.
    steps.step("page", "3 minutes at first", &[], build);
    steps.step("end-to-end", "9 minutes", &[Tool::Chromium, Tool::Node, Tool::NodePackages], || {
        // Two at a time: a page alone leaves a core idle for half of the time.
        let mut command = program("node", &["--test", "--test-concurrency=2"]);
        command.args(end_to_end_tests()?);
        command.env("CHROMIUM", tools::chromium()?);
        run_command(command)
    });
    // It takes long, and finds another thing every time: not for every change.
    if is_long || only.contains(&"fuzz") {
        steps.step("fuzz", "12 minutes at first", &[], || fuzz::fuzz(&[]));
    }
    steps.sum_up()
}
