//! A self-contained HTML page, which needs no network.
use crate::canvas::{Theme, style_sheet};
use crate::drawing::Picture;
use crate::xml::escape;
use std::fmt::Write as _;

/// A page under construction, from top to bottom.
#[derive(Debug, Clone, Default)]
pub(crate) struct Page {
    title: String,
    body: String,
    scripts: String,
    /// Texts of the headings, in order; the anchor of heading `i` is `section-i`.
    headings: Vec<String>,
    /// Place of the table of contents in the body.
    contents: Option<usize>,
    style: &'static str,
    is_live: bool,
}

const STYLE: &str = include_str!("assets/page.css");
/// Script that shows the values of charts under the pointer. A page with charts adds it.
pub(super) const VALUES: &str = include_str!("assets/values.js");
/// Script that opens folded sections for printing.
pub(super) const PRINT: &str = include_str!("assets/print.js");
/// Content security policy: run the embedded code, and fetch nothing.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:";

/// Additional permissions of a live page, and an empty icon, so that the browser does not request one.
const LIVE: (&str, &str) = ("; connect-src 'self'", "<link rel=\"icon\" href=\"data:,\">\n");

impl Page {
    /// Creates a page with a heading.
    pub(crate) fn new(title: &str) -> Self {
        let body = format!("<h1>{}</h1>\n", escape(title));
        Self { title: title.to_owned(), body, ..Self::default() }
    }

    /// Creates a page that may send requests to its server, with an additional style.
    pub(crate) fn live(title: &str, style: &'static str) -> Self {
        Self { style, is_live: true, ..Self::new(title) }
    }

    /// Adds a heading with an anchor for links.
    pub(crate) fn heading(&mut self, text: &str) -> &mut Self {
        let html = format!("<h2 id=\"section-{}\">{}</h2>", self.headings.len(), escape(text));
        self.headings.push(text.to_owned());
        self.push(&html)
    }

    /// Adds a heading within a section.
    pub(crate) fn subheading(&mut self, text: &str) -> &mut Self {
        self.push(&format!("<h3>{}</h3>", escape(text)))
    }

    /// Adds a paragraph.
    pub(crate) fn paragraph(&mut self, text: &str) -> &mut Self {
        self.push(&format!("<p class=\"note\">{}</p>", escape(text)))
    }

    /// Adds the verdict, the one sentence that a reader takes away.
    pub(crate) fn verdict(&mut self, text: &str) -> &mut Self {
        self.push(&format!("<p class=\"verdict\">{}</p>", escape(text)))
    }

    /// Adds a table of contents with a link to each heading of the finished page.
    pub(crate) fn contents(&mut self) -> &mut Self {
        self.contents = Some(self.body.len());
        self
    }

    /// Adds a list of warnings, or nothing if there are none.
    pub(crate) fn warnings(&mut self, texts: &[String]) -> &mut Self {
        let items: String =
            texts.iter().map(|text| format!("<li class=\"warning\">{}</li>", escape(text))).collect();
        if texts.is_empty() { self } else { self.push(&format!("<ul>{items}</ul>")) }
    }

    /// Adds terms with their definitions, in a section that is closed at first.
    pub(crate) fn definitions(&mut self, summary: &str, list: &[(&str, &str)]) -> &mut Self {
        let items =
            list.iter().map(|(word, text)| format!("<dt>{}</dt><dd>{}</dd>", escape(word), escape(text)));
        let items: String = items.collect();
        let summary = escape(summary);
        let html = format!("<details><summary>{summary}</summary><dl>{items}</dl></details>");
        if list.is_empty() { self } else { self.push(&html) }
    }

    /// Adds links to files by their paths from the page's folder.
    pub(crate) fn files(&mut self, paths: &[String]) -> &mut Self {
        let links = paths.iter().map(|path| format!("<li><a href=\"{0}\">{0}</a></li>", escape(path)));
        let links: String = links.collect();
        self.push(&format!("<ul class=\"files\">{links}</ul>"))
    }

    /// Adds a table; numbers are right-aligned. A long or wide table scrolls in its own box.
    pub(crate) fn table(&mut self, header: &[String], rows: &[Vec<String>]) -> &mut Self {
        self.table_of("wide", header, rows)
    }

