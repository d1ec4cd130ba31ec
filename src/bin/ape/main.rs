//! The command line: `ape evaluate`, `train`, `model` and `presets` here, `attack`, `table1`, `sweep` and `results` in
//! `experiments`, `sweep --shard` and `merge` in `shards`.
//!
//! Results go to standard output. Bad input gets one line on standard error and exit code 2.

/// Prints a line on standard output.
macro_rules! say {
    ($($text:tt)*) => { $crate::print_text(format_args!("{}\n", format_args!($($text)*))) };
}

/// Says something on standard error; where nobody can hear it, that is no failure.
macro_rules! mutter {
    ($($text:tt)*) => { _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!($($text)*)) };
}

mod experiments;
mod shards;

use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::process::ExitCode;

use ape_lab::ape::{Digest, Ensemble, EnsembleFile, FIELDS, Field, Figures, Trainer};
use ape_lab::experiment::{CurvePoint, Denied, PRESETS, Preset, Setup};
use ape_lab::files;
use ape_lab::mdp::{Grid, HORIZON, KnownReturns, transition_model};
use clap::{Arg, ArgMatches, Command};
use serde::Serialize;

fn main() -> ExitCode {
    let matches = match command().try_get_matches() {
        Ok(matches) => matches,
        Err(error) if !error.use_stderr() => {
            print_text(format_args!("{error}"));
            return ExitCode::SUCCESS;
        }
        Err(error) => return fail(&usage_sentence(&error)),
    };
    let outcome = match matches.subcommand() {
        Some(("evaluate", matches)) => evaluate(matches),
        Some(("train", matches)) => train(matches),
        Some(("model", matches)) => model(matches),
        Some(("attack", matches)) => experiments::attack(matches),
        Some(("table1", matches)) => experiments::table1(matches),
        Some(("sweep", matches)) => experiments::sweep(matches),
        Some(("merge", matches)) => shards::merge(matches),
        Some(("results", matches)) => experiments::results(matches),
        _ => presets(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(sentence) => fail(&sentence),
    }
}

fn fail(sentence: &str) -> ExitCode {
    mutter!("ape: {}\n", in_a_line(sentence));
    ExitCode::from(2)
}

/// A sentence in one line of a length that is read; what it quotes of a file does nothing to a terminal.
fn in_a_line(sentence: &str) -> String {
    const MOST: usize = 2000;
    let mut line = String::new();
    for (at, letter) in sentence.chars().enumerate() {
        match letter {
            _ if at == MOST => return line + "…",
            '\n' => line.push(' '),
            letter if letter.is_control() => line.extend(letter.escape_default()),
            letter => line.push(letter),
        }
    }
    line
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
    let train = Command::new("train")
        .about("Train an ensemble; prints its figures as JSON")
        .arg(file("out", "Write the ensemble to this file").short('o'))
        .arg(file("curve", "Write the figures after every update to this CSV file"));
    let model = Command::new("model")
        .about("The transition model of a grid, for Python: states, actions, P, as Gymnasium has them")
        .arg(file("out", "Write it to this file instead of standard output").short('o'));
    let fields = FIELDS.each_ref().map(|field| field.name);
    let mut command = Command::new("ape")
        .about("Adversarial policy ensembles: train them, evaluate them, attack them")
        .version(env!("CARGO_PKG_VERSION"))
        .subcommand_required(true)
        .subcommand(
            Command::new("evaluate")
                .about("Exact figures of an ensemble file, as JSON")
                .arg(Arg::new("file").value_name("FILE").required(true)),
        )
        .subcommand(with_setup(train, &[]))
        .subcommand(with_setup(model, &fields));
    for experiment in experiments::commands() {
        command = command.subcommand(experiment);
    }
    command.subcommand(Command::new("presets").about("List the presets"))
}

/// Adds the flags that say what a run starts from, but those of the fields in `without`.
fn with_setup(command: Command, without: &[&str]) -> Command {
    let command = command
        .arg(Arg::new("preset").long("preset").value_name("NAME").help("Start from a preset (see ape presets)"))
        .arg(
            Arg::new("config")
                .long("config")
                .value_name("FILE")
                .help("Start from a file: fields as below, with an optional grid; or an ensemble file"),
        );
    FIELDS.iter().filter(|field| !without.contains(&field.name)).fold(command, |command, field| {
        let flag = field.name.replace('_', "-");
        let argument = Arg::new(field.name).long(flag).value_name("VALUE").allow_hyphen_values(true);
        command.arg(argument.help(field.tip()))
    })
}

/// The text of a file of at most so many bytes.
fn read(file: &str, longest: usize) -> Result<String, String> {
    let sentence = |error: std::io::Error| format!("{file}: {error}");
    let opened = File::open(file).map_err(sentence)?;
    let length = opened.metadata().map_err(sentence)?.len();
    let longest = longest as u64;
    let long = |length: u64| format!("{file}: {length} bytes: expected at most {} MB", longest / 1_000_000);
    if length > longest {
        return Err(long(length));
    }
    // A device does not tell its length.
    let mut bytes = Vec::new();
    let read = opened.take(longest + 1).read_to_end(&mut bytes).map_err(sentence)? as u64;
    if read > longest {
        return Err(long(read));
    }
    String::from_utf8(bytes).map_err(|_| format!("{file}: expected a text in UTF-8"))
}

/// Writes a file whole or not at all, whoever else may be writing it.
fn write(file: &str, text: &str) -> Result<(), String> {
    files::write(file.as_ref(), text).map_err(|error| format!("{file}: {error}"))
}

/// Prints on standard output. Who reads it may have read enough and gone, which is no failure; anything else is.
fn print_text(text: std::fmt::Arguments) {
    let mut out = std::io::stdout().lock();
    match out.write_fmt(text).and_then(|()| out.flush()) {
        Ok(()) => {}
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
        Err(error) => {
            mutter!("ape: standard output: {error}\n");
            std::process::exit(2);
        }
    }
}

/// Whether the files that flags name can be written to, before anything is computed for them: none of them twice, nor in
/// the place of one that is read.
fn check_out(matches: &ArgMatches, flags: &[&str]) -> Result<(), String> {
    // A command without one of the arguments has nothing to be compared.
    let given = |name: &str| matches.try_get_many::<String>(name).ok().flatten().into_iter().flatten();
    let same = |one: &str, other: &str| match (Path::new(one).canonicalize(), Path::new(other).canonicalize()) {
        // A device takes any number of texts.
        (Ok(one), Ok(other)) => one == other && one.is_file(),
        // Whatever way leads to its folder.
        _ => files::place(one.as_ref()).is_some_and(|place| Some(place) == files::place(other.as_ref())),
    };
    let mut taken: Vec<&String> = ["file", "files", "config"].into_iter().flat_map(given).collect();
    for flag in flags {
        for file in given(flag) {
            files::check(file.as_ref()).map_err(|error| format!("--{flag} {file}: {error}"))?;
            if let Some(other) = taken.iter().find(|other| same(other, file)) {
                return Err(format!("--{flag} {file}: is {other}, which is another file of this command"));
            }
            taken.push(file);
        }
    }
    Ok(())
}

fn print(result: &impl Serialize) -> Result<(), String> {
    let text = serde_json::to_string_pretty(result).map_err(|error| error.to_string())?;
    say!("{text}");
    Ok(())
}

/// An ensemble's file, checked.
struct Opened {
    grid: Grid,
    ensemble: Ensemble,
    /// T that it was trained with, in steps.
    horizon: u32,
    digest: Option<Digest>,
}

/// The file that is named.
fn ensemble_file(matches: &ArgMatches) -> Result<Opened, String> {
    let file = matches.get_one::<String>("file").expect("clap requires it");
    let in_file = |error| format!("{file}: {error}");
    let parsed =
        EnsembleFile::parse(&read(file, EnsembleFile::LONGEST)?).map_err(|error| in_file(error.to_string()))?;
    let horizon = parsed.config.as_ref().map_or(HORIZON, |config| config.horizon);
    if let Some(reason) = &parsed.left_out {
        let sentence = format!("{file}: its config is not ours and left out, T is {HORIZON} ({reason})");
        mutter!("ape: {}\n", in_a_line(&sentence));
    }
    let digest = parsed.digest;
    let (grid, ensemble) = parsed.check().map_err(|error| in_file(error.to_string()))?;
    Ok(Opened { grid, ensemble, horizon, digest })
}

fn evaluate(matches: &ArgMatches) -> Result<(), String> {
    /// What is printed: the figures, and the digest that the file says the ensemble has.
    #[derive(Serialize)]
    struct Evaluated {
        #[serde(skip_serializing_if = "Option::is_none")]
        digest: Option<Digest>,
        #[serde(flatten)]
        figures: Figures,
    }
    let Opened { grid, ensemble, horizon, digest } = ensemble_file(matches)?;
    print(&Evaluated { digest, figures: Figures::of(&grid, &ensemble, horizon) })
}

fn presets() -> Result<(), String> {
    for preset in &PRESETS {
        say!("{:<14} {}", preset.name, preset.summary);
    }
    Ok(())
}

fn model(matches: &ArgMatches) -> Result<(), String> {
    check_out(matches, &["out"])?;
    let grid = Grid::new(start(matches)?.grid).map_err(|error| error.to_string())?;
    let text = serde_json::to_string(&transition_model(&grid)).map_err(|error| error.to_string())?;
    match matches.get_one::<String>("out") {
        Some(file) => write(file, &(text + "\n")),
        None => {
            say!("{text}");
            Ok(())
        }
    }
}

/// What the flags say to start from: a preset or a file.
fn start(matches: &ArgMatches) -> Result<Setup, String> {
    let text = |name: &str| matches.get_one::<String>(name);
    match (text("preset"), text("config")) {
        (Some(_), Some(_)) => Err("--preset and --config: give one of them, both say where to start".to_owned()),
        (None, Some(file)) => {
            let text = read(file, EnsembleFile::LONGEST)?;
            if EnsembleFile::parse(&text).is_ok_and(|file| file.moment.is_some()) {
                mutter!(
                    "ape: {file}: its β was moved, or its run cut short or made longer; what its config says is trained\n"
                );
            }
            Setup::parse(&text).map_err(|error| format!("{file}: {error}"))
        }
        (Some(name), None) => {
            let known = || PRESETS.iter().map(|preset| preset.name).collect::<Vec<_>>().join(", ");
            let preset = Preset::find(name).ok_or_else(|| format!("--preset {name}: must be one of {}", known()))?;
            Ok((preset.setup)())
        }
        (None, None) => Ok((PRESETS[0].setup)()),
    }
}

/// The setup to train: what the flags say to start from, then single fields.
fn setup(matches: &ArgMatches) -> Result<Setup, String> {
    let mut setup = start(matches)?;
    if setup.ensemble.is_some() {
        return Err("this preset is a given ensemble: there is nothing to train".to_owned());
    }
    for field in &FIELDS {
        // A command without a flag for a field has none to ask for.
        if let Some(value) = matches.try_get_one::<String>(field.name).ok().flatten() {
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
    digest: Digest,
    observer: String,
    /// β at the end, which `alpha` may have moved.
    beta: f64,
    /// Returns of the clone by the run's own observer.
    clone: KnownReturns,
    /// With an `adversary_reward`: what an expert and the clone collect of it within T, mean over starts.
    #[serde(skip_serializing_if = "Option::is_none")]
    denied: Option<Denied>,
    #[serde(flatten)]
    figures: Figures,
}

/// Most lines of a curve's file, which is written at the end of the run.
const LONGEST_CURVE: u32 = 1_000_000;

fn train(matches: &ArgMatches) -> Result<(), String> {
    check_out(matches, &["out", "curve"])?;
    let Setup { grid, config, .. } = setup(matches)?;
    let horizon = config.horizon;
    let grid = Grid::new(grid).map_err(|error| error.to_string())?;
    let mut trainer = Trainer::new(grid.clone(), config.clone()).map_err(|error| error.to_string())?;
    let curve_file = matches.get_one::<String>("curve");
    if let Some(file) = curve_file.filter(|_| config.updates() > LONGEST_CURVE) {
        return Err(format!(
            "--curve {file}: a line for each of {} updates, expected at most {LONGEST_CURVE}",
            config.updates()
        ));
    }
    let mut curve = CurvePoint::csv_head() + "\n";
    for _ in 0..config.updates() {
        trainer.update();
        if curve_file.is_some() {
            curve += &(CurvePoint::of(&mut trainer).csv_line() + "\n");
        }
    }
    let ensemble = trainer.ensemble();
    if let Some(file) = matches.get_one::<String>("out") {
        let made = EnsembleFile::new(&grid, &ensemble, Some(config.clone()));
        let text = serde_json::to_string(&EnsembleFile { digest: Some(trainer.digest()), ..made });
        write(file, &(text.map_err(|error| error.to_string())? + "\n"))?;
    }
    if let Some(file) = curve_file {
        write(file, &curve)?;
    }
    let point = CurvePoint::of(&mut trainer);
    print(&Trained {
        updates: trainer.updates(),
        digest: trainer.digest(),
        observer: config.observer.to_string(),
        beta: point.beta,
        clone: point.clone,
        denied: point.denied,
        figures: Figures::of(&grid, &ensemble, horizon),
    })
}
