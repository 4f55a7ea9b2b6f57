//! Forwarding of the log to a Python function.
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::fmt::{Debug, Write};
use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::layer::{Context, SubscriberExt};
use tracing_subscriber::util::SubscriberInitExt;

struct Forward(Py<PyAny>);

/// The message, followed by the fields.
#[derive(Default)]
struct Line {
    message: String,
    fields: String,
}

impl Visit for Line {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        // writing to a String cannot fail
        let _ = match field.name() {
            "message" => write!(self.message, "{value:?}"),
            name => write!(self.fields, " {name}={value:?}"),
        };
    }
}

impl<S: Subscriber> Layer<S> for Forward {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut line = Line::default();
        event.record(&mut line);
        let level = match *event.metadata().level() {
            Level::ERROR => 40,
            Level::WARN => 30,
            Level::INFO => 20,
            _ => 10,
        };
        Python::attach(|py| {
            let text = line.message + &line.fields;
            if let Err(error) = self.0.call1(py, (level, event.metadata().target(), text)) {
                error.write_unraisable(py, None);
            }
        });
    }
}

/// Forwards log messages from `level` on to `log(level, target, text)`; works once per process.
#[pyfunction]
fn log_to(log: Py<PyAny>, level: u8) -> PyResult<()> {
    let filter = match level {
        0..=10 => LevelFilter::DEBUG,
        11..=20 => LevelFilter::INFO,
        21..=30 => LevelFilter::WARN,
        _ => LevelFilter::ERROR,
    };
    let registry = tracing_subscriber::registry().with(Forward(log).with_filter(filter));
    registry.try_init().map_err(|error| PyRuntimeError::new_err(error.to_string()))
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(log_to, module)?)
}