    /// Adds a table whose rows become cards on a narrow screen, each cell with the name of its column.
    pub(crate) fn cards(&mut self, header: &[String], rows: &[Vec<String>]) -> &mut Self {
        self.table_of("wide cards", header, rows)
    }

    fn table_of(&mut self, class: &str, header: &[String], rows: &[Vec<String>]) -> &mut Self {
        let mut html = format!("<div class=\"{class}\" tabindex=\"0\"><table><thead><tr>");
        let has_names = class.contains("cards");
        // writing to a String cannot fail
        for (column, cell) in header.iter().enumerate() {
            let cells = || {
                rows.iter()
                    .filter_map(|row| row.get(column))
                    .filter(|cell| !matches!(cell.as_str(), "" | "-"))
            };
            let class = if cells().all(|cell| is_number(cell)) && cells().next().is_some() {
                " class=\"n\""
            } else {
                ""
            };
            let _ = write!(html, "<th scope=\"col\"{class}>{}</th>", escape(cell));
        }
        html += "</tr></thead><tbody>\n";
        for row in rows {
            html += "<tr>";
            for (column, cell) in row.iter().enumerate() {
                let class = if is_number(cell) { " class=\"n\"" } else { "" };
                let name = header.get(column).filter(|_| has_names);
                let name = name.map(|name| format!(" data-name=\"{}\"", escape(name))).unwrap_or_default();
                let _ = write!(html, "<td{class}{name}>{}</td>", escape(cell));
            }
            html += "</tr>\n";
        }
        self.push(&(html + "</tbody></table></div>"))
    }

    /// Adds a picture with a caption.
    pub(crate) fn picture(&mut self, picture: &Picture, caption: &str) -> &mut Self {
        let html = figure(picture, caption);
        self.push(&html)
    }

    /// Adds pictures with captions, side by side if there is room.
    pub(crate) fn pictures<'a>(
        &mut self,
        pictures: impl Iterator<Item = (&'a Picture, String)>,
    ) -> &mut Self {
        let figures: String = pictures.map(|(picture, caption)| figure(picture, &caption)).collect();
        if figures.is_empty() { self } else { self.push(&format!("<div class=\"figures\">{figures}</div>")) }
    }

    /// Adds a preformatted text, such as a config, in a section that is closed at first.
    pub(crate) fn folded(&mut self, summary: &str, text: &str) -> &mut Self {
        self.push(&format!(
            "<details><summary>{}</summary><pre>{}</pre></details>",
            escape(summary),
            escape(text)
        ))
    }

    /// Adds trusted markup and scripts of the program, never foreign text.
    pub(crate) fn own(&mut self, html: &str, scripts: &str) -> &mut Self {
        self.scripts += scripts;
        self.push(html)
    }

    /// Adds data for scripts, in an element with the given `id`.
    pub(crate) fn data(&mut self, id: &'static str, value: &serde_json::Value) -> &mut Self {
        self.push(&format!(
            "<script type=\"application/json\" id=\"{id}\">{}</script>",
            in_script(&value.to_string())
        ))
    }

    fn push(&mut self, html: &str) -> &mut Self {
        self.body += html;
        self.body.push('\n');
        self
    }

    /// Returns the HTML of the page.
    pub(crate) fn html(&self) -> String {
        let title = escape(&self.title);
        let (above, below) = self.body.split_at(self.contents.unwrap_or(0));
        let contents = if self.contents.is_some() { self.table_of_contents() } else { String::new() };
        let (light, dark) = (style_sheet(Theme::Light), style_sheet(Theme::Dark));
        let theme =
            format!(":root{{{light}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}\n");
        let (style, more) = (self.style, if self.is_live { LIVE } else { ("", "") });
        let scripts = match self.scripts.as_str() {
            "" => String::new(),
            scripts => format!("<script>\n{scripts}</script>\n"),
        };
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}{}\">\n{}<title>{title}</title>\n\
             <style>\n{theme}{STYLE}{style}</style>\n</head>\n<body>\n<main>\n{above}{contents}{below}</main>\n{scripts}</body>\n</html>\n",
            more.0, more.1
        )
    }
}

