//! The server: connections and their limits. Each connection carries one request.
use super::access::Access;
use super::answers::{Answers, States};
use futures_util::future::select;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use manifactor::viz::LiveMap;
use std::convert::Infallible;
use std::future::ready;
use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::runtime;
use tokio::sync::{Semaphore, watch};
use tokio::time::{sleep, timeout};
use tokio_io_timeout::TimeoutStream;

/// Largest number of connections at once; further ones wait. A page takes two.
const MOST: usize = 32;
/// Connections may use one in four of the files that may be open; the rest is for the results.
const SHARE: u64 = 4;
/// Largest head of a request, and roughly the data buffered for a browser before its next state is encoded.
/// Unit: bytes.
const LONGEST: usize = 16 * 1024;
/// Longest time for the head of a request, and for a browser that takes no data before it counts as gone.
const PATIENCE: Duration = Duration::from_secs(10);
/// Pause after a connection that could not be accepted.
const PAUSE: Duration = Duration::from_millis(100);
/// Longest wait at the end for browsers that have not received the last state.
const FAREWELL: Duration = Duration::from_secs(5);

/// Serves in a new thread, which ends when the state can no longer change and the browsers have its last
/// version.
///
/// # Errors
/// If the system cannot create the thread.
pub(super) fn begin(
    listener: std::net::TcpListener,
    access: Access,
    states: States,
) -> io::Result<JoinHandle<()>> {
    listener.set_nonblocking(true)?;
    let runtime = runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
    let listener = {
        let _within = runtime.enter();
        TcpListener::from_std(listener)?
    };
    let serve = move || runtime.block_on(serve(listener, access, states));
    thread::Builder::new().name("view".into()).spawn(serve)
}

/// Number of browsers that receive these states.
pub(super) fn watchers(states: &watch::Sender<Arc<LiveMap>>) -> usize {
    // the server itself holds two receivers: one that it copies, and one that waits for the end
    states.receiver_count().saturating_sub(2)
}

async fn serve(listener: TcpListener, access: Access, mut states: States) {
    let answers = Arc::new(Answers::new(access, states.clone()));
    let connections = GracefulShutdown::new();
    let ended = async { while states.changed().await.is_ok() {} };
    select(pin!(accept(&listener, &answers, &connections)), pin!(ended)).await;
    // browsers that have not received the last state by then miss it
    let _ = timeout(FAREWELL, connections.shutdown()).await;
}

/// HTTP with one request per connection and limits on its head.
pub(super) fn http() -> http1::Builder {
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(PATIENCE).max_buf_size(LONGEST).keep_alive(false);
    http
}

/// Number of connections that leave enough files for the rest of the program.
fn most_connections(open_files: Option<u64>) -> usize {
    let share = open_files.map_or(u64::MAX, |files| files / SHARE);
    usize::try_from(share).unwrap_or(MOST).clamp(1, MOST)
}

/// Number of files that may be open (`ulimit -n`); `None` if there is no limit.
#[cfg(unix)]
fn open_files() -> Option<u64> {
    rustix::process::getrlimit(rustix::process::Resource::Nofile).current
}

/// Returns `None`: this system has no known limit.
#[cfg(not(unix))]
fn open_files() -> Option<u64> {
    None
}

