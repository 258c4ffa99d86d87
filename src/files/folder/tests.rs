//! Replacement of results: what is kept, what is refused, and what a process leaves that is killed after any step.

use std::path::{Path, PathBuf};
use std::{fs, io};

use super::*;
use crate::files::disk::kill;
use crate::files::scratch::Scratch;

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// All files under a folder with their texts; the lists are left out.
fn content(folder: &Path) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut waiting = vec![folder.to_owned()];
    while let Some(parent) = waiting.pop() {
        for name in names(&parent) {
            let path = parent.join(&name);
            if path.is_dir() {
                waiting.push(path);
            } else if name != MARKER {
                let name = path.strip_prefix(folder).unwrap().display().to_string();
                found.push((name, fs::read_to_string(&path).unwrap()));
            }
        }
    }
    found.sort();
    found
}

/// Fills a folder as a run does: some names come every time, others once.
fn fill(folder: &Path, run: &str) {
    fs::create_dir_all(folder.join("frames/deep")).unwrap();
    for name in ["report.json", "frames/0.png", "frames/deep/1.png", &format!("only-{run}")] {
        fs::write(folder.join(name), format!("{run} {name}")).unwrap();
    }
    fs::create_dir_all(folder.join(format!("{run}/empty"))).unwrap();
}

fn expected(run: &str) -> Vec<(String, String)> {
    let names = ["frames/0.png".to_owned(), "frames/deep/1.png".into(), format!("only-{run}"), "report.json".into()];
    names.into_iter().map(|name| (name.clone(), format!("{run} {name}"))).collect()
}

fn filled(target: &Path, name: &str) -> OutputFolder {
    let folder = OutputFolder::create(target).unwrap();
    fill(folder.path(), name);
    folder
}

fn run(target: &Path, name: &str) -> Result<PlacedResult, Error> {
    let folder = OutputFolder::create(target)?;
    fill(folder.path(), name);
    folder.commit()
}

/// A folder with the result of a first run.
fn with_first() -> (Scratch, PathBuf) {
    let scratch = Scratch::new();
    let target = scratch.path().join("run");
    run(&target, "first").unwrap();
    (scratch, target)
}

#[test]
fn a_folder_appears_whole_and_replaces_its_own_kind() {
    let scratch = Scratch::new();
    let target = scratch.path().join("deep/run");
    for name in ["first", "second"] {
        let folder = filled(&target, name);
        assert!(!target.join(format!("only-{name}")).exists(), "nothing shows before the commit");
        folder.commit().unwrap();
        assert_eq!(content(&target), expected(name));
    }
    assert_eq!(names(&scratch.path().join("deep")), ["run"], "nothing is left beside it");
    assert_eq!(names(&target), [MARKER, "frames", "only-second", "report.json", "second"]);
}

#[test]
fn a_dropped_folder_leaves_nothing_and_keeps_the_old_one() {
    let scratch = Scratch::new();
    let target = scratch.path().join("deep/run");
    drop(OutputFolder::create(&target).unwrap());
    assert!(names(scratch.path()).is_empty(), "the folders above it vanish too");
    run(&target, "first").unwrap();
    let folder = filled(&target, "second");
    drop(folder);
    assert_eq!(names(target.parent().unwrap()), ["run"]);
    assert_eq!(content(&target), expected("first"));
}

