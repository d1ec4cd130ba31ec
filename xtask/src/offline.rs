//! The service worker of a built page: the list of its files with their hashes, then web/service_worker.js, which says
//! what it does with them.

use std::collections::BTreeMap;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};

use crate::{Failure, root};

const NAME: &str = "service_worker.js";

/// Writes the service worker of the page in `folder`.
pub fn write(folder: &Path) -> Result<(), Failure> {
    let template = root().join("web").join(NAME);
    let template = String::from_utf8_lossy(&read(&template)?).into_owned();
    let mut files = BTreeMap::new();
    list(folder, "", &mut files)?;
    let page = files.remove("index.html").ok_or_else(|| format!("{} holds no built page", folder.display()))?;
    // What browsers ask for, and what every server gives without a redirection.
    files.insert("./".to_owned(), page);
    if is_served_by_trunk(folder)? {
        // Trunk reloads the page when a file has changed: it must then come from the server, so nothing is kept.
        files.clear();
    }
    // A map of plain strings looks the same in Rust and in JavaScript.
    let body = format!("const FILES = {files:#?};\n{template}");
    let version: String = Sha256::digest(&body).iter().take(8).map(|byte| format!("{byte:02x}")).collect();
    let path = folder.join(NAME);
    std::fs::write(&path, format!("const VERSION = {version:?};\n{body}"))
        .map_err(|error| format!("{}: {error}", path.display()))
}

/// Adds all files below a folder: their addresses relative to the page, with what a browser compares their bytes to.
fn list(folder: &Path, prefix: &str, files: &mut BTreeMap<String, String>) -> Result<(), Failure> {
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let address = format!("{prefix}{name}");
        // Servers keep hidden files to themselves.
        if name.starts_with('.') || address == NAME {
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
fn is_served_by_trunk(folder: &Path) -> Result<bool, Failure> {
    let page = read(&folder.join("index.html"))?;
    Ok(String::from_utf8_lossy(&page).contains("{{__TRUNK_ADDRESS__}}"))
}

fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))
}
