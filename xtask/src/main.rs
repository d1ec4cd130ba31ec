//! The commands of this repository: `cargo xtask serve`, `build`, `test`, `tools`.
//!
//! Everything a command needs and does not find, it installs first, saying what it does and how long
//! that takes. `tools` says what is needed and gets it, `steps` runs one command after another and sums
//! up. Only the standard library is used, so that this program itself builds in a moment.

mod steps;
mod tools;

use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

use steps::Steps;
use tools::Tool;

const USAGE: &str = "\
usage: cargo xtask COMMAND

  serve [--port N]   install what is missing, build the page, serve it on 127.0.0.1
  build              the same page made small for publishing, in dist/
  test [STEP ...]    install what tests need, run everything (or the named steps), sum up
  tools              only install what the other commands need
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
        Some("tools") => tools::install(&tools::ALL),
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
    let shown = format!("{command:?}").replace('"', "");
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`{shown}` ended with {status}")),
        Err(error) => Err(format!("`{shown}` could not be started: {error}")),
    }
}

const TRUNK: [&str; 2] = ["--config", "trunk.toml"];

fn serve(arguments: &[&str]) -> Result<(), Failure> {
    let wanted = match arguments {
        [] => None,
        ["--port", port] => {
            Some(port.parse::<u16>().map_err(|_| format!("--port {port}: expected a number from 1 to 65535"))?)
        }
        _ => return Err(USAGE.trim_end().to_owned()),
    };
    let is_free = |port: &u16| TcpListener::bind((Ipv4Addr::LOCALHOST, *port)).is_ok();
    let port = match wanted {
        Some(port) if is_free(&port) => port,
        Some(port) => return Err(format!("port {port} is taken: choose another with --port")),
        None => (8080..8180).find(is_free).ok_or("ports 8080 to 8179 are all taken: choose one with --port")?,
    };
    tools::install(&tools::PAGE)?;
    steps::say("building the page (the first time about 3 minutes on two cores, then seconds)");
    let number = port.to_string();
    let mut trunk =
        program("trunk", &["serve", TRUNK[0], TRUNK[1], "--release", "--address", "127.0.0.1", "--port", &number])
            .spawn()
            .map_err(|error| format!("trunk could not be started: {error}"))?;
    let start = Instant::now();
    while TcpStream::connect((Ipv4Addr::LOCALHOST, port)).is_err() {
        if let Some(status) = trunk.try_wait().map_err(|error| error.to_string())? {
            return Err(format!("trunk stopped before it served the page ({status}); what it printed above says why"));
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    let seconds = start.elapsed().as_secs_f64();
    println!("\n  ape-lab is at http://127.0.0.1:{port}/ (built in {seconds:.0} s; Ctrl-C stops it)\n");
    let status = trunk.wait().map_err(|error| error.to_string())?;
    if status.success() { Ok(()) } else { Err(format!("trunk ended with {status}")) }
}

fn build_page() -> Result<(), Failure> {
    steps::say("building the page (the first time about 3 minutes on two cores)");
    run("trunk", &["build", TRUNK[0], TRUNK[1], "--release"])
}

/// The page for publishing: built, then each wasm file made smaller.
fn build() -> Result<(), Failure> {
    tools::install(&tools::PAGE)?;
    tools::install(&[Tool::WasmOpt])?;
    build_page()?;
    for name in wasm_files()? {
        let file = name.to_string_lossy().into_owned();
        steps::say(&format!("wasm-opt on {file} (about a minute)"));
        let before = size(&name)?;
        run("node", &["web/node_modules/binaryen/bin/wasm-opt", "-Oz", "--all-features", &file, "-o", &file])?;
        println!("{file}: {before} bytes before, {} after", size(&name)?);
    }
    println!("dist/ holds the page: any static file server can publish it");
    Ok(())
}

fn wasm_files() -> Result<Vec<PathBuf>, Failure> {
    let dist = root().join("dist");
    let entries = std::fs::read_dir(&dist).map_err(|error| format!("{}: {error}", dist.display()))?;
    Ok(entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "wasm"))
        .collect())
}

fn size(file: &Path) -> Result<u64, Failure> {
    Ok(std::fs::metadata(file).map_err(|error| format!("{}: {error}", file.display()))?.len())
}

fn test(only: &[&str]) -> Result<(), Failure> {
    tools::install(&tools::ALL)?;
    let chrome = tools::chromium()?;
    let wasm = ["--target", "wasm32-unknown-unknown"];
    let deny = ["--", "-D", "warnings"];
    let mut steps = Steps::new(only);
    steps.step("fmt", "seconds", || run("cargo", &["fmt", "--all", "--check"]));
    steps.step("clippy", "2 minutes at first", || {
        run("cargo", &[&["clippy", "--workspace", "--all-targets"][..], &deny].concat())
    });
    steps.step("clippy-wasm", "2 minutes at first", || {
        let page = ["clippy", "--no-default-features", "--features", "page", "--tests", "--lib", "--bins"];
        run("cargo", &[&page[..], &wasm, &deny].concat())
    });
    // The core must stand without the page: neither egui nor the command line.
    steps.step("core-alone", "a minute at first", || run("cargo", &["check", "--lib", "--no-default-features"]));
    steps.step("doc", "2 minutes at first", || {
        let mut command = program("cargo", &["doc", "--workspace", "--no-deps", "--document-private-items"]);
        command.env("RUSTDOCFLAGS", "-D warnings");
        run_command(command)
    });
    steps.step("native", "4 minutes at first", || run("cargo", &["test", "--workspace"]));
    for (name, flags, file) in [
        ("wasm-node", &["--node"][..], "wasm_node"),
        ("wasm-chrome", &["--headless", "--chrome"], "wasm_page"),
        ("wasm-worker", &["--headless", "--chrome"], "wasm_worker"),
    ] {
        steps.step(name, "3 minutes at first", || {
            let driver = tools::chromedriver()?;
            let driver = driver.to_string_lossy();
            let chromedriver = ["--chromedriver", &*driver];
            let driver = if flags.len() > 1 { &chromedriver[..] } else { &[] };
            let cargo = ["--", "--no-default-features", "--test", file];
            run("wasm-pack", &[&["test", "--release"][..], flags, driver, &cargo].concat())
        });
    }
    steps.step("page", "3 minutes at first", build_page);
    steps.step("end-to-end", "a minute", || {
        let mut command = program("node", &["--test", "tests/e2e/"]);
        command.env("CHROMIUM", &chrome);
        run_command(command)
    });
    steps.sum_up()
}
