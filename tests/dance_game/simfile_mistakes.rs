//! StepMania files with mistakes: the line, what is expected, and that nothing panics.

use super::simfiles::SONG;
use crate::{
    random::Random,
    song::{Lane, Mistake, Simfile, SimfileError, SongProblem},
};

/// Number of damaged files that are read.
const DAMAGED_FILES: usize = 2_000;

/// Returns the mistake in the song after a text in it was replaced.
#[track_caller]
fn mistake(old: &str, new: &str) -> Mistake {
    assert!(SONG.contains(old), "{old} is not in the song");
    Simfile::parse(&SONG.replacen(old, new, 1)).expect_err("there is a mistake")
}

/// Returns the line in which a text is, from 1.
fn line_of(text: &str) -> usize {
    SONG.lines().position(|line| line.contains(text)).expect("the text is in the song") + 1
}

#[test]
fn a_missing_semicolon_is_found_at_the_tag_that_lacks_it() {
    let found = mistake("#OFFSET:-0.125;", "#OFFSET:-0.125");
    assert_eq!(found, Mistake { line: 6, problem: SongProblem::Unclosed { tag: "OFFSET".to_owned() } });
    // The last one in the file.
    let found = mistake("1001;", "1001");
    assert_eq!(found.problem, SongProblem::Unclosed { tag: "NOTES".to_owned() });
    assert_eq!(found.line, SONG.lines().count() - 6);
}

#[test]
fn numbers_that_are_none_are_found_with_their_tag() {
    let found = mistake("8.000=150.000", "8.000=fast");
    let problem = SongProblem::Number { tag: "BPMS".to_owned(), found: "fast".to_owned() };
    assert_eq!(found, Mistake { line: line_of("8.000=150"), problem });
    let found = mistake("4.000=0.500", "4.000");
    assert_eq!(found.problem, SongProblem::Pair { tag: "STOPS".to_owned(), found: "4.000".to_owned() });
    assert!(matches!(mistake("-0.125", "-0,125").problem, SongProblem::Number { .. }));
    assert!(matches!(mistake("-0.125", "inf").problem, SongProblem::Offset(_)));
    assert_eq!(mistake("4.000=0.5", "-4=0.5").problem, SongProblem::Beat { tag: "STOPS".to_owned(), beat: -4.0 });
}

#[test]
fn lines_are_counted_through_comments_and_escapes() {
    let text = SONG.replace("#TITLE:Two", "//;#:\n#TITLE:T\\\nw\no");
    let found = Simfile::parse(&text.replace("8.000=150", "8.000=fast")).expect_err("there is a mistake");
    assert_eq!(found.line, line_of("8.000=150") + 3);
}

#[test]
fn a_song_without_tempo_at_beat_0_is_a_mistake() {
    let found = mistake("0.000=120.000", "1.000=120.000");
    assert_eq!(found, Mistake { line: 7, problem: SongProblem::NoFirstTempo { first_beat: Some(1.0) } });
    assert_eq!(mistake("#BPMS", "#BPM").problem, SongProblem::NoFirstTempo { first_beat: None });
}

#[test]
fn old_tricks_that_skip_beats_are_mistakes() {
    let found = mistake("8.000=150.000", "8.000=-150.000");
    assert_eq!(found, Mistake { line: 8, problem: SongProblem::Tempo { beat: 8.0, bpm: -150.0 } });
    assert!(matches!(mistake("4.000=0.500", "4.000=-0.5").problem, SongProblem::Pause { .. }));
}

#[test]
fn rows_of_other_widths_are_found_in_their_line() {
    for row in ["000", "00010", "0 01"] {
        let found = mistake("\n0001\n", &format!("\n{row}\n"));
        let problem = SongProblem::Columns { found: row.to_owned() };
        let expected = if row == "0 01" { SongProblem::NoteKind { row: row.to_owned(), found: ' ' } } else { problem };
        assert_eq!(found, Mistake { line: line_of("// measure 1") + 2, problem: expected }, "{row}");
    }
}

