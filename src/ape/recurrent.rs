//! The paper's learned sequential observer: p(c|τ_{1:t}), who acts by all cells seen so far.
//!
//! A GRU reads the cells of an episode one after another. Its output, next to the cell itself, goes through a
//! dense layer of 128 rectified units and a softmax over contexts, at every step. Cells are one-hot, so that
//! their weights (and their layers' biases) are rows of tables.

use std::ops::Range;

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::observer::Memory;
use super::{Adam, Contexts};

/// Units of the dense layer (paper: 128).
const DENSE: usize = 128;
/// Largest weight before training, of either sign.
const WEIGHT: f64 = 0.2;
/// Adam's step size at the first minibatch; it falls linearly to 0.
const LEARNING_RATE: f64 = 0.02;

/// An episode with the expert that acted.
#[derive(Clone, Debug, PartialEq)]
pub struct Labelled {
    pub context: u8,
    /// The cells it went through, the goal left out.
    pub states: Vec<u32>,
}

/// The network's tables, in the order of its parameters.
#[derive(Clone, Copy)]
enum Table {
    /// What a cell adds to the GRU's candidate, update and reset, `[S][3H]`.
    Input,
    /// What a unit of the GRU adds to the next step's update, reset and candidate, `[H][3H]`.
    Recurrent,
    /// What a cell adds to the dense layer, `[S][128]`.
    Seen,
    /// What a unit of the GRU adds to the dense layer, `[H][128]`.
    Remembered,
    /// What the dense layer adds to a context's logit, `[n][128]`.
    Output,
    /// The contexts' logits when the dense layer is silent, `[1][n]`.
    Bias,
}

/// The observer: all its weights.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    cells: usize,
    contexts: usize,
    units: usize,
    /// One [`Table`] after another.
    parameters: Vec<f64>,
}

/// What an episode's way forward keeps for the way back; its buffers are used again for the next, so that a copy of it is empty.
#[derive(Default)]
struct Trace {
    /// `[T + 1][H]`: the GRU's output, from before the first cell.
    hidden: Vec<f64>,
    /// `[T][4H]`: see [`Network::remember`].
    gates: Vec<f64>,
    /// `[T][H]`: gradient by the GRU's output, of that step's p alone.
    pull: Vec<f64>,
}

impl Clone for Trace {
    fn clone(&self) -> Self {
        Trace::default()
    }
}

impl Network {
    /// Most units the GRU may have.
    pub const MAX_UNITS: usize = 64;

    /// Number of weights.
    pub fn parameters(&self) -> usize {
        self.parameters.len()
    }

    /// Small random weights for S `cells`, n `contexts` and H `units`, 1..=[`Network::MAX_UNITS`].
    pub fn new(cells: usize, contexts: usize, units: usize, rng: &mut Xoshiro256PlusPlus) -> Network {
        assert!((1..=Self::MAX_UNITS).contains(&units), "{units} units");
        let mut network = Network { cells, contexts, units, parameters: Vec::new() };
        let size = network.row(Table::Bias, 0).end;
        network.parameters = (0..size).map(|_| WEIGHT * (2.0 * rng.random::<f64>() - 1.0)).collect();
        network
    }

    /// Where a row of a table lies among the parameters.
    #[inline]
    fn row(&self, table: Table, index: usize) -> Range<usize> {
        let (s, n, h) = (self.cells, self.contexts, self.units);
        let shapes = [(s, 3 * h), (h, 3 * h), (s, DENSE), (h, DENSE), (n, DENSE), (1, n)];
        let start: usize = shapes[..table as usize].iter().map(|(rows, width)| rows * width).sum();
        let width = shapes[table as usize].1;
        start + index * width..start + (index + 1) * width
    }

    /// Hidden state before the first cell: zeros, `[H]`.
    pub fn start(&self) -> Vec<f64> {
        vec![0.0; self.units]
    }

