//! StepMania 5 files (`.ssc`), whose charts are rows of tags.

use super::simfiles::SONG;
use crate::song::{Difficulty, Simfile, SongProblem};

const SSC: &str = "\
#VERSION:0.83;
#TITLE:Two\\: the beat;
#ARTIST:Nobody;
#CREDIT:Somebody;
#MUSIC:songs/two.ogg;
#OFFSET:-0.125;
#BPMS:0.000=120.000,
8.000=150.000;
#STOPS:4.000=0.500;
#WARPS:;
#FAKES:;

//---- for two pads ----
#NOTEDATA:;
#STEPSTYPE:dance-double;
#DIFFICULTY:Hard;
#METER:9;
#NOTES:
10000001
00000000
00000000
00000000
;
#NOTEDATA:;
#CHARTNAME:;
#STEPSTYPE:dance-single;
#DIFFICULTY:Easy;
#METER:3;
#RADARVALUES:0.1,0.2,0,0,0;
#BPMS:0.000=120.000,
8.000=150.000;
#NOTES:
1000
0001
02M0
0000
, // measure 2
0000
0300
0000
0011
0000
0000
4000
3000
;
#NOTEDATA:;
#STEPSTYPE:dance-single;
#DIFFICULTY:Challenge;
#METER:10;
#NOTES:1001;
";

#[test]
fn the_same_song_in_both_formats_is_the_same() {
    let ssc = Simfile::parse(SSC).expect("the file has no mistakes");
    let sm = Simfile::parse(SONG).expect("nor has this one");
    assert_eq!(ssc, sm);
}

#[test]
fn charts_with_another_timing_than_the_song_are_skipped() {
    let own = SSC.replace("#BPMS:0.000=120.000,\n8.000=150.000;\n#NOTES", "#BPMS:0.000=90.000;\n#NOTES");
    let song = Simfile::parse(&own).expect("a chart is left");
    assert_eq!(song.charts.iter().map(|chart| chart.difficulty).collect::<Vec<_>>(), [Difficulty::Hard]);
    assert_eq!(song.timing.tempos().collect::<Vec<_>>(), [(0.0, 120.0), (8.0, 150.0)], "that of the song");
}

#[test]
fn mistakes_are_found_in_their_lines() {
    let line_of = |text: &str| SSC.lines().position(|line| line.contains(text)).expect("in the song") + 1;
    let mistake = |old: &str, new: &str| Simfile::parse(&SSC.replacen(old, new, 1)).expect_err("there is a mistake");
    let found = mistake("#METER:3;", "#METER:three;");
    assert_eq!((found.line, found.problem), (line_of("METER:3"), SongProblem::Meter { found: "three".to_owned() }));
    let found = mistake("#DIFFICULTY:Easy;", "");
    assert_eq!(found.problem, SongProblem::Difficulty { found: String::new() });
    let found = mistake("#NOTES:1001;", "");
    assert_eq!(found.problem, SongProblem::NoRows);
    let found = mistake("#WARPS:;", "#WARPS:8.000=4.000;");
    assert_eq!((found.line, found.problem), (line_of("#WARPS"), SongProblem::Warps));
    assert_eq!(mistake("02M0", "02M").line, line_of("02M0"));
}
