//! A batch of episodes, and how it is played: by several walkers at once.
//!
//! A step has to wait for what it loads, its cell's thresholds and then the cell it leads to. While one walker
//! waits the others go on, so that four take little longer than one. How many there are follows from the
//! configuration, never from the machine.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::Ensemble;
use crate::mdp::{ACTIONS, ActionDraw, Draw, Grid, one_of};

/// Most walkers at once: more would not fit into a processor's registers.
pub const WALKERS: usize = 4;

/// A step in four bytes: below, the number of its (state, context, action), `(s · n + c) · 5 + a`; above, how many
/// steps of its episode came before.
#[derive(Clone, Copy, Default)]
pub struct Step(u32);

impl Step {
    const ENTRY: u32 = 0xffff;
    /// One step of time.
    const TICK: u32 = Self::ENTRY + 1;

    pub fn entry(self) -> usize {
        (self.0 & Self::ENTRY) as usize
    }

    /// Steps of its episode before it.
    pub fn time(self) -> usize {
        (self.0 / Self::TICK) as usize
    }
}

/// Where episodes are played, and by which policies. Its pairs (state, context) are numbered `s · n + c`.
pub struct Course {
    /// `[S][n]`.
    pairs: Vec<Pair>,
    /// First pairs of states where an episode may start.
    starts: Vec<u32>,
    experts: usize,
    slip: Draw<1>,
    is_slippery: bool,
    /// The time of an episode, in ticks.
    horizon: u32,
}

/// What a walker meets at a state, in a context.
#[derive(Clone)]
struct Pair {
    action: ActionDraw,
    /// The pair that each executed action leads to, in the same context, by the set of those before it;
    /// [`Course::GOAL`] for the goal.
    next: [u16; ActionDraw::SETS],
}

impl Course {
    const GOAL: u16 = u16::MAX;

    /// Episodes of at most `horizon` steps, below 2¹⁶.
    pub fn new(grid: &Grid, experts: usize, horizon: u32) -> Course {
        let next = |pair: usize| {
            std::array::from_fn(|passed| {
                let next = grid.next(pair / experts)[ActionDraw::after(passed)] as usize;
                if next == grid.goal() { Self::GOAL } else { (next * experts + pair % experts) as u16 }
            })
        };
        let action = ActionDraw::new(&[1.0]);
        Course {
            pairs: (0..grid.cells() * experts).map(|pair| Pair { action, next: next(pair) }).collect(),
            starts: grid.starts().iter().map(|&state| state * experts as u32).collect(),
            experts,
            slip: Draw::new(&[1.0 - grid.slip(), grid.slip()]),
            is_slippery: grid.slip() > 0.0,
            horizon: horizon * Step::TICK,
        }
    }

    /// From now on these are the experts.
    pub fn set(&mut self, ensemble: &Ensemble) {
        for (context, policy) in ensemble.policies().iter().enumerate() {
            let pairs = self.pairs[context..].iter_mut().step_by(self.experts);
            policy.rows().iter().zip(pairs).for_each(|(pi, pair)| pair.action = ActionDraw::new(pi));
        }
    }

    /// Where an episode begins at this time, and which expert is drawn for it. Not often, so it is kept out of the way.
    #[cold]
    #[inline(never)]
    fn start<P: Player>(&self, walker: usize, now: u32, starts: &mut Starts<impl Rng>) -> usize {
        starts.drawn = starts.drawn.wrapping_add(1);
        let drawn = one_of(self.starts.len() * self.experts, starts.rng.next_u32());
        let first = self.starts[drawn / self.experts] as usize;
        (starts.began[walker], starts.ends[walker]) = (now, now.wrapping_add(self.horizon));
        if P::DRAWS { first } else { first + drawn % self.experts }
    }
}

/// Where chance comes from: one generator for what happens at steps, one for where episodes start.
#[derive(Clone)]
pub struct Luck<R> {
    steps: R,
    starts: Starts<R>,
}

