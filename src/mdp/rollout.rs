//! Drawing starts, actions and outcomes from a named, portable generator.

use rand::{Rng, RngExt};

use super::{ACTIONS, Grid};

/// Draws one of up to `OUTCOMES` outcomes with given probabilities, without a branch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draw<const OUTCOMES: usize> {
    /// Upper ends of all outcomes' intervals on 0..2³¹; 31 bits, so that probability 1 has one too and an
    /// outcome of probability 0 is never drawn.
    ends: [u32; OUTCOMES],
}

impl<const OUTCOMES: usize> Draw<OUTCOMES> {
    const SCALE: f64 = (1u32 << 31) as f64;

    /// `probabilities`: at most `OUTCOMES` of them, with sum 1.
    pub fn new(probabilities: &[f64]) -> Self {
        let mut ends = [1 << 31; OUTCOMES];
        let mut sum = 0.0;
        for (end, p) in ends.iter_mut().zip(probabilities) {
            sum += p;
            *end = (sum * Self::SCALE + 0.5) as u32;
        }
        Draw { ends }
    }

    /// The outcome that 32 uniform bits stand for.
    #[inline]
    pub fn outcome(&self, bits: u32) -> usize {
        let x = bits >> 1;
        // The last outcome takes what is left, whatever rounding did to its end.
        self.ends[..OUTCOMES - 1].iter().map(|&end| usize::from(x >= end)).sum()
    }
}

/// Starts of episodes and outcomes of actions on one grid.
pub struct Starts<'g> {
    grid: &'g Grid,
    slip: Draw<2>,
    is_slippery: bool,
}

impl<'g> Starts<'g> {
    pub fn new(grid: &'g Grid) -> Self {
        let slip = grid.slip();
        Starts { grid, slip: Draw::new(&[1.0 - slip, slip]), is_slippery: slip > 0.0 }
    }

    /// A start, each as likely as the others.
    #[inline]
    pub fn start(&self, rng: &mut impl Rng) -> usize {
        let starts = self.grid.starts();
        // A u32 range: one of usize would draw differently on 32 and 64 bits.
        starts[rng.random_range(0..starts.len() as u32) as usize] as usize
    }

    /// Where choosing `action` in `state` leads, slip included.
    #[inline]
    pub fn step(&self, state: usize, action: usize, rng: &mut impl Rng) -> usize {
        let mut executed = action;
        if self.is_slippery && self.slip.outcome(rng.next_u32()) == 1 {
            executed = rng.random_range(0..ACTIONS as u32) as usize;
        }
        self.grid.next(state)[executed] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outcomes_take_their_share_and_nothing_else() {
        let draw = Draw::<5>::new(&[0.0, 1.0, 0.0, 0.0, 0.0]);
        assert_eq!([0, 1, u32::MAX / 2, u32::MAX].map(|bits| draw.outcome(bits)), [1; 4]);
        let draw = Draw::<5>::new(&[0.25, 0.25, 0.0, 0.5, 0.0]);
        let quarters = [0, 1 << 30, 2 << 30, 3 << 30].map(|bits: u32| draw.outcome(bits));
        assert_eq!(quarters, [0, 1, 3, 3]);
        assert_eq!(draw.outcome(u32::MAX), 3);
        // Fewer probabilities than outcomes: the rest is impossible.
        assert_eq!(Draw::<8>::new(&[0.5, 0.5]).outcome(u32::MAX), 1);
    }
}
