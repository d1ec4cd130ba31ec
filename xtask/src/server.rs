//! Serves a built page as a host would: its files and nothing else, on this machine and to nobody else, with the headers
//! that its file `_headers` names. Nothing is built and nothing fetched.

use std::net::Ipv4Addr;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use axum::Router;
use axum::http::header::{ALLOW, CACHE_CONTROL, CONTENT_TYPE, HeaderName, HeaderValue, LOCATION};
use axum::http::{Method, StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use percent_encoding::{NON_ALPHANUMERIC, percent_decode_str, utf8_percent_encode};
use tokio::net::TcpListener;

use crate::Failure;
use crate::offline::HEADERS;

const PAGE: &str = "index.html";

const TYPES: [(&str, &str); 7] = [
    ("html", "text/html; charset=utf-8"),
    ("js", "text/javascript; charset=utf-8"),
    ("css", "text/css; charset=utf-8"),
    ("wasm", "application/wasm"),
    ("svg", "image/svg+xml"),
    ("png", "image/png"),
    ("webmanifest", "application/manifest+json"),
];

/// A folder of files, and what is said with each of them.
pub struct Site {
    folder: PathBuf,
    headers: Vec<(HeaderName, HeaderValue)>,
}

/// What is at an address.
enum Found {
    File(PathBuf),
    /// A folder, asked for without the slash at its end; this is where it is.
    Moved(String),
    Nothing,
}

impl Site {
    pub fn open(folder: &Path) -> Result<Site, Failure> {
        let missing = |error| format!("{}: {error} (`cargo xtask build` makes the page)", folder.display());
        let folder = folder.canonicalize().map_err(missing)?;
        let text = std::fs::read_to_string(folder.join(HEADERS)).map_err(missing)?;
        // Below a line with addresses, here all of them, each header has an indented line.
        let lines = text.lines().filter(|line| line.starts_with(' '));
        let mut headers = lines
            .map(|line| header(line.trim()).ok_or_else(|| format!("{HEADERS}: no header: {}", line.trim())))
            .collect::<Result<Vec<_>, Failure>>()?;
        // A page that was built again is a new page.
        headers.push((CACHE_CONTROL, HeaderValue::from_static("no-cache")));
        Ok(Site { folder, headers })
    }

    /// Answers at this port of 127.0.0.1 until the program is ended.
    pub fn serve(self, port: u16) -> Result<(), Failure> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let failed = |error| format!("port {port}: {error}");
        runtime.map_err(failed)?.block_on(async {
            let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).await.map_err(failed)?;
            println!("\n  ape-lab is at http://127.0.0.1:{port}/ (Ctrl-C stops it)\n");
            self.answer_all(listener).await.map_err(failed)
        })
    }

    async fn answer_all(self, listener: TcpListener) -> std::io::Result<()> {
        let site = Arc::new(self);
        let answer = async move |method, uri: Uri| site.answer(&method, uri.path());
        axum::serve(listener, Router::new().fallback(answer)).await
    }

    fn answer(&self, method: &Method, path: &str) -> Response {
        let missing = || (StatusCode::NOT_FOUND, "There is no such file.").into_response();
        let is_read = [Method::GET, Method::HEAD].contains(method);
        let mut response = match self.find(path) {
            _ if !is_read => {
                (StatusCode::METHOD_NOT_ALLOWED, [(ALLOW, "GET, HEAD")], "Files can only be read.").into_response()
            }
            Found::File(file) => match std::fs::read(&file) {
                Ok(bytes) => ([(CONTENT_TYPE, media_type(&file))], bytes).into_response(),
                Err(_) => missing(),
            },
            Found::Moved(place) => {
                (StatusCode::PERMANENT_REDIRECT, [(LOCATION, place)], "This is a folder.").into_response()
            }
            Found::Nothing => missing(),
        };
        response.headers_mut().extend(self.headers.iter().cloned());
        response
    }

    fn find(&self, path: &str) -> Found {
        let Ok(decoded) = percent_decode_str(path).decode_utf8() else { return Found::Nothing };
        let Some(mut file) = self.inside(Path::new(decoded.trim_start_matches('/'))) else { return Found::Nothing };
        if file.is_dir() {
            if !decoded.ends_with('/') {
                let name = decoded.rsplit('/').next().unwrap_or_default();
                return Found::Moved(format!("{}/", utf8_percent_encode(name, NON_ALPHANUMERIC)));
            }
            match self.inside(&file.join(PAGE)) {
                Some(page) => file = page,
                None => return Found::Nothing,
            }
        }
        if file.is_file() { Found::File(file) } else { Found::Nothing }
    }

    /// What a path leads to, by whatever way, if that is in the folder and not hidden.
    fn inside(&self, path: &Path) -> Option<PathBuf> {
        let file = self.folder.join(path).canonicalize().ok()?;
        let below = file.strip_prefix(&self.folder).ok()?;
        let is_shown = |part: Component| {
            let name = part.as_os_str().to_string_lossy();
            !name.starts_with('.') && name != HEADERS
        };
        below.components().all(is_shown).then_some(file)
    }
}

/// `Name: value`.
fn header(line: &str) -> Option<(HeaderName, HeaderValue)> {
    let (name, value) = line.split_once(':')?;
    Some((name.parse().ok()?, value.trim_start().parse().ok()?))
}

