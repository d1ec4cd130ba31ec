//! Drawing starts, actions and outcomes from a named, portable generator.

use rand::Rng;
use wide::i32x4;

use super::{ACTIONS, Grid};

/// Draws one of up to `ENDS` + 1 outcomes with given probabilities, without a branch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draw<const ENDS: usize> {
    /// Upper ends of all outcomes' intervals on 0..2³⁰ but the last; signed and not of all bits, so that probability 1
    /// has one too, an outcome of probability 0 is never drawn, and processors compare all at once.
    ends: [i32; ENDS],
}

/// The draw of an action: the same with all four ends compared at once.
#[derive(Clone, Copy, Debug)]
pub struct ActionDraw {
    /// The last number of each action's interval, where [`Draw`] has the first of the next.
    lasts: i32x4,
}

impl ActionDraw {
    /// Values of [`ActionDraw::passed`] lie below.
    pub const SETS: usize = 1 << (ACTIONS - 1);

    /// `probabilities`: at most five of them, with sum 1.
    pub fn new(probabilities: &[f64]) -> Self {
        ActionDraw { lasts: i32x4::new(Draw::new(probabilities).ends.map(|end| end - 1)) }
    }

    /// The set of actions before that which 32 uniform bits stand for, bit a for action a.
    #[inline]
    pub fn passed(&self, bits: u32) -> usize {
        i32x4::splat((bits >> 2) as i32).simd_gt(self.lasts).to_bitmask() as usize % Self::SETS
    }

    /// The action that comes after such a set.
    #[inline]
    pub fn after(passed: usize) -> usize {
        passed.trailing_ones() as usize
    }

    /// The action that 32 uniform bits stand for.
    #[inline]
    pub fn outcome(&self, bits: u32) -> usize {
        Self::after(self.passed(bits))
    }
}

impl<const ENDS: usize> Draw<ENDS> {
    const SCALE: f64 = (1 << 30) as f64;
    /// Adding it rounds to a whole number, which then stands in the lowest bits.
    const ROUND: f64 = (1u64 << 52) as f64;

    /// `probabilities`: at most `ENDS` + 1 of them, with sum 1.
    pub fn new(probabilities: &[f64]) -> Self {
        let mut ends = [1 << 30; ENDS];
        let mut sum = 0.0;
        for (end, p) in ends.iter_mut().zip(probabilities) {
            sum += p;
            *end = (sum * Self::SCALE + Self::ROUND).to_bits() as i32;
        }
        Draw { ends }
    }

    /// The outcome that 32 uniform bits stand for.
    #[inline]
    pub fn outcome(&self, bits: u32) -> usize {
        let x = (bits >> 2) as i32;
        // The last outcome takes what is left, whatever rounding did to the sum.
        self.ends.iter().map(|&end| ((end + !x) as u32) >> 31).sum::<u32>() as usize
    }
}

/// One of `n` equally likely outcomes, by 32 uniform bits; their shares differ by 2⁻³² at most.
#[inline]
pub fn one_of(n: usize, bits: u32) -> usize {
    ((n as u64 * u64::from(bits)) >> 32) as usize
}

/// Starts of episodes and outcomes of actions on one grid.
pub struct Starts<'g> {
    grid: &'g Grid,
    slip: Draw<1>,
    is_slippery: bool,
}

impl<'g> Starts<'g> {
    pub fn new(grid: &'g Grid) -> Self {
        let slip = grid.slip();
        Starts { grid, slip: Draw::new(&[1.0 - slip, slip]), is_slippery: slip > 0.0 }
    }

    /// A start, each as likely as the others, by 32 uniform bits.
    #[inline]
    pub fn start(&self, bits: u32) -> usize {
        let starts = self.grid.starts();
        starts[one_of(starts.len(), bits)] as usize
    }

    /// Where choosing `action` in `state` leads, slip included.
    #[inline]
    pub fn step(&self, state: usize, action: usize, rng: &mut impl Rng) -> usize {
        let mut executed = action;
        if self.is_slippery {
            let bits = rng.next_u64();
            let other = one_of(ACTIONS, bits as u32);
            executed = if self.slip.outcome((bits >> 32) as u32) == 1 { other } else { action };
        }
        self.grid.next(state)[executed] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outcomes_take_their_share_and_nothing_else() {
        let draw = ActionDraw::new(&[0.0, 1.0, 0.0, 0.0, 0.0]);
        assert_eq!([0, 1, u32::MAX / 2, u32::MAX].map(|bits| draw.outcome(bits)), [1; 4]);
        let draw = ActionDraw::new(&[0.25, 0.25, 0.0, 0.5, 0.0]);
        let quarters = [0, 1 << 30, 2 << 30, 3 << 30].map(|bits: u32| draw.outcome(bits));
        assert_eq!(quarters, [0, 1, 3, 3]);
        assert_eq!(draw.outcome(u32::MAX), 3);
        // Fewer probabilities than outcomes: the rest is impossible.
        assert_eq!(Draw::<7>::new(&[0.5, 0.5]).outcome(u32::MAX), 1);
    }
}
