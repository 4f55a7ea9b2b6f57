//! The page of a growing map: it draws each state that its server sends.
use super::page::Page;
use super::run_page::version;
use super::viewer;

const MARKUP: &str = include_str!("assets/live.html");
const STYLE: &str = include_str!("assets/live.css");
const SCRIPTS: [&str; 2] = [include_str!("assets/latencies.js"), include_str!("assets/live.js")];

/// Returns the page. It requests `events` next to it, with its own query: server-sent events, each with the
/// [JSON](crate::LiveMap::to_json) of a whole state.
pub fn live_page() -> String {
    let mut page = Page::live("Live map", STYLE);
    let [state, facts] = parts();
    page.own(state, "").own(viewer::MARKUP, &viewer::VIEW.concat());
    page.own("", viewer::MAP).own(facts, &SCRIPTS.concat());
    page.paragraph(&version());
    page.html()
}

/// Splits the markup into the parts above and below the map.
fn parts() -> [&'static str; 2] {
    MARKUP.split_once("<!-- map -->\n").map_or([MARKUP, ""], |(above, below)| [above, below])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_may_ask_its_own_server_and_nobody_else() {
        let html = live_page().replace("http://www.w3.org/2000/svg", "a name");
        assert!(html.contains("default-src 'none';") && html.contains("connect-src 'self'\""));
        assert!(!super::super::page::Page::new("report").html().contains("connect-src"));
        for attribute in ["src=", "href=\"http", "url(", "@import", "innerHTML", "https:", "http:"] {
            assert!(!html.contains(attribute), "{attribute}");
        }
    }

    #[test]
    fn the_map_stands_in_the_middle() {
        let html = live_page();
        let place = |text: &str| html.find(text).unwrap_or_else(|| panic!("no {text}"));
        assert!(
            place("id=\"phase\"") < place("id=\"canvas\"") && place("id=\"canvas\"") < place("id=\"notes\"")
        );
    }
}
