// Opens pages that the command has written in a headless Chromium, on a desktop and on a phone, light and dark, and uses what is on them.
//   node run.mjs COMMAND [--shots DIR] [--only NAME,...] [--screens NAME,...]
// Screenshots of every page on every screen, or on those named, go into DIR.
// Ends with 77, and says why, where it cannot be run: no Chromium, no playwright-core. SWARMFIT_CHROMIUM names the browser,
// SWARMFIT_DATA_DIR captured data, which are looked at too where they are.
import {execFileSync} from 'node:child_process';
import {existsSync, mkdirSync, mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {delimiter, join, resolve} from 'node:path';
import {pathToFileURL} from 'node:url';

import {frame, lines, pairs, solids} from './scenes.mjs';
import {usePage} from './use.mjs';

const cannotRun = 77;

function skip(reason) {
  console.log(`skipped: ${reason}`);
  process.exit(cannotRun);
}

function browserProgram() {
  if (process.env.SWARMFIT_CHROMIUM) return process.env.SWARMFIT_CHROMIUM;
  for (const name of ['chromium', 'chromium-browser', 'google-chrome', 'chrome']) {
    for (const folder of (process.env.PATH ?? '').split(delimiter)) {
      if (folder && existsSync(join(folder, name))) return join(folder, name);
    }
  }
  return undefined;
}

// Drawn in software, every pixel costs: only screenshots are as sharp as a phone's.
const desktop = {viewport: {width: 1280, height: 800}, reducedMotion: 'reduce'};
const phone = (sharp) => ({viewport: {width: 390, height: 844}, deviceScaleFactor: sharp ? 2 : 1, isMobile: true, hasTouch: true, reducedMotion: 'reduce'});
const screensOf = (sharp) => ({
  'desktop-light': {...desktop, colorScheme: 'light'},
  'desktop-dark': {...desktop, colorScheme: 'dark'},
  'phone-light': {...phone(sharp), colorScheme: 'light'},
  'phone-dark': {...phone(sharp), colorScheme: 'dark'},
});

/** name: the arguments of the command, and what the page must show. */
function cases(folder) {
  writeFileSync(join(folder, 'lines.csv'), lines());
  writeFileSync(join(folder, 'solids.csv'), solids());
  writeFileSync(join(folder, 'pairs.csv'), pairs());
  writeFileSync(join(folder, 'frame.pcd'), frame());
  const all = [
    {name: 'lines', arguments: ['fit', 'line2d', 'lines.csv'], models: 4, screens: ['desktop-light', 'phone-dark']},
    {name: 'solids', arguments: ['fit', 'plane,sphere,cylinder', 'solids.csv'], models: 4, screens: ['desktop-dark']},
    {name: 'pairs', arguments: ['fit', 'homography', 'pairs.csv'], models: 2, screens: ['phone-light']},
    {name: 'frame', arguments: ['perceive', 'frame.pcd'], image: true, things: true, screens: ['desktop-dark', 'phone-light']},
  ];
  const data = process.env.SWARMFIT_DATA_DIR;
  if (!data) {
    console.log('SWARMFIT_DATA_DIR is unset: captured data are left out');
    return all;
  }
  const table = join(data, 'middlebury/Playtable');
  const captured = [
    {name: 'mosd', file: join(data, 'mosd/learn0.pcd'), arguments: ['perceive', join(data, 'mosd/learn0.pcd')], image: true, things: true, screens: ['desktop-light']},
    {name: 'room', file: join(data, 'clouds/room_scan1.pcd'), arguments: ['fit', 'plane', join(data, 'clouds/room_scan1.pcd'), '--threshold', '0.03'], screens: ['desktop-dark']},
    {name: 'playtable', file: table, image: true, things: true, screens: ['phone-dark'],
      arguments: ['perceive', '--left', join(table, 'im0.png'), '--right', join(table, 'im1.png'), '--calib', join(table, 'calib.txt')]},
  ];
  for (const one of captured) {
    if (existsSync(one.file)) all.push(one);
    else console.log(`${one.file} is not there: left out`);
  }
  return all;
}

const [command, ...rest] = process.argv.slice(2);
const argument = (name) => (rest.includes(name) ? rest[rest.indexOf(name) + 1] : undefined);
const shots = argument('--shots'), only = argument('--only')?.split(','), onScreens = argument('--screens')?.split(',');
const program = browserProgram();
if (!program) skip('no Chromium on the PATH (on Debian: tools/setup.sh --report)');
let chromium;
try {
  ({chromium} = await import('playwright-core'));
} catch {
  skip('playwright-core is not installed (npm ci --prefix report)');
}

const folder = mkdtempSync(join(tmpdir(), 'swarmfit-report-'));
if (shots) mkdirSync(shots, {recursive: true});
const browser = await chromium.launch({
  executablePath: program,
  args: ['--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync', '--disable-dev-shm-usage',
    '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});
let failures = 0;
try {
  for (const one of cases(folder)) {
    if (only && !only.includes(one.name)) continue;
    const page = join(folder, `${one.name}.html`);
    // The page is what is tested, on the back end that every machine has.
    const options = ['--backend', 'cpu', '--report', page, '--quiet'];
    execFileSync(resolve(command), [...one.arguments, ...options], {cwd: folder, stdio: ['ignore', 'inherit', 'inherit']});
    for (const [screen, options] of Object.entries(screensOf(Boolean(shots)))) {
      if (!(onScreens ?? (shots ? [screen] : one.screens)).includes(screen)) continue;
      const started = Date.now();
      const problems = await usePage(browser, pathToFileURL(page).href, options, one, shots && join(shots, `${one.name}-${screen}`));
      failures += problems.length;
      console.log(`${problems.length === 0 ? 'ok  ' : 'FAIL'} ${one.name}, ${screen}, ${((Date.now() - started) / 1000).toFixed(1)} s`);
      for (const problem of problems) console.log(`     ${problem}`);
    }
  }
} finally {
  await browser.close();
  rmSync(folder, {recursive: true, force: true});
}
console.log(failures === 0 ? 'the pages work' : `${failures} problems`);
process.exit(failures === 0 ? 0 : 1);
