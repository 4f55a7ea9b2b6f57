//! The responses: the page and its events.
use super::access::Access;
use futures_util::stream::{Stream, unfold};
use http_body_util::combinators::UnsyncBoxBody;
use http_body_util::{BodyExt, Full, StreamBody};
use hyper::body::{Bytes, Frame};
use hyper::header::{ALLOW, HeaderValue};
use hyper::{Method, Request, Response, StatusCode};
use manifactor::viz::{LiveMap, live_page};
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::watch;
use tokio::time::{sleep, timeout};

/// Shortest time between two states, and longest silence. After it, a comment is sent to detect closed
/// connections.
const PACE: Duration = Duration::from_millis(100);
const SILENCE: Duration = Duration::from_secs(15);
/// Headers of every response. It is not cached, its content type is not guessed, and no foreign page can
/// embed it. The address, which may have a token, is not sent as a referrer.
const HEADERS: [(&str, &str); 5] = [
    ("cache-control", "no-store"),
    ("x-content-type-options", "nosniff"),
    ("referrer-policy", "no-referrer"),
    ("cross-origin-resource-policy", "same-origin"),
    ("content-security-policy", "frame-ancestors 'none'"),
];

/// The newest state of the map, and the notice of a newer one.
pub(super) type States = watch::Receiver<Arc<LiveMap>>;
type Body = UnsyncBoxBody<Bytes, Infallible>;

pub(super) struct Answers {
    access: Access,
    states: States,
    page: Bytes,
}

impl Answers {
    /// Creates the responses for requests that `access` admits, from these states.
    pub(super) fn new(access: Access, states: States) -> Self {
        Self { access, states, page: live_page().into() }
    }

    /// Returns the response to a request. Its body is ignored.
    pub(super) fn to<T>(&self, request: &Request<T>) -> Response<Body> {
        if !self.access.admits(request) {
            return words(StatusCode::FORBIDDEN, "open the complete address that the command printed");
        }
        match (request.method(), request.uri().path()) {
            (&Method::GET, "/") => {
                let page = Full::new(self.page.clone()).boxed_unsync();
                respond(StatusCode::OK, "text/html; charset=utf-8", page)
            }
            (&Method::GET, "/events") => {
                let events = StreamBody::new(events(self.states.clone())).boxed_unsync();
                respond(StatusCode::OK, "text/event-stream", events)
            }
            (&Method::GET, _) => words(StatusCode::NOT_FOUND, "there is / and no more"),
            _ => {
                let mut refusal = words(StatusCode::METHOD_NOT_ALLOWED, "GET alone");
                refusal.headers_mut().insert(ALLOW, HeaderValue::from_static("GET"));
                refusal
            }
        }
    }
}

/// Streams the states, from the current one to the last. A state is encoded after the browser has taken the
/// previous one.
fn events(mut states: States) -> impl Stream<Item = Result<Frame<Bytes>, Infallible>> {
    states.mark_changed();
    unfold((states, Duration::ZERO), |(mut states, pause)| async move {
        sleep(pause).await;
        let event = match timeout(SILENCE, states.changed()).await {
            Ok(Ok(())) => {
                let map = states.borrow_and_update().clone();
                format!("retry: 1000\ndata: {}\n\n", map.to_json())
            }
            Ok(Err(_)) => return None,
            Err(_) => ":\n\n".to_owned(),
        };
        Some((Ok(Frame::data(event.into())), (states, PACE)))
    })
}

fn words(status: StatusCode, words: &'static str) -> Response<Body> {
    respond(status, "text/plain", Full::new(Bytes::from_static(words.as_bytes())).boxed_unsync())
}

fn respond(status: StatusCode, kind: &'static str, body: Body) -> Response<Body> {
    let mut response = Response::new(body);
    *response.status_mut() = status;
    for (name, value) in HEADERS.into_iter().chain([("content-type", kind)]) {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}
