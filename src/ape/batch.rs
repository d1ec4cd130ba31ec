//! A batch of episodes, and how it is played: by several walkers at once.
//!
//! A step has to wait for what it loads, its cell's thresholds and then the cell it leads to. While one walker
//! waits the others go on, so that four take little longer than one. How many there are follows from the
//! configuration, never from the machine.

use rand::Rng;

use crate::mdp::{ACTIONS, ActionDraw, Draw, Grid, one_of};

/// Most walkers at once: more would not fit into a processor's registers.
pub const WALKERS: usize = 4;

/// A step in four bytes: below, the number of its (context, state, action), `(c · S + s) · 5 + a`; above, how many
/// steps of its episode came before.
#[derive(Clone, Copy, Default)]
pub struct Step(u32);

impl Step {
    const BITS: u32 = 16;

    pub fn entry(self) -> usize {
        (self.0 & 0xffff) as usize
    }

    /// Steps of its episode before it.
    pub fn time(self) -> usize {
        (self.0 >> Self::BITS) as usize
    }
}

/// Where episodes are played, laid out for speed.
#[derive(Clone)]
pub struct Course {
    /// `[S][8]`: where each executed action leads, padded.
    next: Vec<[u16; 8]>,
    starts: Vec<u32>,
    goal: usize,
    slip: Option<Draw<1>>,
    horizon: u32,
}

impl Course {
    /// Episodes of at most `horizon` steps, below 2¹⁶.
    pub fn new(grid: &Grid, horizon: u32) -> Course {
        let next = |cell| std::array::from_fn(|action| grid.next(cell)[action.min(ACTIONS - 1)] as u16);
        Course {
            next: (0..grid.cells()).map(next).collect(),
            starts: grid.starts().to_vec(),
            goal: grid.goal(),
            slip: (grid.slip() > 0.0).then(|| Draw::new(&[1.0 - grid.slip(), grid.slip()])),
            horizon,
        }
    }

    #[inline(always)]
    fn lead(&self, state: usize, action: usize, rng: &mut impl Rng) -> usize {
        let mut executed = action;
        if let Some(slip) = &self.slip {
            let bits = rng.next_u64();
            let other = one_of(ACTIONS, bits as u32);
            executed = if slip.outcome((bits >> 32) as u32) == 1 { other } else { action };
        }
        usize::from(self.next[state][executed])
    }
}

/// Who chooses the actions, without a memory of more than its expert.
pub trait Player {
    /// Whether a step takes 64 random bits, not 32.
    const IS_WIDE: bool;

    /// What is drawn for an episode.
    fn begin(&self, bits: u32) -> usize;

    /// The pair (context, state), `c · S + s`, and the action; `drawn` is what the episode began with.
    fn act(&self, drawn: usize, state: usize, bits: u64) -> (usize, usize);
}

/// The ensemble: an expert is drawn for an episode and acts for all of it.
pub struct EnsemblePlayer<'a> {
    /// `[n][S]`.
    pub actions: &'a [ActionDraw],
    pub cells: usize,
}

impl Player for EnsemblePlayer<'_> {
    const IS_WIDE: bool = false;

    #[inline(always)]
    fn begin(&self, bits: u32) -> usize {
        one_of(self.actions.len() / self.cells, bits) * self.cells
    }

    #[inline(always)]
    fn act(&self, drawn: usize, state: usize, bits: u64) -> (usize, usize) {
        let pair = drawn + state;
        (pair, self.actions[pair].outcome(bits as u32))
    }
}

/// The clone: the context is drawn anew at each cell, then the action from that expert. Of `ENDS` + 1 experts at
/// most.
pub struct ClonePlayer<'a, const ENDS: usize> {
    /// `[n][S]`.
    pub actions: &'a [ActionDraw],
    /// `[S]`.
    pub contexts: &'a [Draw<ENDS>],
}

impl<const ENDS: usize> Player for ClonePlayer<'_, ENDS> {
    const IS_WIDE: bool = true;

    #[inline(always)]
    fn begin(&self, _bits: u32) -> usize {
        0
    }

    #[inline(always)]
    fn act(&self, _drawn: usize, state: usize, bits: u64) -> (usize, usize) {
        let pair = self.contexts[state].outcome((bits >> 32) as u32) * self.contexts.len() + state;
        (pair, self.actions[pair].outcome(bits as u32))
    }
}

/// A walker under way.
#[derive(Clone, Copy, Default)]
struct Walker {
    state: usize,
    drawn: usize,
    time: u32,
}

