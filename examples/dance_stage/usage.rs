//! What `--help` says.

pub(crate) const USAGE: &str = "\
A dance game on a real desk, lit by the room that a mirrored ball shows, or in a place of its own.

usage: dance_stage [OPTIONS]

  --feed clip:DIR          a folder of pictures with a sidecar clip.json; repeated for ever
                           (default: the recorded desk in assets/desk_clip)
         image:FILE        one picture
         device:N          webcam number N (needs the feature `webcam`)
  --intrinsics FX,FY,CX,CY the camera's focal lengths and principal point in pixels of its pictures
  --calibration FILE       or what the example `calibrate` has measured, or YAML of OpenCV or ROS, with the distortion
  --fov DEG                or its horizontal field of view, if it was never calibrated
                           (default: what the clip's sidecar says, else 60)
  --set FILE               a glTF file whose node extras say where marker, ball and real things are; the stage stands on
                           the marker (default: assets/desk/set.glb for the recorded desk, else
                           assets/desk/bare_set.glb, which has nothing but marker and ball)
  --scene FILE             the same with virtual things of its own, instead of set and stage
  --mat MM                 a printed mat to step on with fingers or feet, this wide (A4: 297); the example marker_sheet
                           prints it (--kind mat)
  --shoes                  with feet whose shoes bear the markers 30 and 31, 50 mm wide; two cameras know best
                           where they are, but one will do
  --toon THING[,THING…]    what starts as toon: dancer, floor, rim, left loudspeaker, right loudspeaker, mirror ball,
                           stonehenge, or all
  --solo                   no camera: the dancer is in a place of its own
  --place NAME             which one, stonehenge or campus (implies --solo; default: stonehenge). With --feed it is a
                           model on the desk, and the room of the feed is its light
  --song FILE              what is danced to: a StepMania file, .sm or .ssc (default: assets/music/vibe_ace.sm)
  --music FILE             or any OGG Vorbis or WAV file, to whose beats arrows are set
  --save-song FILE.sm      write these arrows to a StepMania file, to edit them
  --difficulty LEVEL       easy, medium or hard (default: medium)
  --players N              1 or 2 (default: 1)
  --dancer FILE            a glTF file with animations `idle`, `step_left`, `step_down`, `step_up`, `step_right`,
                           `jump`, `spin`, `cheer` and `stumble`, whose seconds are beats, of a figure that faces −Z
                           (default: assets/models/dancer.glb). Figures of others, which face +Z, dance with what they
                           have: dance, idle, walk, run, jump, wave, in the names of their animations
  --demo                   the players dance by themselves, at once
  --seed N                 how inaccurate they are then (default: 1)
  --headless               draw to files instead of a window; chosen by itself where there is no display
  --frames N               pictures to draw then (default 60)
  --size WIDTHxHEIGHT      their size in pixels (default: that of the feed's pictures, 640x480 in a place)
  --out DIR                folder for them, frame_0000.png and so on, a contact sheet and report.json
                           (default dance_stage_out)
  --result FILE            write what the players have reached to a JSON file (with --headless --demo)

Keys: arrow keys or W, A, S, D step; with two players the first has the letters, the second the arrow keys. Enter
starts, Space is the pause, C on the title measures how late screen and keys are, H lists all keys and buttons, Esc goes
back and ends. 1 to 9 switch one thing between toon and image-based, T all of them, a click shows all settings of a
thing, Tab or F1 the panel, F11 full screen, L the lights of the stage. Gamepads and dance mats need the feature
`gamepad`, sound the feature `audio`.";
