//! From TeX to a tree: which commands there are, and what each sign is to its neighbours. Nothing here has a size.

use super::glyphs::{Font, Glyph};

/// What an atom is to its neighbours: it decides on the space between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Class {
    Ordinary,
    Operator,
    Binary,
    Relation,
    Open,
    Close,
    Punctuation,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Node {
    /// A sign, or a word (`\max`).
    Atom(Class, Vec<Glyph>),
    /// A sum or product, in a line and on display.
    Sum(Glyph, Glyph),
    /// In ems.
    Space(f32),
    Accent(Glyph, Box<Node>),
    Fraction(Vec<Node>, Vec<Node>),
    Group(Vec<Node>),
    /// Base, subscript and superscript, of which one may be empty.
    Scripts(Box<Node>, Vec<Node>, Vec<Node>),
}

/// Commands that stand for one sign, each before its sign.
const SIGNS: &str = "alpha α beta β gamma γ delta δ epsilon ϵ varepsilon ε theta θ lambda λ mu μ pi π rho ρ sigma σ \
                     tau τ phi ϕ varphi φ Delta Δ Sigma Σ infty ∞ dots … prime ′ cdot ⋅ times × mid ∣ ge ≥ le ≤ in ∈ \
                     to → sim ∼ approx ≈ propto ∝";

/// Commands that are set as upright words, and whether what they range over goes below them.
pub(super) const WORDS: [(&str, bool); 5] =
    [("max", true), ("min", true), ("log", false), ("exp", false), ("arg", false)];

/// Commands that are spaces, in ems.
const SPACES: [(&str, f32); 3] = [(",", 3.0 / 18.0), (";", 5.0 / 18.0), ("quad", 1.0)];

/// Nodes in nodes beyond this depth are a mistake.
const DEPTH: usize = 24;

/// # Errors
/// What is wrong with the equation.
pub(super) fn parse(tex: &str) -> Result<Vec<Node>, String> {
    let mut parser = Parser { rest: tex, depth: 0 };
    let nodes = parser.nodes()?;
    if parser.rest.is_empty() { Ok(nodes) } else { Err("There is a } without its {.".to_owned()) }
}

struct Parser<'a> {
    rest: &'a str,
    depth: usize,
}

impl<'a> Parser<'a> {
    /// Skips spaces and takes one character.
    fn next(&mut self) -> Option<char> {
        let mut chars = self.rest.trim_start().chars();
        let next = chars.next();
        self.rest = chars.as_str();
        next
    }

    fn take(&mut self, wanted: char) -> bool {
        let rest = self.rest.trim_start().strip_prefix(wanted);
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }

    /// All up to the end, or to a } that is left.
    fn nodes(&mut self) -> Result<Vec<Node>, String> {
        let mut nodes = Vec::new();
        loop {
            self.rest = self.rest.trim_start();
            if self.rest.is_empty() || self.rest.starts_with('}') {
                return Ok(nodes);
            }
            let node = self.node()?;
            nodes.push(self.scripts(node)?);
        }
    }

    fn scripts(&mut self, base: Node) -> Result<Node, String> {
        let (mut sub, mut sup) = (Vec::new(), Vec::new());
        loop {
            if self.take('\'') {
                sup.push(sign('′')?);
                continue;
            }
            let (place, mark) = if self.take('_') {
                (&mut sub, '_')
            } else if self.take('^') {
                (&mut sup, '^')
            } else {
                break;
            };
            if place.iter().any(|node| Ok(node) != sign('′').as_ref()) {
                return Err(format!("There are two {mark} at one base."));
            }
            place.extend(self.argument()?);
        }
        let is_plain = sub.is_empty() && sup.is_empty();
        Ok(if is_plain { base } else { Node::Scripts(Box::new(base), sub, sup) })
    }

    /// A group in braces, or one node.
    fn argument(&mut self) -> Result<Vec<Node>, String> {
        match self.node()? {
            Node::Group(nodes) => Ok(nodes),
            node => Ok(vec![node]),
        }
    }

    /// What follows, without its scripts.
    fn node(&mut self) -> Result<Node, String> {
        self.depth += 1;
        if self.depth > DEPTH {
            return Err("It is nested too deeply.".to_owned());
        }
        let node = match self.next() {
            None => Err("Something is missing at the end.".to_owned()),
            Some('\\') => self.command(),
            Some('{') => {
                let nodes = self.nodes()?;
                if self.take('}') { Ok(Node::Group(nodes)) } else { Err("There is a { without its }.".to_owned()) }
            }
            Some(mark @ ('_' | '^' | '\'' | '}')) => Err(format!("There is a {mark} with nothing before it.")),
            Some('-') => sign('−'),
            Some(char) => sign(char),
        };
        self.depth -= 1;
        node
    }