    /// Takes a cell in: updates the hidden state, `[H]`, and writes p(c|τ_{1:t}) to `p`, `[n]`.
    pub fn see(&self, hidden: &mut [f64], state: usize, p: &mut [f64]) {
        self.remember(hidden, state, &mut [0.0; 4 * Self::MAX_UNITS][..4 * self.units]);
        self.judge(hidden, state, &mut [0.0; DENSE], p);
    }

    /// p(c|s) where an episode starts.
    pub fn at_start(&self, cells: usize, experts: usize) -> Contexts {
        let mut p = vec![0.0; cells * experts];
        for (state, p) in p.chunks_mut(experts).enumerate() {
            self.see(&mut Network::start(self), state, p);
        }
        Contexts::from_weights(cells, experts, |state, context| p[state * experts + context])
    }

    /// One step of the GRU (Cho et al. 2014, the reset after the recurrent weights). Leaves in `gates`,
    /// `[4][H]`: candidate, update, reset, and what the past had for the candidate before the reset. So the
    /// cell feeds the first three, the past the last three.
    fn remember(&self, hidden: &mut [f64], state: usize, gates: &mut [f64]) {
        let h = self.units;
        gates[h..].fill(0.0);
        for (unit, &value) in hidden.iter().enumerate() {
            add(&mut gates[h..], value, &self.parameters[self.row(Table::Recurrent, unit)]);
        }
        let input = &self.parameters[self.row(Table::Input, state)];
        for i in 0..h {
            let update = sigmoid(input[h + i] + gates[h + i]);
            let reset = sigmoid(input[2 * h + i] + gates[2 * h + i]);
            let candidate = libm::tanh(input[i] + reset * gates[3 * h + i]);
            (gates[i], gates[h + i], gates[2 * h + i]) = (candidate, update, reset);
            hidden[i] = candidate + update * (hidden[i] - candidate);
        }
    }

    /// The dense layer and the softmax: p(c|τ_{1:t}) from the GRU's output and the cell.
    fn judge(&self, hidden: &[f64], state: usize, dense: &mut [f64; DENSE], p: &mut [f64]) {
        dense.copy_from_slice(&self.parameters[self.row(Table::Seen, state)]);
        for (unit, &value) in hidden.iter().enumerate() {
            add(dense, value, &self.parameters[self.row(Table::Remembered, unit)]);
        }
        dense.iter_mut().for_each(|value| *value = if *value > 0.0 { *value } else { 0.0 });
        for (context, (p, bias)) in p.iter_mut().zip(&self.parameters[self.row(Table::Bias, 0)]).enumerate() {
            *p = bias + dot(dense, &self.parameters[self.row(Table::Output, context)]);
        }
        let top = p.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        p.iter_mut().for_each(|p| *p = libm::exp(*p - top));
        let sum: f64 = p.iter().sum();
        p.iter_mut().for_each(|p| *p /= sum);
    }

