//! docs/tutorial.md is true: each command runs, and prints the lines that the page shows.

#![allow(clippy::unwrap_used)]

use std::process::Command;

use crate::common::{Scratch, outcome};

/// Letters of a shown line that a command's output must hold: names and words, before the first figure.
fn first_words(line: &str) -> String {
    line.chars().take_while(|letter| !letter.is_ascii_digit()).collect::<String>().trim().to_owned()
}

/// Blocks between fences: what stands after the opening fence, and the lines.
fn blocks(page: &str) -> Vec<(String, Vec<&str>)> {
    let (mut found, mut open): (Vec<(String, Vec<&str>)>, bool) = (Vec::new(), false);
    for line in page.lines() {
        match line.strip_prefix("```") {
            Some(_) if open => open = false,
            Some(kind) => {
                open = true;
                found.push((kind.to_owned(), Vec::new()));
            }
            None if open => found.last_mut().unwrap().1.push(line),
            None => {}
        }
    }
    found
}

#[test]
fn every_command_of_the_tutorial_runs_and_prints_what_the_page_shows() {
    let root = env!("CARGO_MANIFEST_DIR");
    let page = std::fs::read_to_string(format!("{root}/docs/tutorial.md")).unwrap();
    let scratch = Scratch::new("tutorial");
    let (mut printed, mut commands, mut lines) = (String::new(), 0, 0);
    for (kind, text) in blocks(&page) {
        if let Some(file) = kind.strip_prefix("toml ") {
            std::fs::write(scratch.path().join(file), text.join("\n")).unwrap();
        } else if kind == "sh" {
            printed.clear();
            for line in text {
                let (words, comment) = line.split_once('#').unwrap_or((line, ""));
                let words: Vec<&str> = words.split_whitespace().collect();
                assert_eq!(words[0], "sensel", "{line}");
                let mut command = Command::new(env!("CARGO_BIN_EXE_sensel"));
                command.args(&words[1..]).args(["--scenes", &format!("{root}/scenes")]);
                command.args(["--cache", concat!(env!("CARGO_TARGET_TMPDIR"), "/cache")]).current_dir(scratch.path());
                let done = outcome(command);
                let code = comment.trim().strip_prefix("exit code ").map_or(0, |code| code.parse().unwrap());
                assert_eq!(done.code, code, "{line}: {}", done.stderr);
                printed += &done.stdout;
                commands += 1;
            }
        } else if kind == "text" {
            for line in text {
                let words = first_words(line);
                assert!(printed.contains(&words), "the output does not hold '{words}':\n{printed}");
                lines += 1;
            }
        }
    }
    assert!(commands >= 7 && lines >= 30, "{commands} commands, {lines} lines");
}
