// Tests the browser's camera in Chromium; see scripts/test_browser_camera.sh, which sets:
//   PAGES     the folder with page.html and pkg/, made by wasm-bindgen
//   CLIP      a folder with frame_000.jpg to frame_059.jpg
//   VIDEO     the same frames as .y4m, which Chromium's fake camera plays
//   CHROMIUM  the browser
// Its argument is a part of the names of the tests to run.
import http from 'node:http';
import fs from 'node:fs';
import path from 'node:path';
import { chromium } from 'playwright-core';

const { PAGES, CLIP, VIDEO, CHROMIUM = '/usr/bin/chromium' } = process.env;
const FAKE = ['--use-fake-device-for-media-stream'];
const ALLOW = ['--use-fake-ui-for-media-stream'];
const FILE = VIDEO ? [`--use-file-for-fake-video-capture=${VIDEO}`] : [];
const types = { html: 'text/html', js: 'text/javascript', wasm: 'application/wasm', jpg: 'image/jpeg' };

const server = http.createServer((request, response) => {
  const name = path.normalize(new URL(request.url, 'http://x').pathname);
  const file = name.startsWith('/clip/') ? path.join(CLIP, name.slice(5)) : path.join(PAGES, name);
  fs.readFile(file, (error, bytes) => {
    response.writeHead(error ? 404 : 200, { 'content-type': types[file.split('.').pop()] ?? 'text/plain' });
    response.end(bytes ?? '');
  });
}).listen(0);
const port = server.address().port;

let failures = 0;
function check(what, is_right, found) {
  console.log(`${is_right ? 'ok  ' : 'FAIL'} ${what}: ${typeof found === 'string' ? found : JSON.stringify(found)}`);
  failures += is_right ? 0 : 1;
}

const wanted = process.argv[2] ?? '';
// Runs a test in a page of its own. `before` runs in the page before its scripts.
async function test(name, flags, run, { before, host = 'localhost' } = {}) {
  if (!name.includes(wanted)) return;
  console.log(`# ${name}`);
  const args = ['--no-sandbox', '--disable-gpu', '--disable-background-networking', '--no-first-run', ...flags];
  const browser = await chromium.launch({ executablePath: CHROMIUM, headless: true, args });
  try {
    const context = await browser.newContext();
    const page = await context.newPage();
    page.on('console', (message) => console.log('  page:', message.text()));
    page.on('pageerror', (error) => check('no error in the page', false, error.message));
    if (before) await page.addInitScript(before);
    await page.goto(`http://${host}:${port}/page.html`);
    await page.waitForFunction('window.isReady');
    await run(page, context);
  } catch (error) {
    check(name, false, String(error));
  } finally {
    await browser.close();
  }
}

// Keeps what the camera gets from the browser, so that a test can meddle with it.
const keepStreams = () => {
  window.streams = [];
  const devices = navigator.mediaDevices;
  window.realGet = devices.getUserMedia.bind(devices);
  devices.getUserMedia = async (constraints) => {
    window.asked = (window.asked ?? 0) + 1;
    window.constraints = constraints;
    const stream = await (window.give ?? window.realGet)(constraints);
    window.streams.push(stream);
    return stream;
  };
  window.clones = 0;
  const clone = MediaStreamTrack.prototype.clone;
  MediaStreamTrack.prototype.clone = function () { window.clones += 1; return clone.call(this); };
  window.videos = [];
  const create = document.createElement.bind(document);
  document.createElement = (name) => {
    const element = create(name);
    if (name === 'video') window.videos.push(element);
    return element;
  };
};
// Counts frames that are copied, opened and closed.
const countFrames = () => {
  window.counts = { copied: 0, opened: 0, closed: 0 };
  const { copyTo, close } = VideoFrame.prototype;
  VideoFrame.prototype.copyTo = function (...all) { counts.copied += 1; return copyTo.apply(this, all); };
  VideoFrame.prototype.close = function () { counts.closed += 1; return close.call(this); };
  window.VideoFrame = new Proxy(VideoFrame, { construct(of, all) { counts.opened += 1; counts.at = performance.now(); return new of(...all); } });
};
const withoutVideoFrame = () => { delete window.VideoFrame; };
const withoutCallbacks = () => {
  delete HTMLVideoElement.prototype.requestVideoFrameCallback;
  delete HTMLVideoElement.prototype.cancelVideoFrameCallback;
};
const withDeafCallbacks = () => {
  HTMLVideoElement.prototype.requestVideoFrameCallback = () => 1;
};

