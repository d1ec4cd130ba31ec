//! What a part was measured on: the processor, how many cores, memory, system and programs. Never the name of a machine.

use serde_json::{Map, Value};

use crate::tools;

/// The facts, by name. `programs`: those whose version matters.
pub fn facts(programs: &[&str]) -> Value {
    let mut facts = Map::new();
    let mut add = |name: &str, fact: Option<String>| {
        facts.insert(name.to_owned(), Value::from(fact.unwrap_or_else(|| "unknown".to_owned())));
    };
    add("processor", processor());
    add("cores", Some(cores().to_string()));
    add("memory", memory());
    add("system", system());
    for program in programs {
        add(program, Some(version(program)));
    }
    Value::Object(facts)
}

/// Threads that run at once.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// How many programs want a processor, as a mean over the last minute.
pub fn load() -> Option<f64> {
    std::fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next()?.parse().ok()
}

/// The version of a program as it tells it, without its name.
pub fn version(program: &str) -> String {
    let said = tools::output(program, &["--version"]).unwrap_or_default();
    let begin = said.find(|letter: char| letter.is_ascii_digit()).unwrap_or(0);
    said[begin..].to_owned()
}

/// What stands behind the first line of a file that begins with this word, without what is around it.
fn line(file: &str, begins: &str) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find(|line| line.starts_with(begins))?;
    Some(line[begins.len()..].trim_matches([' ', '\t', ':', '=', '"']).to_owned())
}

fn processor() -> Option<String> {
    let sysctl = || tools::output("sysctl", &["-n", "machdep.cpu.brand_string"]);
    line("/proc/cpuinfo", "model name").or_else(sysctl)
}

fn memory() -> Option<String> {
    let kilobytes: f64 = line("/proc/meminfo", "MemTotal")?.strip_suffix("kB")?.trim().parse().ok()?;
    Some(format!("{:.0} GB", kilobytes * 1024.0 / 1e9))
}

fn system() -> Option<String> {
    line("/etc/os-release", "PRETTY_NAME").or_else(|| Some(std::env::consts::OS.to_owned()))
}
