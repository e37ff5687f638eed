// The page around the stage: loads the program with a progress bar, shows its state, and turns presses of buttons into keys.
// The program tells its state as attributes of the root element, see report.rs.
import init from './dance_stage.js';

const root = document.documentElement;
const element = (id) => document.getElementById(id);
const query = new URLSearchParams(location.search);
const isCamera = query.has('feed');

function fail(reason) {
  root.dataset.stage = 'failed';
  root.dataset.reason = reason;
}

// Why there is no picture, in words, or nothing.
async function lack() {
  if (!isSecureContext) return 'Browsers give graphics and cameras to pages over HTTPS or on localhost only. Open this one there.';
  if (!navigator.gpu) return 'This browser has no WebGPU. Current Chrome and Edge have it, Safari since 26, Firefox on Windows since 141.';
  const adapter = await navigator.gpu.requestAdapter().catch(() => null);
  return adapter ? '' : 'This browser has WebGPU, but finds no graphics device for it. Try another browser, or newer drivers.';
}

// Fetches the program and shows how much of it is here.
async function fetchProgram() {
  const response = await fetch('dance_stage_bg.wasm');
  if (!response.ok) throw new Error(`the server has no dance_stage_bg.wasm (${response.status})`);
  // Written by the script that builds the page: the length in the header is that of the compressed file.
  const total = Number(root.dataset.size);
  let here = 0;
  const count = new TransformStream({
    transform(bytes, out) {
      here += bytes.length;
      if (total > 0) element('progress').value = here / total;
      element('doing').textContent = `Loading, ${(here / 2 ** 20).toFixed(1)} MiB`;
      out.enqueue(bytes);
    },
  });
  return new Response(response.body.pipeThrough(count), { headers: { 'Content-Type': 'application/wasm' } });
}

// Presses a key for the program.
function press(code, key) {
  const canvas = element('stage');
  for (const type of ['keydown', 'keyup']) {
    canvas.dispatchEvent(new KeyboardEvent(type, { code, key, bubbles: true, cancelable: true }));
  }
}

function showState() {
  const { stage, reason = '', things = '[]', feed, marker } = root.dataset;
  element('reason').textContent = reason;
  if (stage === 'failed') element('cover').hidden = true;
  if (stage === 'loading' && feed) {
    element('progress').removeAttribute('value');
    const waits = feed === 'playing' && isCamera && marker !== 'tracked';
    element('doing').textContent = waits ? 'Show the marker and the ball to the camera' : 'Lighting the stage';
  }
  JSON.parse(things).forEach(([name, isToon], i) => {
    let button = element('things').querySelector(`[data-thing="${name}"]`);
    if (!button) {
      button = document.createElement('button');
      button.dataset.thing = name;
      button.textContent = name;
      button.onclick = () => press(`Digit${i + 1}`, `${i + 1}`);
      element('things').append(button);
    }
    button.setAttribute('aria-pressed', isToon);
  });
}

// Opens the page with another option.
function reopen(name, value) {
  if (value === null) query.delete(name); else query.set(name, value);
  location.search = query;
}

// Focal lengths of cameras in millimeters, as data sheets give them: for a film of 43.3 mm from corner to corner. Movies may use
// less of the sensor, so that the slider has the last word.
const DEVICES = [['an iPhone', 26], ['an iPhone Pro, from the 14 on', 24], ['a Google Pixel', 25], ['a Samsung Galaxy S', 24], ['another phone', 26],
  ['a laptop', 29], ['a wide webcam', 22]];
const DIAGONAL = 43.27;
// Field of view in degrees along the longer edge of pictures of 4 : 3.
const fieldOfView = (focal) => Math.round(2 * Math.atan(0.4 * DIAGONAL / focal) * 360 / Math.PI) / 2;

function showLens() {
  const degrees = Number(query.get('fov') ?? 60);
  element('fov').value = degrees;
  element('degrees').textContent = `${degrees}°`;
  const device = query.get('device');
  for (const [name] of DEVICES) element('device').append(new Option(name, name, false, name === device));
  element('device').append(new Option('unknown', '', false, !device));
  element('fov').oninput = () => { element('degrees').textContent = `${element('fov').value}°`; };
  element('fov').onchange = () => { query.delete('device'); reopen('fov', element('fov').value); };
  element('device').onchange = () => {
    const chosen = DEVICES.find(([name]) => name === element('device').value);
    if (!chosen) return;
    query.set('device', chosen[0]);
    reopen('fov', fieldOfView(chosen[1]));
  };
  for (const id of ['fov', 'device']) element(id).disabled = !isCamera;
}

new MutationObserver(showState).observe(root, { attributes: true });
element('all').onclick = () => press('KeyT', 't');
element('feed').textContent = isCamera ? 'Show the recorded desk' : 'Use my camera';
element('feed').onclick = () => reopen('feed', isCamera ? null : 'device:0');
showLens();

const reason = await lack();
if (reason) {
  fail(reason);
} else {
  try {
    await init({ module_or_path: await fetchProgram() });
  } catch (error) {
    // winit leaves its start by an exception.
    if (!String(error).includes('Using exceptions for control flow')) fail(`The program ended: ${error}`);
  }
}