/// A generator that counts.
#[derive(Clone)]
struct Starts<R> {
    rng: R,
    drawn: u32,
    /// When each walker's episode began, and when its time is over, on the clock of all: in ticks, which go round. They do
    /// not change with a step, and stay here to leave registers to what does.
    began: [u32; WALKERS],
    ends: [u32; WALKERS],
}

impl Luck<Xoshiro256PlusPlus> {
    pub fn new(seed: u32) -> Self {
        let steps = Xoshiro256PlusPlus::seed_from_u64(u64::from(seed));
        let mut rng = steps.clone();
        // 2¹²⁸ draws ahead.
        rng.jump();
        Luck { steps, starts: Starts { rng, drawn: 0, began: [0; WALKERS], ends: [0; WALKERS] } }
    }
}

/// Who says which expert acts.
pub trait Player {
    /// Whether the expert is drawn anew at each step, which takes 32 random bits, and not for an episode.
    const DRAWS: bool;

    /// The pair of a walker's state and the context that acts there. Where contexts are drawn, the walker is at the first of
    /// its state's pairs.
    fn pair(&self, at: usize, bits: u32) -> usize;
}

/// The ensemble: an expert acts for all of an episode.
pub struct EnsemblePlayer;

impl Player for EnsemblePlayer {
    const DRAWS: bool = false;

    #[inline(always)]
    fn pair(&self, at: usize, _bits: u32) -> usize {
        at
    }
}

/// The clone: the expert is drawn anew at each step. Of `ENDS` + 1 experts at most.
pub struct ClonePlayer<const ENDS: usize> {
    /// `[S][n]`; only the first of a state's is looked at.
    pub contexts: Vec<Draw<ENDS>>,
}

impl<const ENDS: usize> Player for ClonePlayer<ENDS> {
    const DRAWS: bool = true;

    #[inline(always)]
    fn pair(&self, at: usize, bits: u32) -> usize {
        at + self.contexts[at].outcome(bits)
    }
}

/// A clone that goes by what it has seen of its episode.
pub trait RememberingPlayer {
    /// An episode begins.
    fn begin(&mut self);

    /// The context that acts at a state.
    fn context(&mut self, state: usize, bits: u32) -> usize;

    /// What was done there.
    fn acted(&mut self, state: usize, action: usize);
}

/// A context that is known.
struct Known(usize);

impl Player for Known {
    const DRAWS: bool = true;

    fn pair(&self, at: usize, _bits: u32) -> usize {
        at + self.0
    }
}

/// A walker under way.
#[derive(Clone, Copy)]
struct Walker {
    /// Its place among all.
    number: usize,
    /// A pair of its state: that of the expert drawn for the episode, or the first where experts are drawn anew.
    at: usize,
}

impl Walker {
    /// One that has no episode yet.
    fn new(number: usize) -> Walker {
        Walker { number, at: Course::GOAL.into() }
    }

    /// Whether it has no episode, or its episode has ended.
    #[inline(always)]
    fn is_idle<R>(&self, now: u32, course: &Course, starts: &Starts<R>) -> bool {
        self.at >= course.pairs.len() || now == starts.ends[self.number]
    }

    /// Begins a new episode, where that is due.
    fn begin<P: Player>(&mut self, now: u32, course: &Course, starts: &mut Starts<impl Rng>) {
        if self.is_idle(now, course, starts) {
            self.at = course.start::<P>(self.number, now, starts);
        }
    }