/// What a user may do to a result, and the name that the refusal must say.
type Deed = (&'static str, fn(&Path));
const DEEDS: &[Deed] = &[
    ("notes.txt", |at| fs::write(at.join("notes.txt"), "x").unwrap()),
    ("frames/deep/notes.txt", |at| fs::write(at.join("frames/deep/notes.txt"), "x").unwrap()),
    (".hidden", |at| fs::write(at.join(".hidden"), "x").unwrap()),
    ("mine", |at| fs::create_dir(at.join("mine")).unwrap()),
    ("first/empty/mine", |at| fs::create_dir(at.join("first/empty/mine")).unwrap()),
    ("report.json", |at| fs::write(at.join("report.json"), "longer than it was before").unwrap()),
    // The same length, and the time that it had.
    ("report.json", |at| {
        let time = fs::metadata(at.join("report.json")).unwrap().modified().unwrap();
        fs::write(at.join("report.json"), "FIRST report.json").unwrap();
        fs::File::options().append(true).open(at.join("report.json")).unwrap().set_modified(time).unwrap();
    }),
    ("report.json", |at| {
        fs::remove_file(at.join("report.json")).unwrap();
        fs::create_dir(at.join("report.json")).unwrap();
    }),
    #[cfg(unix)]
    ("frames", |at| {
        fs::rename(at.join("frames"), at.with_file_name("elsewhere")).unwrap();
        std::os::unix::fs::symlink("../elsewhere", at.join("frames")).unwrap();
    }),
    #[cfg(unix)]
    ("report.json", |at| {
        fs::rename(at.join("report.json"), at.with_file_name("elsewhere")).unwrap();
        std::os::unix::fs::symlink("../elsewhere", at.join("report.json")).unwrap();
    }),
    ("holds a .sensel that is no list", |at| {
        let text = fs::read_to_string(at.join(MARKER)).unwrap();
        fs::write(at.join(MARKER), text.replace("only-first", "only-other")).unwrap();
    }),
    ("holds a .sensel that is an older version's", |at| fs::write(at.join(MARKER), "sensel 0.1.0\n").unwrap()),
    ("no .sensel", |at| fs::remove_file(at.join(MARKER)).unwrap()),
];

#[test]
fn nothing_that_a_user_put_into_a_result_or_changed_is_ever_removed() {
    let mut tried = 0;
    for when in ["before", "meanwhile"] {
        for (word, deed) in DEEDS {
            let (scratch, target) = with_first();
            let started = (when == "meanwhile").then(|| OutputFolder::create(&target).unwrap());
            deed(&target);
            let visible = || content(scratch.path()).into_iter().filter(|(name, _)| !name.starts_with(".run."));
            let before: Vec<_> = visible().collect();
            let error = match started {
                None => run(&target, "second").unwrap_err(),
                Some(folder) => {
                    fill(folder.path(), "second");
                    folder.commit().unwrap_err()
                }
            };
            assert_eq!(error.exit_code(), 2, "{error}");
            assert!(error.to_string().contains(word), "{word}: {error}");
            let after: Vec<_> = visible().collect();
            assert!(before.iter().all(|file| after.contains(file)), "{word} {when}: {after:?}");
            // A result that was finished by then is not lost either.
            let finished = scratch.path().join("run.finished-1");
            assert_eq!(finished.exists(), error.to_string().contains("run.finished-1"), "{error}");
            if finished.exists() {
                assert_eq!(content(&finished), expected("second"));
            } else {
                assert_eq!(before, after);
            }
            tried += 1;
        }
    }
    assert!(tried >= 20, "{tried}");
}

#[test]
fn a_result_with_missing_files_is_replaced() {
    let (scratch, target) = with_first();
    fs::remove_dir_all(target.join("frames")).unwrap();
    fs::remove_file(target.join("report.json")).unwrap();
    run(&target, "second").unwrap();
    assert_eq!(content(&target), expected("second"));
    assert_eq!(names(scratch.path()), ["run"]);
}

#[test]
fn folders_and_files_of_others_are_refused_untouched() {
    let scratch = Scratch::new();
    let target = scratch.path().join("photos");
    fs::create_dir(&target).unwrap();
    fs::write(target.join("cat.jpg"), "x").unwrap();
    let error = OutputFolder::create(&target).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().contains("photos"), "{error}");
    assert_eq!(names(&target), ["cat.jpg"]);
    assert_eq!(OutputFolder::create(&target.join("cat.jpg")).unwrap_err().exit_code(), 2);
    // Taken by somebody else between creation and commit.
    let late = scratch.path().join("late");
    let folder = OutputFolder::create(&late).unwrap();
    fs::create_dir(&late).unwrap();
    fs::write(late.join("theirs"), "x").unwrap();
    assert!(folder.commit().unwrap_err().to_string().contains("late.finished-1"));
    assert_eq!(names(&late), ["theirs"]);
    assert_eq!(names(scratch.path()), ["late", "late.finished-1", "photos"]);
}

