//! The output in `docs/mistakes.md` is the real output.
use crate::{folder, root};
use std::process::Command;

/// A fenced block, and the line before it.
struct Block<'a> {
    language: &'a str,
    text: String,
    before: &'a str,
}

fn blocks(page: &str) -> Vec<Block<'_>> {
    let (mut blocks, mut open, mut before) = (vec![], None, "");
    for line in page.lines() {
        match (line.strip_prefix("```"), open.take()) {
            (Some(language), None) => open = Some(Block { language, text: String::new(), before }),
            (Some(_), Some(block)) => blocks.push(block),
            (None, Some(Block { language, text, before })) => {
                open = Some(Block { language, text: text + line + "\n", before });
            }
            (None, None) => before = line,
        }
    }
    blocks
}

/// Returns the output of a command in the folder of the graph.
fn printed(command: &str, graph: &str) -> String {
    let folder = folder(&[("graph.toml", graph)]);
    let words = command.split_whitespace().skip(1);
    let mut binary = Command::new(env!("CARGO_BIN_EXE_manifactor"));
    let output = binary.args(words).current_dir(folder.path()).env("NO_COLOR", "1").output().unwrap();
    let text =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    text.lines()
        .map(|line| line.trim_end().to_owned() + "\n")
        .collect::<String>()
        .trim_matches('\n')
        .to_owned()
}

#[test]
fn every_message_of_the_page_is_printed() {
    let page = std::fs::read_to_string(root().join("docs/mistakes.md")).unwrap();
    let (mut graph, mut commands, mut messages) = (String::new(), 0, 0);
    for block in blocks(&page) {
        match block.language {
            "toml" => graph = block.text,
            "console" => {
                let (command, expected) = block.text.split_once('\n').unwrap();
                let now = printed(command.trim_start_matches("$ "), &graph);
                assert_eq!(expected.trim_end(), now, "\n{command} prints:\n{now}\n");
                commands += 1;
            }
            "text" if block.before.starts_with("<!--") => {
                let file = block.before.trim_start_matches("<!-- ").trim_end_matches(" -->");
                let message = std::fs::read_to_string(root().join(file)).unwrap();
                assert_eq!(block.text.trim_end(), message.trim_end(), "{file}");
                messages += 1;
            }
            _ => {}
        }
    }
    assert_eq!((commands, messages), (6, 3));
}
