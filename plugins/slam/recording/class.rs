//! Names of classes, and their synonyms.
use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Spellings of detectors and data sets, with the names that COCO's own papers print.
const CLASS_SYNONYMS: [(&str, &str); 12] = [
    ("tvmonitor", "tv monitor"),
    ("tv", "tv monitor"),
    ("monitor", "tv monitor"),
    ("pottedplant", "potted plant"),
    ("diningtable", "dining table"),
    ("couch", "sofa"),
    ("cellphone", "cell phone"),
    ("mobile phone", "cell phone"),
    ("wineglass", "wine glass"),
    ("teddybear", "teddy bear"),
    ("aeroplane", "airplane"),
    ("motorbike", "motorcycle"),
];

/// Class names that stand for other names, in addition to the built-in ones: `{ "desk lamp" = "lamp" }`.
///
/// Case, underscores and hyphens make no difference: `Cell_Phone` is `cell phone`. `tvmonitor`,
/// `pottedplant`, `couch` and similar names are built in.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(rename = "Aliases")]
pub struct ClassAliases(
    #[schemars(with = "std::collections::HashMap<String, String>")] pub IndexMap<String, String>,
);

impl ClassAliases {
    /// Returns the unique name of a class.
    pub fn canonical(&self, name: &str) -> String {
        let name = plain(name);
        let own = self.0.iter().find(|(alias, _)| plain(alias) == name).map(|(_, class)| plain(class));
        own.or_else(|| shipped_synonym(&name)).unwrap_or(name)
    }
}

fn shipped_synonym(name: &str) -> Option<String> {
    CLASS_SYNONYMS.iter().find(|(alias, _)| *alias == name).map(|(_, class)| (*class).to_owned())
}

fn plain(name: &str) -> String {
    let spaced = name.to_lowercase().replace(['_', '-'], " ");
    spaced.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings_of_one_class_have_one_name() {
        let aliases = ClassAliases::default();
        for name in ["tvmonitor", "TV", "tv_monitor", "Tv  Monitor"] {
            assert_eq!(aliases.canonical(name), "tv monitor");
        }
        assert_eq!(aliases.canonical("Sports-Ball"), "sports ball");
    }

    #[test]
    fn an_alias_of_ones_own_goes_first() {
        let aliases = ClassAliases(IndexMap::from([("TV".to_owned(), "Television".to_owned())]));
        assert_eq!(aliases.canonical("tv"), "television");
        assert_eq!(aliases.canonical("tvmonitor"), "tv monitor");
    }

    #[test]
    fn no_shipped_alias_leads_to_another() {
        for (alias, class) in CLASS_SYNONYMS {
            assert_eq!(plain(alias), alias);
            assert_eq!(shipped_synonym(class), None);
        }
    }
}
