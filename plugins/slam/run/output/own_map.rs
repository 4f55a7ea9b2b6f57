//! Check that a run does not overwrite the map that it reads.
use super::{MAP_FILE, variant_folder};
use manifactor_config::{Diagnostics, Errors, Fault};
use manifactor_mapping::settings::run_document::RunDocument;

/// Refuses a run if a variant reads a map that the run itself writes. If relocalization failed, the run would
/// replace this map by a new one, and the map would be lost.
///
/// # Errors
/// All such maps, each at its position in the document.
pub fn refuse_own_maps(run: &RunDocument) -> Result<(), Diagnostics> {
    let errors = Errors::new();
    let written =
        run.variants.iter().map(|variant| variant_folder(&run.output, &variant.name).join(MAP_FILE));
    // a file that does not exist yet was not read
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
