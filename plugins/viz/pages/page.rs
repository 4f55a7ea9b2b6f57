//! A page of HTML with everything in it: it opens without a network, and fetches nothing.
use crate::drawing::picture::{Picture, numbered};
use crate::xml::escape;
use std::fmt::Write as _;

/// A page that grows from top to bottom.
#[derive(Debug, Clone)]
pub struct Page {
    title: String,
    body: String,
}

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222}\
h1{font-size:1.6em}h2{margin-top:2em;border-bottom:1px solid #ccc}table{border-collapse:collapse;margin:1em 0;font-size:14px}\
th,td{padding:.25em .7em;border-bottom:1px solid #e5e5e5;text-align:left;vertical-align:top}\
td.n{text-align:right;font-variant-numeric:tabular-nums}div.wide{overflow-x:auto}svg{max-width:100%;height:auto}\
pre{background:#f6f6f6;padding:1em;overflow-x:auto;font-size:13px}details{margin:1em 0}p.note{color:#555}\
li.warning{color:#9a3b00}";

impl Page {
    /// A page with a heading.
    pub fn new(title: &str) -> Self {
        Self { title: title.to_owned(), body: format!("<h1>{}</h1>\n", escape(title)) }
    }

    /// A part without a heading, to be [appended](Self::append) to another.
    pub(crate) fn part() -> Self {
        Self { title: String::new(), body: String::new() }
    }

    /// Adds another page's body.
    pub(crate) fn append(&mut self, part: &Page) -> &mut Self {
        self.push(&part.body)
    }

    /// A heading.
    pub fn heading(&mut self, text: &str) -> &mut Self {
        self.push(&format!("<h2>{}</h2>", escape(text)))
    }

    /// A paragraph.
    pub fn paragraph(&mut self, text: &str) -> &mut Self {
        self.push(&format!("<p class=\"note\">{}</p>", escape(text)))
    }

    /// A list of warnings; nothing for none.
    pub fn warnings(&mut self, texts: &[String]) -> &mut Self {
        let items: String =
            texts.iter().map(|text| format!("<li class=\"warning\">{}</li>", escape(text))).collect();
        if texts.is_empty() { self } else { self.push(&format!("<ul>{items}</ul>")) }
    }

    /// A table; cells that are numbers stand to the right.
    pub fn table(&mut self, header: &[String], rows: &[Vec<String>]) -> &mut Self {
        let mut html = String::from("<div class=\"wide\"><table><thead><tr>");
        // writing to a String does not fail
        header.iter().for_each(|cell| _ = write!(html, "<th>{}</th>", escape(cell)));
        html += "</tr></thead><tbody>\n";
        for row in rows {
            html += "<tr>";
            for cell in row {
                let class = if is_number(cell) { " class=\"n\"" } else { "" };
                let _ = write!(html, "<td{class}>{}</td>", escape(cell));
            }
            html += "</tr>\n";
        }
        self.push(&(html + "</tbody></table></div>"))
    }

    /// A picture.
    pub fn picture(&mut self, picture: &Picture) -> &mut Self {
        self.svg(&picture.part())
    }

    fn svg(&mut self, svg: &str) -> &mut Self {
        // a prolog belongs to files, and not into a page
        let start = svg.find("<svg").unwrap_or(0);
        self.push(&format!("<div class=\"wide\">{}</div>", svg.get(start..).unwrap_or_default()))
    }

    /// A text as it is, such as a config, behind a line that opens it.
    pub fn folded(&mut self, summary: &str, text: &str) -> &mut Self {
        self.push(&format!(
            "<details><summary>{}</summary><pre>{}</pre></details>",
            escape(summary),
            escape(text)
        ))
    }

    fn push(&mut self, html: &str) -> &mut Self {
        self.body += html;
        self.body.push('\n');
        self
    }

    /// The page.
    pub fn html(&self) -> String {
        let (title, body) = (escape(&self.title), numbered(&self.body));
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{title}</title>\n\
             <style>{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n"
        )
    }
}

fn is_number(cell: &str) -> bool {
    cell.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+')
        && cell.chars().filter(char::is_ascii_digit).count() * 2 >= cell.chars().count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_shown_and_not_obeyed() {
        let mut page = Page::new("a < b");
        page.heading("<script>").table(&["x & y".into()], &[vec!["0.125".into(), "cup".into()]]);
        page.svg("<?xml version=\"1.0\"?><svg></svg>").folded("config", "a = \"<b>\"");
        let html = page.html();
        assert!(html.contains("<title>a &lt; b</title>") && !html.contains("<script>"));
        assert!(html.contains("<td class=\"n\">0.125</td><td>cup</td>") && html.contains("x &amp; y"));
        assert!(!html.contains("<?xml") && html.contains("<svg></svg>"));
    }
}