    /// One step; after an episode's last, it is the first of a new one.
    #[inline(always)]
    fn step<const SLIPS: bool, P: Player>(
        &mut self,
        now: u32,
        course: &Course,
        player: &P,
        bits: u64,
        steps: &mut impl Rng,
        starts: &mut Starts<impl Rng>,
    ) -> Step {
        // That there is such a pair is asked once: there is none for the goal.
        let here = match course.pairs.get(self.at) {
            Some(here) if now != starts.ends[self.number] => here,
            _ => {
                self.at = course.start::<P>(self.number, now, starts);
                &course.pairs[self.at]
            }
        };
        let pair = player.pair(self.at, (bits >> 32) as u32);
        let passed = if P::DRAWS { &course.pairs[pair] } else { here }.action.passed(bits as u32);
        let action = ActionDraw::after(passed);
        let mut executed = passed;
        if SLIPS {
            let bits = steps.next_u64();
            let other = (1 << one_of(ACTIONS, bits as u32)) - 1;
            executed = if course.slip.outcome((bits >> 32) as u32) == 1 { other } else { passed };
        }
        self.at = usize::from(here.next[executed % ActionDraw::SETS]);
        Step((pair * ACTIONS + action) as u32 + now.wrapping_sub(starts.began[self.number]))
    }
}

/// Whole episodes, in the order in which each walker went through them.
#[derive(Default)]
pub struct Batch {
    /// A row for each moment at which all walkers took a step.
    rows: Vec<[Step; WALKERS]>,
    /// What each walker still had to go then.
    tails: [Vec<Step>; WALKERS],
    pub episodes: u32,
}

impl Batch {
    /// Steps played.
    pub fn steps(&self) -> usize {
        WALKERS * self.rows.len() + self.tails.iter().map(Vec::len).sum::<usize>()
    }

    /// Plays whole episodes of at least `wanted` steps in all. Where that is little for four walkers, who may each
    /// end in the midst of a long episode, there is one.
    pub fn play(&mut self, course: &Course, player: &impl Player, wanted: u32, luck: &mut Luck<impl Rng + Clone>) {
        if course.is_slippery {
            self.play_on::<true, _>(course, player, wanted, luck);
        } else {
            self.play_on::<false, _>(course, player, wanted, luck);
        }
    }

    #[inline(always)]
    fn play_on<const SLIPS: bool, P: Player>(
        &mut self,
        course: &Course,
        player: &P,
        wanted: u32,
        luck: &mut Luck<impl Rng + Clone>,
    ) {
        let is_much = wanted / WALKERS as u32 >= course.horizon / Step::TICK;
        let rounds = if is_much { wanted.div_ceil(WALKERS as u32) as usize } else { 0 };
        self.rows.resize(rounds, [Step::default(); WALKERS]);
        let before = luck.starts.drawn;
        let [mut a, mut b, mut c, mut d] = std::array::from_fn(Walker::new);
        let mut now = 0u32;
        // A copy close at hand, which stays in registers.
        let mut steps = luck.steps.clone();
        for row in &mut self.rows {
            let bits = steps.next_u64();
            row[0] = a.step::<SLIPS, P>(now, course, player, bits, &mut steps, &mut luck.starts);
            // Of 64 bits, two walkers take a half each where that is enough.
            let bits = if P::DRAWS { steps.next_u64() } else { bits >> 32 };
            row[1] = b.step::<SLIPS, P>(now, course, player, bits, &mut steps, &mut luck.starts);
            let bits = steps.next_u64();
            row[2] = c.step::<SLIPS, P>(now, course, player, bits, &mut steps, &mut luck.starts);
            let bits = if P::DRAWS { steps.next_u64() } else { bits >> 32 };
            row[3] = d.step::<SLIPS, P>(now, course, player, bits, &mut steps, &mut luck.starts);
            now = now.wrapping_add(Step::TICK);
        }
        luck.steps = steps;
        let mut played = WALKERS * rounds;
        let mut walkers = [a, b, c, d];
        walkers.iter_mut().for_each(|walker| walker.begin::<P>(now, course, &mut luck.starts));
        for (walker, tail) in walkers.iter_mut().zip(&mut self.tails) {
            tail.clear();
            let mut now = now;
            while luck.starts.began[walker.number] != now || played < wanted as usize {
                let bits = luck.steps.next_u64();
                tail.push(walker.step::<SLIPS, P>(now, course, player, bits, &mut luck.steps, &mut luck.starts));
                now = now.wrapping_add(Step::TICK);
                played += 1;
                walker.begin::<P>(now, course, &mut luck.starts);
            }
        }
        // In the end each stands at a start that was drawn in vain.
        self.episodes = luck.starts.drawn.wrapping_sub(before) - WALKERS as u32;
    }

