#![cfg(not(target_arch = "wasm32"))]
//! The command `ape` as a user meets it: what it writes, and what it says of bad input.

use std::path::PathBuf;
use std::process::{Command, Output};

use ape_lab::ape::{Ensemble, EnsembleFile};
use ape_lab::experiment::PRESETS;
use ape_lab::mdp::{Grid, GridSpec, Policy};
use serde_json::{Value, json};

fn ape(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_ape")).args(arguments).output().unwrap()
}

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// The one line that `ape` says of bad input; anything else about it fails the test.
fn complaint(arguments: &[&str]) -> String {
    let output = ape(arguments);
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{line}");
    assert_eq!(line.lines().count(), 1, "{line}");
    assert!(output.stdout.is_empty());
    line
}

#[test]
fn a_trained_ensemble_evaluates_to_the_figures_it_was_printed_with() {
    let (out, curve) = (file("trained.json"), file("curve.csv"));
    let arguments = ["train", "--total-steps", "80000", "--seed", "7", "--experts", "3"];
    let files = ["--out", out.to_str().unwrap(), "--curve", curve.to_str().unwrap()];
    let output = ape(&[&arguments[..], &files[..]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let trained: Value = serde_json::from_slice(&output.stdout).unwrap();
    let evaluated: Value = serde_json::from_slice(&ape(&["evaluate", files[1]]).stdout).unwrap();
    assert_eq!(trained["updates"], 19);
    for key in ["experts", "ensemble", "clone_uniform", "clone_occupancy", "identity", "optimal"] {
        assert_eq!(trained[key], evaluated[key], "{key}");
    }
    // The curve's last row is the result; and the ensemble file is a configuration file too.
    let curve = std::fs::read_to_string(&curve).unwrap();
    let last: Vec<&str> = curve.lines().last().unwrap().split(',').collect();
    assert_eq!(curve.lines().count(), 20);
    assert_eq!((last[0], last[2].parse().ok()), ("19", trained["ensemble"]["capped_return"].as_f64()));
    let again: Value = serde_json::from_slice(&ape(&["train", "--config", files[1]]).stdout).unwrap();
    assert_eq!(again["digest"], trained["digest"]);
    // Of a run that its configuration alone does not make this is said.
    let said = |args: &[&str]| String::from_utf8(ape(args).stderr).unwrap();
    assert_eq!(said(&["train", "--config", files[1]]), "");
    let mut turned: Value = serde_json::from_str(&std::fs::read_to_string(files[1]).unwrap()).unwrap();
    turned["moment"] = json!({"update": 19, "turns": [[3, 0.2]]});
    let other = file("turned.json");
    std::fs::write(&other, turned.to_string()).unwrap();
    assert!(said(&["train", "--config", other.to_str().unwrap()]).contains("its β was moved, or its run"));
    // So that it can be told which run a result is of, the digest goes with the files and with what is made of them.
    let file: Value = serde_json::from_str(&std::fs::read_to_string(files[1]).unwrap()).unwrap();
    let attack = ape(&["attack", files[1], "--attackers", "uniform", "--json"]);
    let attack: Value = serde_json::from_slice(&attack.stdout).unwrap();
    for digest in [&file["digest"], &attack["digest"], &evaluated["digest"], &json!(last.last().unwrap())] {
        assert_eq!(*digest, trained["digest"]);
    }
}

/// What else a file says does not change its ensemble; its T is the one that counts.
#[test]
fn evaluate_takes_the_files_horizon_and_leaves_strange_fields_alone() {
    let out = file("horizon.json");
    let path = out.to_str().unwrap();
    let trained = ape(&["train", "--total-steps", "9000", "--horizon", "30", "--out", path]);
    let trained: Value = serde_json::from_slice(&trained.stdout).unwrap();
    let evaluate = || serde_json::from_slice::<Value>(&ape(&["evaluate", path]).stdout).unwrap();
    assert_eq!((evaluate()["horizon"].as_u64(), &evaluate()["ensemble"]), (Some(30), &trained["ensemble"]));
    let mut strange: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    // A configuration of ours that is for another grid is no better.
    strange["config"] = json!({"adversary_reward": "20,20=1"});
    std::fs::write(path, strange.to_string()).unwrap();
    let said = String::from_utf8(ape(&["evaluate", path]).stderr).unwrap();
    assert!(said.contains("left out, T is 100 (adversary_reward 20,20: must be a cell"), "{said}");
    strange["config"] = json!({"lambda": 1});
    strange["seed"] = json!(5);
    strange["digest"] = json!("sha256:5");
    std::fs::write(path, strange.to_string()).unwrap();
    assert_eq!(evaluate()["horizon"], 100);
    let said = String::from_utf8(ape(&["evaluate", path]).stderr).unwrap();
    assert!(
        said.contains("its config is not ours and left out, T is 100 (config.lambda: unknown field `lambda`"),
        "{said}"
    );
}

#[test]
fn flags_reach_the_configuration() {
    let config = file("config.json");
    std::fs::write(&config, json!({"batch_steps": 100, "total_steps": 300, "seed": 3}).to_string()).unwrap();
    let digest = |extra: &[&str]| {
        let output = ape(&[&["train", "--config", config.to_str().unwrap()], extra].concat());
        serde_json::from_slice::<Value>(&output.stdout).unwrap()["digest"].clone()
    };
    let plain = digest(&[]);
    assert_eq!(plain, digest(&["--seed", "3"]));
    for different in [
        ["--seed", "4"],
        ["--beta", "0.5"],
        ["--gradient", "mixture"],
        ["--baseline", "joint"],
        ["--observer", "occupancy"],
        ["--learning-rate", "0.06"],
        ["--discount", "0.9"],
        ["--return-to-go", "from_start"],
        ["--horizon", "90"],
        ["--algorithm", "exact"],
        ["--adversary-reward", "9,9=-1 stay=0.5"],
        ["--alpha", "-14"],
    ] {
        assert_ne!(plain, digest(&different), "{different:?}");
    }
}

#[test]
fn presets_are_listed() {
    let list = String::from_utf8(ape(&["presets"]).stdout).unwrap();
    let names: Vec<&str> = list.lines().map(|line| line.split_whitespace().next().unwrap()).collect();
    assert_eq!(names, PRESETS.iter().map(|preset| preset.name).collect::<Vec<_>>());
}

#[test]
fn bad_flags_get_one_sentence() {
    assert!(complaint(&["train", "--beta", "5"]).contains("--beta 5: must be a number from 0 to 2"));
    assert!(
        complaint(&["train", "--observer", "replay(2000)"]).contains(
            "one of uniform; occupancy; replay(contexts kept at each cell), 1 to 1000; history; gru(recurrent units), 1 to 32"
        )
    );
    assert!(
        complaint(&["train", "--preset", "none"]).contains("blind, paper, exact, price, lure, no-protection, trap")
    );
    assert!(complaint(&["train", "--preset", "trap"]).contains("nothing to train"));
    assert!(complaint(&["train", "--learning-rate"]).contains("--learning-rate"));
    assert!(complaint(&["train", "--no-such-flag"]).contains("--no-such-flag"));
    assert!(complaint(&["train", "--seed", "-1"]).contains("--seed -1"));
    assert!(complaint(&[]).contains("evaluate, train, model, attack, table1, sweep, merge, results, presets"));
    assert!(complaint(&["train", "--alpha", "5"]).contains("--alpha 5: must be none, or a return from -10000"));
    assert!(complaint(&["train", "--adversary-reward", "9;9"]).contains("must be none, or rewards as 9,9=-1"));
    let outside = complaint(&["train", "--adversary-reward", "10,0=1"]);
    assert!(
        outside.contains("adversary_reward 10,0: must be a cell of the grid of 10 × 10 cells where a step begins"),
        "{outside}"
    );
    let memory = complaint(&["train", "--algorithm", "exact", "--observer", "history"]);
    assert!(memory.contains("observer history: must be uniform or occupancy with the algorithm exact"), "{memory}");
    let reward = complaint(&["train", "--adversary-reward", "stay=1", "--observer", "gru"]);
    assert!(reward.contains("observer gru(4): must be one whose clone is exact"), "{reward}");
    let lines = complaint(&["train", "--batch-steps", "1", "--total-steps", "1000001", "--curve", "curve.csv"]);
    assert!(
        lines.contains("--curve curve.csv: a line for each of 1000001 updates, expected at most 1000000"),
        "{lines}"
    );
    assert!(complaint(&["table1", "--observer", "history"]).contains("needs one without a memory"));
    assert!(complaint(&["table1", "--preset", "price"]).contains("alpha -14: must be none where runs are compared"));
    assert!(complaint(&["sweep", "--out", "/no/such/folder/x.csv"]).contains("there is no folder /no/such/folder"));
    assert!(complaint(&["table1", "--seeds", "0"]).contains("--seeds 0: must be a whole number from 1 to 1000"));
    for (flag, value) in [("--seeds", "-1"), ("--betas", "-1:1:0.5")] {
        assert!(complaint(&["sweep", flag, value]).contains(&format!("{flag} {value}: must be")));
    }
    assert!(complaint(&["sweep", "--betas", "0.6,0.6"]).contains("--betas 0.6,0.6: β 0.6 stands there twice"));
    // A sentence has a length that is read.
    assert!(complaint(&["train", "--preset", &"long".repeat(9000)]).chars().count() < 2100);
    assert!(complaint(&["sweep", "--betas", "0:3:1"]).contains("--betas 0:3:1: must be FIRST:LAST:STEP"));
    assert!(complaint(&["attack", "/no/such/file"]).contains("/no/such/file"));
    assert!(complaint(&["evaluate", "/no/such/file"]).contains("/no/such/file"));
}

#[test]
fn bad_files_get_one_sentence_and_leave_nothing_behind() {
    let grid = Grid::new(GridSpec { rows: 2, cols: 2, ..GridSpec::default() }).unwrap();
    let good = EnsembleFile::new(&grid, &Ensemble::new(vec![Policy::from_rows(vec![[0.2; 5]; 4])]), None);
    let good = serde_json::to_value(good).unwrap();
    for (change, expected) in [
        (json!({"format": "other"}), "must be \"ape-ensemble\""),
        (json!({"version": 2}), "reads version 1"),
        (json!({"experts": []}), "from 1 to 8"),
        (json!({"experts": [[[0.2, 0.2, 0.2, 0.2, 0.2]]]}), "expert 1: the policy has 1 rows"),
        (json!({"experts": [vec![[0.5; 5]; 4]]}), "sum to 2.5"),
        (json!({"experts": [[[0.2]]]}), "not an ensemble file"),
        (json!({"experts": [[[null, 0.2, 0.2, 0.2, 0.2]]]}), "experts[0][0][0]: invalid type: null, expected f64"),
        (json!({"experts": [vec![[-0.2, 0.6, 0.2, 0.2, 0.2]; 4]]}), "probability -0.2 of action 0"),
        (json!({"version": 99}), "version 99: this program reads version 1"),
        (json!({"grid": {"rows": 2, "cols": 2, "goal": [5, 0]}}), "lies outside"),
        (json!({"grid": {"rows": 99, "cols": 2, "goal": [0, 0]}}), "from 2 to 32"),
    ] {
        let mut bad = good.clone();
        bad.as_object_mut().unwrap().extend(change.as_object().unwrap().clone());
        let path = file("bad.json");
        std::fs::write(&path, bad.to_string()).unwrap();
        for command in ["evaluate", "attack"] {
            let line = complaint(&[command, path.to_str().unwrap()]);
            assert!(line.contains("bad.json") && line.contains(expected), "{line}");
        }
    }
    // Cut short, not a number, no text at all, a hundred megabytes.
    let whole = good.to_string();
    let path = file("bad.json");
    for (bytes, expected) in [
        (whole.as_bytes()[..whole.len() / 2].to_vec(), "not an ensemble file: EOF"),
        (whole.replace("0.2", "NaN").into_bytes(), "not an ensemble file: expected value"),
        (whole.replace("0.2", "1e999").into_bytes(), "not an ensemble file: number out of range"),
        (vec![0xff, 0xfe, 0x00], "a text in UTF-8"),
        (Vec::new(), "not an ensemble file: EOF"),
        (whole.replace("\"version\":1", "\"version\":1,\"version\":1").into_bytes(), "\"version\" stands there twice"),
    ] {
        std::fs::write(&path, bytes).unwrap();
        let line = complaint(&["attack", path.to_str().unwrap()]);
        assert!(line.contains("bad.json") && line.contains(expected), "{line}");
    }
    // What a file says does nothing to a terminal.
    std::fs::write(&path, r#"{"\u001b[31mred\u0007\r": 1}"#).unwrap();
    let line = complaint(&["train", "--config", path.to_str().unwrap()]);
    assert!(line.contains(r"unknown field `\u{1b}[31mred\u{7}\r`"), "{line}");
    // Nor does the mark that some editors begin a file with.
    std::fs::write(&path, "\u{feff}{\"beta\": 5}").unwrap();
    assert!(complaint(&["train", "--config", path.to_str().unwrap()]).contains("beta 5: must be a number"));
    std::fs::File::create(&path).unwrap().set_len(100_000_000).unwrap();
    let line = complaint(&["evaluate", path.to_str().unwrap()]);
    assert!(line.contains("100000000 bytes: expected at most 10 MB"), "{line}");
    let nowhere = file("no-such-folder").join("out.json");
    let line = complaint(&["train", "--total-steps", "1", "--out", nowhere.to_str().unwrap()]);
    assert!(line.contains("no-such-folder"), "{line}");
    let folder = file("folder.json");
    std::fs::create_dir_all(folder.join("kept")).unwrap();
    let line = complaint(&["train", "--total-steps", "1", "--out", folder.to_str().unwrap()]);
    assert!(line.contains("is a folder, expected a file"), "{line}");
}

/// Where a result cannot go is said before anything is computed; and it never takes the place of another file.
#[test]
fn results_go_where_they_can_be_written() {
    let folder = file("outputs");
    std::fs::create_dir_all(&folder).unwrap();
    let at = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let train = |out: &str| ape(&["train", "--total-steps", "4096", "--out", out]).status.success();
    let (ensemble, long) = (at("ensemble.json"), at(&"x".repeat(300)));
    assert!(train(&ensemble));
    let before = std::fs::read(&ensemble).unwrap();
    let slash = at("new.json/");
    // A run of all updates there can be would not end.
    for (files, expected) in [
        (vec!["--out", ""], "--out : expected the name of a file"),
        (vec!["--out", &slash], "expected the name of a file"),
        (vec!["--out", &long], "File name too long"),
        (vec!["--curve", &ensemble, "--out", &ensemble], "which is another file of this command"),
        (vec!["--config", &ensemble, "--out", &ensemble], "which is another file of this command"),
    ] {
        let line = complaint(&[&["train", "--batch-steps", "64", "--total-steps", "640000000"], &files[..]].concat());
        assert!(line.contains(expected), "{line}");
    }
    let line = complaint(&["attack", &ensemble, "--out", &ensemble]);
    assert!(line.contains("which is another file of this command"), "{line}");
    assert_eq!(std::fs::read(&ensemble).unwrap(), before);
    // A name as long as names can be.
    assert!(train(&at(&"y".repeat(255))));
    assert!(
        std::fs::read_dir(&folder).unwrap().all(|file| !file.unwrap().file_name().to_str().unwrap().ends_with(".part"))
    );
}

/// What is no file is written to, not replaced: what a link stands for, or who listens at a pipe.
#[cfg(unix)]
#[test]
fn links_and_pipes_stay_what_they_are() {
    use std::os::unix::fs::{FileTypeExt, PermissionsExt};
    let folder = file("links");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let (link, target, pipe) = (folder.join("link.json"), folder.join("target.json"), folder.join("pipe"));
    std::fs::write(&target, "old").unwrap();
    std::os::unix::fs::symlink("target.json", &link).unwrap();
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let grid = |out: &PathBuf| ape(&["model", "--out", out.to_str().unwrap()]).status.success();
    assert!(grid(&link) && link.is_symlink());
    let model = std::fs::read_to_string(&target).unwrap();
    assert!(model.starts_with("{\"format\""), "{}", &model[..40.min(model.len())]);
    let heard = std::thread::scope(|scope| {
        let listener = scope.spawn(|| std::fs::read_to_string(&pipe).unwrap());
        assert!(grid(&pipe));
        listener.join().unwrap()
    });
    assert!(heard == model && pipe.metadata().unwrap().file_type().is_fifo());
    // A link to what is not there yet leads there all the same.
    let (dangling, new) = (folder.join("dangling.json"), folder.join("new.json"));
    std::os::unix::fs::symlink("new.json", &dangling).unwrap();
    assert!(grid(&dangling) && dangling.is_symlink());
    assert_eq!(std::fs::read_to_string(&new).unwrap(), model);
    // Who could not read the old file cannot read the new one.
    std::fs::set_permissions(&new, std::fs::Permissions::from_mode(0o600)).unwrap();
    assert!(grid(&new));
    assert_eq!(new.metadata().unwrap().permissions().mode() & 0o777, 0o600);
}

/// What is known of one seed is a figure, and no spread.
#[test]
fn one_seed_has_no_spread() {
    let sweep = ["sweep", "--betas", "0.6", "--total-steps", "4096", "--seeds"];
    let lines = |seeds: &'static str| String::from_utf8(ape(&[&sweep[..], &[seeds]].concat()).stdout).unwrap();
    let spreads = |text: &str| text.lines().filter(|line| line.contains("β = ") && line.contains('±')).count();
    assert_eq!([spreads(&lines("1")), spreads(&lines("2"))], [0, 2]);
}

/// The figures that are printed and the file would write over each other.
#[cfg(target_os = "linux")]
#[test]
fn what_is_printed_to_is_no_output() {
    let path = file("printed.json");
    let command = |arguments: &[&str]| {
        let printed = std::fs::File::create(&path).unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_ape")).args(arguments).stdout(printed).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    for out in ["/dev/stdout", path.to_str().unwrap()] {
        let (code, line) = command(&["train", "--total-steps", "4096", "--out", out]);
        assert_eq!(
            (code, line.trim_end()),
            (Some(2), &*format!("ape: --out {out}: is what is printed to, expected another file"))
        );
        assert!(path.metadata().unwrap().len() == 0);
    }
}

/// Half a result is no success, and help that nobody reads is no crash.
#[cfg(target_os = "linux")]
#[test]
fn an_output_that_takes_nothing_is_a_failure_with_a_sentence() {
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let command = || Command::new(env!("CARGO_BIN_EXE_ape"));
    for arguments in [&["model"][..], &["presets"], &["train", "--help"], &["--version"]] {
        let output = command().args(arguments).stdout(full()).stderr(std::process::Stdio::piped()).output().unwrap();
        let line = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?} {line}");
        assert!(line.starts_with("ape: standard output: No space left"), "{line}");
    }
    let output = command().args(["evaluate", "no-such-file"]).stderr(full()).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
}

/// The model is that of the grid the flags start from, a given ensemble's too, with no flags of a training run.
#[test]
fn the_model_of_a_grid_is_written() {
    let (config, out) = (file("grid.json"), file("model.json"));
    let grid = json!({"rows": 2, "cols": 3, "goal": [0, 0], "walls": [[1, 1]], "slip": 0.5});
    std::fs::write(&config, json!({ "grid": grid }).to_string()).unwrap();
    let output = ape(&["model", "--config", config.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    assert!(output.status.success() && output.stdout.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    let model: Value = serde_json::from_str(&std::fs::read_to_string(&out).unwrap()).unwrap();
    assert_eq!(model["actions"], json!(["Up", "Down", "Left", "Right", "Stay"]));
    assert_eq!((&model["nS"], &model["nA"], &model["shape"]), (&json!(6), &json!(5), &json!([2, 3])));
    assert_eq!((&model["goal"], &model["walls"]), (&json!(0), &json!([4])));
    assert_eq!(model["P"]["1"]["2"], json!([[0.6, 0, -1.0, true], [0.3, 1, -1.0, false], [0.1, 2, -1.0, false]]));
    assert_eq!(model["P"]["0"]["3"], json!([[1.0, 0, 0.0, true]]));
    assert_eq!(model["initial_state_distrib"], json!([0.0, 0.25, 0.25, 0.25, 0.0, 0.25]));
    let trap: Value = serde_json::from_slice(&ape(&["model", "--preset", "trap"]).stdout).unwrap();
    assert_eq!(trap["nS"], 100);
    assert!(complaint(&["model", "--beta", "0.5"]).contains("--beta"));
}

/// Every cloner against a file, as a table, as JSON and as CSV.
#[test]
fn an_ensemble_file_is_attacked() {
    let (out, csv) = (file("attacked.json"), file("attack.csv"));
    let path = out.to_str().unwrap();
    ape(&["train", "--total-steps", "800000", "--out", path]);
    let attackers = "uniform,occupancy,bc_counts(20000),history_k(2),history,gru(1)";
    let arguments = ["attack", path, "--attackers", attackers, "--seed", "4"];
    let text = String::from_utf8(ape(&arguments).stdout).unwrap();
    let json = ape(&[&arguments[..], &["--json", "--out", csv.to_str().unwrap()]].concat());
    let bench: Value = serde_json::from_slice(&json.stdout).unwrap();
    let evaluated: Value = serde_json::from_slice(&ape(&["evaluate", path]).stdout).unwrap();
    assert_eq!((&bench["ensemble"], &bench["seed"]), (&evaluated["ensemble"], &json!(4)));
    let lines = bench["attackers"].as_array().unwrap();
    let names: Vec<&str> = lines.iter().filter_map(|line| line["attacker"].as_str()).collect();
    assert_eq!(names.join(","), attackers);
    assert!(names.iter().all(|name| text.contains(name)));
    for (line, key) in [(&lines[0], "clone_uniform"), (&lines[1], "clone_occupancy")] {
        for figure in ["capped_return", "uncapped_return", "horizon_return", "success"] {
            assert_eq!(line["returns"][figure], evaluated[key][figure], "{key} {figure}");
        }
    }
    assert_eq!((&lines[2]["pairs"], &lines[3]["drop"]), (&json!(20_000), &Value::Null));
    assert!(lines[5]["returns"]["horizon_error"].as_f64() > Some(0.0));
    assert_eq!(std::fs::read_to_string(csv).unwrap().lines().count(), 1 + names.len());
    let many = vec!["uniform"; 101].join(",");
    assert!(complaint(&["attack", path, "--attackers", &many]).contains("101 of them, expected at most 100"));
    let line = complaint(&["attack", path, "--attackers", "uniform,thief"]);
    assert!(line.contains("\"thief\": must be one of uniform; occupancy;") && line.contains("or all"), "{line}");
}

/// Table 1 and the sweep: runs in order, whatever the number of cores.
#[test]
fn experiments_do_not_depend_on_the_number_of_cores() {
    let short = ["--total-steps", "40000", "--exact-updates", "20"];
    let run = |arguments: &[&str], cores: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_ape"))
            .args([arguments, &short, &["--json"]].concat())
            .env("RAYON_NUM_THREADS", cores)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let csv = file("sweep.csv");
    let sweep = ["sweep", "--betas", "0:0.4:0.2", "--seeds", "2", "--out", csv.to_str().unwrap()];
    let table = ["table1", "--seeds", "3", "--attackers", "uniform,bc_counts(1000),bc(300)"];
    for arguments in [&sweep[..], &table[..]] {
        assert_eq!(run(arguments, "1"), run(arguments, "3"));
    }
    let lines: Vec<String> = std::fs::read_to_string(&csv).unwrap().lines().map(str::to_owned).collect();
    let starts: Vec<&str> = lines[1..].iter().filter_map(|line| line.get(..5)).collect();
    assert_eq!(starts, ["0,1,-", "0,2,-", "0.2,1", "0.2,2", "0.4,1", "0.4,2"]);
    let made: Value = serde_json::from_str(&run(&table, "2")).unwrap();
    assert_eq!(made["runs"].as_array().unwrap().len(), 3 * 6);
}

/// A short sweep of nine runs.
const SWEEP: [&str; 9] =
    ["sweep", "--betas", "0:0.4:0.2", "--seeds", "3", "--total-steps", "30000", "--observer", "occupancy"];

/// What a command says that goes well.
fn said(arguments: &[&str]) -> String {
    let output = ape(arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The text of the file of a shard, computed anew.
fn shard(which: &str, name: &str) -> String {
    let path = file(name);
    let _ = std::fs::remove_file(&path);
    let line = said(&[&SWEEP[..], &["--shard", which, "--out", path.to_str().unwrap()]].concat());
    assert!(line.contains(&format!("{name}: shard {which} is complete (runs: ")), "{line}");
    std::fs::read_to_string(path).unwrap()
}

/// One shard, seven shards and no shards: the same table, JSON and CSV.
#[test]
fn merged_shards_are_the_sweep_byte_for_byte() {
    let (whole, merged) = (file("whole.csv"), file("merged.csv"));
    let table = said(&[&SWEEP[..], &["--out", whole.to_str().unwrap()]].concat());
    let json = said(&[&SWEEP[..], &["--json"]].concat());
    let csv = std::fs::read(&whole).unwrap();
    assert_eq!(csv.iter().filter(|byte| **byte == b'\n').count(), 1 + 9);
    for shards in [1, 7] {
        // In no special order.
        let names: Vec<String> = (1..=shards).rev().map(|i| format!("merged-{i}-of-{shards}.json")).collect();
        for (i, name) in (1..=shards).rev().zip(&names) {
            shard(&format!("{i}/{shards}"), name);
        }
        let paths: Vec<PathBuf> = names.iter().map(|name| file(name)).collect();
        let mut merge = vec!["merge"];
        merge.extend(paths.iter().map(|path| path.to_str().unwrap()));
        let _ = std::fs::remove_file(&merged);
        assert_eq!(said(&[&merge[..], &["-o", merged.to_str().unwrap()]].concat()), table);
        assert_eq!(said(&[&merge[..], &["--json"]].concat()), json);
        assert_eq!(std::fs::read(&merged).unwrap(), csv);
    }
}

/// A shard whose file lacks runs, as a stop leaves it, ends up as one that was never stopped, on any number of cores;
/// what is there already is kept.
#[test]
fn a_stopped_shard_goes_on() {
    let name = "stopped.json";
    let path = file(name);
    let go_on = |cores: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_ape"))
            .args([&SWEEP[..], &["--shard", "1/2", "--out", path.to_str().unwrap()]].concat())
            .env("RAYON_NUM_THREADS", cores)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let whole = shard("1/2", name);
    let parsed: Value = serde_json::from_str(&whole).unwrap();
    assert_eq!((&parsed["complete"], parsed["runs"].as_array().unwrap().len()), (&json!(true), 5));
    let kept = |which: &[usize]| {
        let mut stopped = parsed.clone();
        let runs = which.iter().map(|&run| parsed["runs"][run].clone());
        stopped["runs"] = Value::Array(runs.collect());
        stopped["complete"] = json!(false);
        stopped
    };
    for (which, cores) in [(&[][..], "1"), (&[0], "3"), (&[1, 3], "2"), (&[0, 1, 2, 4], "1")] {
        std::fs::write(&path, kept(which).to_string()).unwrap();
        let line = complaint(&["merge", path.to_str().unwrap()]);
        assert!(line.contains("shard 2/2 is missing"), "{line}");
        assert!(go_on(cores).contains(&format!("(runs: 5, kept from before: {})", which.len())));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), whole);
    }
    // A run that was done is not done again, and a complete file is not written again.
    let mut marked = kept(&[2, 3]);
    marked["runs"][1]["clone"]["success"] = json!(0.125);
    std::fs::write(&path, marked.to_string()).unwrap();
    go_on("2");
    let gone_on: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    assert_eq!(gone_on["runs"][3], marked["runs"][1]);
    assert_eq!(gone_on["runs"][4], parsed["runs"][4]);
    let pretty = serde_json::to_string_pretty(&gone_on).unwrap();
    std::fs::write(&path, &pretty).unwrap();
    assert!(go_on("2").contains("shard 1/2 is complete already (runs: 5), nothing to do"));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), pretty);
}

#[test]
fn bad_shards_get_one_sentence_and_are_left_alone() {
    let (first, second) = (file("bad-1.json"), file("bad-2.json"));
    let (one, two) = (first.to_str().unwrap(), second.to_str().unwrap());
    shard("1/2", "bad-1.json");
    let whole = shard("2/2", "bad-2.json");
    let good: Value = serde_json::from_str(&whole).unwrap();
    let csv = file("bad.csv");
    let merge = |files: &[&str]| {
        let line = complaint(&[&["merge"], files, &["--out", csv.to_str().unwrap()]].concat());
        assert!(!csv.exists());
        line
    };
    let again = |extra: &[&str]| complaint(&[&SWEEP[..], &["--shard", "2/2", "--out", two], extra].concat());
    let change = |pointer: &str, value: Value| {
        let mut bad = good.clone();
        *bad.pointer_mut(pointer).unwrap() = value;
        bad.to_string().into_bytes()
    };
    let replace = |from: &str, to: &str| {
        assert!(whole.contains(from), "{from}");
        whole.replacen(from, to, 1).into_bytes()
    };
    let run = good["runs"][0].clone();
    for (bytes, expected) in [
        (whole.as_bytes()[..whole.len() / 2].to_vec(), "not a shard of a sweep: EOF"),
        (Vec::new(), "not a shard of a sweep: EOF"),
        (format!("{{\"runs\":[{}0]}}", "0,".repeat(4_000_001)).into_bytes(), "more than 4000000 values"),
        (vec![0xff, 0xfe], "a text in UTF-8"),
        (b"[".repeat(100_000), "not a shard of a sweep: "),
        (replace("\"success\":", "\"success\":NaN,\"s\":"), "not a shard of a sweep: expected value"),
        (replace("\"success\":", "\"success\":1e999,\"s\":"), "not a shard of a sweep: number out of range"),
        (change("/runs/0/ensemble/success", Value::Null), "not a shard of a sweep: invalid type: null"),
        (change("/format", json!("ape-ensemble")), "format \"ape-ensemble\": must be \"ape-sweep-shard\""),
        (change("/version", json!(2)), "version 2: this program reads version 1"),
        (change("/shard", json!(0)), "0/2: must be I/K"),
        (change("/shards", json!(0)), "2/0: must be I/K"),
        (change("/shards", json!(10)), "2/10: the sweep has 9 runs, expected K from 1 to 9"),
        (change("/sweep/seeds", json!(0)), "sweep.seeds has 0 entries: must have from 1 to 1000"),
        (change("/sweep/betas", json!([])), "sweep.betas has 0 entries"),
        (change("/sweep/betas/1", json!(3)), "config: beta 3: must be a number from 0 to 2"),
        (change("/sweep/config/horizon", json!(0)), "config: horizon 0: must be"),
        (change("/sweep/grid/rows", json!(99)), "grid: "),
        (change("/runs/0/index", json!(2)), "run 2 (β 0, seed 2): expected a run of shard 2/2"),
        (change("/runs/0/index", json!(90)), "the sweep has 9 runs"),
        (change("/runs/0/seed", json!(1)), "expected β 0, seed 2 there"),
        (change("/runs/1", run), "expected every run once"),
        (change("/complete", json!(false)), "complete false: every run is there, expected true"),
        (change("/runs", json!([])), "complete true: run 1 (β 0, seed 2), run 3"),
    ] {
        std::fs::write(&second, &bytes).unwrap();
        for line in [merge(&[one, two]), again(&[])] {
            assert!(line.contains("bad-2.json") && line.contains(expected), "{line}");
        }
        assert!(again(&[]).contains("; the file is left as it is"));
        assert_eq!(std::fs::read(&second).unwrap(), bytes);
    }
    std::fs::File::create(&second).unwrap().set_len(200_000_000).unwrap();
    assert!(merge(&[one, two]).contains("200000000 bytes: expected at most 100 MB"));
    // Good files that are not what was asked for.
    std::fs::write(&second, &whole).unwrap();
    let line = again(&["--horizon", "90"]);
    assert!(line.contains("bad-2.json: sweep.config.horizon 100: expected 90; the file is left as it is"), "{line}");
    let line = complaint(&[&SWEEP[..], &["--shard", "1/2", "--out", two]].concat());
    assert!(line.contains("bad-2.json: shard 2/2: expected shard 1/2; the file is left as it is"), "{line}");
    assert_eq!(std::fs::read_to_string(&second).unwrap(), whole);
    // Files that do not make a whole.
    assert!(merge(&[two]).contains("shard 1/2 is missing: expected every shard of the sweep"));
    assert!(merge(&[one, two, two]).contains("bad-2.json: given twice"));
    let copy = file("bad-copy.json");
    std::fs::copy(&first, &copy).unwrap();
    let line = merge(&[one, two, copy.to_str().unwrap()]);
    assert!(line.contains("bad-copy.json: shard 1/2, which is in ") && line.contains("bad-1.json too"), "{line}");
    let line = {
        std::fs::write(&second, change("/sweep/config/discount", json!(0.5))).unwrap();
        merge(&[one, two])
    };
    assert!(line.contains("bad-2.json: sweep.config.discount 0.5: expected 0.99, as in "), "{line}");
    assert!(merge(&["/no/such/file"]).contains("/no/such/file"));
    assert!(complaint(&["merge"]).contains("<FILES>"));
    // Flags; none of them leaves a file.
    let out = file("bad-none.json");
    let flags = |extra: &[&str]| {
        let line = complaint(&[&SWEEP[..], &["--out", out.to_str().unwrap()], extra].concat());
        assert!(!out.exists());
        line
    };
    for bad in ["0/4", "5/4", "a/b", "4", "1/10001"] {
        let line = flags(&["--shard", bad]);
        assert!(line.contains(&format!("--shard {bad}: must be I/K, shard I of K, with I from 1 to K")), "{line}");
    }
    assert!(flags(&["--shard", "1/10"]).contains("--shard 1/10: the sweep has 9 runs, expected K from 1 to 9"));
    assert!(flags(&["--shard", "1/2", "--json"]).contains("--json"));
    assert!(flags(&["--shard", "1/2", "--config", "/no/such/file"]).contains("/no/such/file"));
    assert!(complaint(&["sweep", "--shard", "1/2"]).contains("--shard 1/2: expected --out FILE with it"));
    let price = complaint(&["sweep", "--preset", "price", "--shard", "1/2", "--out", out.to_str().unwrap()]);
    assert!(price.contains("alpha -14: must be none where runs are compared") && !out.exists(), "{price}");
}

/// The clone of a sweep is that of the run's own observer, as along the run's curve; where it was simulated its interval is there.
#[test]
fn the_clone_of_a_sweep_is_that_of_the_run() {
    for observer in ["replay(5)", "gru(1)"] {
        let (curve, csv) = (file("own-curve.csv"), file("own-sweep.csv"));
        let short = ["--total-steps", "9000", "--batch-steps", "1000", "--horizon", "20", "--observer", observer];
        said(&[&["train", "--beta", "0.6", "--curve", curve.to_str().unwrap()], &short[..]].concat());
        said(&[&["sweep", "--betas", "0.6", "--seeds", "1", "--out", csv.to_str().unwrap()], &short[..]].concat());
        let last = |path: &PathBuf| {
            let text = std::fs::read_to_string(path).unwrap();
            let [head, last] = [text.lines().next().unwrap(), text.lines().last().unwrap()].map(|line| line.split(','));
            head.map(str::to_owned).zip(last.map(str::to_owned)).collect::<std::collections::HashMap<_, _>>()
        };
        let [run, sweep] = [last(&curve), last(&csv)];
        assert_eq!(run["digest"], sweep["digest"]);
        let [in_run, in_sweep] = [&run, &sweep].map(|of| of["clone_horizon_return"].parse::<f64>().unwrap());
        let [first, second] = [&run, &sweep].map(|of| of["clone_horizon_error"].parse::<f64>().unwrap());
        // Of what is simulated a curve tries fewer episodes.
        assert_eq!((first > 0.0, second > 0.0), (observer == "gru(1)", observer == "gru(1)"), "{observer}");
        assert!((in_run - in_sweep).abs() <= 2.0 * (first + second), "{observer}: {in_run} {in_sweep}");
    }
}

/// The paper's figures stand beside what they can be compared with.
#[test]
fn the_papers_table_stands_beside_its_like() {
    let short = ["table1", "--seeds", "1", "--total-steps", "40000", "--exact-updates", "20", "--attackers", "bc(100)"];
    let text = said(&short);
    assert!(text.contains("(paper -16.24 ± 1.20)") && !text.contains("-44.27"), "{text}");
    assert!(!said(&[&short[..], &["--beta", "0"]].concat()).contains("paper -"));
}

/// What cannot be gone on from, written, or told from another output is refused before any work.
#[cfg(unix)]
#[test]
fn outputs_are_checked_before_the_work() {
    let line = complaint(&[&SWEEP[..], &["--shard", "1/2", "--out", "/dev/null"]].concat());
    assert!(line.contains("/dev/null: is no file, expected one that --shard can go on from"), "{line}");
    let folder = file("outputs");
    std::fs::create_dir_all(folder.join("inner")).unwrap();
    let [one, other] = ["inner/../same", "same"].map(|name| folder.join(name).to_str().unwrap().to_owned());
    let line = complaint(&["train", "--total-steps", "1000000000", "--out", &one, "--curve", &other]);
    assert!(line.contains("which is another file of this command"), "{line}");
    std::fs::create_dir_all(folder.join("docs/RESULTS.md")).unwrap();
    let line = complaint(&["results", folder.join("docs").to_str().unwrap()]);
    assert!(line.contains("RESULTS.md: is a folder, expected a file"), "{line}");
}

/// No r̃ is written as everywhere else.
#[test]
fn no_adversary_reward_is_none_in_a_file_too() {
    let config = file("none.json");
    for value in [json!("none"), Value::Null] {
        std::fs::write(&config, json!({"adversary_reward": value, "total_steps": 9000}).to_string()).unwrap();
        assert!(said(&["train", "--config", config.to_str().unwrap()]).contains("\"digest\""));
    }
}
