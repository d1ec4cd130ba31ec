//! The command line: `ape evaluate`, `ape train`, `ape presets`.
//!
//! Results go to standard output as JSON. Bad input gets one line on standard error and exit code 2.

use std::path::Path;
use std::process::ExitCode;

use ape_lab::ape::{EnsembleFile, FIELDS, Field, Figures, Trainer};
use ape_lab::experiment::{CurvePoint, PRESETS, Preset, Setup};
use ape_lab::mdp::{Grid, HORIZON, Returns};
use clap::{Arg, ArgMatches, Command};
use serde::Serialize;

fn main() -> ExitCode {
    let matches = match command().try_get_matches() {
        Ok(matches) => matches,
        Err(error) if !error.use_stderr() => {
            print!("{error}");
            return ExitCode::SUCCESS;
        }
        Err(error) => return fail(&usage_sentence(&error)),
    };
    let outcome = match matches.subcommand() {
        Some(("evaluate", matches)) => evaluate(matches),
        Some(("train", matches)) => train(matches),
        _ => presets(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(sentence) => fail(&sentence),
    }
}

fn fail(sentence: &str) -> ExitCode {
    eprintln!("ape: {}", sentence.replace('\n', " "));
    ExitCode::from(2)
}

/// The first paragraph of clap's error, in one line.
fn usage_sentence(error: &clap::Error) -> String {
    let text = error.to_string();
    let first = text.split("\n\n").next().unwrap_or_default();
    let line = first.trim_start_matches("error: ").split_whitespace().collect::<Vec<_>>().join(" ");
    format!("{line} (see ape --help)")
}

fn command() -> Command {
    let file = |name: &'static str, help: &'static str| Arg::new(name).long(name).value_name("FILE").help(help);
    let mut train = Command::new("train")
        .about("Train an ensemble with PG-APE; prints its figures as JSON")
        .arg(Arg::new("preset").long("preset").value_name("NAME").help("Start from a preset (see ape presets)"))
        .arg(file("config", "Start from a file: fields as below, with an optional grid; or an ensemble file"))
        .arg(file("out", "Write the ensemble to this file"))
        .arg(file("curve", "Write the figures after every update to this CSV file"));
    for field in &FIELDS {
        let flag = field.name.replace('_', "-");
        let argument = Arg::new(field.name).long(flag).value_name("VALUE").allow_hyphen_values(true);
        train = train.arg(argument.help(field.tip()));
    }
    Command::new("ape")
        .about("Adversarial policy ensembles: train them, evaluate them")
        .version(env!("CARGO_PKG_VERSION"))
        .subcommand_required(true)
        .subcommand(
            Command::new("evaluate")
                .about("Exact figures of an ensemble file, as JSON")
                .arg(Arg::new("file").value_name("FILE").required(true)),
        )
        .subcommand(train)
        .subcommand(Command::new("presets").about("List the presets"))
}

fn read(file: &str) -> Result<String, String> {
    std::fs::read_to_string(file).map_err(|error| format!("{file}: {error}"))
}

/// Writes a file whole or not at all.
fn write(file: &str, text: &str) -> Result<(), String> {
    let part = Path::new(file).with_added_extension("part");
    let written = std::fs::write(&part, text).and_then(|()| std::fs::rename(&part, file));
    written.map_err(|error| {
        // What could not be renamed is of no use to anyone.
        let _ = std::fs::remove_file(&part);
        format!("{file}: {error}")
    })
}

fn print(result: &impl Serialize) -> Result<(), String> {
    let text = serde_json::to_string_pretty(result).map_err(|error| error.to_string())?;
    println!("{text}");
    Ok(())
}

fn evaluate(matches: &ArgMatches) -> Result<(), String> {
    let file = matches.get_one::<String>("file").expect("clap requires it");
    let in_file = |error| format!("{file}: {error}");
    let parsed = EnsembleFile::parse(&read(file)?).map_err(|error| in_file(error.to_string()))?;
    // The T it was trained with, where the file says so.
    let horizon = parsed.config.as_ref().map_or(HORIZON, |config| config.horizon);
    let (grid, ensemble) = parsed.check().map_err(|error| in_file(error.to_string()))?;
    print(&Figures::of(&grid, &ensemble, horizon))
}

fn presets() -> Result<(), String> {
    for preset in &PRESETS {
        println!("{:<14} {}", preset.name, preset.summary);
    }
    Ok(())
}

/// The setup that the flags describe: a preset or a file, then single fields.
fn setup(matches: &ArgMatches) -> Result<Setup, String> {
    let text = |name: &str| matches.get_one::<String>(name);
    let mut setup = match (text("preset"), text("config")) {
        (Some(_), Some(_)) => return Err("--preset and --config: give one of them, both say where to start".to_owned()),
        (None, Some(file)) => Setup::parse(&read(file)?).map_err(|error| format!("{file}: {error}"))?,
        (Some(name), None) => {
            let known = || PRESETS.iter().map(|preset| preset.name).collect::<Vec<_>>().join(", ");
            (Preset::find(name).ok_or_else(|| format!("--preset {name}: must be one of {}", known()))?.setup)()
        }
        (None, None) => (PRESETS[0].setup)(),
    };
    if setup.ensemble.is_some() {
        return Err("this preset is a given ensemble: there is nothing to train".to_owned());
    }
    for field in &FIELDS {
        if let Some(value) = text(field.name) {
            field.set(&mut setup.config, value).map_err(|error| flag_sentence(field, &error.to_string()))?;
        }
    }
    Ok(setup)
}

fn flag_sentence(field: &Field, sentence: &str) -> String {
    sentence.replacen(field.name, &format!("--{}", field.name.replace('_', "-")), 1)
}

/// What `train` prints: the figures, with those of the clone it trained against.
#[derive(Serialize)]
struct Trained {
    updates: u32,
    /// Hash of all parameters: equal runs share it, on every machine.
    digest: String,
    observer: String,
    /// Returns of the clone by the run's own observer.
    clone: Returns,
    #[serde(flatten)]
    figures: Figures,
}

fn train(matches: &ArgMatches) -> Result<(), String> {
    let Setup { grid, config, .. } = setup(matches)?;
    let horizon = config.horizon;
    let grid = Grid::new(grid).map_err(|error| error.to_string())?;
    let mut trainer = Trainer::new(grid.clone(), config.clone()).map_err(|error| error.to_string())?;
    let curve_file = matches.get_one::<String>("curve");
    let mut curve = vec![CurvePoint::csv_head()];
    for _ in 0..config.updates() {
        trainer.update();
        if curve_file.is_some() {
            curve.push(CurvePoint::of(&mut trainer).csv_line());
        }
    }
    let ensemble = trainer.ensemble();
    if let Some(file) = matches.get_one::<String>("out") {
        let text = serde_json::to_string(&EnsembleFile::new(&grid, &ensemble, Some(config.clone())));
        write(file, &(text.map_err(|error| error.to_string())? + "\n"))?;
    }
    if let Some(file) = curve_file {
        write(file, &(curve.join("\n") + "\n"))?;
    }
    print(&Trained {
        updates: trainer.updates(),
        digest: format!("{:016x}", trainer.digest()),
        observer: config.observer.to_string(),
        clone: CurvePoint::of(&mut trainer).clone,
        figures: Figures::of(&grid, &ensemble, horizon),
    })
}