#[test]
fn of_two_that_write_to_one_target_at_once_the_second_is_refused() {
    let scratch = Scratch::new();
    let target = scratch.path().join("run");
    let first = OutputFolder::create(&target).unwrap();
    let error = OutputFolder::create(&target).unwrap_err().to_string();
    assert!(error.contains("being written by another process"), "{error}");
    drop(OutputFolder::create(&scratch.path().join("run2")).unwrap());
    fill(first.path(), "first");
    first.commit().unwrap();
    run(&target, "second").unwrap();
    assert_eq!(names(scratch.path()), ["run"]);
}

#[test]
fn many_that_write_side_by_side_into_a_folder_that_comes_and_goes_all_succeed() {
    let scratch = Scratch::new();
    let deep = scratch.path().join("a/b/c");
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let target = deep.join(format!("run{thread}"));
            scope.spawn(move || {
                for _ in 0..20 {
                    OutputFolder::check(&target).unwrap();
                    check_file(&target.with_extension("csv")).unwrap();
                }
            });
        }
    });
    // Folders on the way that one has made and another was using may stay, empty.
    assert!(content(scratch.path()).is_empty());
    run(&deep.join("run"), "first").unwrap();
}

#[test]
fn a_file_that_appears_in_the_last_moment_is_kept_and_named() {
    fn exchange(new: &Path, old: &Path) -> io::Result<()> {
        fs::write(old.join("frames/notes.txt"), "mine")?;
        crate::files::disk::exchange(new, old)?;
        // Somebody still stands in the old folder, and changes a file.
        fs::write(new.join("report.json"), "mine too")
    }
    let (scratch, target) = with_first();
    let folder = filled(&target, "second");
    let placed = folder.commit_by(exchange).unwrap();
    let root = fs::canonicalize(scratch.path()).unwrap();
    assert_eq!((placed.folder, placed.kept), (root.join("run"), vec![root.join("run.kept-1")]));
    let kept = [("frames/notes.txt", "mine"), ("report.json", "mine too")].map(|(a, b)| (a.to_owned(), b.to_owned()));
    assert_eq!(content(&scratch.path().join("run.kept-1")), kept);
    assert_eq!(content(&target), expected("second"));
}

#[cfg(unix)]
#[test]
fn a_replaced_folder_keeps_its_permissions() {
    use std::os::unix::fs::PermissionsExt as _;
    let scratch = Scratch::new();
    let target = scratch.path().join("run");
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o7777;
    let mut tried = 0;
    for wanted in [0o700, 0o2775, 0o1777, 0o750] {
        // Once an empty folder, then a result.
        let _ = fs::create_dir(&target);
        fs::set_permissions(&target, fs::Permissions::from_mode(wanted)).unwrap();
        run(&target, "first").unwrap();
        assert_eq!(mode(&target), wanted);
        tried += 1;
    }
    assert_eq!(tried, 4);
    fs::set_permissions(&target, fs::Permissions::from_mode(0o555)).unwrap();
    assert!(run(&target, "second").unwrap_err().to_string().contains("write-protected"));
    fs::set_permissions(&target, fs::Permissions::from_mode(0o755)).unwrap();
    let file = scratch.path().join("table.csv");
    fs::write(&file, "x").unwrap();
    fs::set_permissions(&file, fs::Permissions::from_mode(0o604)).unwrap();
    replace_file(&file, b"y").unwrap();
    assert_eq!((mode(&file), fs::read_to_string(&file).unwrap().as_str()), (0o604, "y"));
    fs::set_permissions(&file, fs::Permissions::from_mode(0o444)).unwrap();
    assert!(replace_file(&file, b"z").unwrap_err().to_string().contains("write-protected"));
    assert!(check_file(&file).is_err() && fs::read_to_string(&file).unwrap() == "y");
}

