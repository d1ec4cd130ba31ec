//! What the fuzzer begins with: a little of everything that is right, and the words it is written in.

use std::fmt::Write;

use ape_lab::ape::{Config, EnsembleFile, FIELDS, Trainer};
use ape_lab::attack::AttackerChoice;
use ape_lab::experiment::{Course, PRESETS, Race, Setup, Shard, ShardNumber, SweepPlan, SweepRun, Task, address};
use ape_lab::lab::{Command, Event, Session, TaskEvent, encode};
use ape_lab::mdp::{Grid, GridSpec, RETURN_KINDS};

/// Three updates on six cells.
fn setup() -> Setup {
    let grid = GridSpec { rows: 2, cols: 3, goal: (0, 0), walls: vec![(1, 1)], slip: 0.125 };
    let config = Config { batch_steps: 20, total_steps: 60, exact_updates: 3, horizon: 9, ..Config::default() };
    Setup { grid, config, course: Course::default(), ensemble: None }
}

fn ensemble(experts: u32) -> EnsembleFile {
    let Setup { grid, config, .. } = setup();
    let config = Config { experts, ..config };
    let grid = Grid::new(grid).expect("it is a good grid");
    let mut trainer = Trainer::new(grid, config.clone()).expect("it is a good configuration");
    trainer.update();
    EnsembleFile::new(trainer.grid(), &trainer.ensemble(), Some(config))
}

fn given() -> Setup {
    let file = ensemble(2);
    Setup { grid: file.grid.clone(), ensemble: Some(file), ..setup() }
}

fn texts(texts: impl IntoIterator<Item = String>) -> Vec<Vec<u8>> {
    texts.into_iter().map(String::into_bytes).collect()
}

/// Messages one after another, each with its length.
fn joined(messages: &[Vec<u8>]) -> Vec<u8> {
    let length = |message: &Vec<u8>| u16::try_from(message.len()).expect("seeds are small").to_le_bytes();
    messages.iter().flat_map(|message| [&length(message)[..], message].concat()).collect()
}

pub fn addresses() -> Vec<Vec<u8>> {
    let presets = PRESETS.iter().map(|preset| address::encode(&address::write(&(preset.setup)())));
    let more = [
        "",
        "v=1&size=2x3&goal=1,2&walls=0:1&slip=0.5&batch_steps=20&total_steps=200&horizon=5&turns=2:0.1;5:2&updates=9",
        "v=1&size=32x32&algorithm=exact&observer=occupancy&experts=8&tab=race&cell=3,4&speed=max&return=success",
        "v=1&observer=gru(3)&alpha=-14&adversary_reward=1,1=-1 stay=0.5&clones=uniform;history_k(2)&step=4&tab=learn",
        "v=1&observer=replay(7)&gradient=mixture&at=3&digest=0123456789abcdef&file=a.json",
        "v=1&updates=10000000&batch_steps=1&total_steps=10000000&turns=0:0.25;9999999:0.5",
    ];
    texts(presets.chain(more.map(str::to_owned)))
}

pub fn ensembles() -> Vec<Vec<u8>> {
    let files = [1, 2, 8].map(|experts| serde_json::to_string(&ensemble(experts)).expect("a file is plain data"));
    let config = serde_json::to_string(&setup().config).expect("a configuration is plain data");
    let plain = r#"{"format":"ape-ensemble","version":1,"grid":{"rows":2,"cols":2,"goal":[0,0]},"experts":[[[0,0,1,0,0],[1,0,0,0,0],[1,0,0,0,0],[0.2,0.2,0.2,0.2,0.2]]],"config":{"beta":9}}"#;
    texts(files.into_iter().chain([
        config,
        plain.to_owned(),
        r#"{"beta":0.3,"grid":{"rows":3,"cols":4,"goal":[1,1]}}"#.to_owned(),
    ]))
}

pub fn shards() -> Vec<Vec<u8>> {
    let plan = SweepPlan::new(&setup(), vec![0.0, 0.5], 2).expect("it is a good sweep");
    let mut seeds = Vec::new();
    for (shard, shards) in [(1, 1), (1, 2), (2, 3)] {
        let mut shard = Shard::new(plan.clone(), ShardNumber { shard, shards }).expect("it is a good shard");
        seeds.extend(shard.text());
        for index in shard.missing() {
            let run = SweepRun::run(&plan.setup(index), &mut |_| true).ok().flatten().expect("it was not told to stop");
            shard.add(index, run).expect("it belongs there");
        }
        seeds.extend(shard.text());
    }
    texts(seeds)
}

pub fn stored() -> Vec<Vec<u8>> {
    let preferences = r#"{"theme":"Dark","color_map":1,"text_size":1.3,"motion":"Less","explains":true}"#;
    let file = format!("a.json\n{}", serde_json::to_string(&ensemble(2)).expect("a file is plain data"));
    texts([
        format!("{preferences}\0{file}\0v=1&file=a.json&tab=train"),
        format!("{{\"text_size\":1e30,\"color_map\":99999999}}\0{file}\0v=1&file=b.json"),
        "\0a.json\n{}\0v=1&file=a.json".to_owned(),
    ])
}