    /// Mean of log p(c|τ_{1:t}) over all steps of the episodes, c being who acted; adds its gradient to
    /// `gradient`, laid out as the parameters.
    fn gradient(&self, episodes: &[&Labelled], gradient: &mut [f64], trace: &mut Trace) -> f64 {
        let h = self.units;
        let steps: usize = episodes.iter().map(|episode| episode.states.len()).sum();
        let share = 1.0 / steps as f64;
        let (mut dense, mut pushed) = ([0.0; DENSE], [0.0; DENSE]);
        let (mut p, mut back) = (vec![0.0; self.contexts], vec![0.0; h]);
        let mut sum = 0.0;
        for episode in episodes {
            let (length, label) = (episode.states.len(), usize::from(episode.context));
            trace.hidden.resize((length + 1) * h, 0.0);
            trace.gates.resize(length * 4 * h, 0.0);
            trace.pull.resize(length * h, 0.0);
            // Forward through the GRU; through the dense layer forward and back at once.
            for (t, &state) in episode.states.iter().enumerate() {
                let state = state as usize;
                trace.hidden.copy_within(t * h..(t + 1) * h, (t + 1) * h);
                let hidden = &mut trace.hidden[(t + 1) * h..][..h];
                self.remember(hidden, state, &mut trace.gates[t * 4 * h..][..4 * h]);
                self.judge(hidden, state, &mut dense, &mut p);
                sum += libm::log(p[label]);
                pushed.fill(0.0);
                for (context, p) in p.iter().enumerate() {
                    let push = share * (f64::from(u8::from(context == label)) - p);
                    gradient[self.row(Table::Bias, 0)][context] += push;
                    add(&mut gradient[self.row(Table::Output, context)], push, &dense);
                    add(&mut pushed, push, &self.parameters[self.row(Table::Output, context)]);
                }
                pushed.iter_mut().zip(&dense).for_each(|(push, v)| *push = if *v > 0.0 { *push } else { 0.0 });
                add(&mut gradient[self.row(Table::Seen, state)], 1.0, &pushed);
                for unit in 0..h {
                    add(&mut gradient[self.row(Table::Remembered, unit)], hidden[unit], &pushed);
                    trace.pull[t * h + unit] = dot(&self.parameters[self.row(Table::Remembered, unit)], &pushed);
                }
            }
            // Back through time; `back` is the gradient by the GRU's output at t.
            back.fill(0.0);
            for (t, &state) in episode.states.iter().enumerate().rev() {
                add(&mut back, 1.0, &trace.pull[t * h..][..h]);
                let before = &trace.hidden[t * h..][..h];
                let gates = &mut trace.gates[t * 4 * h..][..4 * h];
                for i in 0..h {
                    let (candidate, update, reset) = (gates[i], gates[h + i], gates[2 * h + i]);
                    // Now `gates` takes the gradient by what went into each.
                    gates[i] = back[i] * (1.0 - update) * (1.0 - candidate * candidate);
                    gates[h + i] = back[i] * (before[i] - candidate) * update * (1.0 - update);
                    gates[2 * h + i] = gates[i] * gates[3 * h + i] * reset * (1.0 - reset);
                    gates[3 * h + i] = gates[i] * reset;
                    back[i] *= update;
                }
                add(&mut gradient[self.row(Table::Input, state as usize)], 1.0, &gates[..3 * h]);
                for unit in 0..h {
                    add(&mut gradient[self.row(Table::Recurrent, unit)], before[unit], &gates[h..]);
                    back[unit] += dot(&self.parameters[self.row(Table::Recurrent, unit)], &gates[h..]);
                }
            }
        }
        sum * share
    }

    /// Learns from every episode `epochs` times. After every minibatch `progress` hears what share is done and
    /// says whether to go on; the result is whether all was done.
    pub fn train(
        &mut self,
        episodes: &[Labelled],
        epochs: u32,
        rng: &mut Xoshiro256PlusPlus,
        progress: &mut dyn FnMut(f64) -> bool,
    ) -> bool {
        let mut learner = Learner::new(self);
        let mut shuffled: Vec<&Labelled> = episodes.iter().collect();
        let minibatches = f64::from(epochs) * episodes.len().div_ceil(Learner::MINIBATCH) as f64;
        let mut done = 0.0;
        for _ in 0..epochs {
            for last in (1..shuffled.len()).rev() {
                // A u32 range: one of usize would draw differently on 32 and 64 bits.
                shuffled.swap(last, rng.random_range(0..=last as u32) as usize);
            }
            for minibatch in shuffled.chunks(Learner::MINIBATCH) {
                learner.step(self, minibatch, LEARNING_RATE * (1.0 - done / minibatches));
                done += 1.0;
                if !progress(done / minibatches) {
                    return false;
                }
            }
        }
        true
    }
}

impl Memory for Network {
    fn start(&self) -> Vec<f64> {
        Network::start(self)
    }

    fn see(&self, memory: &mut [f64], state: usize, p: &mut [f64]) {
        Network::see(self, memory, state, p);
    }
}

