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
    strange["config"] = json!({"lambda": 1});
    strange["seed"] = json!(5);
    std::fs::write(path, strange.to_string()).unwrap();
    assert_eq!(evaluate()["horizon"], 100);
    let said = String::from_utf8(ape(&["evaluate", path]).stderr).unwrap();
    assert!(said.contains("its config is not ours and left out, T is 100 (unknown field `lambda`"), "{said}");
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
        complaint(&["train", "--observer", "me"]).contains("one of uniform, occupancy, replay(60), history, gru(4)")
    );
    assert!(
        complaint(&["train", "--preset", "none"]).contains("blind, paper, exact, price, lure, no-protection, trap")
    );
    assert!(complaint(&["train", "--preset", "trap"]).contains("nothing to train"));
    assert!(complaint(&["train", "--learning-rate"]).contains("--learning-rate"));
    assert!(complaint(&["train", "--no-such-flag"]).contains("--no-such-flag"));
    assert!(complaint(&["train", "--seed", "-1"]).contains("--seed -1"));
    assert!(complaint(&[]).contains("evaluate, train, model, attack, table1, sweep, results, presets"));
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
    assert!(complaint(&["table1", "--observer", "history"]).contains("needs one without a memory"));
    assert!(complaint(&["table1", "--preset", "price"]).contains("alpha -14: must be none where runs are compared"));
    assert!(complaint(&["sweep", "--out", "/no/such/folder/x.csv"]).contains("there is no folder /no/such/folder"));
    assert!(complaint(&["table1", "--seeds", "0"]).contains("--seeds 0: must be a whole number from 1 to 1000"));
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
        (json!({"experts": [[[null, 0.2, 0.2, 0.2, 0.2]]]}), "not an ensemble file"),
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
        (vec![0xff, 0xfe, 0x00], "valid UTF-8"),
        (Vec::new(), "not an ensemble file: EOF"),
    ] {
        std::fs::write(&path, bytes).unwrap();
        let line = complaint(&["attack", path.to_str().unwrap()]);
        assert!(line.contains("bad.json") && line.contains(expected), "{line}");
    }
    std::fs::File::create(&path).unwrap().set_len(100_000_000).unwrap();
    let line = complaint(&["evaluate", path.to_str().unwrap()]);
    assert!(line.contains("100000000 bytes: expected at most 10 MB"), "{line}");
    let nowhere = file("no-such-folder").join("out.json");
    let line = complaint(&["train", "--total-steps", "1", "--out", nowhere.to_str().unwrap()]);
    assert!(line.contains("no-such-folder"), "{line}");
    // A folder cannot be replaced by a file: the part written before is taken away again.
    let folder = file("folder.json");
    std::fs::create_dir_all(folder.join("kept")).unwrap();
    complaint(&["train", "--total-steps", "1", "--out", folder.to_str().unwrap()]);
    assert!(!file("folder.json.part").exists());
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