// Plays the clip for some seconds, and compares each frame with the files.
async function comparePixels(page, copies, hasCallbacks) {
  const seconds = 6;
  const found = await page.evaluate(async (seconds) => {
    const files = await reference(60);
    const cam = new Cam(640, 480, undefined, undefined, false);
    const frames = [];
    let status = await play(cam, (status, frame, t) => {
      const at = performance.now();
      if (frame) frames.push({ at, frame, wait: window.counts ? at - counts.at : 0 });
      return t < 1000 * seconds;
    });
    const notice = cam.notice();
    cam.free();
    await new Promise((resolve) => setTimeout(resolve, 200));
    const list = frames.map(({ at, wait, frame: [width, height, age, read, dropped, rgba] }) => {
      const rough = files.map((file) => difference(rgba, file, 997));
      const index = rough.indexOf(Math.min(...rough));
      let alpha = 255;
      for (let i = 3; i < rgba.length; i += 4) alpha = Math.min(alpha, rgba[i]);
      return { at, wait, width, height, age, read, dropped, index, alpha, difference: difference(rgba, files[index], 1) };
    });
    return { status, notice, list, counts: window.counts };
  }, seconds);
  const { list } = found;
  const max = (key) => Math.max(...list.map((frame) => frame[key]));
  const median = (key) => list.map((frame) => frame[key]).sort((a, b) => a - b)[list.length >> 1];
  const round = (value) => Math.round(100 * value) / 100;
  check('status', /^playing 640x480 /.test(found.status), found.status);
  const { copied, opened, closed } = found.counts ?? { copied: 0, opened: 0, closed: 0 };
  check('way of reading', copies ? copied >= list.length && copied <= list.length + 2 : copied === 0, { copied });
  check('frames closed', opened === closed, { opened, closed });
  check('size and alpha', list.every((f) => f.width === 640 && f.height === 480 && f.alpha === 255), list.length);
  check('pixels, mean difference', max('difference') < 2, { median: round(median('difference')), max: round(max('difference')) });
  // A busy machine skips frames before the browser counts them, and the fake camera repeats its first one.
  const steps = list.slice(1).map((f, i) => (f.index - list[i].index + 60) % 60 - f.dropped);
  const odd = steps.filter((step) => step !== 1);
  check('order, odd steps', odd.length <= 0.1 * steps.length && odd.every((step) => step >= 0 && step < 15), odd);
  const rate = (list.length - 1) / (list.at(-1).at - list[0].at) * 1000;
  check('rate', Math.abs(rate - 15) < 1.5, round(rate));
  check('age in ms', median('age') < 60, { median: round(median('age')), max: round(max('age')) });
  check('reading in ms', median('read') < 20, { median: round(median('read')), max: round(max('read')) });
  // Before the game's update in the same frame of the page; without callbacks, in the next one.
  check('from reading to the game in ms', median('wait') < (hasCallbacks ? 10 : 25), { median: round(median('wait')), max: round(max('wait')) });
  check('dropped', true, list.reduce((sum, frame) => sum + frame.dropped, 0));
}

await test('pixels copied', [...FAKE, ...ALLOW, ...FILE], (page) => comparePixels(page, true, true), { before: countFrames });
await test('pixels drawn', [...FAKE, ...ALLOW, ...FILE], (page) => comparePixels(page, false, true), { before: withoutVideoFrame });
await test('pixels without callbacks', [...FAKE, ...ALLOW, ...FILE], (page) => comparePixels(page, true, false), { before: `(${withoutCallbacks})(); (${countFrames})()` });
await test('pixels with deaf callbacks', [...FAKE, ...ALLOW, ...FILE], (page) => comparePixels(page, true, false), { before: `(${withDeafCallbacks})(); (${countFrames})()` });