    fn command(&mut self) -> Result<Node, String> {
        let letters = self.rest.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(self.rest.len());
        let length = if letters == 0 { self.rest.chars().next().map_or(0, char::len_utf8) } else { letters };
        let (name, rest) = self.rest.split_at(length);
        self.rest = rest;
        if let Some((_, width)) = SPACES.iter().find(|(space, _)| *space == name) {
            return Ok(Node::Space(*width));
        }
        if WORDS.iter().any(|(word, _)| *word == name) {
            return word(Class::Operator, name);
        }
        match name {
            "sum" => Ok(Node::Sum(Glyph::find(Font::Sum, '∑')?, Glyph::find(Font::BigSum, '∑')?)),
            "prod" => Ok(Node::Sum(Glyph::find(Font::Sum, '∏')?, Glyph::find(Font::BigSum, '∏')?)),
            "ne" => word(Class::Relation, "\u{e020}="),
            "frac" => Ok(Node::Fraction(self.argument()?, self.argument()?)),
            "tilde" => Ok(Node::Accent(Glyph::find(Font::Roman, '˜')?, Box::new(self.node()?))),
            "mathbb" => {
                let letter = self.braced()?.chars().map(|c| Glyph::find(Font::Double, c)).collect::<Result<_, _>>()?;
                Ok(Node::Atom(Class::Ordinary, letter))
            }
            "text" => {
                let mut nodes = Vec::new();
                for (i, part) in self.braced()?.split(' ').enumerate() {
                    nodes.extend((i > 0).then_some(Node::Space(1.0 / 3.0)));
                    nodes.push(word(Class::Ordinary, part)?);
                }
                Ok(Node::Group(nodes))
            }
            _ => {
                let mut signs = SIGNS.split(' ');
                let found = signs.find(|sign| *sign == name).and_then(|_| signs.next()?.chars().next());
                sign(found.ok_or_else(|| format!("There is no command \\{name}."))?)
            }
        }
    }

    /// Text in braces as it stands.
    fn braced(&mut self) -> Result<&'a str, String> {
        let inside = self.rest.trim_start().strip_prefix('{').and_then(|rest| rest.split_once('}'));
        let (text, rest) = inside.ok_or_else(|| "A command needs text in { }.".to_owned())?;
        self.rest = rest;
        Ok(text)
    }
}

fn sign(char: char) -> Result<Node, String> {
    let (font, class) = match char {
        'a'..='z' | 'A'..='Z' | 'α'..='ϵ' => (Font::Italic, Class::Ordinary),
        '+' | '−' | '⋅' | '×' => (Font::Roman, Class::Binary),
        '=' | ':' | '∣' | '≥' | '≤' | '∈' | '→' | '∼' | '≈' | '∝' => (Font::Roman, Class::Relation),
        '(' | '[' => (Font::Roman, Class::Open),
        ')' | ']' => (Font::Roman, Class::Close),
        ',' | ';' => (Font::Roman, Class::Punctuation),
        _ => (Font::Roman, Class::Ordinary),
    };
    Ok(Node::Atom(class, vec![Glyph::find(font, char)?]))
}

fn word(class: Class, word: &str) -> Result<Node, String> {
    Ok(Node::Atom(class, word.chars().map(|c| Glyph::find(Font::Roman, c)).collect::<Result<_, _>>()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mistakes_are_told() {
        let (deep, long) = ("{".repeat(100_000), r"\tilde".repeat(100_000));
        let open = ["{a", "a}", "a_", "a^", "_a", "a_b_c", r"\frac{a}", r"\text{a", r"\mathbb E", "\\", &deep, &long];
        let unknown = [r"\nosuch", "é", r"\text{é}", r"\mathbb{Q}"];
        for tex in open.into_iter().chain(unknown) {
            assert!(parse(tex).is_err(), "{}", tex.chars().take(20).collect::<String>());
        }
    }

    #[test]
    fn every_sign_and_word_has_its_glyphs() {
        for name in SIGNS.split(' ').step_by(2).chain(WORDS.map(|(word, _)| word)) {
            assert!(parse(&format!("\\{name}")).is_ok(), "{name}");
        }
    }
}
