//! What the steps of the lesson say and show.

use super::live;
use super::{Block, Mark, Scene, Step};
use crate::ape::Config;
use crate::ape::observer::ObserverChoice;
use crate::experiment::{Preset, Setup};
use crate::ui::app::Tab;
use Block::{Go, Live, Math, Text, Try};

const CAPPED: &str = "capped_return";
const WITHIN: &str = "horizon_return";

fn with(config: Config) -> Setup {
    Setup { config, ..Setup::default() }
}

fn agreeing() -> Setup {
    with(Config { beta: 0.0, ..Config::default() })
}

fn parted() -> Setup {
    Setup::default()
}

fn honest() -> Setup {
    with(Config { observer: ObserverChoice::OCCUPANCY, ..Config::default() })
}

fn trap() -> Setup {
    Preset::find("trap").map_or(Setup::default(), |preset| (preset.setup)())
}

/// The lesson.
pub static STEPS: [Step; 10] = [
    Step {
        title: "One expert has no secrets",
        scene: Scene {
            setup: || with(Config { beta: 0.0, experts: 1, ..Config::default() }),
            clones: &["uniform"],
            kind: CAPPED,
            mark: Mark::None,
        },
        blocks: &[
            Text(
                "An agent walks on a grid, one cell a step, until it reaches the flag. Its policy π(a|s) is what it does at each cell: arrows as \
                  long as the moves are probable. Colour is how many steps the flag is away: yellow near, purple far. Each step costs 1, so the \
                  return is minus the number of steps.",
            ),
            Text(
                "Whoever watches sees cells and actions. Behaviour cloning copies how often each action followed each cell. With enough \
                  demonstrations of one expert that is the expert:",
            ),
            Math(r"\pi_o(a \mid s) \to \pi(a \mid s)", "The observer's policy tends to the expert's policy."),
            Live(live::clone_and_ensemble),
            Try(
                "Point at a cell, or tap it. Its numbers in every panel stand in the table: expert and clone are the same.",
            ),
        ],
    },
    Step {
        title: "Two experts who agree",
        scene: Scene { setup: agreeing, clones: &["uniform", "occupancy"], kind: CAPPED, mark: Mark::None },
        blocks: &[
            Text(
                "Now there are two experts, an ensemble. For each episode one of them is drawn by lot, and acts until the end. The observer does \
                  not know which one acted; at a cell it sees a mixture of both:",
            ),
            Math(
                r"\pi_o(a \mid s) = \sum_{c=1}^{n} p(c \mid s)\, \pi_c(a \mid s)",
                "The clone's policy at s is the sum over experts c of p of c given s times expert c's policy. Equation 1 of the paper.",
            ),
            Text(
                "p(c|s) is who the observer takes to have acted at s. These two were trained to be fast and nothing else. Both know the short ways, so \
                  mixing them does no harm.",
            ),
            Live(live::clone_and_ensemble),
        ],
    },
    Step {
        title: "β rises, and they part",
        scene: Scene { setup: parted, clones: &["uniform", "occupancy"], kind: CAPPED, mark: Mark::None },
        blocks: &[
            Text(
                "Adversarial policy ensembles want two things: experts that are fast, and a clone that is not. β says how much the second counts:",
            ),
            Math(
                r"J(\theta) = \mathbb{E}_{\tau \sim \pi_c}[R(\tau)] - \beta\, \mathbb{E}_{\tau \sim \pi_o}[R(\tau)]",
                "J of theta is the expected return of the ensemble minus beta times the expected return of the clone. Equation 3 of the paper.",
            ),
            Text(
                "The page climbs J by policy gradient, as the paper does, in 732 updates. At β = 0.6 the experts cross the grid by different \
                  ways, and the clone that weighs them equally gets lost.",
            ),
            Live(live::clone_and_ensemble),
            Try(
                "Move β slowly from 0 up and watch where the arrows begin to differ. Drag the line in the chart to see the training again, update by update.",
            ),
        ],
    },
    Step {
        title: "Why the clone wanders",
        scene: Scene { setup: parted, clones: &["uniform", "occupancy"], kind: CAPPED, mark: Mark::Cell(1, 2) },
        blocks: &[
            Text(
                "Look at one cell, marked in every panel. Each expert knows where it wants to go, and they want opposite ways. The blind clone gives \
                  both the same weight, so it tosses a coin: a step one way, then perhaps a step back.",
            ),
            Math(r"p(c \mid s) = \frac{1}{n}", "p of c given s is one over n."),
            Live(live::one_cell),
            Text(
                "Two good policies, mixed cell by cell, can be a bad one: what one expert has begun the other undoes. An expert is consistent over an \
                  episode; a mixture that tosses anew at each step is not. (Where experts agree, as in step 2, mixing does no harm.)",
            ),
            Try(
                "Point at cells where the clone is purple, then where it is not: near the flag the experts must agree, or be slow themselves.",
            ),
        ],
    },
    Step {
        title: "A little for the experts, a lot for the clone",
        scene: Scene { setup: parted, clones: &["uniform"], kind: WITHIN, mark: Mark::None },
        blocks: &[
            Text(
                "The detours cost the experts something: the best possible is −9.00 on this grid. The clone pays many times as much. These are the \
                  returns within T = 100 steps, what an episode really costs; in them the clone can lose at most 100 steps.",
            ),
            Live(live::price),
            Text(
                "The paper, against an observer that estimates p(c|s) from recent episodes, reports −16.2 for the ensemble and −44.3 for the clone, both \
                  capped returns (step 8 says what that hides). The tab “Table 1” makes the whole comparison, beside the paper's own figures.",
            ),
            Try("Let the three race from one cell, and then a thousand times."),
            Go(Tab::Race, "To the race"),
        ],
    },
    Step {
        title: "But who is the observer?",
        scene: Scene { setup: honest, clones: &["occupancy", "uniform"], kind: CAPPED, mark: Mark::Cell(1, 2) },
        blocks: &[
            Text(
                "So far the clone weighed the experts equally, everywhere. Nobody has to. Whoever clones the demonstrations themselves \
                  weighs an expert by how often it is there:",
            ),
            Math(
                r"p(c \mid s) = \frac{d_c(s)}{\sum_{c'} d_{c'}(s)}",
                "p of c given s is the expected visits of expert c to s, divided by those of all experts.",
            ),
            Text(
                "d_c(s) is how often expert c visits s in an episode. This is behaviour cloning with infinite data, the observer “occupancy”. The experts \
                  on the page were trained against it, with the same β = 0.6. The effect has vanished: the clone is as good as they are.",
            ),
            Live(live::clone_and_ensemble),
            Try(
                "Move β up to 1: clone and ensemble stay together. (At 1 there is nothing left to climb, as J = (1 − β) E[ensemble] when both are equal; \
                 beyond 1 the experts would be paid for being slow themselves.)",
            ),
        ],
    },
    Step {
        title: "It must be so",
        scene: Scene { setup: parted, clones: &["uniform", "occupancy"], kind: WITHIN, mark: Mark::None },
        blocks: &[
            Text(
                "These are the parted experts again, at β = 0.6, and beside the blind clone stands the honest one. Let D be the mean length of \
                  infinitely many demonstrations, at most T steps each, m(s) the share of them that are cut off by T at s, and h(s) the honest clone's expected \
                  steps from there. Then",
            ),
            Math(
                r"\mathbb{E}[\text{steps of the clone}] = D + \sum_s m(s)\, h(s)",
                "The expected steps of the clone are D plus the sum over s of m of s times h of s.",
            ),
            Text(
                "whatever the experts do. The clone visits each cell as often as the demonstrations do, for it leaves each cell as they left \
                  it. Where no demonstration is cut off, it is exactly as good as the ensemble.",
            ),
            Live(live::identity),
            Text(
                "So no β, no number of experts and no training can keep out an honest cloner, as long as the experts arrive within T.",
            ),
        ],
    },
    Step {
        title: "The trap, and what a cap hides",
        scene: Scene { setup: trap, clones: &["occupancy"], kind: CAPPED, mark: Mark::Cell(0, 1) },
        blocks: &[
            Text(
                "Two experts drawn by hand seem to break that rule. Both would stay for ever at the marked cell, and both walk around it, but for the \
                  second, who enters it from below, where it hardly ever is. The clone gets there once in a hundred episodes, and never leaves.",
            ),
            Math(
                r"-\mathbb{E}_s[\min(h(s), 100)] \ne -\mathbb{E}_s\,\mathbb{E}[\min(\tau_s, T)]",
                "Minus the mean over s of the lesser of h of s and 100 is not minus the mean of the lesser of tau s and T.",
            ),
            Text(
                "The paper's figure cuts the mean hitting time h(s) of each cell. A small chance of never arriving makes that mean huge, and then it \
                  counts as 100 from almost everywhere, although nearly every episode arrives.",
            ),
            Live(live::capped_and_real),
            Try(
                "Switch between the returns under the figures: capped, uncapped, within T, success. The policy stays the same.",
            ),
        ],
    },
    Step {
        title: "A clone that remembers",
        scene: Scene { setup: parted, clones: &["uniform", "history"], kind: WITHIN, mark: Mark::Cell(1, 2) },
        blocks: &[
            Text(
                "Back to the parted experts and the blind clone. A cloner may also remember its own episode. It asks: of the experts, who would have \
                  done what I did so far?",
            ),
            Math(
                r"p(c \mid \tau) \propto \prod_t \pi_c(a_t \mid s_t)",
                "p of c given the episode is proportional to the product over t of expert c's probabilities of the actions taken.",
            ),
            Text(
                "At first it does not know, and its first move is a coin toss. But that move speaks for one of the experts, the next for the same one still \
                  more: within a few steps it follows one of them to the flag. Its episodes have exactly the ensemble's law. The paper saw this with \
                  a learned memory (a GRU).",
            ),
            Live(live::clone_and_ensemble),
            Try("Choose history as the clone in the race, and watch the first steps."),
            Go(Tab::Race, "To the race"),
        ],
    },
    Step {
        title: "Where this leaves protection",
        scene: Scene { setup: parted, clones: &["uniform", "occupancy"], kind: CAPPED, mark: Mark::None },
        blocks: &[
            Text(
                "The pair on the page is the whole story: the same two experts, a clone that is lost and a clone that is not. The ensemble protects \
                  against an observer who weighs its experts wrongly: equally at each cell, say. It does not protect \
                  against one who clones what was shown, nor one who remembers.",
            ),
            Text(
                "What remains open, and can be tried here: experts that give up part of their own arrivals, rewards other than time, cloners with \
                  little data, worlds with few ways. Disagreement needs room: draw a corridor, and there is none.",
            ),
            Try(
                "On the bench every cloner attacks the ensemble of your choice, your own too. In the world tab, look for a grid where the clone is lost \
                 at a small price.",
            ),
            Go(Tab::Bench, "To the attack bench"),
            Go(Tab::World, "Draw a world"),
        ],
    },
];