/// A network's optimiser, from one minibatch to the next.
#[derive(Clone)]
pub struct Learner {
    adam: Adam,
    gradient: Vec<f64>,
    trace: Trace,
}

impl Learner {
    /// Episodes of one gradient.
    pub const MINIBATCH: usize = 32;

    pub fn new(network: &Network) -> Learner {
        let size = network.parameters.len();
        Learner { adam: Adam::new(size), gradient: vec![0.0; size], trace: Trace::default() }
    }

    /// One step of Adam up the mean log-likelihood of a minibatch.
    pub fn step(&mut self, network: &mut Network, minibatch: &[&Labelled], learning_rate: f64) {
        self.gradient.fill(0.0);
        network.gradient(minibatch, &mut self.gradient, &mut self.trace);
        self.adam.ascend(&mut network.parameters, &self.gradient, learning_rate);
    }
}

/// `sums` += `factor` · `row`.
#[inline]
fn add(sums: &mut [f64], factor: f64, row: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(row) {
        *sum += factor * value;
    }
}

/// Σ aᵢ bᵢ, in eight sums side by side: one alone would wait for itself.
#[inline]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}

fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-x))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    /// With this seed no finite difference crosses a kink of the dense layer.
    fn rng() -> Xoshiro256PlusPlus {
        Xoshiro256PlusPlus::seed_from_u64(2)
    }

    /// Against central differences, parameter by parameter.
    #[test]
    fn the_gradient_is_that_of_the_log_likelihood() {
        let mut rng = rng();
        let mut network = Network::new(6, 3, 2, &mut rng);
        let mut episode = |context| Labelled {
            context,
            states: (0..1 + 3 * u32::from(context)).map(|_| rng.random_range(0..6)).collect(),
        };
        let episodes = [episode(0), episode(1), episode(2)];
        let episodes: Vec<&Labelled> = episodes.iter().collect();
        let mut trace = Trace::default();
        let mut gradient = vec![0.0; network.parameters.len()];
        network.gradient(&episodes, &mut gradient, &mut trace);
        let mut unused = gradient.clone();
        for (index, exact) in gradient.into_iter().enumerate() {
            let here = network.parameters[index];
            let [above, below] = [1e-5, -1e-5].map(|by| {
                network.parameters[index] = here + by;
                network.gradient(&episodes, &mut unused, &mut trace)
            });
            network.parameters[index] = here;
            let measured = (above - below) / 2e-5;
            assert!((measured - exact).abs() < 1e-6 * exact.abs() + 1e-10, "{index}: {measured}, {exact}");
        }
    }

    /// Who acts shows in the first cell alone, 0 or 1; then all go through the same cells.
    #[test]
    fn it_remembers_the_first_cell() {
        let episode = |index: u32| Labelled {
            context: (index % 2) as u8,
            states: [index % 2].into_iter().chain((0..4 + index % 5).map(|step| 2 + step % 4)).collect(),
        };
        let episodes: Vec<Labelled> = (0..640).map(episode).collect();
        for units in [1, 4] {
            let train = || {
                let mut rng = rng();
                let mut network = Network::new(6, 2, units, &mut rng);
                assert!(network.train(&episodes, 20, &mut rng, &mut |_| true));
                network
            };
            let mut network = train();
            assert_eq!(network, train(), "a seed is a network");
            for episode in &episodes[..10] {
                let (mut hidden, mut p) = (network.start(), [0.0; 2]);
                episode.states.iter().for_each(|&state| network.see(&mut hidden, state as usize, &mut p));
                assert!(p[usize::from(episode.context)] > 0.95, "{units} units: {p:?}");
            }
            let mut share = 0.0;
            let mut stop = |done| {
                share = done;
                done < 0.5
            };
            assert!(!network.train(&episodes, 20, &mut rng(), &mut stop));
            assert_eq!(share, 0.5, "it stops when told");
        }
    }
}