/// Names that look like this program's, but whose content does not.
#[test]
fn what_only_looks_like_a_leftover_is_left_alone() {
    let scratch = Scratch::new();
    let target = scratch.path().join("run");
    let theirs = [".run.building-1-0", ".run.old-7-3", ".run.building-x", ".run2.building-1-0"];
    for name in theirs {
        fs::create_dir(scratch.path().join(name)).unwrap();
        fs::write(scratch.path().join(name).join("thesis.tex"), "x").unwrap();
    }
    fs::write(scratch.path().join(".run.old-7-3").join(MARKER), "sensel 0.1.0\n").unwrap();
    fs::write(scratch.path().join(".run.building-8-8"), "a file").unwrap();
    fs::write(scratch.path().join(".run.sensel-lock"), "a user's text").unwrap();
    let before = content(scratch.path());
    run(&target, "first").unwrap();
    run(&target, "second").unwrap();
    let after = content(scratch.path());
    assert!(before.iter().all(|file| after.contains(file)), "{after:?}");
}

/// How a result is replaced.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Swap {
    Exchange,
    TwoRenames,
    Contents,
}

fn no_exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

fn replace(target: &Path, name: &str, swap: Swap) -> Result<PlacedResult, Error> {
    let folder = match swap {
        Swap::Contents => OutputFolder::create_where(target, |_| true)?,
        _ => OutputFolder::create(target)?,
    };
    // A killed process fills nothing.
    if folder.path().exists() {
        fill(folder.path(), name);
    }
    folder.commit_by(if swap == Swap::TwoRenames { no_exchange } else { crate::files::disk::exchange })
}

/// The states that a kill after any step leaves: a result that is old or new and whole, and a next run that is whole and leaves nothing.
#[test]
fn a_process_that_is_killed_after_any_step_leaves_the_old_or_the_new_result() {
    for (swap, earlier) in [
        (Swap::Exchange, "absent"),
        (Swap::Exchange, "empty"),
        (Swap::Exchange, "first"),
        (Swap::TwoRenames, "first"),
        (Swap::Contents, "empty"),
        (Swap::Contents, "first"),
    ] {
        let mut states = std::collections::BTreeSet::new();
        let mut killed = 0;
        for steps in 0.. {
            let scratch = Scratch::new();
            let target = scratch.path().join("run");
            match earlier {
                "empty" => fs::create_dir(&target).unwrap(),
                "first" => drop(run(&target, "first").unwrap()),
                _ => {}
            }
            kill::after(steps);
            let outcome = replace(&target, "second", swap);
            let was_killed = kill::off();
            let found = if target.exists() { content(&target) } else { Vec::new() };
            let is_visible = |name: &str| !name.starts_with('.');
            let visible: Vec<_> = found.iter().filter(|(name, _)| is_visible(name)).cloned().collect();
            let state = match visible {
                visible if visible == expected("second") => "new",
                visible if visible == expected("first") => "old",
                visible if visible.is_empty() => "none",
                _ => "between",
            };
            states.insert(state);
            let may_be_between = match swap {
                Swap::Exchange => earlier != "first" && state == "none",
                // The target is missing between the two renames.
                Swap::TwoRenames => state == "none",
                Swap::Contents => true,
            };
            assert!(["new", "old"].contains(&state) || may_be_between, "{swap:?} {earlier} {steps}: {found:?}");
            // Whichever way the next one takes.
            let next = [Swap::Exchange, Swap::Contents][steps as usize % 2];
            if next == Swap::Contents && !target.exists() {
                drop(OutputFolder::create(&target).unwrap());
            }
            if earlier == "first" && state == "none" {
                assert!(target.exists(), "{swap:?} {steps}: the old result is put back");
            }
            if target.exists() {
                let placed = replace(&target, "third", next).unwrap();
                assert_eq!(placed.kept, Vec::<PathBuf>::new());
            } else {
                run(&target, "third").unwrap();
            }
            assert_eq!(content(&target), expected("third"), "{swap:?} {earlier} {steps}");
            assert_eq!(names(scratch.path()), ["run"], "{swap:?} {earlier} {steps}");
            assert_eq!(names(&target).len(), 5, "{:?}", names(&target));
            killed += usize::from(was_killed);
            if !was_killed {
                outcome.unwrap();
                break;
            }
        }
        assert!(killed > 10, "{swap:?} {earlier}: {killed}");
        assert!(states.contains("new"), "{swap:?} {earlier}: {states:?}");
        assert_eq!(states.contains("old"), earlier == "first", "{swap:?} {earlier}: {states:?}");
    }
}

