// Tests the page with the dance stage in Chromium; see scripts/test_web.sh, which sets:
//   PAGE      the folder that scripts/web.sh has made
//   OUT       the folder for lit.png, toon.png and camera.png
//   NATIVE    the folder with lit.png and toon.png of the native program
//   VIDEO     what the browser's fake camera sees, the recorded desk
//   CHROMIUM  the browser
import http from 'node:http';
import fs from 'node:fs';
import path from 'node:path';
import { chromium } from 'playwright-core';

const { PAGE, OUT, CHROMIUM, NATIVE, VIDEO } = process.env;
// Largest mean difference of a picture from the native one, of 255: rasterizers differ along edges.
const MAX_DIFFERENCE = 2;
const types = { html: 'text/html', js: 'text/javascript', wasm: 'application/wasm', jpg: 'image/jpeg', json: 'application/json' };
// Software graphics on two busy cores takes ten seconds a picture, and the first ten prepare it.
const PATIENCE = 600_000;
// WebGPU by SwiftShader, into the canvas as well: without a Vulkan behind ANGLE the canvas loses the device.
const flags = ['--no-sandbox', '--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader', '--enable-features=Vulkan',
  '--use-angle=vulkan', '--use-vulkan=swiftshader', '--disable-background-networking', '--no-first-run'];

let sent = 0;
const server = http.createServer((request, response) => {
  const name = path.normalize(new URL(request.url, 'http://x').pathname);
  const file = path.join(PAGE, name === '/' ? 'index.html' : name);
  const isCompressed = fs.existsSync(`${file}.gz`);
  fs.readFile(isCompressed ? `${file}.gz` : file, (error, bytes) => {
    const type = types[name.split('.').pop()] ?? (name === '/' ? 'text/html' : 'application/octet-stream');
    const encoding = isCompressed ? { 'content-encoding': 'gzip' } : {};
    response.writeHead(error ? 404 : 200, { 'content-type': type, 'content-length': bytes?.length ?? 0, ...encoding });
    response.end(bytes ?? '');
    sent += bytes?.length ?? 0;
  });
}).listen(0, '127.0.0.1');
await new Promise((ready) => server.once('listening', ready));
const address = `http://127.0.0.1:${server.address().port}/`;

let failures = 0;
function check(what, isRight, found = '') {
  console.log(`${isRight ? 'ok  ' : 'FAIL'} ${what}${found ? `: ${found}` : ''}`);
  failures += isRight ? 0 : 1;
}

// Opens a page in a browser of its own, and collects what it has to complain about.
async function open(query, run, { args = flags, before } = {}) {
  const browser = await chromium.launch({ executablePath: CHROMIUM, headless: true, args });
  const errors = [];
  try {
    const page = await browser.newPage({ viewport: { width: 1000, height: 900 } });
    page.setDefaultTimeout(PATIENCE);
    const isError = (message) => message.type() === 'error' || /ERROR|panicked|WebGPU|GPUValidation/.test(message.text());
    page.on('console', (message) => { if (isError(message)) errors.push(message.text()); });
    page.on('pageerror', (error) => { if (!error.message.includes('control flow')) errors.push(error.message); });
    page.on('request', (request) => { if (!request.url().startsWith(address) && !/^(data|blob):/.test(request.url())) errors.push(`asked for ${request.url()}`); });
    if (before) await page.addInitScript(before);
    await page.goto(address + query);
    await run(page);
  } catch (error) {
    check(query, false, String(error).slice(0, 500));
  } finally {
    await browser.close();
  }
  return errors;
}

const stage = (page) => page.evaluate(() => document.documentElement.dataset.stage);
const settled = (page) => page.waitForFunction(() => ['lit', 'failed'].includes(document.documentElement.dataset.stage));
const reason = (page) => page.textContent('#reason');

// The picture of the canvas alone.
async function save(page, name) {
  await page.locator('#stage').screenshot({ path: path.join(OUT, `${name}.png`), timeout: PATIENCE });
}

// Compares a picture of the page with the native one.
async function compare(name) {
  const url = (folder) => `data:image/png;base64,${fs.readFileSync(path.join(folder, `${name}.png`)).toString('base64')}`;
  const browser = await chromium.launch({ executablePath: CHROMIUM, headless: true, args: ['--no-sandbox'] });
  try {
    const page = await browser.newPage();
    const found = await page.evaluate(async (urls) => {
      const [a, b] = await Promise.all(urls.map(async (url) => {
        const image = await createImageBitmap(await (await fetch(url)).blob());
        const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
        context.drawImage(image, 0, 0);
        return context.getImageData(0, 0, image.width, image.height);
      }));
      if (a.width !== b.width || a.height !== b.height) return `${a.width} × ${a.height} pixels instead of ${b.width} × ${b.height}`;
      let sum = 0;
      for (let i = 0; i < a.data.length; i += 1) sum += Math.abs(a.data[i] - b.data[i]);
      // Alpha is 255 in both.
      return sum / (a.width * a.height * 3);
    }, [url(OUT), url(NATIVE)]);
    check(`${name}.png is the native picture`, found <= MAX_DIFFERENCE, typeof found === 'string' ? found : `${found.toFixed(2)} of 255 in the mean`);
  } catch (error) {
    check(`${name}.png is the native picture`, false, String(error).slice(0, 300));
  } finally {
    await browser.close();
  }
}

for (const name of ['lit', 'toon', 'camera']) fs.rmSync(path.join(OUT, `${name}.png`), { force: true });

const withoutGpu = await open('', async (page) => {
  await settled(page);
  check('without WebGPU the page says so', (await reason(page)).includes('no WebGPU'), await reason(page));
}, { before: () => Object.defineProperty(Navigator.prototype, 'gpu', { get: () => undefined }) });
check('without WebGPU there is no other error', withoutGpu.length === 0, withoutGpu.join('; '));

const start = Date.now();
sent = 0;
const errors = await open('?frame=0', async (page) => {
  await settled(page);
  console.log(`     the first picture came after ${((Date.now() - start) / 1000).toFixed(0)} s and ${(sent / 1e6).toFixed(1)} MB`);
  check('frame 0 is lit', (await stage(page)) === 'lit', await reason(page));
  await save(page, 'lit');
  await page.click('#all');
  await page.waitForFunction(() => JSON.parse(document.documentElement.dataset.things).every(([, isToon]) => isToon));
  await page.waitForFunction(() => document.documentElement.dataset.stage === 'loading');
  await settled(page);
  check('all things are toon', (await stage(page)) === 'lit');
  await save(page, 'toon');
});
check('nothing is an error', errors.length === 0, errors.slice(0, 5).join('; '));
await compare('lit');
await compare('toon');

// The clip's camera, whose images are 640 pixels wide at a focal length of 601.8.
const camera = ['--use-fake-device-for-media-stream', '--use-fake-ui-for-media-stream', `--use-file-for-fake-video-capture=${VIDEO}`];
const cameraErrors = await open('?feed=device:0&fov=56', async (page) => {
  const isOver = () => document.documentElement.dataset.marker === 'tracked' || document.documentElement.dataset.stage === 'failed';
  await page.waitForFunction(isOver);
  await settled(page);
  const { feed, marker } = await page.evaluate(() => ({ ...document.documentElement.dataset }));
  check('the camera plays', feed === 'playing', await reason(page));
  check('its marker is tracked', marker === 'tracked', marker);
  await save(page, 'camera');
}, { args: [...flags, ...camera] });
check('nothing is an error with a camera', cameraErrors.length === 0, cameraErrors.slice(0, 5).join('; '));

server.close();
process.exit(failures ? 1 : 0);