#[test]
fn holds_have_two_ends() {
    let lane = Lane::Down;
    let found = mistake("\n0300\n", "\n0000\n");
    assert_eq!(found, Mistake { line: line_of("02M0"), problem: SongProblem::HoldWithoutEnd { lane } });
    assert_eq!(mistake("\n02M0\n", "\n0000\n").problem, SongProblem::EndWithoutHold { lane });
    assert_eq!(mistake("\n0300\n", "\n0100\n").problem, SongProblem::WithinHold { lane });
}

#[test]
fn other_kinds_of_notes_are_mistakes() {
    let found = mistake("\n02M0\n", "\n02L0\n");
    let problem = SongProblem::NoteKind { row: "02L0".to_owned(), found: 'L' };
    assert_eq!(found, Mistake { line: line_of("02M0"), problem });
}

#[test]
fn numbers_of_rows_divide_192() {
    let found = mistake("\n0300\n", "\n0300\n0000\n");
    assert_eq!(found, Mistake { line: line_of("0300") - 1, problem: SongProblem::MeasureRows { found: 9 } });
}

#[test]
fn headers_of_charts_are_checked() {
    assert_eq!(mistake("  :\n1001", "1001").problem, SongProblem::ChartParts { found: 5 });
    let found = mistake("Easy:", "Cosy:");
    let problem = SongProblem::Difficulty { found: "Cosy".to_owned() };
    assert_eq!(found, Mistake { line: line_of("Easy:"), problem });
    assert_eq!(mistake("  3:", "  three:").problem, SongProblem::Meter { found: "three".to_owned() });
    let text = SONG.replace("dance-single", "pump-single");
    let found = Simfile::parse(&text).expect_err("no chart can be danced");
    assert_eq!(found, Mistake { line: SONG.lines().count(), problem: SongProblem::NoChart });
    assert_eq!(Simfile::parse("").expect_err("there is nothing").line, 1);
}

#[test]
fn messages_name_file_line_and_remedy() {
    let folder = std::env::temp_dir().join(format!("dance_game_{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("the folder for temporary files can be written to");
    let file = folder.join("song.sm");
    std::fs::write(&file, SONG.replace("8.000=150", "8.000=-150")).expect("the folder can be written to");
    let message = Simfile::open(&file).expect_err("there is a mistake").to_string();
    let missing = Simfile::open(&folder.join("none.sm")).expect_err("there is no such file");
    std::fs::write(&file, [b"#ARTIST:Beyonc\xe9;\n", SONG.replace("#ARTIST", "#OTHER").as_bytes()].concat())
        .expect("the folder can be written to");
    let latin = Simfile::open(&file).expect("titles of old files are read");
    std::fs::remove_dir_all(&folder).expect("the folder is the test's own");
    for part in ["song.sm, line 8: ", "#BPMS", "-150 at beat 8", "write 0.001 to 9999999"] {
        assert!(message.contains(part), "{part} is not in: {message}");
    }
    assert!(matches!(missing, SimfileError::Unreadable { .. }));
    assert!(missing.to_string().contains("none.sm"), "{missing}");
    assert_eq!(latin.artist, "Beyonc\u{fffd}");
}

#[test]
fn damaged_files_are_read_or_are_mistakes_within_them() {
    let mut random = Random::new(3);
    let mut mistakes = 0;
    for _ in 0..DAMAGED_FILES {
        let mut bytes = SONG.as_bytes().to_vec();
        if random.unit() < 0.3 {
            bytes.truncate(random.below(bytes.len()));
        }
        for _ in 0..random.below(6) {
            let place = random.below(bytes.len());
            if let Some(byte) = bytes.get_mut(place) {
                *byte = random.bits() as u8;
            }
        }
        let text = String::from_utf8_lossy(&bytes);
        match Simfile::parse(&text) {
            // What can be read can be written and is the same then.
            Ok(song) => {
                let again = Simfile::parse(&song.to_sm()).expect("the song has no mistakes");
                assert_eq!((again.timing, again.charts), (song.timing, song.charts));
            }
            Err(mistake) => {
                mistakes += 1;
                assert!(mistake.line >= 1 && mistake.line <= text.split('\n').count(), "{mistake:?}\n{text}");
                assert!(!mistake.problem.to_string().is_empty());
            }
        }
    }
    assert!(mistakes > DAMAGED_FILES / 4, "only {mistakes} of the damaged files have mistakes");
}
