//! `history`: exact Bayes over the whole episode, p(c|τ) ∝ Π π_c(a|s), acting by the mixture.
//!
//! Its next action has the distribution that the ensemble itself predicts after the same episode, so its
//! episodes have exactly the ensemble's law: from every start it takes the mean of the experts' steps, and it
//! arrives as often. That is how it is evaluated; the tests simulate it.

use super::{Attacker, Cloned, Progress, Target};
use crate::ape::Contexts;
use crate::mdp::Solver;

pub const ATTACKER: Attacker = Attacker {
    name: "history",
    title: "remembers its episode",
    summary: "p(c|τ) in proportion to Π π_c(a|s) over its episode so far, exact Bayes. Its episodes have the ensemble's own law, so it is \
              as good, whatever the experts do. Exact; drawn as at the start of an episode.",
    parameter: None,
    usual: &[],
    is_quick: true,
    remembers: true,
    clone,
};

fn clone(target: &Target, _: u32, _: &mut Progress) -> Option<Cloned> {
    let contexts = Contexts::equal(target.grid.cells(), target.ensemble.experts());
    let law = target.ensemble.law(&mut Solver::new(target.grid), target.horizon);
    Some(Cloned {
        policy: target.ensemble.cloned(&contexts),
        contexts: Some(contexts),
        steps: law.hitting_time,
        returns: law.returns.into(),
        pairs: None,
    })
}