fn load(setup: Setup) -> Command {
    Command::Load { setup: Box::new(setup), play: true }
}

pub fn commands() -> Vec<Vec<u8>> {
    let with = |change: &dyn Fn(&mut Config)| {
        let mut setup = setup();
        change(&mut setup.config);
        load(setup)
    };
    let beginnings = [
        load(setup()),
        load(given()),
        load(Setup { course: Course { turns: vec![(1, 0.5), (2, 0.25)], updates: Some(9) }, ..setup() }),
        with(&|config| config.observer = "replay(5)".parse().expect("it is in the table")),
        with(&|config| config.observer = "gru(2)".parse().expect("it is in the table")),
        with(&|config| config.observer = "history".parse().expect("it is in the table")),
        with(&|config| config.alpha = Some(-4.0)),
        with(&|config| config.adversary_reward = "0,1=-1 stay=2".parse().ok()),
        with(&|config| config.algorithm = ape_lab::ape::AlgorithmKind::Exact),
    ];
    let rest = [
        Command::Show(AttackerChoice::all().take(8).collect()),
        Command::Speed(Some(60.0)),
        Command::Step,
        Command::Seek { run: 1, update: 1 },
        Command::Continue { beta: 0.25 },
        Command::Play,
        Command::Export,
        Command::Retrain { beta: 0.75 },
        Command::Pause,
        Command::Seek { run: 2, update: 0 },
        Command::Continue { beta: 1.5 },
        Command::Speed(None),
        Command::Seen(3),
    ];
    let all = |first: &Command| joined(&std::iter::once(first).chain(&rest).map(encode).collect::<Vec<_>>());
    beginnings.iter().map(all).collect()
}

pub fn events() -> Vec<Vec<u8>> {
    let said = |setup: Setup, show: &str| {
        let mut session = Session::new();
        session.handle(Command::Show(vec![show.parse().expect("it is in the table")]));
        session.handle(load(setup));
        let mut now = 0.0;
        let mut messages: Vec<Event> = Vec::new();
        for _ in 0..4 {
            now += 100.0;
            session.advance(&|| now);
            messages.extend(session.events());
            session.handle(Command::Step);
        }
        session.handle(Command::Export);
        messages.extend(session.events());
        messages.push(Event::Refused("No.".to_owned()));
        messages.push(Event::Remade(7));
        joined(&messages.iter().map(encode).collect::<Vec<_>>())
    };
    let alpha = Setup { config: Config { alpha: Some(-4.0), ..setup().config }, ..setup() };
    vec![said(setup(), "occupancy"), said(given(), "history_k(1)"), said(alpha, "uniform")]
}

pub fn tasks() -> Vec<Vec<u8>> {
    let attack = |attacker: &str| Task::Attack {
        ensemble: Box::new(ensemble(2)),
        attacker: attacker.parse().expect("it is in the table"),
        horizon: 9,
        seed: 1,
    };
    let race = Race {
        ensemble: ensemble(2),
        cloner: AttackerChoice::OCCUPANCY,
        expert: None,
        start: (1, 2),
        horizon: 9,
        episodes: 5,
        seed: 1,
        luck: 2,
    };
    let history = Race { cloner: "history".parse().expect("it is in the table"), expert: Some(1), ..race.clone() };
    let all = [
        attack("uniform"),
        attack("replay(3)"),
        attack("bc(50)"),
        attack("bc_counts(50)"),
        attack("filtered"),
        attack("history_k(3)"),
        attack("history"),
        Task::Sweep { setup: Box::new(setup()) },
        Task::Table1 { setup: Box::new(setup()), attackers: vec![AttackerChoice::UNIFORM] },
        Task::Race(Box::new(race)),
        Task::Race(Box::new(history)),
    ];
    let with_outcome = |task: &Task| {
        let outcome = task.run(&|| 0.0, &mut |_| true).ok().flatten().expect("it is a good task");
        joined(&[encode(task), encode(&TaskEvent::Done(Box::new(outcome), 1.5)), encode(&TaskEvent::Progress(0.5))])
    };
    all.iter().map(with_outcome).collect()
}

/// Names, values that are close to a limit, and what is no number.
pub fn dictionary() -> String {
    let fields = FIELDS.iter().map(|field| field.name);
    let views = ["v=1", "size=", "goal=", "walls=", "turns=", "updates=", "ensemble=trap", "file=", "tab=", "step="];
    let more =
        ["return=", "speed=", "clones=", "cell=", "at=", "digest=", "format", "version", "grid", "experts", "config"];
    let values = ["NaN", "inf", "-inf", "1e308", "-0", "4294967295", "10000000", "1024", "0.000001", "null", "32x32"];
    let kinds = RETURN_KINDS.iter().map(|kind| kind.name);
    let cloners = AttackerChoice::all().map(|cloner| cloner.to_string()).collect::<Vec<_>>();
    let words = fields.chain(views).chain(more).chain(values).chain(kinds).chain(cloners.iter().map(String::as_str));
    words.fold(String::new(), |mut text, word| {
        let _ = writeln!(text, "\"{word}\"");
        text
    })
}
