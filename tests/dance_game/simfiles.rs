//! StepMania files: what is read, and that what is written is read as the same.

use crate::{
    random::Random,
    song::{
        Difficulty, Lane, Note, Pause, PauseKind, ROWS_PER_BEAT, ROWS_PER_MEASURE, Row, Simfile, StepChart,
        TempoChange, Timing,
    },
};

/// A file with all that is read.
pub(crate) const SONG: &str = "\
// made by hand
#TITLE:Two\\: the beat;
#ARTIST:Nobody;
#CREDIT:Somebody;
#MUSIC:songs/two.ogg;
#OFFSET:-0.125;
#BPMS:0.000=120.000,
8.000=150.000; // faster
#STOPS:4.000=0.500;
#DELAYS:;
#BGCHANGES:;

//---- for two pads ----
#NOTES:
  dance-double:
  :
  Hard:
  9:
  0,0,0,0,0:
10000001
00000000
00000000
00000000
;
#NOTES:
  dance-single:
  Somebody:
  Easy:
  3:
  0.1,0.2,0,0,0:
// measure 1
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
#NOTES:
  dance-single:
  :
  Challenge:
  10:
  :
1001;
";

fn notes(simfile: &Simfile, chart: usize) -> Vec<Note> {
    simfile.charts[chart].notes().to_vec()
}

#[test]
fn a_file_is_read_with_titles_timing_and_charts() {
    let song = Simfile::parse(SONG).expect("the file has no mistakes");
    let titles = [&song.title, &song.artist, &song.credit, &song.music];
    assert_eq!(titles, ["Two: the beat", "Nobody", "Somebody", "songs/two.ogg"]);
    assert_eq!(song.timing.offset_seconds(), -0.125);
    assert_eq!(song.timing.tempos().collect::<Vec<_>>(), [(0.0, 120.0), (8.0, 150.0)]);
    assert_eq!(song.timing.pauses(PauseKind::Stop).collect::<Vec<_>>(), [(4.0, 0.5)]);
    assert_eq!(song.timing.pauses(PauseKind::Delay).count(), 0);
    let charts: Vec<_> = song.charts.iter().map(|chart| (chart.difficulty, chart.meter)).collect();
    assert_eq!(charts, [(Difficulty::Easy, 3), (Difficulty::Hard, 10)]);
    assert_eq!(song.mines, 1);
}

#[test]
fn rows_divide_measures_evenly() {
    let song = Simfile::parse(SONG).expect("the file has no mistakes");
    let expected = [
        Note::tap(Row(0), Lane::Left),
        Note::tap(Row(48), Lane::Right),
        Note::hold(Row(96), Lane::Down, 192 + 24 - 96),
        Note::tap(Row(192 + 72), Lane::Up),
        Note::tap(Row(192 + 72), Lane::Right),
        Note::hold(Row(192 + 144), Lane::Left, 24),
    ];
    assert_eq!(notes(&song, 0), expected);
    assert_eq!(notes(&song, 1), [Note::tap(Row(0), Lane::Left), Note::tap(Row(0), Lane::Right)]);
}

#[test]
fn the_nearest_chart_is_chosen() {
    let mut song = Simfile::parse(SONG).expect("the file has no mistakes");
    let chart = |difficulty, meter| StepChart::new(difficulty, meter, Vec::new()).expect("there are no notes");
    let meter_of = |song: &Simfile, difficulty| song.chart(difficulty).map(|chart| chart.meter);
    // Medium is as far from easy as from hard.
    assert_eq!(Difficulty::ALL.map(|difficulty| meter_of(&song, difficulty)), [Some(3), Some(3), Some(10)]);
    // Beginner and Challenge give way to Easy and Hard.
    song.charts.extend([chart(Difficulty::Easy, 1), chart(Difficulty::Hard, 8)]);
    assert_eq!(Difficulty::ALL.map(|difficulty| meter_of(&song, difficulty)), [Some(3), Some(3), Some(8)]);
    song.charts.clear();
    assert_eq!(meter_of(&song, Difficulty::Easy), None);
}

