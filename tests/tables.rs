//! Tables in the docs that experiments make are of the experiments as they are.
use manifactor::config::Document;
use manifactor::slam::experiment::{Experiment, page_tables};
use std::path::Path;

#[test]
fn no_table_of_the_docs_is_stale() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let mut tables = 0;
    let folders = [docs.clone(), docs.join("decisions")];
    let pages = folders.iter().flat_map(|folder| std::fs::read_dir(folder).unwrap());
    for path in pages.map(|entry| entry.unwrap().path()) {
        let Ok(page) = std::fs::read_to_string(&path) else { continue };
        for table in page_tables(&page) {
            let document = Document::open(path.with_file_name(&table.experiment)).unwrap();
            let digest = Experiment::read(&document).unwrap().digest();
            let (page, experiment) = (path.file_name().unwrap().to_string_lossy(), &table.experiment);
            assert_eq!(
                table.digest,
                Some(digest),
                "docs/{page} has a stale table: manifactor experiment {experiment} --markdown docs/{page}"
            );
            tables += 1;
        }
    }
    assert!(tables >= 5, "{tables} tables are marked");
}
