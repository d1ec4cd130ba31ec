//! A run's past: any of its updates again, to the last bit.
//!
//! A run is the same whenever it is made again. So it is enough to keep a copy of the trainer now and then: what lies
//! between two copies is made again when it is wanted: at first seven updates, less than a millisecond of work. When
//! the memory for copies is used up, every other one is dropped.

use crate::ape::Trainer;
use crate::experiment::Course;

/// Copies of a trainer, from update 0 on.
pub struct Recording {
    /// At updates 0, `spacing`, 2 `spacing`, …
    copies: Vec<Trainer>,
    spacing: u32,
    /// The last update there has been.
    end: u32,
    /// Bytes that the copies may take.
    budget: usize,
}

impl Recording {
    /// Bytes that the copies of one run may take in all.
    pub const BUDGET: usize = 16_000_000;
    /// Updates from one copy to the next, as long as there is memory.
    const SPACING: u32 = 8;

    /// Begins with a run at its start.
    pub fn new(start: &Trainer, budget: usize) -> Recording {
        Recording { copies: vec![start.clone()], spacing: Self::SPACING, end: 0, budget }
    }

    /// The last update that can be had.
    pub fn end(&self) -> u32 {
        self.end
    }

    /// Takes in the moment after an update; one that is known already is passed over.
    pub fn keep(&mut self, trainer: &Trainer) {
        let update = trainer.updates();
        if update <= self.end {
            return;
        }
        self.end = update;
        if !update.is_multiple_of(self.spacing) {
            return;
        }
        self.copies.push(trainer.clone());
        while self.bytes() > self.budget && self.copies.len() > 2 {
            let mut is_even = false;
            self.copies.retain(|_| {
                is_even = !is_even;
                is_even
            });
            self.spacing *= 2;
        }
    }

    /// The way to the run after so many updates, or after the last there has been.
    pub fn search(&self, update: u32) -> Search {
        let update = update.min(self.end);
        let copy = (update / self.spacing) as usize;
        Search { trainer: self.copies[copy.min(self.copies.len() - 1)].clone(), update }
    }

    /// Forgets what came after an update.
    pub fn cut(&mut self, update: u32) {
        self.copies.retain(|copy| copy.updates() <= update);
        self.end = self.end.min(update);
    }

    /// Bytes that the copies take, about.
    pub fn bytes(&self) -> usize {
        self.copies.iter().map(Trainer::bytes).sum()
    }
}

/// A moment of a run on its way from the copy before it.
pub struct Search {
    pub trainer: Trainer,
    update: u32,
}

impl Search {
    /// Makes an update again, or nothing where the trainer has come to the moment: whether it has.
    pub fn step(&mut self, course: &Course) -> bool {
        if self.trainer.updates() < self.update {
            advance(&mut self.trainer, course);
        }
        let has_arrived = self.trainer.updates() == self.update;
        if has_arrived {
            // The copy may be from before β was moved here.
            turn(&mut self.trainer, course);
        }
        has_arrived
    }
}

/// One update of a run with this course; β is then as the course has it from there on.
pub fn advance(trainer: &mut Trainer, course: &Course) {
    turn(trainer, course);
    trainer.update();
    turn(trainer, course);
}

/// β as the course has it from this moment on.
pub fn turn(trainer: &mut Trainer, course: &Course) {
    if let Some(beta) = course.turn_at(trainer.updates()) {
        trainer.set_beta(beta).expect("turns were checked when they were taken in");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ape::observer::ObserverChoice;
    use crate::ape::{AlgorithmKind, Config};
    use crate::mdp::{Grid, GridSpec};

    /// Whatever the algorithm and the observer, every update comes back with the digest it had, also across a turn of β and with
    /// little memory.
    #[test]
    fn every_update_comes_back() {
        let grid = Grid::new(GridSpec { rows: 4, cols: 5, walls: vec![(1, 1)], slip: 0.1, ..GridSpec::default() });
        let base = Config { batch_steps: 256, total_steps: 256 * 60, exact_updates: 60, ..Config::default() };
        let course = Course { turns: vec![(17, 0.2), (40, 0.9)], updates: None };
        for config in [
            base.clone(),
            Config { observer: ObserverChoice::PAPER, ..base.clone() },
            Config { observer: "gru(2)".parse().unwrap(), ..base.clone() },
            Config { algorithm: AlgorithmKind::Exact, alpha: Some(-8.0), ..base.clone() },
        ] {
            for budget in [0, 60_000, Recording::BUDGET] {
                let mut trainer = Trainer::new(grid.clone().unwrap(), config.clone()).unwrap();
                let mut recording = Recording::new(&trainer, budget);
                let mut digests = vec![(trainer.digest(), trainer.config().beta)];
                for _ in 0..60 {
                    advance(&mut trainer, &course);
                    recording.keep(&trainer);
                    turn(&mut trainer, &course);
                    digests.push((trainer.digest(), trainer.config().beta));
                }
                assert!(recording.bytes() <= budget.max(3 * trainer.bytes()));
                for update in [60, 0, 1, 16, 17, 18, 39, 40, 41, 59, 99] {
                    let mut search = recording.search(update);
                    while !search.step(&course) {}
                    let then = search.trainer;
                    let expected = digests[update.min(60) as usize];
                    assert_eq!((then.digest(), then.config().beta), expected, "{update} {config:?}");
                }
            }
        }
    }

    /// The run that the page opens with keeps every update in the memory there is.
    #[test]
    fn a_default_run_fits() {
        let config = Config::default();
        let trainer = Trainer::new(Grid::new(GridSpec::default()).unwrap(), config.clone()).unwrap();
        let mut recording = Recording::new(&trainer, Recording::BUDGET);
        // Copies are of one size whatever they hold.
        recording.copies = vec![trainer; config.updates().div_ceil(Recording::SPACING) as usize];
        assert!(recording.bytes() <= Recording::BUDGET, "{}", recording.bytes());
    }
}
