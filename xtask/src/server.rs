//! Serves a built page as a host would: its files and nothing else, on this machine and to nobody else, with the headers
//! that its file `_headers` names. Nothing is built and nothing fetched.

use std::net::Ipv4Addr;
use std::path::{Component, Path, PathBuf};

use percent_encoding::{NON_ALPHANUMERIC, percent_decode_str, utf8_percent_encode};
use tiny_http::{Header, Method, Request, Response, ResponseBox, Server};

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
    headers: Vec<Header>,
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
            .map(|line| line.trim().parse().map_err(|()| format!("{HEADERS}: no header: {}", line.trim())))
            .collect::<Result<Vec<Header>, Failure>>()?;
        // A page that was built again is a new page.
        headers.push(header("Cache-Control", "no-cache"));
        Ok(Site { folder, headers })
    }

    /// Answers at this port of 127.0.0.1 until the program is ended.
    pub fn serve(&self, port: u16) -> Result<(), Failure> {
        let server = Server::http((Ipv4Addr::LOCALHOST, port)).map_err(|error| format!("port {port}: {error}"))?;
        println!("\n  ape-lab is at http://127.0.0.1:{port}/ (Ctrl-C stops it)\n");
        self.answer_all(&server);
        Ok(())
    }

    /// Several at a time, as a browser asks.
    fn answer_all(&self, server: &Server) {
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    while let Ok(request) = server.recv() {
                        let response = self.answer(&request);
                        // Whoever has gone away needs no answer.
                        let _ = request.respond(response);
                    }
                });
            }
        });
    }

    fn answer(&self, request: &Request) -> ResponseBox {
        let response = match (request.method(), self.find(request.url())) {
            (Method::Get | Method::Head, Found::File(file)) => match std::fs::read(&file) {
                Ok(bytes) => Response::from_data(bytes).with_header(header("Content-Type", media_type(&file))).boxed(),
                Err(_) => status(404, "There is no such file."),
            },
            (Method::Get | Method::Head, Found::Moved(place)) => {
                status(308, "This is a folder.").with_header(header("Location", &place))
            }
            (Method::Get | Method::Head, Found::Nothing) => status(404, "There is no such file."),
            _ => status(405, "Files can only be read.").with_header(header("Allow", "GET, HEAD")),
        };
        // With its length, however long.
        let response = response.with_chunked_threshold(usize::MAX);
        self.headers.iter().cloned().fold(response, Response::with_header)
    }

    fn find(&self, address: &str) -> Found {
        let path = address.split(['?', '#']).next().unwrap_or_default();
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

fn header(name: &str, value: &str) -> Header {
    Header::from_bytes(name, value).expect("our headers are plain text")
}

fn media_type(file: &Path) -> &'static str {
    let extension = file.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    TYPES.iter().find(|(known, _)| *known == extension).map_or("application/octet-stream", |(_, media)| media)
}

fn status(code: u16, sentence: &str) -> ResponseBox {
    Response::from_string(sentence).with_status_code(code).boxed()
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::{Ipv4Addr, TcpStream};

    use tiny_http::Server;

    use super::Site;

    /// Sends requests as they are, which no browser would, and returns the answers: status line and headers, and body.
    fn answers(requests: &[&str]) -> Vec<(String, String)> {
        let outside = std::env::temp_dir().join(format!("ape-lab-server-{}", std::process::id()));
        let folder = outside.join("dist");
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
        {
            let _ = std::fs::remove_file(folder.join("link"));
            std::os::unix::fs::symlink("../secret", folder.join("link")).unwrap();
        }
        let site = Site::open(&folder).unwrap();
        let server = Server::http((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let port = server.server_addr().to_ip().unwrap().port();
        let ask = |request: &&str| {
            let mut stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).unwrap();
            write!(stream, "{request} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").unwrap();
            let mut answer = String::new();
            stream.read_to_string(&mut answer).unwrap();
            let (head, body) = answer.split_once("\r\n\r\n").unwrap();
            (head.to_owned(), body.to_owned())
        };
        let answers = std::thread::scope(|scope| {
            scope.spawn(|| site.answer_all(&server));
            let answers = requests.iter().map(ask).collect();
            (0..4).for_each(|_| server.unblock());
            answers
        });
        std::fs::remove_dir_all(outside).unwrap();
        answers
    }

    /// All in one test: the folder is one.
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
            assert!(head.contains("\r\nX-Content-Type-Options: nosniff"), "{request}: {head}");
        }
        for ((request, media, text), (head, body)) in good.iter().zip(&answers) {
            assert!(head.starts_with("HTTP/1.1 200"), "{request}: {head}");
            assert!(head.contains(&format!("Content-Type: {media}")), "{request}: {head}");
            assert_eq!(body, text, "{request}");
        }
        assert!(answers[good.len() - 1].0.contains("Content-Length: 7"));
        let (missing_answers, other_answers) = answers[good.len()..].split_at(missing.len());
        for (request, (head, _)) in missing.iter().zip(missing_answers) {
            assert!(head.starts_with("HTTP/1.1 404"), "{request}: {head}");
        }
        assert!(other_answers[0].0.starts_with("HTTP/1.1 308") && other_answers[0].0.contains("Location: deep/"));
        assert!(other_answers[1].0.contains("Location: some/"));
        for (head, _) in &other_answers[2..] {
            assert!(head.starts_with("HTTP/1.1 405") && head.contains("Allow: GET, HEAD"), "{head}");
        }
    }
}
