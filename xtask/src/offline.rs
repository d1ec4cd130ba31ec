//! The service worker of a built page: the list of its files with their hashes, then web/service_worker.js, which says
//! what it does with them. While trunk serves the page it keeps no file, and the page has no policy: trunk reloads the
//! page by a script within it.

use std::collections::BTreeMap;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};

use crate::{Failure, root};

pub const NAME: &str = "service_worker.js";
const PAGE: &str = "index.html";
/// What hosts read and do not serve.
pub const HEADERS: &str = "_headers";

/// Writes the service worker of the page in `folder`.
pub fn write(folder: &Path) -> Result<(), Failure> {
    let template = root().join("web").join(NAME);
    let template = String::from_utf8_lossy(&read(&template)?).into_owned();
    let mut files = BTreeMap::new();
    list(folder, "", &mut files)?;
    let page = files.remove(PAGE).ok_or_else(|| format!("{} holds no built page", folder.display()))?;
    // What browsers ask for, and what every server gives without a redirection.
    files.insert("./".to_owned(), page);
    let text = String::from_utf8_lossy(&read(&folder.join(PAGE))?).into_owned();
    if is_served_by_trunk(&text) {
        // Trunk reloads the page when a file has changed: it must then come from the server, so nothing is kept.
        files.clear();
        write_file(&folder.join(PAGE), &without_policy(&text))?;
    }
    // A map of plain strings looks the same in Rust and in JavaScript.
    let body = format!("const FILES = {files:#?};\n{template}");
    // What the cache keeps of a file has the headers that it came with.
    let headers = std::fs::read_to_string(folder.join(HEADERS)).unwrap_or_default();
    let hash = Sha256::digest(body.clone() + &headers);
    let version: String = hash.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
    write_file(&folder.join(NAME), &format!("const VERSION = {version:?};\n{body}"))
}

/// Adds all files below a folder: their addresses relative to the page, with what a browser compares their bytes to.
fn list(folder: &Path, prefix: &str, files: &mut BTreeMap<String, String>) -> Result<(), Failure> {
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let address = format!("{prefix}{name}");
        // Servers keep hidden files to themselves.
        if name.starts_with('.') || [NAME, HEADERS].contains(&address.as_str()) {
            continue;
        }
        if path.is_dir() {
            list(&path, &format!("{address}/"), files)?;
        } else {
            files.insert(address, format!("sha256-{}", STANDARD.encode(Sha256::digest(read(&path)?))));
        }
    }
    Ok(())
}

/// Whether `trunk serve` made this page: then it holds a script that listens to trunk.
fn is_served_by_trunk(page: &str) -> bool {
    page.contains("{{__TRUNK_ADDRESS__}}")
}

/// The page without the element that holds its Content-Security-Policy.
fn without_policy(page: &str) -> String {
    let Some((start, end)) = policy_element(page) else { return page.to_owned() };
    format!("{}{}", &page[..start], &page[end..])
}

fn policy_element(page: &str) -> Option<(usize, usize)> {
    let name = page.find("http-equiv=\"Content-Security-Policy\"")?;
    Some((page[..name].rfind('<')?, name + page[name..].find('>')? + 1))
}

fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))
}

fn write_file(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::{HEADERS, PAGE, policy_element, without_policy};
    use crate::root;

    fn text(file: &str) -> String {
        std::fs::read_to_string(root().join(file)).unwrap()
    }

    #[test]
    fn trunk_serves_the_page_without_its_policy() {
        let page = text(PAGE);
        let served = without_policy(&page);
        assert!(page.len() > served.len() + 200 && !served.contains("Content-Security-Policy"));
        assert!(served.contains("<meta charset") && served.contains("<meta name=\"referrer\""));
        assert_eq!(without_policy(&served), served);
    }

    #[test]
    fn the_policy_is_the_same_in_the_page_in_its_headers_and_in_the_instructions() {
        let page = text(PAGE);
        let (start, end) = policy_element(&page).unwrap();
        let policy = page[start..end].split("content=\"").nth(1).unwrap().split('"').next().unwrap();
        // Only a header can say who may frame the page.
        let header = format!("Content-Security-Policy: {policy}; frame-ancestors 'none'");
        let headers = text(&format!("web/{HEADERS}"));
        assert!(headers.lines().any(|line| line.trim() == header), "{header}");

        let instructions = text("docs/DEPLOYMENT.md");
        for line in headers.lines().filter(|line| line.starts_with(' ')) {
            let (name, value) = line.trim().split_once(": ").unwrap();
            for words in
                [format!("add_header {name} \"{value}\" always;"), format!("Header always set {name} \"{value}\"")]
            {
                assert!(instructions.contains(&words), "docs/DEPLOYMENT.md does not say: {words}");
            }
        }
    }
}