async fn accept(listener: &TcpListener, answers: &Arc<Answers>, connections: &GracefulShutdown) {
    let http = http();
    let places = Arc::new(Semaphore::new(most_connections(open_files())));
    loop {
        // acquired before the connection, which takes a file even if it is closed at once
        let Ok(place) = places.clone().acquire_owned().await else { return };
        let Ok((stream, _)) = listener.accept().await else {
            // for example, too many files are open, which may pass
            sleep(PAUSE).await;
            continue;
        };
        // Nagle's algorithm would delay small responses
        let _ = stream.set_nodelay(true);
        let mut stream = TimeoutStream::new(stream);
        stream.set_write_timeout(Some(PATIENCE));
        let answers = answers.clone();
        let answer = service_fn(move |request| ready(Ok::<_, Infallible>(answers.to(&request))));
        let connection = connections.watch(http.serve_connection(TokioIo::new(Box::pin(stream)), answer));
        tokio::spawn(async move {
            // an error concerns only the browser: it has gone, or it asks again
            let _ = connection.await;
            drop(place);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor::viz::Phase;
    use std::io::{BufRead, BufReader, Read, Write};
    use std::net::{SocketAddr, TcpStream};
    use tokio::time::Instant;

    type Feed = watch::Sender<Arc<LiveMap>>;

    fn feed() -> (Feed, States) {
        watch::channel(Arc::new(LiveMap::new("desk", "only")))
    }

    fn served(access: Access) -> (SocketAddr, Feed, JoinHandle<()>) {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let (feed, states) = feed();
        (address, feed, begin(listener, access, states).unwrap())
    }

    fn change(feed: &Feed, change: impl FnOnce(&mut LiveMap)) {
        feed.send_modify(|map| change(Arc::make_mut(map)));
    }

    fn asked(address: SocketAddr, request: &str) -> TcpStream {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        stream
    }

    /// The status of a response, and its whole text.
    fn answer(address: SocketAddr, line: &str, host: &str) -> (u16, String) {
        let mut text = String::new();
        asked(address, &format!("{line} HTTP/1.1\r\nHost: {host}\r\n\r\n"))
            .read_to_string(&mut text)
            .unwrap();
        (text.split(' ').nth(1).unwrap().parse().unwrap(), text)
    }

    #[test]
    fn the_page_is_there_and_nothing_else() {
        let (address, _feed, _) = served(Access::Local);
        let status = |line: &str| answer(address, line, "localhost").0;
        let (ok, page) = answer(address, "GET /?x=1", &address.to_string());
        assert!(
            ok == 200 && page.contains("<title>Live map</title>") && page.contains("frame-ancestors 'none'")
        );
        assert_eq!((status("GET /favicon.ico"), status("GET /../etc/passwd")), (404, 404));
        assert_eq!((status("POST /"), status("HEAD /"), status("DELETE /events")), (405, 405, 405));
        assert!(answer(address, "PUT /", "localhost").1.contains("\r\nallow: GET\r\n"));
    }

    #[test]
    fn a_name_that_was_made_to_lead_here_is_refused() {
        let (address, _feed, _) = served(Access::Local);
        for host in
            ["example.org", "localhost.example.org", &format!("127.0.0.1.example.org:{}", address.port())]
        {
            for line in ["GET /", "GET /events", "GET /nowhere", "POST /"] {
                assert_eq!(answer(address, line, host).0, 403, "{line} of {host}");
            }
        }
        let mut text = String::new();
        asked(address, "GET / HTTP/1.1\r\n\r\n").read_to_string(&mut text).unwrap();
        assert!(text.starts_with("HTTP/1.1 403 "), "{text}");
    }

    #[test]
    fn every_request_needs_the_token() {
        let (address, _feed, _) = served(Access::Token("0123abcd".to_owned()));
        let status = |line: &str| answer(address, line, "robot.example.org").0;
        for path in [
            "/",
            "/events",
            "/nowhere",
            "/?token=",
            "/?token=0123abce",
            "/?token=0123abcd0",
            "/events?token=1",
        ] {
            assert_eq!(status(&format!("GET {path}")), 403, "{path}");
        }
        assert_eq!(status("POST /"), 403);
        assert_eq!((status("GET /?token=0123abcd"), status("GET /x?token=0123abcd")), (200, 404));
        let mut events = BufReader::new(asked(
            address,
            "GET /events?token=0123abcd HTTP/1.1\r\nHost: robot.example.org\r\n\r\n",
        ));
        let mut first = String::new();
        events.read_line(&mut first).unwrap();
        assert!(first.starts_with("HTTP/1.1 200 "), "{first}");
    }

    #[test]
    fn what_is_no_request_is_told_so() {
        let (address, _feed, _) = served(Access::Local);
        let status = |text: &str| {
            let mut answer = String::new();
            asked(address, text).read_to_string(&mut answer).unwrap();
            answer
        };
        assert!(status("\u{16}\u{3}\u{1}\r\n\r\n").starts_with("HTTP/1.1 400 "));
        let many = format!("GET / HTTP/1.1\r\n{}\r\n", "a: b\r\n".repeat(101));
        assert!(status(&many).starts_with("HTTP/1.1 431 "));
        let long = format!("GET / HTTP/1.1\r\na: {}", "b".repeat(LONGEST));
        assert!(status(&long).starts_with("HTTP/1.1 431 "));
    }

    #[test]
    fn events_are_whole_states_and_end_with_the_last() {
        let (address, feed, server) = served(Access::Local);
        let mut lines =
            BufReader::new(asked(address, "GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n")).lines();
        let mut state = || loop {
            let line = lines.next()?.unwrap();
            if let Some(json) = line.strip_prefix("data: ") {
                return Some(serde_json::from_str::<serde_json::Value>(json).unwrap());
            }
        };
        assert_eq!(state().unwrap()["phase"], "waiting");
        assert_eq!(watchers(&feed), 1);
        change(&feed, |map| map.set_phase(Phase::Solving { iteration: 2 }, Some(0.5)));
        assert_eq!(state().unwrap()["words"], "iteration 2");
        change(&feed, |map| map.set_phase(Phase::Ended("done".to_owned()), None));
        drop(feed);
        // the server ends even if no browser reads
        server.join().unwrap();
        assert_eq!(state().unwrap()["words"], "done");
        assert!(state().is_none() && TcpStream::connect(address).is_err());
    }

    #[test]
    fn who_takes_nothing_holds_up_nobody() {
        let (address, feed, _) = served(Access::Local);
        let deaf = asked(address, "GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n");
        // more than all buffers on the way can hold
        let long = "x".repeat(1 << 20);
        for i in 0..40 {
            change(&feed, |map| *map = LiveMap::new(&long, &i.to_string()));
        }
        assert_eq!(answer(address, "GET /", "localhost").0, 200);
        drop(deaf);
    }

    /// A browser that requests events and reads none. After that, the paused clock jumps to the next timer
    /// whenever the runtime is idle.
    async fn deaf(address: SocketAddr) -> tokio::net::TcpStream {
        tokio::time::resume();
        let stream = tokio::net::TcpStream::connect(address).await.unwrap();
        stream.writable().await.unwrap();
        stream.try_write(b"GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
        stream.readable().await.unwrap();
        tokio::time::pause();
        stream
    }

    #[test]
    fn nobody_is_waited_for_for_ever() {
        let mut runtime = runtime::Builder::new_current_thread();
        runtime.enable_all().start_paused(true).build().unwrap().block_on(async {
            let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
            let address = listener.local_addr().unwrap();
            let (feed, states) = feed();
            // longer than all buffers on the way
            change(&feed, |map| *map = LiveMap::new(&"x".repeat(1 << 25), "only"));
            let server = tokio::spawn(serve(listener, Access::Local, states));
            let begun = Instant::now();
            let silent = tokio::net::TcpStream::connect(address).await.unwrap();
            let first = deaf(address).await;
            while watchers(&feed) > 0 {
                sleep(PAUSE).await;
            }
            assert!(begun.elapsed() >= PATIENCE);
            silent.readable().await.unwrap();
            assert_eq!(silent.try_read(&mut [0]).unwrap(), 0);
            // nor at the end
            let second = deaf(address).await;
            let begun = Instant::now();
            drop(feed);
            server.await.unwrap();
            assert!((FAREWELL..PATIENCE).contains(&begun.elapsed()));
            drop((first, second));
        });
    }

    #[test]
    fn connections_leave_files_for_the_results() {
        let most = [None, Some(1024), Some(40), Some(20), Some(0)].map(most_connections);
        assert_eq!(most, [32, 32, 10, 5, 1]);
    }

    #[test]
    fn there_is_an_end_to_how_many_look() {
        let (address, feed, _) = served(Access::Local);
        let looks = || asked(address, "GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n");
        let heard = |stream: TcpStream| {
            let mut first = String::new();
            let mut reader = BufReader::new(stream);
            reader.read_line(&mut first).unwrap();
            (first, reader)
        };
        let mut all: Vec<_> = (0..most_connections(open_files())).map(|_| heard(looks())).collect();
        assert!(all.iter().all(|(first, _)| first.contains("200")));
        // a further connection waits until one is closed
        let waiting = looks();
        waiting.set_read_timeout(Some(PAUSE)).unwrap();
        assert!((&waiting).read(&mut [0]).is_err());
        all.pop();
        change(&feed, |map| *map = LiveMap::new("next", "only"));
        waiting.set_read_timeout(None).unwrap();
        assert!(heard(waiting).0.contains("200"));
    }
}
