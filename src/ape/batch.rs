//! A batch of episodes, and how it is played: by several walkers at once.
//!
//! A step has to wait for what it loads, its cell's thresholds and then the cell it leads to. While one walker
//! waits the others go on, so that four take little longer than one. How many there are follows from the
//! configuration, never from the machine.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::mdp::{ACTIONS, ActionDraw, Draw, Grid, one_of};

/// Most walkers at once: more would not fit into a processor's registers.
pub const WALKERS: usize = 4;

/// A step in four bytes: below, the number of its (context, state, action), `(c · S + s) · 5 + a`; above, how many
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

/// Where episodes are played, laid out for speed: as many copies of the grid as one plays on, each a context of its
/// own. A place is `copy · S + state`.
#[derive(Clone)]
pub struct Course {
    /// `[copies][S][8]`: the place that each executed action leads to, padded; [`Course::GOAL`] for the goal.
    next: Vec<[u16; 8]>,
    starts: Vec<u32>,
    cells: usize,
    slip: Draw<1>,
    is_slippery: bool,
    /// Where a walker's clock is when its time is over.
    end: u32,
}

impl Course {
    const GOAL: u16 = u16::MAX;

    /// Episodes of at most `horizon` steps, below 2¹⁶.
    pub fn new(grid: &Grid, horizon: u32, copies: usize) -> Course {
        let cells = grid.cells();
        let next = |place: usize| {
            let to = grid.next(place % cells).map(|state| state as usize);
            let to =
                to.map(|state| if state == grid.goal() { Self::GOAL } else { (place - place % cells + state) as u16 });
            std::array::from_fn(|action| to[action.min(ACTIONS - 1)])
        };
        Course {
            next: (0..copies * cells).map(next).collect(),
            starts: grid.starts().to_vec(),
            cells,
            slip: Draw::new(&[1.0 - grid.slip(), grid.slip()]),
            is_slippery: grid.slip() > 0.0,
            end: horizon * Step::TICK,
        }
    }

    /// Where an episode begins: any copy, any start. Not often, so it is kept out of the way.
    #[cold]
    #[inline(never)]
    fn start(&self, starts: &mut Starts<impl Rng>) -> usize {
        starts.drawn = starts.drawn.wrapping_add(1);
        let bits = starts.rng.next_u64();
        let copy = one_of(self.next.len() / self.cells, (bits >> 32) as u32);
        copy * self.cells + self.starts[one_of(self.starts.len(), bits as u32)] as usize
    }

    /// Where choosing `action` leads, on a grid that slips or not.
    #[inline(always)]
    fn lead<const SLIPS: bool>(&self, place: usize, action: usize, rng: &mut impl Rng) -> u16 {
        let mut executed = action;
        if SLIPS {
            let bits = rng.next_u64();
            let other = one_of(ACTIONS, bits as u32);
            executed = if self.slip.outcome((bits >> 32) as u32) == 1 { other } else { action };
        }
        self.next[place][executed]
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
}

impl Luck<Xoshiro256PlusPlus> {
    pub fn new(seed: u32) -> Self {
        let steps = Xoshiro256PlusPlus::seed_from_u64(u64::from(seed));
        let mut rng = steps.clone();
        // 2¹²⁸ draws ahead.
        rng.jump();
        Luck { steps, starts: Starts { rng, drawn: 0 } }
    }
}

/// Who chooses the actions.
pub trait Player {
    /// Whether a choice takes 64 random bits, not 32.
    const IS_WIDE: bool;

    /// The pair (context, state), `c · S + s`, and the action.
    fn act(&self, place: usize, bits: u64) -> (usize, usize);
}

/// The ensemble, each expert on its own copy of the grid.
pub struct EnsemblePlayer<'a> {
    /// `[n][S]`.
    pub actions: &'a [ActionDraw],
}

impl Player for EnsemblePlayer<'_> {
    const IS_WIDE: bool = false;

    #[inline(always)]
    fn act(&self, place: usize, bits: u64) -> (usize, usize) {
        (place, self.actions[place].outcome(bits as u32))
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
    fn act(&self, place: usize, bits: u64) -> (usize, usize) {
        let pair = self.contexts[place].outcome((bits >> 32) as u32) * self.contexts.len() + place;
        (pair, self.actions[pair].outcome(bits as u32))
    }
}

/// A choice that was made already.
struct Chosen {
    pair: usize,
    action: usize,
}

impl Player for Chosen {
    const IS_WIDE: bool = true;

    fn act(&self, _place: usize, _bits: u64) -> (usize, usize) {
        (self.pair, self.action)
    }
}

/// A walker under way.
#[derive(Clone, Copy, Default)]
struct Walker {
    place: usize,
    /// Steps of its episode so far, in ticks.
    clock: u32,
}

impl Walker {
    fn begin(course: &Course, luck: &mut Luck<impl Rng>) -> Walker {
        Walker { place: course.start(&mut luck.starts), clock: 0 }
    }

