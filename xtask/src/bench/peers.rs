//! The part `peers`: the same training in the tools of others, and ours beside it in the same minutes.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::{environment, last_line, native, part, rounded, target};
use crate::steps::say;
use crate::tools::{self, Tool};
use crate::{Failure, program, run_command};

/// A program of benches/peers and what it needs.
struct Peer {
    script: &'static str,
    packages: &'static [&'static str],
    /// Where pip looks first, and what that saves.
    index: Option<&'static str>,
    usual: &'static str,
    /// What it prints: for each of its times what comes before it, and what the time is of.
    times: &'static [(&'static str, &'static str)],
}

const PEERS: [Peer; 2] = [
    Peer {
        script: "jax_ape.py",
        packages: &["jax==0.10.2", "numpy==2.4.6"],
        index: None,
        usual: "half a minute",
        times: &[("; run ", "JAX, compiled beforehand"), ("compile+run ", "JAX, the first run, which compiles")],
    },
    Peer {
        script: "torch_ape.py",
        packages: &["torch==2.15.0", "numpy==2.4.6"],
        // Elsewhere torch brings 5 GB of programs for graphics cards with it.
        index: Some("https://download.pytorch.org/whl/cpu"),
        usual: "2 minutes, and up to 6 GB",
        times: &[("-> ", "NumPy and PyTorch, 732 updates from 100")],
    },
];

/// The benchmark that they are compared with.
const OURS: &str = "training/default";

pub fn measure() -> Result<Value, Failure> {
    tools::install(&[Tool::Python])?;
    say("our own run, for comparison");
    let ours = native::criterion(Some(OURS))?;
    let ours = ours.iter().find(|row| row["name"] == OURS).ok_or("criterion did not measure our own run")?;
    let seconds = ours["value"].as_f64().ok_or("criterion did not say how long our own run takes")? / 1e9;
    let mut rows = vec![json!({ "name": "ape-lab", "unit": "s", "value": rounded(seconds, 4), "ratio": 1.0 })];
    for peer in &PEERS {
        match times(peer) {
            Ok(times) => rows.extend(times.into_iter().map(|(name, time)| {
                json!({ "name": name, "unit": "s", "value": time, "ratio": rounded(time / seconds, 1),
                    "packages": peer.packages })
            })),
            Err(failure) => {
                println!("{failure}");
                rows.push(
                    json!({ "name": peer.times[0].1, "unit": "s", "failure": failure, "packages": peer.packages }),
                );
            }
        }
    }
    Ok(part(environment::facts(&["rustc", "python3"]), rows))
}

/// Installs what a peer needs where nothing else lies, runs it, and reads its times.
fn times(peer: &Peer) -> Result<Vec<(&'static str, f64)>, Failure> {
    let python = environment_of(peer)?;
    say(&format!("running {}", peer.script));
    let script = format!("benches/peers/{}", peer.script);
    let line = last_line(program(&python.to_string_lossy(), &[&script]))?;
    println!("{line}");
    let time = |&(before, name): &(&str, &'static str)| {
        let number = line.split_once(before)?.1.split_whitespace().next()?;
        Some((name, number.parse().ok()?))
    };
    let times: Option<Vec<_>> = peer.times.iter().map(time).collect();
    times.ok_or_else(|| format!("{script} printed no times, but: {line}"))
}

/// The Python of a virtual environment with a peer's packages.
fn environment_of(peer: &Peer) -> Result<PathBuf, Failure> {
    let folder = target().join("peers").join(peer.script.trim_end_matches(".py"));
    let python = folder.join("bin/python");
    // Written when all is there, with what is there.
    let (stamp, wanted) = (folder.join("installed"), peer.packages.join(" "));
    if std::fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted) {
        return Ok(python);
    }
    say(&format!("installing {wanted} into {} ({}, once)", shown(&folder), peer.usual));
    run_command(program("python3", &["-m", "venv", "--clear", &folder.to_string_lossy()]))?;
    let pip = |more: &[&str]| {
        let mut pip = program(&python.to_string_lossy(), &["-m", "pip", "install", "--quiet", "--no-cache-dir"]);
        pip.args(["--disable-pip-version-check"]).args(more).args(peer.packages);
        run_command(pip)
    };
    let small = |index| {
        pip(&[
            "--retries",
            "0",
            "--timeout",
            "10",
            "--extra-index-url",
            "https://pypi.org/simple",
            "--index-url",
            index,
        ])
    };
    match peer.index.map(small) {
        Some(Ok(())) => {}
        _ => pip(&[]).map_err(|_| format!("{} could not be installed with pip", peer.packages[0]))?,
    }
    std::fs::write(&stamp, wanted).map_err(|error| format!("{}: {error}", stamp.display()))?;
    Ok(python)
}

/// A folder as the user sees it.
fn shown(folder: &Path) -> String {
    folder.strip_prefix(crate::root()).unwrap_or(folder).display().to_string()
}