fn media_type(file: &Path) -> &'static str {
    let extension = file.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    TYPES.iter().find(|(known, _)| *known == extension).map_or("application/octet-stream", |(_, media)| media)
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::{Ipv4Addr, TcpStream};
    use std::time::Duration;

    use tokio::net::TcpListener;

    use super::Site;

    /// A folder with a page, and a file beside it that is nobody's business.
    fn folder() -> tempfile::TempDir {
        let outside = tempfile::tempdir().unwrap();
        let folder = outside.path().join("dist");
        std::fs::create_dir_all(folder.join("some/deep")).unwrap();
        let files = [
            ("../secret", "secret"),
            ("_headers", "/*\n  X-Content-Type-Options: nosniff\n"),
            (".hidden", "secret"),
            ("index.html", "the page"),
            ("some/deep/index.html", "another page"),
            ("some/program.wasm", "program"),
            ("some/page.webmanifest", "{}"),
            ("some/ü.js", "script"),
            ("some/else", "bytes"),
        ];
        for (name, text) in files {
            std::fs::write(folder.join(name), text).unwrap();
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink("../secret", folder.join("link")).unwrap();
        outside
    }

    /// What `ask` finds out at the port where the page is served meanwhile.
    fn served<T: Send + 'static>(ask: impl FnOnce(u16) -> T + Send + 'static) -> T {
        let folder = folder();
        let site = Site::open(&folder.path().join("dist")).unwrap();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await.unwrap();
            let port = listener.local_addr().unwrap().port();
            tokio::spawn(site.answer_all(listener));
            tokio::task::spawn_blocking(move || ask(port)).await.unwrap()
        })
    }

    /// Sends a request as it is, which no browser would; what becomes of the connection afterwards is asked for.
    fn send(port: u16, request: &str, connection: &str) -> TcpStream {
        let mut stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).unwrap();
        write!(stream, "{request} HTTP/1.1\r\nHost: localhost\r\nConnection: {connection}\r\n\r\n").unwrap();
        stream
    }

    /// Status line and headers, and body.
    fn answers(requests: &[&'static str]) -> Vec<(String, String)> {
        let requests = requests.to_vec();
        served(move |port| {
            let ask = |request| {
                let mut answer = String::new();
                send(port, request, "close").read_to_string(&mut answer).unwrap();
                let (head, body) = answer.split_once("\r\n\r\n").unwrap();
                (head.to_owned(), body.to_owned())
            };
            requests.into_iter().map(ask).collect()
        })
    }

    /// Browsers keep several connections open, and open some before they know what for.
    #[test]
    fn every_connection_is_answered_while_others_stay_open() {
        let begins = served(|port| {
            let _silent: Vec<_> = (0..8).map(|_| TcpStream::connect((Ipv4Addr::LOCALHOST, port)).unwrap()).collect();
            let mut open: Vec<_> = (0..32).map(|_| send(port, "GET /some/program.wasm", "keep-alive")).collect();
            let begin = |stream: &mut TcpStream| {
                // An end to the test, should there be no answer.
                stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
                let mut begin = [0; 12];
                stream.read_exact(&mut begin).map(|()| begin)
            };
            open.iter_mut().map(begin).collect::<Vec<_>>()
        });
        for (connection, begin) in begins.into_iter().enumerate() {
            assert_eq!(begin.ok().as_ref(), Some(b"HTTP/1.1 200"), "connection {connection}");
        }
    }

    #[test]
    fn files_are_served_as_by_a_host_and_nothing_else_is() {
        let good = [
            ("GET /", "text/html; charset=utf-8", "the page"),
            ("GET /index.html?from=home", "text/html; charset=utf-8", "the page"),
            ("GET /some/deep/", "text/html; charset=utf-8", "another page"),
            ("GET /some/program.wasm", "application/wasm", "program"),
            ("GET /some/page.webmanifest", "application/manifest+json", "{}"),
            ("GET /some/%C3%BC.js", "text/javascript; charset=utf-8", "script"),
            ("GET /some/else", "application/octet-stream", "bytes"),
            ("GET /some/../index.html", "text/html; charset=utf-8", "the page"),
            ("HEAD /some/program.wasm", "application/wasm", ""),
        ];
        let missing = [
            "GET /nothing",
            "GET /some/",
            "GET /index.html/",
            "GET /_headers",
            "GET /.hidden",
            "GET /../secret",
            "GET /%2e%2e/secret",
            "GET /..%2fsecret",
            "GET /some/../../secret",
            "GET //../secret",
            "GET /link",
            "GET /..\\secret",
            "GET /%00",
            "GET /%ff",
            "GET /../dist/../secret",
            "GET //etc/passwd",
            "GET /%2Fetc%2Fpasswd",
            "HEAD /../secret",
        ];
        let others = ["GET /some/deep", "GET //some", "POST /", "DELETE /index.html"];
        let requests = [&good.map(|(request, _, _)| request)[..], &missing, &others].concat();
        let answers = answers(&requests);
        for (request, (head, body)) in requests.iter().zip(&answers) {
            assert!(!body.contains("secret") && !body.contains("root:"), "{request}: {body}");
            assert!(head.contains("\r\nx-content-type-options: nosniff"), "{request}: {head}");
        }
        for ((request, media, text), (head, body)) in good.iter().zip(&answers) {
            assert!(head.starts_with("HTTP/1.1 200"), "{request}: {head}");
            assert!(head.contains(&format!("content-type: {media}")), "{request}: {head}");
            assert_eq!(body, text, "{request}");
        }
        assert!(answers[good.len() - 1].0.contains("content-length: 7"));
        let (missing_answers, other_answers) = answers[good.len()..].split_at(missing.len());
        for (request, (head, _)) in missing.iter().zip(missing_answers) {
            assert!(head.starts_with("HTTP/1.1 404"), "{request}: {head}");
        }
        assert!(other_answers[0].0.starts_with("HTTP/1.1 308") && other_answers[0].0.contains("location: deep/"));
        assert!(other_answers[1].0.contains("location: some/"));
        for (head, _) in &other_answers[2..] {
            assert!(head.starts_with("HTTP/1.1 405") && head.contains("allow: GET, HEAD"), "{head}");
        }
    }
}