    /// One step; after an episode's last, a new one begins.
    #[inline(always)]
    fn step<const SLIPS: bool>(
        &mut self,
        course: &Course,
        player: &impl Player,
        bits: u64,
        steps: &mut impl Rng,
        starts: &mut Starts<impl Rng>,
    ) -> Step {
        let (pair, action) = player.act(self.place, bits);
        let step = Step((pair * ACTIONS + action) as u32 + self.clock);
        let next = course.lead::<SLIPS>(self.place, action, steps);
        self.place = usize::from(next);
        self.clock += Step::TICK;
        if (next == Course::GOAL) | (self.clock == course.end) {
            *self = Walker { place: course.start(starts), clock: 0 };
        }
        step
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
        let is_much = wanted / WALKERS as u32 >= course.end / Step::TICK;
        let rounds = if is_much { wanted.div_ceil(WALKERS as u32) as usize } else { 0 };
        self.rows.resize(rounds, [Step::default(); WALKERS]);
        let before = luck.starts.drawn;
        let [mut a, mut b, mut c, mut d] = [(); WALKERS].map(|()| Walker::begin(course, luck));
        // A copy close at hand, which stays in registers.
        let mut steps = luck.steps.clone();
        for row in &mut self.rows {
            let bits = steps.next_u64();
            row[0] = a.step::<SLIPS>(course, player, bits, &mut steps, &mut luck.starts);
            // Of 64 bits, two walkers take a half each where that is enough.
            let bits = if P::IS_WIDE { steps.next_u64() } else { bits >> 32 };
            row[1] = b.step::<SLIPS>(course, player, bits, &mut steps, &mut luck.starts);
            let bits = steps.next_u64();
            row[2] = c.step::<SLIPS>(course, player, bits, &mut steps, &mut luck.starts);
            let bits = if P::IS_WIDE { steps.next_u64() } else { bits >> 32 };
            row[3] = d.step::<SLIPS>(course, player, bits, &mut steps, &mut luck.starts);
        }
        luck.steps = steps;
        let mut played = WALKERS * rounds;
        for (mut walker, tail) in [a, b, c, d].into_iter().zip(&mut self.tails) {
            tail.clear();
            while walker.clock > 0 || played < wanted as usize {
                let bits = luck.steps.next_u64();
                tail.push(walker.step::<SLIPS>(course, player, bits, &mut luck.steps, &mut luck.starts));
                played += 1;
            }
        }
        // In the end each stands at a start that was drawn in vain.
        self.episodes = luck.starts.drawn.wrapping_sub(before) - WALKERS as u32;
    }

    /// Plays as a clone that remembers its episode; `act` chooses context and action at (state, time) by 64 random bits.
    pub fn play_one(
        &mut self,
        course: &Course,
        wanted: u32,
        luck: &mut Luck<impl Rng>,
        mut act: impl FnMut(usize, usize, u64) -> (usize, usize),
    ) {
        self.rows.clear();
        self.tails.iter_mut().for_each(Vec::clear);
        let before = luck.starts.drawn;
        let tail = &mut self.tails[0];
        let mut walker = Walker::begin(course, luck);
        while walker.clock > 0 || tail.len() < wanted as usize {
            let (context, action) = act(walker.place, Step(walker.clock).time(), luck.steps.next_u64());
            let pair = context * course.cells + walker.place;
            let player = Chosen { pair, action };
            tail.push(if course.is_slippery {
                walker.step::<true>(course, &player, 0, &mut luck.steps, &mut luck.starts)
            } else {
                walker.step::<false>(course, &player, 0, &mut luck.steps, &mut luck.starts)
            });
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
    use crate::mdp::GridSpec;

    /// Every walker goes through whole episodes, one expert to each, from a start to the goal or until time is over, whatever
    /// the batch's size; a batch of many steps is shared by all of them.
    #[test]
    fn walkers_play_whole_episodes() {
        let walls = vec![(1, 1), (2, 3)];
        let grid = Grid::new(GridSpec { rows: 4, cols: 5, goal: (3, 0), walls, slip: 0.0 }).unwrap();
        let (experts, horizon) = (3, 20);
        let actions = vec![ActionDraw::new(&[0.2; ACTIONS]); experts * grid.cells()];
        let course = Course::new(&grid, horizon, experts);
        let mut luck = Luck::new(1);
        let mut batch = Batch::default();
        for (wanted, walkers) in [(1, 1), (79, 1), (80, 4), (5000, 4)] {
            batch.play(&course, &EnsemblePlayer { actions: &actions }, wanted, &mut luck);
            assert!((wanted as usize..(wanted + 4 * horizon) as usize).contains(&batch.steps()));
            let (mut episodes, mut at_work) = (0, 0);
            for walk in batch.walks() {
                // Expert, where its action leads, and time of the step before; an episode's last leads nowhere.
                let mut before: Option<(usize, usize, usize)> = None;
                let mut walk = walk.peekable();
                at_work += usize::from(walk.peek().is_some());
                for step in walk {
                    let (pair, action) = (step.entry() / ACTIONS, step.entry() % ACTIONS);
                    let (expert, state) = (pair / grid.cells(), pair % grid.cells());
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