await test('slow game', [...FAKE, ...ALLOW, ...FILE], async (page) => {
  const found = await page.evaluate(async () => {
    const cam = new Cam(640, 480, undefined, undefined, false);
    await until(cam, /^playing/, 5000);
    let count = 0, dropped = 0;
    const start = performance.now();
    await play(cam, (_, frame, t) => {
      if (frame) { count += 1; dropped += frame[4]; }
      const end = performance.now() + 300;
      while (performance.now() < end);
      return t < 4000;
    });
    return { count, dropped, rate: (count + dropped) / (performance.now() - start) * 1000 };
  });
  check('taken and dropped frames make up the rate', found.dropped > found.count && Math.abs(found.rate - 15) < 3, found);
});

await test('refused', [...FAKE, '--deny-permission-prompts'], async (page, context) => {
  const refused = await page.evaluate(async () => {
    window.cam = new Cam(640, 480, undefined, undefined, false);
    const first = await until(cam, /^lost/, 5000);
    await play(cam, (_s, _f, t) => t < 3500);
    return { first, asked: window.asked };
  });
  check('reason', /^lost: the camera was not permitted/.test(refused.first), refused.first);
  check('asked once', refused.asked === 1, refused.asked);
  await context.grantPermissions(['camera']);
  const later = await page.evaluate(() => until(cam, /^playing/, 5000));
  check('permitted later', /^playing/.test(later), later);
}, { before: keepStreams });

await test('missing', [...ALLOW], async (page) => {
  const status = await page.evaluate(() => until(new Cam(640, 480, undefined, undefined, true), /^lost/, 5000));
  check('reason', /^lost: the browser finds no camera/.test(status), status);
});

await test('insecure', [...FAKE, ...ALLOW, '--host-resolver-rules=MAP insecure.test 127.0.0.1'], async (page) => {
  const status = await page.evaluate(() => until(new Cam(640, 480, undefined, undefined, true), /^lost/, 5000));
  check('reason', /^lost: .*secure pages only/.test(status), status);
}, { host: 'insecure.test' });

await test('unknown device', [...FAKE, ...ALLOW], async (page) => {
  const status = await page.evaluate(() => until(new Cam(640, 480, 'nobody', undefined, true), /^lost/, 5000));
  check('reason', /^lost: there is no camera with the id "nobody"/.test(status), status);
  const known = await page.evaluate(async () => {
    const id = (await navigator.mediaDevices.enumerateDevices()).find((d) => d.kind === 'videoinput').deviceId;
    return until(new Cam(640, 480, id, 10, true), /^playing/, 5000);
  });
  check('known device', /^playing 640x480/.test(known), known);
});

