//! That a run does not write over the map that it reads.
use super::{MAP, variant_folder};
use manifactor_config::{Diagnostics, Errors, Fault};
use manifactor_mapping::settings::run_document::RunDocument;

/// Refuses a run of which a variant reads a map that the run itself writes: one that does not find its place in it would leave a map of
/// its own there, and the one that was read would be lost.
///
/// # Errors
/// Each such map, where the document names it.
pub fn refuse_own_maps(run: &RunDocument) -> Result<(), Diagnostics> {
    let errors = Errors::new();
    let written = run.variants.iter().map(|variant| variant_folder(&run.output, &variant.name).join(MAP));
    // what is not there yet was not read
    let written: Vec<_> = written.filter_map(|file| file.canonicalize().ok()).collect();
    for prior in run.variants.iter().filter_map(|variant| variant.settings.prior_map.as_ref()) {
        let Some(file) = &prior.read_from else { continue };
        if file.canonicalize().is_ok_and(|file| written.contains(&file)) {
            let what = "names a map that this run itself writes, so that it would be lost";
            let help = "choose another folder for the results, with `output` or --out, or copy the map";
            errors.report(file.place.clone(), Fault::with_help(what, help));
        }
    }
    errors.finish(Some(()))
}
