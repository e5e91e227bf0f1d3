//! A static web server for one folder.

use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Component, Path};

/// Serves the files of `folder` until the program ends; answers its address.
pub fn serve(folder: &Path) -> String {
    serve_with(folder, "")
}

/// The same with the headers that let a page share memory.
pub fn serve_isolated(folder: &Path) -> String {
    serve_with(
        folder,
        "Cross-Origin-Opener-Policy: same-origin\r\nCross-Origin-Embedder-Policy: require-corp\r\n",
    )
}

fn serve_with(folder: &Path, headers: &'static str) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("bound");
    let folder = folder.to_owned();
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let folder = folder.clone();
            // A browser that goes away in the middle of an answer is no fault.
            std::thread::spawn(move || answer(stream, &folder, headers));
        }
    });
    format!("http://{address}/")
}

fn answer(mut stream: TcpStream, folder: &Path, headers: &str) -> std::io::Result<()> {
    let mut lines = BufReader::new(stream.try_clone()?).lines();
    let request = lines.next().transpose()?.unwrap_or_default();
    for line in lines {
        if line?.is_empty() {
            break;
        }
    }
    let name = request.split(' ').nth(1).unwrap_or("/").trim_matches('/');
    // All that these tests' names have of what addresses cannot.
    let name = name.replace("%20", " ");
    let name = if name.is_empty() { "index.html" } else { &name };
    let path = folder.join(name);
    let is_inside = |part| matches!(part, Component::Normal(_));
    let (status, body) = match std::fs::read(&path) {
        Ok(body) if Path::new(name).components().all(is_inside) => ("200 OK", body),
        _ => ("404 Not Found", Vec::new()),
    };
    let kind = match path.extension().and_then(|extension| extension.to_str()) {
        Some("html") => "text/html",
        Some("js") => "text/javascript",
        Some("wasm") => "application/wasm",
        _ => "application/octet-stream",
    };
    let length = body.len();
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n\
         {headers}Connection: close\r\n\r\n"
    )?;
    stream.write_all(&body)
}
