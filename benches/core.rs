//! How long the core takes: `cargo bench --no-default-features --features cli --bench core`.
//!
//! `cargo xtask bench native` runs it and puts the figures into docs/PERFORMANCE.md. One thread, no page.

mod workload;

use std::hint::black_box;
use std::time::Duration;

use ape_lab::ape::observer::ObserverChoice;
use ape_lab::ape::{AlgorithmKind, Config};
use ape_lab::attack::AttackerChoice;
use ape_lab::experiment::{Setup, Table1, Task};
use ape_lab::mdp::{Grid, Solver};
use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, BenchmarkId, Criterion, SamplingMode, Throughput};
use criterion::{criterion_group, criterion_main};
use workload::{Desk, TRAININGS, Training};

/// Sides of the grids in the tables of growth.
const SIDES: [u32; 4] = [4, 8, 16, Grid::MAX_SIDE];
/// Ensemble steps of the short runs in the tables of growth.
const SHORT: u32 = 1 << 18;

/// A group of things that take from milliseconds to seconds: as few samples as there may be.
fn slow<'c>(criterion: &'c mut Criterion, name: &str) -> BenchmarkGroup<'c, WallTime> {
    let mut group = criterion.benchmark_group(name);
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    group.warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_millis(1500));
    group
}

/// A group of things that take microseconds.
fn quick<'c>(criterion: &'c mut Criterion, name: &str) -> BenchmarkGroup<'c, WallTime> {
    let mut group = criterion.benchmark_group(name);
    group.sample_size(50).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_millis(1500));
    group
}

/// Whole runs, each with one thing changed; an element is an environment step (of the exact gradient: an update).
fn training(criterion: &mut Criterion) {
    let mut group = slow(criterion, "training");
    group.sample_size(20);
    for training in &TRAININGS {
        let setup = training.setup();
        group.throughput(Throughput::Elements(match setup.config.algorithm {
            AlgorithmKind::PgApe => workload::steps(&setup.config),
            AlgorithmKind::Exact => u64::from(setup.config.updates()),
        }));
        group.bench_function(training.name, |bencher| bencher.iter(|| workload::run(&setup)));
    }
}

/// What a step costs on larger grids, with more experts, in other batches.
fn growth(criterion: &mut Criterion) {
    let measure = |group: &mut BenchmarkGroup<WallTime>, parameter: u32, change: &dyn Fn(&mut Setup)| {
        let mut setup = Setup::default();
        setup.config.total_steps = SHORT;
        change(&mut setup);
        group.throughput(Throughput::Elements(workload::steps(&setup.config)));
        group.bench_function(BenchmarkId::from_parameter(parameter), |bencher| bencher.iter(|| workload::run(&setup)));
    };
    let mut group = slow(criterion, "training by states");
    for side in SIDES {
        measure(&mut group, side * side, &|setup| setup.grid = workload::square(side));
    }
    group.finish();
    let mut group = slow(criterion, "training by experts");
    for experts in [1, 2, 4, Config::MAX_EXPERTS] {
        measure(&mut group, experts, &|setup| setup.config.experts = experts);
    }
    group.finish();
    let mut group = slow(criterion, "training by batch");
    for batch in [256, 1024, 4096, 16384] {
        measure(&mut group, batch, &|setup| setup.config.batch_steps = batch);
    }
}

/// The four returns of a policy, and p(c|s) of the observers that have to compute it.
fn exact(criterion: &mut Criterion) {
    let mut group = quick(criterion, "returns");
    for side in SIDES.into_iter().chain([workload::side()]) {
        let setup = Setup { grid: workload::square(side), ..Setup::default() };
        let (grid, ensemble) = (workload::grid(&setup.grid), workload::experts(&setup));
        let mut solver = Solver::new(&grid);
        group.bench_function(BenchmarkId::from_parameter(side * side), |bencher| {
            bencher.iter(|| solver.evaluate(black_box(&ensemble.policies()[0]), setup.config.horizon));
        });
    }
    group.finish();
    let mut group = quick(criterion, "contexts");
    let setup = Setup::default();
    let (grid, ensemble) = (workload::grid(&setup.grid), workload::experts(&setup));
    for observer in [ObserverChoice::OCCUPANCY, ObserverChoice::PAPER] {
        let Config { horizon, seed, .. } = setup.config;
        group.bench_function(observer.to_string(), |bencher| {
            bencher.iter(|| observer.contexts(&grid, black_box(&ensemble), horizon, seed));
        });
    }
}

/// Cloners that are made of pairs. Both draw their pairs first, and end with the exact returns of the clone.
fn cloning(criterion: &mut Criterion) {
    let mut group = slow(criterion, "cloning");
    let setup = Setup::default();
    let ensemble = workload::experts(&setup);
    let made_of_pairs = |attacker: &AttackerChoice| ["bc", "bc_counts"].contains(&attacker.model().name);
    for attacker in AttackerChoice::usual().into_iter().filter(made_of_pairs) {
        group.throughput(Throughput::Elements(u64::from(attacker.parameter())));
        group.bench_function(attacker.to_string(), |bencher| {
            bencher.iter(|| workload::clone(&setup, black_box(&ensemble), attacker));
        });
    }
}

/// Table 1 over the seeds of the paper's size, with every cloner that is quick, one seed after another.
fn table1(criterion: &mut Criterion) {
    const SEEDS: u32 = 5;
    let (cells, horizon) = (100, Setup::default().config.horizon);
    let attackers: Vec<_> =
        AttackerChoice::usual().into_iter().filter(|attacker| attacker.is_quick(cells, horizon)).collect();
    let task = |setup| Task::Table1 { setup: Box::new(setup), attackers: attackers.clone() };
    let tasks: Vec<Task> = Table1::setups(&Setup::default(), SEEDS).into_iter().map(task).collect();
    let mut group = slow(criterion, "table1");
    group.bench_function(format!("{SEEDS} seeds"), |bencher| {
        bencher.iter(|| {
            for task in &tasks {
                black_box(task.run(&|| 0.0, &mut |_| true).expect("the setup is good"));
            }
        });
    });
}

/// What the page gets to see of a run, evaluated and as bytes.
fn snapshot(criterion: &mut Criterion) {
    let mut group = quick(criterion, "snapshot");
    let mut desk = Desk::new(Training::named("default").setup());
    group.throughput(Throughput::Bytes(desk.snapshot().len() as u64));
    group.bench_function("default", |bencher| bencher.iter_batched(|| (), |()| desk.snapshot(), BatchSize::SmallInput));
}

criterion_group! {
    name = all;
    config = Criterion::default().without_plots();
    targets = training, growth, exact, cloning, table1, snapshot
}
criterion_main!(all);