impl Page {
    fn table_of_contents(&self) -> String {
        let link = |(i, text): (usize, &String)| format!("<a href=\"#section-{i}\">{}</a>", escape(text));
        let links: Vec<String> = self.headings.iter().enumerate().map(link).collect();
        format!("<nav class=\"contents\" aria-label=\"contents\">{}</nav>\n", links.join("\n"))
    }
}

fn figure(picture: &Picture, caption: &str) -> String {
    format!(
        "<figure><div class=\"wide\">{}</div><figcaption>{}</figcaption></figure>",
        picture.part(),
        escape(caption)
    )
}

/// Escapes JSON for a script element: sequences that end a script or open a comment, and characters that
/// are not allowed in a page. They occur only in strings, so JSON escapes can replace them.
fn in_script(json: &str) -> String {
    let mut out = String::with_capacity(json.len());
    for c in json.chars() {
        match c {
            '<' | '>' | '&' | '\u{7f}'..='\u{9f}' | '\u{2028}' | '\u{2029}' | '\u{fffe}' | '\u{ffff}' => {
                _ = write!(out, "\\u{:04x}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out
}

fn is_number(cell: &str) -> bool {
    cell.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+')
        && cell.chars().filter(char::is_ascii_digit).count() * 2 >= cell.chars().count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::Ink;
    use serde_json::{Value, json};

    #[test]
    fn what_is_written_is_shown_and_not_obeyed() {
        let mut page = Page::new("a < b");
        page.heading("<script>").table(&["x & y".into()], &[vec!["0.125".into(), "cup".into()]]);
        page.folded("config", "a = \"<b>\"").files(&["\"><b>/a.svg".into()]);
        let html = page.html();
        assert!(html.contains("<title>a &lt; b</title>") && !html.contains("<script>"));
        assert!(html.contains("<td class=\"n\">0.125</td><td>cup</td>") && html.contains("x &amp; y"));
        assert!(!html.contains("<b>"));
    }

    #[test]
    fn each_heading_is_in_the_contents() {
        let mut page = Page::new("run");
        page.contents().heading("Results").heading("a <b>");
        let html = page.html();
        for (i, text) in ["Results", "a &lt;b&gt;"].iter().enumerate() {
            assert!(html.contains(&format!("<a href=\"#section-{i}\">{text}</a>")), "{html}");
            assert!(html.contains(&format!("<h2 id=\"section-{i}\">{text}</h2>")));
        }
        assert!(html.find("<nav").unwrap() < html.find("<h2").unwrap());
        assert!(!Page::new("run").html().contains("<nav"));
    }

    #[test]
    fn a_card_names_its_cells() {
        let mut page = Page::new("run");
        page.cards(&["a \"b\"".into()], &[vec!["0.5".into()]]);
        assert!(page.html().contains("data-name=\"a &quot;b&quot;\">0.5</td>"));
    }

    /// Contrast ratio of two colours, from 1 to 21 (WCAG 2.2, section 1.4.3).
    fn contrast(a: Ink, b: Ink, theme: Theme) -> f64 {
        let luminance = |ink: Ink| {
            let linear = ink.rgb(theme).map(|byte| {
                let share = f64::from(byte) / 255.0;
                if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
            });
            0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
        };
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn texts_and_links_have_the_contrast_of_level_aa() {
        for theme in [Theme::Light, Theme::Dark] {
            for ink in [Ink::Text, Ink::Faint, Ink::Link, Ink::Warning] {
                let ratio = contrast(ink, Ink::Paper, theme);
                assert!(ratio >= 4.5, "{ink:?} on {theme:?}: {ratio:.2}");
            }
        }
        assert!(STYLE.contains("a { color: var(--link) }"));
    }

    #[test]
    fn data_do_not_end_their_script_and_are_read_as_they_were() {
        let nasty = json!({ "</script><b>": "<!-- \u{2028}\u{9b}2J\u{0}\u{ffff} & Tasse ☕" });
        let text = in_script(&nasty.to_string());
        assert!(!text.contains(['<', '>', '&', '\u{9b}', '\u{2028}', '\u{ffff}']), "{text}");
        assert_eq!(serde_json::from_str::<Value>(&text).unwrap(), nasty);
    }
}