impl Walker {
    #[inline(always)]
    fn begin(course: &Course, player: &impl Player, rng: &mut impl Rng) -> Walker {
        let bits = rng.next_u64();
        let state = course.starts[one_of(course.starts.len(), bits as u32)] as usize;
        Walker { state, drawn: player.begin((bits >> 32) as u32), time: 0 }
    }

    /// One step; after an episode's last, a new one begins.
    #[inline(always)]
    fn step(&mut self, course: &Course, player: &impl Player, bits: u64, rng: &mut impl Rng) -> Step {
        let (pair, action) = player.act(self.drawn, self.state, bits);
        let step = Step((pair * ACTIONS + action) as u32 | self.time << Step::BITS);
        self.state = course.lead(self.state, action, rng);
        self.time += 1;
        if self.state == course.goal || self.time == course.horizon {
            *self = Walker::begin(course, player, rng);
        }
        step
    }
}

/// Whole episodes, in the order in which each walker went through them.
#[derive(Clone, Default)]
pub struct Batch {
    /// A row for each moment at which all walkers took a step.
    rows: Vec<[Step; WALKERS]>,
    /// What each walker still had to go then.
    tails: [Vec<Step>; WALKERS],
}

impl Batch {
    /// Steps played.
    pub fn steps(&self) -> usize {
        WALKERS * self.rows.len() + self.tails.iter().map(Vec::len).sum::<usize>()
    }

    /// Plays whole episodes of at least `wanted` steps in all. Where that is little for four walkers, who may each
    /// end in the midst of a long episode, there is one.
    pub fn play<P: Player>(&mut self, course: &Course, player: &P, wanted: u32, rng: &mut impl Rng) {
        let has_own_bits = |walker: usize| P::IS_WIDE || walker.is_multiple_of(2);
        let is_much = wanted / WALKERS as u32 >= course.horizon;
        let rounds = if is_much { wanted.div_ceil(WALKERS as u32) as usize } else { 0 };
        self.rows.resize(rounds, [Step::default(); WALKERS]);
        let mut walkers = [Walker::default(); WALKERS].map(|_| Walker::begin(course, player, rng));
        for row in &mut self.rows {
            let mut bits = 0;
            for (i, (walker, step)) in walkers.iter_mut().zip(row).enumerate() {
                // Of 64 bits, two walkers take a half each where that is enough.
                bits = if has_own_bits(i) { rng.next_u64() } else { bits >> 32 };
                *step = walker.step(course, player, bits, rng);
            }
        }
        let mut played = WALKERS * rounds;
        for (walker, tail) in walkers.iter_mut().zip(&mut self.tails) {
            tail.clear();
            while walker.time > 0 || played < wanted as usize {
                let bits = rng.next_u64();
                tail.push(walker.step(course, player, bits, rng));
                played += 1;
            }
        }
    }

    /// Plays as a clone that remembers its episode; `act` chooses context and action at (state, time) by 64 random bits.
    pub fn play_one(
        &mut self,
        course: &Course,
        wanted: u32,
        rng: &mut impl Rng,
        mut act: impl FnMut(usize, u32, u64) -> (usize, usize),
    ) {
        self.rows.clear();
        self.tails.iter_mut().for_each(Vec::clear);
        let tail = &mut self.tails[0];
        while tail.len() < wanted as usize {
            let mut state = course.starts[one_of(course.starts.len(), rng.next_u32())] as usize;
            let mut time = 0;
            while state != course.goal && time < course.horizon {
                let (context, action) = act(state, time, rng.next_u64());
                let pair = context * course.next.len() + state;
                tail.push(Step((pair * ACTIONS + action) as u32 | time << Step::BITS));
                state = course.lead(state, action, rng);
                time += 1;
            }
        }
    }

    /// Visits every step, each episode from its last to its first; `visit` gets the walker's number too.
    #[inline(always)]
    pub fn backwards(&self, mut visit: impl FnMut(usize, Step)) {
        for (i, tail) in self.tails.iter().enumerate() {
            tail.iter().rev().for_each(|&step| visit(i, step));
        }
        for row in self.rows.iter().rev() {
            row.iter().enumerate().for_each(|(i, &step)| visit(i, step));
        }
    }

    /// Every walker's steps, in order.
    pub fn walks(&self) -> impl Iterator<Item = impl Iterator<Item = Step>> {
        (0..WALKERS).map(|i| self.rows.iter().map(move |row| row[i]).chain(self.tails[i].iter().copied()))
    }
}
