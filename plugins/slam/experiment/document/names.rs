//! Checks of the names in a summary.
use super::SummarySettings;
use super::axis::Axis;
use crate::measures::{measure_names, measure_names_in_words};
use crate::trial::Trial;
use manifactor_config::{Errors, Fault, Node, Place, Value, nearest, quoted_list};
use manifactor_metrics::Alignment;
use manifactor_run::output::report::alignment_name;
use std::collections::HashSet;

/// Names in a `[summary]`.
pub(super) struct SummaryNameCheck<'a> {
    pub(super) settings: &'a SummarySettings,
    /// The table, if there is one.
    pub(super) written: Option<&'a Node>,
    /// Position of the table, or of the document if there is no table.
    pub(super) place: Place,
    pub(super) errors: &'a Errors,
}

impl SummaryNameCheck<'_> {
    /// Checks that all columns, values and metrics exist, and that none is listed twice.
    pub(super) fn check(&self, axes: &[Axis]) {
        self.check_columns(axes);
        self.check_metrics();
        self.check_compared(axes);
        let SummarySettings { by, clusters, metrics, .. } = self.settings;
        self.check_across();
        self.check_duplicates("by", "column", by);
        self.check_duplicates("clusters", "column", clusters);
        self.check_duplicates("metrics", "metric", metrics);
    }

    fn check_columns(&self, axes: &[Axis]) {
        let SummarySettings { by, baseline, clusters, across, curve, .. } = self.settings;
        let columns: Vec<String> =
            axes.iter().flat_map(|axis| &axis.columns).map(|column| column.name.clone()).collect();
        let named = |field: &'static str| move |name| (field, name);
        let all = by.iter().map(named("by")).chain(baseline.keys().map(named("baseline")));
        let all = all.chain(clusters.iter().map(named("clusters"))).chain(curve.iter().map(named("curve")));
        let all = all.chain(across.iter().map(named("across")));
        for (field, name) in all.filter(|(_, name)| !columns.contains(name)) {
            self.report_unknown(field, "column", name, &columns);
        }
    }

    fn check_metrics(&self) {
        let known = measure_names(&Alignment::ALL);
        for name in self.settings.metrics.iter().filter(|name| !known.contains(name)) {
            let meant = nearest(name, known.iter().map(String::as_str));
            let meant = meant.map_or_else(String::new, |meant| format!("did you mean `{meant}`? "));
            let help = format!("{meant}there are {}", measure_names_in_words());
            let problem = Fault::with_help(format!("unknown metric `{name}`"), help);
            self.errors.report(self.place_of("metrics", name), problem);
        }
    }

    fn check_compared(&self, axes: &[Axis]) {
        if let Some((column, value)) = self.settings.compared() {
            let labels = axes.iter().filter_map(|axis| {
                let place = axis.columns.iter().position(|c| c.name == column)?;
                Some(axis.options.iter().filter_map(move |option| option.labels.get(place).cloned()))
            });
            let labels: Vec<String> = labels.flatten().collect();
            if !labels.is_empty() && !labels.iter().any(|label| label == value) {
                self.report_unknown("baseline", column, value, &labels);
            }
        }
        if self.settings.baseline.len() > 1 {
            let problem = Fault::invalid("`baseline` is one column and one of its values");
            self.errors.report(self.place_of("baseline", ""), problem);
        }
    }

    fn check_across(&self) {
        let Some(across) = &self.settings.across else { return };
        let compared = self.settings.compared().map(|(column, _)| column);
        if !self.settings.by.contains(across) && compared != Some(across) {
            let help = format!("add \"{across}\" to `by`");
            let problem = Fault::with_help("what stands side by side has to be kept apart", help);
            self.errors.report(self.place_of("across", across), problem);
        }
    }

    fn check_duplicates(&self, field: &str, what: &str, names: &[String]) {
        let mut met = HashSet::new();
        for name in names.iter().filter(|name| !met.insert(*name)) {
            let problem = Fault::Duplicate { what: what.to_owned(), name: name.clone() };
            self.errors.report(self.place_of(field, name), problem);
        }
    }

    /// Checks that at least one trial uses the alignment that each metric needs.
    pub(super) fn check_alignments(&self, trials: &[Trial]) {
        if trials.is_empty() {
            return;
        }
        let used = |by: &Alignment| trials.iter().any(|t| t.settings.evaluation.alignments.contains(by));
        let used: Vec<Alignment> = Alignment::ALL.into_iter().filter(used).collect();
        let (known, all) = (measure_names(&used), measure_names(&Alignment::ALL));
        for name in self.settings.metrics.iter().filter(|name| all.contains(name) && !known.contains(name)) {
            let used = quoted_list(&used.iter().copied().map(alignment_name).collect::<Vec<_>>());
            let used = if used.is_empty() { "none".to_owned() } else { used };
            let message =
                format!("no trial has the metric `{name}`: of `evaluation.alignments` there is {used}");
            let problem = Fault::with_help(message, "add its alignment to those of the run");
            self.errors.report(self.place_of("metrics", name), problem);
        }
    }

    fn report_unknown(&self, field: &str, what: &str, name: &str, known: &[String]) {
        let (what, name, known) = (what.to_owned(), name.to_owned(), known.to_vec());
        self.errors.report(self.place_of(field, &name), Fault::UnknownName { what, name, known });
    }

    /// Returns the position at which a field of the summary names something; for duplicates the last one.
    fn place_of(&self, field: &str, name: &str) -> Place {
        let Some(Value::Table(table)) = self.written.map(|node| &node.value) else {
            return self.place.clone();
        };
        let Some(field) = table.get(field).map(|field| &field.node) else { return self.place.clone() };
        let is_it = |node: &&Node| matches!(&node.value, Value::String(text) if text == name);
        let found = match &field.value {
            Value::Array(items) => items.iter().rfind(is_it),
            Value::Table(table) => table
                .get(name)
                .map(|field| &field.node)
                .or_else(|| table.values().map(|field| &field.node).find(is_it)),
            _ => None,
        };
        found.unwrap_or(field).place.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_config::{Document, Format};

    /// Returns the errors of a summary over the columns `seed` and `model`; empty if it is valid.
    fn wrong(summary: &str) -> String {
        let text = format!(
            "axes = [{{ columns = {{ seed = 'a', model = 'b' }}, rows = [[1, 'x'], [2, 'y']] }}]\nsummary = {{ {summary} }}"
        );
        let document = Document::parse("sweep.toml", text, Format::Toml).unwrap();
        let errors = Errors::new();
        let axes =
            document.root().items("axes").iter().filter_map(|axis| Axis::read(axis.read(&errors)?, &errors));
        let axes: Vec<Axis> = axes.collect();
        let written = document.root().field("summary").unwrap();
        let settings: SummarySettings = written.read(&errors).unwrap();
        let place = written.place.clone();
        SummaryNameCheck { settings: &settings, written: Some(written), place, errors: &errors }.check(&axes);
        errors.finish(Some(())).map_or_else(|e| e.to_string(), |()| String::new())
    }

    #[test]
    fn an_unknown_metric_is_reported_at_its_place_with_those_that_exist() {
        assert_eq!(wrong("metrics = ['ate_se3', 'gain_first_pose', 'position']"), "");
        let told = wrong("metrics = ['position', 'ate_se33']");
        assert!(
            told.starts_with("sweep.toml:2:36: unknown metric `ate_se33` (did you mean `ate_se3`?"),
            "{told}"
        );
        let told = wrong("metrics = ['ate']");
        for name in ["unknown metric `ate`", "`rpe_rotation_*`", "`first_pose`", "`iterations`"] {
            assert!(told.contains(name), "{told}");
        }
    }

    #[test]
    fn names_of_columns_and_values_are_checked_at_their_place() {
        assert_eq!(
            wrong("by = ['seed'], clusters = ['seed'], baseline = { model = 'x' }, curve = 'seed'"),
            ""
        );
        for (summary, expected) in [
            ("by = ['seed', 'sede']", "sweep.toml:2:27: unknown column `sede` (did you mean `seed`?"),
            ("baseline = { model = 'z' }", "sweep.toml:2:34: unknown model `z` (there are `x` and `y`)"),
            ("baseline = { modle = 'x' }", "sweep.toml:2:34: unknown column `modle`"),
            ("metrics = ['shape', 'shape']", "sweep.toml:2:33: metric `shape` is given twice"),
            ("by = ['seed', 'seed']", "sweep.toml:2:27: column `seed` is given twice"),
            ("across = 'seed'", "sweep.toml:2:22: what stands side by side has to be kept apart"),
        ] {
            let told = wrong(summary);
            assert!(told.starts_with(expected), "{told}, not {expected}");
        }
    }
}