await test('busy, then free', [...FAKE, ...ALLOW], async (page) => {
  const found = await page.evaluate(async () => {
    let refusals = 2;
    window.give = async (constraints) => {
      if (refusals-- > 0) throw new DOMException('Could not start video source', 'NotReadableError');
      return realGet(constraints);
    };
    const cam = new Cam(640, 480, undefined, undefined, false);
    const first = await until(cam, /^lost/, 5000);
    return { first, last: await until(cam, /^playing/, 6000), asked };
  });
  check('reason', /^lost: the browser cannot open the camera \(Could not start/.test(found.first), found.first);
  check('asked again until it plays', /^playing/.test(found.last) && found.asked === 3, `${found.last}, asked ${found.asked}`);
}, { before: keepStreams });

await test('ended', [...FAKE, ...ALLOW], async (page) => {
  const found = await page.evaluate(async () => {
    const cam = new Cam(640, 480, undefined, undefined, false);
    await until(cam, /^playing/, 5000);
    streams[0].getTracks()[0].stop();
    const lost = await until(cam, /^lost/, 1000);
    const again = await until(cam, /^playing/, 5000);
    // Without a permission that lasts, it waits until a camera is plugged in.
    navigator.permissions.query = async () => { throw new TypeError('unknown'); };
    streams[1].getTracks()[0].stop();
    await play(cam, (_s, _f, t) => t < 3000);
    const waiting = cam.status(), askedBefore = asked;
    const enumerate = navigator.mediaDevices.enumerateDevices.bind(navigator.mediaDevices);
    const all = await enumerate();
    navigator.mediaDevices.enumerateDevices = async () => [];
    await play(cam, (_s, _f, t) => t < 1500);
    navigator.mediaDevices.enumerateDevices = async () => all;
    return { lost, again, waiting, askedBefore, plugged: await until(cam, /^playing/, 3000), asked };
  });
  check('reason', /^lost: the camera "fake_device_0" is gone/.test(found.lost), found.lost);
  check('asked again where permitted', /^playing/.test(found.again), found.again);
  check('no dialogs without a lasting permission', /^lost/.test(found.waiting) && found.askedBefore === 2, found.askedBefore);
  check('plugged in again', /^playing/.test(found.plugged) && found.asked === 3, `${found.plugged}, asked ${found.asked}`);
}, { before: keepStreams });

await test('muted, silent, paused', [...FAKE, ...ALLOW], async (page) => {
  const found = await page.evaluate(async () => {
    const cam = new Cam(640, 480, undefined, undefined, false);
    await until(cam, /^playing/, 5000);
    const track = streams[0].getTracks()[0];
    Object.defineProperty(track, 'muted', { value: true, configurable: true });
    const muted = await until(cam, /^lost/, 1000);
    delete track.muted;
    const unmuted = await until(cam, /^playing/, 3000);
    const start = performance.now();
    track.enabled = true;
    videos[0].pause();
    const paused = await play(cam, (_s, frame, t) => !(frame && t > 300) && t < 3000);
    const resumed = performance.now() - start;
    videos[0].play = () => Promise.reject(new DOMException('play() can only be initiated by a user gesture.', 'NotAllowedError'));
    videos[0].pause();
    const silent = await until(cam, /^lost/, 4000);
    delete videos[0].play;
    return { muted, unmuted, paused, resumed, silent, again: await until(cam, /^playing/, 3000) };
  });
  check('muted', /^lost: the system holds back/.test(found.muted), found.muted);
  check('unmuted', /^playing/.test(found.unmuted), found.unmuted);
  check('paused video plays again', /^playing/.test(found.paused) && found.resumed < 2000, Math.round(found.resumed));
  check('video that may not play', /^lost: the browser does not play/.test(found.silent), found.silent);
  check('plays later', /^playing/.test(found.again), found.again);
}, { before: keepStreams });

await test('odd streams', [...FAKE, ...ALLOW], async (page) => {
  const found = await page.evaluate(async () => {
    const result = {};
    const lose = async (give) => {
      window.give = give;
      const cam = new Cam(640, 480, undefined, undefined, true);
      const start = performance.now();
      const status = await until(cam, /^lost/, 8000);
      cam.free();
      return `${Math.round((performance.now() - start) / 1000)} s, ${status}`;
    };
    result.empty = await lose(async () => new MediaStream());
    result.black = await lose(async () => {
      const canvas = document.createElement('canvas');
      canvas.getContext('2d');
      return canvas.captureStream(0);
    });
    result.huge = await lose(async () => {
      const canvas = document.createElement('canvas');
      canvas.width = 9000; canvas.height = 16;
      const context = canvas.getContext('2d');
      setInterval(() => context.fillRect(0, 0, 9000 * Math.random(), 16), 50);
      return canvas.captureStream(20);
    });
    result.nothing = await lose(async () => { throw undefined; });
    return result;
  });
  check('without a picture', /^0 s, lost: .*\(the stream has no picture\)/.test(found.empty), found.empty);
  check('without a frame', /^5 s, lost: no picture from/.test(found.black), found.black);
  check('too wide', /^5 s, lost: no picture from/.test(found.huge), found.huge);
  check('an error that is none', /^0 s, lost: the browser gives no camera/.test(found.nothing), found.nothing);
}, { before: keepStreams });

await test('dropped', [...FAKE, ...ALLOW], async (page) => {
  const found = await page.evaluate(async () => {
    const live = () => streams.flatMap((s) => s.getTracks()).filter((t) => t.readyState === 'live').length;
    const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
    const result = {};
    const cam = new Cam(640, 480, undefined, undefined, true);
    await until(cam, /^playing/, 5000);
    await play(cam, (_s, _f, t) => t < 1500);
    result.clones = clones;
    result.before = live();
    cam.free();
    result.after = live();
    result.source = videos[0].srcObject;
    const early = new Cam(640, 480, undefined, undefined, true);
    early.free();
    await wait(1000);
    result.early = [streams.length, live()];
    for (let i = 0; i < 20; i++) {
      const one = new Cam(640, 480, undefined, undefined, true);
      await until(one, /^playing/, 3000);
      one.free();
    }
    await wait(500);
    return { ...result, many: [streams.length, live()] };
  });
  check('light goes off', found.before === 1 && found.after === 0 && found.clones === 0 && found.source === null, found);
  check('dropped while asking', found.early[0] === 2 && found.early[1] === 0, found.early);
  check('opened twenty times', found.many[0] === 22 && found.many[1] === 0, found.many);
}, { before: keepStreams });

await test('turned phone', [...FAKE, ...ALLOW], async (page) => {
  const found = await page.evaluate(async () => {
    const canvas = document.createElement('canvas');
    const context = canvas.getContext('2d');
    const paint = (width, height) => {
      if (canvas.width !== width) { canvas.width = width; canvas.height = height; }
      // Upper left red, lower right blue.
      context.fillStyle = '#00ff00'; context.fillRect(0, 0, width, height);
      context.fillStyle = '#ff0000'; context.fillRect(0, 0, 100, 100);
      context.fillStyle = '#0000ff'; context.fillRect(width - 100, height - 100, 100, 100);
    };
    let size = [640, 480];
    setInterval(() => paint(...size), 33);
    window.give = async () => canvas.captureStream(30);
    const cam = new Cam(640, 480, undefined, undefined, true);
    const seen = [];
    let wrong = 0;
    const look = async (ms) => play(cam, (status, frame, t) => {
      if (frame) {
        const [w, h, , , , p] = frame;
        const at = (x, y) => [...p.slice(4 * (y * w + x), 4 * (y * w + x) + 3)];
        const near = (a, b) => a.every((v, i) => Math.abs(v - b[i]) < 30);
        wrong += p.length === 4 * w * h && near(at(50, 50), [255, 0, 0]) && near(at(w - 50, h - 50), [0, 0, 255])
          && near(at(w >> 1, h >> 1), [0, 255, 0]) ? 0 : 1;
        if (seen.at(-1) !== `${w}x${h}`) seen.push(`${w}x${h}`);
      }
      return t < ms;
    });
    await look(1500); size = [480, 640]; await look(1500); size = [640, 480]; await look(1500); size = [333, 201];
    const status = await look(1500);
    return { seen, wrong, status };
  });
  check('sizes', found.seen.join() === '640x480,480x640,640x480,333x201', found.seen);
  check('corners', found.wrong <= 1, found.wrong);
  check('status', /^playing 333x201/.test(found.status), found.status);
}, { before: keepStreams });

// A camera with modes, which the browser's own fake one lacks. Its picture is `dark` in these modes: with a value or none.
const withModes = ({ takesMixed = true, dark = [], exposure, balance }) => {
  const canvas = document.createElement('canvas');
  canvas.width = 640; canvas.height = 480;
  const context = canvas.getContext('2d');
  const state = { exposureMode: 'continuous', exposureTime: 200, iso: 100, whiteBalanceMode: 'continuous', colorTemperature: 4000 };
  window.state = state;
  window.applied = [];
  let isDark = false;
  setInterval(() => {
    context.fillStyle = isDark ? '#101010' : `rgb(${120 + 5 * Math.random()}, 130, 140)`;
    context.fillRect(0, 0, 640, 480);
  }, 33);
  window.give = async () => {
    const stream = canvas.captureStream(30);
    const [track] = stream.getTracks();
    track.getSettings = () => ({ ...state });
    track.getCapabilities = () => ({ exposureMode: exposure, whiteBalanceMode: balance });
    track.applyConstraints = async ({ advanced, ...other }) => {
      applied.push({ advanced, other: Object.keys(other) });
      if (!takesMixed && Object.keys(other).length) throw new DOMException('Mixing', 'OverconstrainedError');
      for (const set of advanced) Object.assign(state, set);
      const set = advanced.at(-1);
      const isLock = Object.values(set).includes('manual');
      isDark = isLock && dark.includes(Object.keys(set).length > 1 ? 'values' : 'mode');
    };
    return stream;
  };
};
const lockWith = async (page, camera) => {
  await page.evaluate(`window.withModes = ${withModes}`);
  return page.evaluate(async (camera) => {
    withModes(camera);
    const cam = new Cam(640, 480, undefined, 20, true);
    await until(cam, /^playing/, 5000);
    let notice = 'None';
    const start = performance.now();
    const status = await play(cam, (_s, _f, t) => {
      notice = cam.notice();
      return notice === 'None' && t < 12000;
    });
    const result = { state, applied, notice, again: cam.notice(), status, ms: Math.round(performance.now() - start) };
    cam.free();
    return result;
  }, camera);
};

await test('locks', [...FAKE, ...ALLOW], async (page) => {
  const both = ['continuous', 'manual'];
  const all = await lockWith(page, { exposure: both, balance: both });
  check('locks both', /Ok.*keeps its exposure and white balance/.test(all.notice) && all.state.exposureMode === 'manual'
    && all.state.whiteBalanceMode === 'manual' && all.ms > 2500, `${all.notice} ${all.ms} ms`);
  check('with the wishes kept', all.applied.length === 2 && all.applied[1].advanced.length === 2
    && all.applied[1].other.includes('width'), all.applied);
  const single = await lockWith(page, { takesMixed: false, exposure: ['continuous', 'single-shot'], balance: both });
  check('kinds apart', /Ok.*keeps its exposure and white/.test(single.notice) && single.state.exposureMode === 'single-shot'
    && single.state.whiteBalanceMode === 'manual', single.state);
  const values = await lockWith(page, { dark: ['mode'], exposure: both, balance: ['continuous'] });
  check('dark without values', /Err.*cannot lock white balance of/.test(values.notice) && values.applied.length === 3
    && values.applied[2].advanced[0].exposureTime === 200 && values.state.exposureMode === 'manual', values.applied);
  check('tells it once', values.again === 'None' && /^playing/.test(values.status), values.notice);
  const dark = await lockWith(page, { dark: ['mode', 'values'], exposure: both, balance: ['continuous'] });
  check('dark anyway', /Err.*cannot lock exposure and white balance of/.test(dark.notice)
    && dark.state.exposureMode === 'continuous', `${dark.notice} ${dark.ms} ms`);
  const none = await lockWith(page, { exposure: ['none'] });
  check('no modes', /Err.*cannot lock exposure and white balance/.test(none.notice) && none.applied.length === 0, none.ms);
  const real = await page.evaluate(async () => {
    window.give = undefined;
    const cam = new Cam(640, 480, undefined, undefined, true);
    await until(cam, /^playing/, 5000);
    await play(cam, (_s, _f, t) => t < 4000);
    const { exposureMode, width, height } = streams.at(-1).getTracks()[0].getSettings();
    return { notice: cam.notice(), exposureMode, width, height };
  });
  check('of the browser itself', /Err.*cannot lock white balance of/.test(real.notice) && real.width === 640
    && real.exposureMode === 'manual', real);
}, { before: keepStreams });

server.close();
console.log(failures ? `${failures} FAILED` : 'all passed');
process.exit(failures ? 1 : 0);