#[test]
fn line_ends_of_windows_and_measures_without_rows_are_read() {
    let text = SONG.replace(", // measure 2", ",\n, // measure 3").replace('\n', "\r\n");
    let song = Simfile::parse(&text).expect("the file has no mistakes");
    assert_eq!(notes(&song, 0)[1], Note::tap(Row(48), Lane::Right));
    assert_eq!(notes(&song, 0)[2], Note::hold(Row(96), Lane::Down, 2 * ROWS_PER_MEASURE + 24 - 96));
}

#[test]
fn of_a_tag_that_is_there_twice_the_last_one_counts() {
    let text = format!("{SONG}#TITLE:Three;#OFFSET:1;");
    let song = Simfile::parse(&text).expect("the file has no mistakes");
    assert_eq!((song.title.as_str(), song.timing.offset_seconds()), ("Three", 1.0));
}

#[test]
fn what_is_written_is_read_as_the_same() {
    let mut random = Random::new(1);
    for case in 0..500 {
        let song = random_song(&mut random);
        let text = song.to_sm();
        let read = Simfile::parse(&text);
        assert_eq!(read.as_ref(), Ok(&song), "case {case}\n{text}");
    }
}

#[test]
fn measures_are_written_in_as_few_rows_as_they_need() {
    let mut song = Simfile::parse(SONG).expect("the file has no mistakes");
    song.charts.truncate(1);
    let text = song.to_sm();
    assert!(text.contains("\n1000\n0001\n0200\n0000\n, // measure 2\n0000\n0300\n0000\n0011\n"), "{text}");
}

fn random_song(random: &mut Random) -> Simfile {
    let mut tempos = vec![tempo(Row(0), random)];
    let mut pauses = Vec::new();
    for _ in 0..random.below(4) {
        let mut row = || Row(random.below(10_000) as u32);
        let (tempo_row, stop_row, delay_row) = (row(), row(), row());
        tempos.push(tempo(tempo_row, random));
        for (kind, row) in [(PauseKind::Stop, stop_row), (PauseKind::Delay, delay_row)] {
            pauses.push(Pause::new(kind, row, random.unit()).expect("the pause is short"));
        }
    }
    let timing = Timing::new(random.between(-3.0, 3.0), tempos, pauses).expect("there is a tempo at beat 0");
    let charts = (0..=random.below(3)).map(|_| random_chart(random)).collect();
    let [title, artist, credit, music] = [(); 4].map(|()| random_title(random));
    Simfile { title, artist, credit, music, timing, charts, mines: 0 }
}

fn tempo(row: Row, random: &mut Random) -> TempoChange {
    TempoChange::new(row, random.between(30.0, 300.0)).expect("the tempo is playable")
}

/// Makes a chart whose rows are whole beats, eighths, triplets, or anything.
fn random_chart(random: &mut Random) -> StepChart {
    let step = [ROWS_PER_BEAT, ROWS_PER_BEAT / 2, ROWS_PER_BEAT / 3, 1][random.below(4)];
    let mut notes = Vec::new();
    for lane in Lane::ALL {
        let mut row = 0;
        for _ in 0..random.below(40) {
            row += step * (1 + random.below(9) as u32);
            if random.unit() < 0.3 {
                let length = step * (1 + random.below(6) as u32);
                notes.push(Note::hold(Row(row), lane, length));
                row += length;
            } else {
                notes.push(Note::tap(Row(row), lane));
            }
        }
    }
    let difficulty = Difficulty::ALL[random.below(3)];
    StepChart::new(difficulty, 1 + random.below(12) as u32, notes).expect("the notes of a lane follow each other")
}

/// Makes a title of letters and what has a meaning in files.
fn random_title(random: &mut Random) -> String {
    const PIECES: [&str; 12] = ["a", "Ü", "舞", "\\", ":", ";", "#", "/", "//", "b c", "\n", "=,"];
    let title: String = (0..random.below(8)).map(|_| PIECES[random.below(PIECES.len())]).collect();
    title.trim().to_owned()
}
