#![cfg(not(target_arch = "wasm32"))]
//! The gradient estimators against finite differences of the exact objective, p(c|s) held fixed.

use ape_lab::ape::{Algorithm, BaselineKind, Config, Contexts, Ensemble, GradientKind, PgApe, ReturnToGo};
use ape_lab::mdp::{ACTIONS, Grid, GridSpec, Policy};

/// Exact E[Σ γᵗ r] over at most T steps, from a uniformly drawn start.
fn discounted_return(grid: &Grid, policy: &Policy, horizon: u32, discount: f64) -> f64 {
    let mut value = vec![0.0; grid.cells()];
    for _ in 0..horizon {
        let ahead = |s: usize| -> f64 {
            grid.executed(policy.row(s)).iter().zip(grid.next(s)).map(|(p, &next)| p * value[next as usize]).sum()
        };
        let mut longer = vec![0.0; grid.cells()];
        for &s in grid.starts() {
            longer[s as usize] = -1.0 + discount * ahead(s as usize);
        }
        value = longer;
    }
    grid.starts().iter().map(|&s| value[s as usize]).sum::<f64>() / grid.starts().len() as f64
}

/// J of Eq. 3 for an ensemble given by its logits.
fn objective(grid: &Grid, config: &Config, logits: &[f64], contexts: &Contexts) -> f64 {
    let rows: Vec<[f64; ACTIONS]> = logits
        .chunks(ACTIONS)
        .map(|logits| {
            let weights: [f64; ACTIONS] = std::array::from_fn(|a| libm::exp(logits[a]));
            weights.map(|w| w / weights.iter().sum::<f64>())
        })
        .collect();
    let ensemble = Ensemble::new(rows.chunks(grid.cells()).map(|rows| Policy::from_rows(rows.to_vec())).collect());
    let value = |policy: &Policy| discounted_return(grid, policy, config.horizon, config.discount);
    let mean = ensemble.policies().iter().map(value).sum::<f64>() / ensemble.experts() as f64;
    mean - config.beta * value(&ensemble.cloned(contexts))
}

/// Averages many independent estimates and asks that every component lies within its confidence interval.
fn check(config: Config) {
    const ESTIMATES: usize = 300;
    let spec = GridSpec { rows: 3, cols: 2, goal: (0, 0), walls: vec![(0, 1)], slip: 0.1 };
    let grid = Grid::new(spec).unwrap();
    let mut trainer = PgApe::new(grid.clone(), config.clone());
    // Some training first: away from uniform policies and zero baselines.
    for _ in 0..25 {
        trainer.update();
    }
    let logits: Vec<f64> = trainer
        .experts()
        .ensemble()
        .policies()
        .iter()
        .flat_map(|p| p.rows().iter().flatten().map(|&p| libm::log(p)))
        .collect();
    let estimates: Vec<_> = (0..ESTIMATES).map(|_| trainer.estimate_gradient()).collect();
    let contexts = &estimates[0].contexts;
    let (mut largest, mut compared, mut worst) = (0.0f64, 0, 0.0f64);
    for i in 0..logits.len() {
        let of = |e: &ape_lab::ape::Gradient| e.logits[i];
        let mean = estimates.iter().map(of).sum::<f64>() / ESTIMATES as f64;
        let variance = estimates.iter().map(|e| (of(e) - mean) * (of(e) - mean)).sum::<f64>() / (ESTIMATES - 1) as f64;
        let error = (variance / ESTIMATES as f64).sqrt();
        let at = |step: f64| {
            let mut moved = logits.clone();
            moved[i] += step;
            objective(&grid, &config, &moved, contexts)
        };
        let exact = (at(1e-5) - at(-1e-5)) / 2e-5;
        largest = largest.max(exact.abs() / error.max(1e-12));
        if error > 0.0 {
            compared += 1;
            worst = worst.max((mean - exact).abs() / error);
        } else {
            assert!(exact.abs() < 1e-9, "{i}: {exact}");
        }
    }
    // Of some 40 components 4.5 standard errors is a chance of 1 in 3,000; and the estimates are sharp
    // enough for the comparison to mean something.
    assert!(worst < 4.5, "{worst} standard errors off; {config:?}");
    assert!(largest > 30.0 && compared >= 40, "{largest} {compared}");
}

fn config(gradient: GradientKind, baseline: BaselineKind) -> Config {
    Config {
        gradient,
        baseline,
        observer: "occupancy".parse().unwrap(),
        beta: 0.8,
        horizon: 6,
        batch_steps: 20_000,
        discount: 1.0,
        entropy_start: 0.0,
        entropy_end: 0.0,
        ..Config::default()
    }
}

#[test]
fn sampled_context_is_unbiased() {
    check(config(GradientKind::SampledContext, BaselineKind::Separate));
    check(config(GradientKind::SampledContext, BaselineKind::Joint));
}

#[test]
fn mixture_is_unbiased() {
    check(config(GradientKind::Mixture, BaselineKind::Separate));
    check(config(GradientKind::Mixture, BaselineKind::Joint));
}

#[test]
fn from_start_is_the_gradient_of_the_discounted_return() {
    for gradient in [GradientKind::SampledContext, GradientKind::Mixture] {
        let discounted =
            Config { discount: 0.99, return_to_go: ReturnToGo::FromStart, ..config(gradient, BaselineKind::Separate) };
        check(discounted.clone());
        // A discount that matters more over six steps.
        check(Config { discount: 0.7, observer: "uniform".parse().unwrap(), ..discounted });
    }
}