    /// Plays as a clone that remembers its episode: one walker.
    pub fn play_remembering(
        &mut self,
        course: &Course,
        player: &mut impl RememberingPlayer,
        wanted: u32,
        luck: &mut Luck<impl Rng>,
    ) {
        self.rows.clear();
        self.tails.iter_mut().for_each(Vec::clear);
        let before = luck.starts.drawn;
        let tail = &mut self.tails[0];
        let mut walker = Walker::new(0);
        let mut now = 0u32;
        walker.begin::<Known>(now, course, &mut luck.starts);
        while luck.starts.began[0] != now || tail.len() < wanted as usize {
            if luck.starts.began[0] == now {
                player.begin();
            }
            let state = walker.at / course.experts;
            let bits = luck.steps.next_u64();
            let known = Known(player.context(state, (bits >> 32) as u32));
            let step = if course.is_slippery {
                walker.step::<true, _>(now, course, &known, bits, &mut luck.steps, &mut luck.starts)
            } else {
                walker.step::<false, _>(now, course, &known, bits, &mut luck.steps, &mut luck.starts)
            };
            player.acted(state, step.entry() % ACTIONS);
            now = now.wrapping_add(Step::TICK);
            tail.push(step);
            walker.begin::<Known>(now, course, &mut luck.starts);
        }
        self.episodes = luck.starts.drawn.wrapping_sub(before) - 1;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::{GridSpec, Policy};

    /// Every walker goes through whole episodes, one expert to each, from a start to the goal or until time is over, whatever
    /// the batch's size; a batch of many steps is shared by all of them.
    #[test]
    fn walkers_play_whole_episodes() {
        let walls = vec![(1, 1), (2, 3)];
        let grid = Grid::new(GridSpec { rows: 4, cols: 5, goal: (3, 0), walls, slip: 0.0 }).unwrap();
        let (experts, horizon) = (3, 20);
        let uniform = Policy::from_rows(vec![[0.2; ACTIONS]; grid.cells()]);
        let mut course = Course::new(&grid, experts, horizon);
        course.set(&Ensemble::new(vec![uniform; experts]));
        let mut luck = Luck::new(1);
        let mut batch = Batch::default();
        for (wanted, walkers) in [(1, 1), (79, 1), (80, 4), (5000, 4)] {
            batch.play(&course, &EnsemblePlayer, wanted, &mut luck);
            assert!((wanted as usize..(wanted + 4 * horizon) as usize).contains(&batch.steps()));
            let (mut episodes, mut at_work) = (0, 0);
            for walk in batch.walks() {
                // Expert, where its action leads, and time of the step before; an episode's last leads nowhere.
                let mut before: Option<(usize, usize, usize)> = None;
                let mut walk = walk.peekable();
                at_work += usize::from(walk.peek().is_some());
                for step in walk {
                    let (pair, action) = (step.entry() / ACTIONS, step.entry() % ACTIONS);
                    let (state, expert) = (pair / experts, pair % experts);
                    match before {
                        Some(before) => assert_eq!((before.0, before.1, before.2 + 1), (expert, state, step.time())),
                        None => assert!(step.time() == 0 && grid.starts().contains(&(state as u32))),
                    }
                    let next = grid.next(state)[action] as usize;
                    let is_last = next == grid.goal() || step.time() + 1 == horizon as usize;
                    episodes += u32::from(is_last);
                    before = (!is_last).then_some((expert, next, step.time()));
                }
                assert_eq!(before, None);
            }
            assert_eq!((batch.episodes, at_work), (episodes, walkers));
        }
    }
}