/// A next run that only looks repairs as well, and a kill during the repair is repaired again.
#[test]
fn a_process_that_is_killed_while_it_repairs_is_repaired() {
    for swap in [Swap::Exchange, Swap::TwoRenames, Swap::Contents] {
        let mut tried = 0;
        for steps in (5..50).step_by(5) {
            for more in (0..12).step_by(2) {
                let (scratch, target) = with_first();
                fs::create_dir(scratch.path().join(".run.building-1-1")).unwrap();
                for (count, name) in [(steps, "second"), (more, "third")] {
                    kill::after(count);
                    let _ = replace(&target, name, swap);
                    kill::off();
                }
                OutputFolder::check(&target).unwrap();
                let found = content(&target);
                let is_whole = ["first", "second", "third"].iter().any(|name| found == expected(name));
                assert!(is_whole, "{swap:?} {steps} {more}: {found:?}");
                assert_eq!(names(scratch.path()), ["run"], "{swap:?} {steps} {more}");
                tried += 1;
            }
        }
        assert!(tried >= 50, "{tried}");
    }
}

#[test]
fn what_a_user_put_into_a_killed_swap_is_kept() {
    for steps in 0..40 {
        let (scratch, target) = with_first();
        kill::after(steps);
        let _ = replace(&target, "second", Swap::Contents);
        kill::off();
        fs::create_dir_all(target.join("frames")).unwrap();
        fs::write(target.join("frames/notes.txt"), "mine").unwrap();
        fs::write(target.join("only-second"), "mine as well").unwrap();
        let _ = replace(&target, "third", Swap::Contents);
        let texts: Vec<String> = content(scratch.path()).into_iter().map(|(_, text)| text).collect();
        for text in ["mine", "mine as well"] {
            assert!(texts.iter().any(|found| found == text), "{steps}: '{text}' in {:?}", content(scratch.path()));
        }
    }
}

#[test]
fn a_file_is_replaced_whole_and_leaves_nothing_beside_it() {
    let scratch = Scratch::new();
    let target = scratch.path().join("deep/wave.vcd");
    check_file(&target).unwrap();
    assert!(names(scratch.path()).is_empty());
    for content in ["first", "second"] {
        replace_file(&target, content.as_bytes()).unwrap();
        assert_eq!(fs::read_to_string(&target).unwrap(), content);
    }
    assert_eq!(names(target.parent().unwrap()), ["wave.vcd"]);
    assert_eq!(replace_file(target.parent().unwrap(), b"").unwrap_err().exit_code(), 4);
    assert_eq!(names(target.parent().unwrap()), ["wave.vcd"]);
    for steps in 0.. {
        kill::after(steps);
        let done = replace_file(&target, format!("{steps}").as_bytes());
        let was_killed = kill::off();
        let found = fs::read_to_string(&target).unwrap();
        assert!(found == format!("{steps}") || found == "second", "{steps}: {found}");
        replace_file(&target, b"second").unwrap();
        assert_eq!(names(target.parent().unwrap()), ["wave.vcd"], "{steps}");
        if !was_killed {
            done.unwrap();
            assert!(steps > 5);
            break;
        }
    }
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_written_to_and_never_replaced() {
    use std::os::unix::fs::FileTypeExt as _;
    let scratch = Scratch::new();
    let fifo = scratch.pipe("fifo");
    assert_eq!(replace_file(&fifo, b"x").unwrap_err().exit_code(), 4, "nobody reads it, and nobody waits");
    let reader = fifo.clone();
    let reader = std::thread::spawn(move || fs::read_to_string(reader).unwrap());
    // More than a pipe holds, so that writing has to wait for the reader.
    let text = "x".repeat(1 << 20);
    while replace_file(&fifo, text.as_bytes()).is_err() {
        std::thread::yield_now();
    }
    assert_eq!(reader.join().unwrap(), text);
    assert!(fs::metadata(&fifo).unwrap().file_type().is_fifo());
    replace_file(Path::new("/dev/null"), b"x").unwrap();
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    assert_eq!(names(scratch.path()), ["fifo"]);
}
