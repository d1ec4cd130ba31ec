//! `history`: exact Bayes over the episode so far, p(c|τ) ∝ Π π_c(a_t|s_t).

use super::{Memory, Observer, ObserverModel};
use crate::ape::{Contexts, Ensemble};
use crate::mdp::{ACTIONS, Grid};

pub const MODEL: ObserverModel = ObserverModel {
    name: "history",
    title: "remembers its episode",
    summary: "p(c|τ) in proportion to Π π_c(a|s) over the steps so far: exact Bayes. Such a clone acts by the ensemble's own \
              prediction, so its episodes have the ensemble's law: it cannot be kept out.",
    parameter: None,
    learns: false,
    remembers: true,
    build: |_, _, _| Box::new(History),
};

struct History;

impl Observer for History {
    fn boxed(&self) -> Box<dyn Observer> {
        Box::new(History)
    }

    /// Before the first action every expert is as likely as the others.
    fn contexts(&mut self, grid: &Grid, ensemble: &Ensemble, _horizon: u32) -> Contexts {
        Contexts::equal(grid.cells(), ensemble.experts())
    }

    fn memory(&self, ensemble: &Ensemble) -> Option<Box<dyn Memory>> {
        Some(Box::new(Posterior::new(ensemble)))
    }
}

/// The posterior over contexts. Remembered is Π π_c(a_t|s_t) of every context, `[n]`, scaled to a largest
/// entry of 1, so that it neither vanishes nor needs a logarithm.
pub struct Posterior {
    /// π_c(a|s), `[S][5][n]`.
    likelihood: Vec<f64>,
    experts: usize,
}

impl Posterior {
    pub fn new(ensemble: &Ensemble) -> Posterior {
        let experts = ensemble.experts();
        let cells = ensemble.policies()[0].rows().len();
        let entry = |i: usize| ensemble.policies()[i % experts].rows()[i / experts / ACTIONS][i / experts % ACTIONS];
        Posterior { likelihood: (0..cells * ACTIONS * experts).map(entry).collect(), experts }
    }
}

impl Memory for Posterior {
    fn start(&self) -> Vec<f64> {
        vec![1.0; self.experts]
    }

    fn see(&self, memory: &mut [f64], _state: usize, p: &mut [f64]) {
        let sum: f64 = memory.iter().sum();
        for (p, weight) in p.iter_mut().zip(memory) {
            *p = *weight / sum;
        }
    }

    fn act(&self, memory: &mut [f64], state: usize, action: usize) {
        let row = &self.likelihood[(state * ACTIONS + action) * self.experts..][..self.experts];
        let mut top: f64 = 0.0;
        for (weight, likelihood) in memory.iter_mut().zip(row) {
            *weight *= likelihood;
            top = top.max(*weight);
        }
        if top > 0.0 {
            memory.iter_mut().for_each(|weight| *weight /= top);
        } else {
            // No expert acts so: what was believed is of no use any more.
            memory.fill(1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::Policy;

    #[test]
    fn it_is_bayes() {
        let first = Policy::from_rows(vec![[0.5, 0.5, 0.0, 0.0, 0.0]; 4]);
        let second = Policy::from_rows(vec![[0.25, 0.25, 0.0, 0.5, 0.0]; 4]);
        let posterior = Posterior::new(&Ensemble::new(vec![first, second]));
        let (mut memory, mut p) = (posterior.start(), [0.0; 2]);
        posterior.see(&mut memory, 3, &mut p);
        assert_eq!(p, [0.5, 0.5]);
        posterior.act(&mut memory, 3, 0);
        posterior.act(&mut memory, 2, 1);
        posterior.see(&mut memory, 2, &mut p);
        assert_eq!(p, [0.8, 0.2]);
        posterior.act(&mut memory, 2, 3);
        posterior.see(&mut memory, 1, &mut p);
        assert_eq!(p, [0.0, 1.0]);
        // Impossible for both: it starts again.
        posterior.act(&mut memory, 1, 2);
        posterior.see(&mut memory, 1, &mut p);
        assert_eq!(p, [0.5, 0.5]);
    }
}
