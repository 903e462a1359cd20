// Bundles src/ and three.js into one HTML page, and that into a C++ header.
//   node build.mjs --check                       are the packages there?
//   node build.mjs --page FILE --header FILE
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const oldest = 18;

async function packages() {
  if (Number(process.versions.node.split('.')[0]) < oldest)
    throw new Error(`Node.js was ${process.versions.node}, must be ${oldest} or later,`);
  try {
    await import('three');
    return await import('esbuild');
  } catch {
    throw new Error('the packages of report/ were not installed (npm ci --prefix report)');
  }
}

async function page(esbuild) {
  const common = {bundle: true, minify: true, write: false, target: ['chrome110', 'firefox110', 'safari16'], legalComments: 'inline'};
  const script = await esbuild.build({...common, entryPoints: [join(here, 'src/main.js')], format: 'iife'});
  const style = await esbuild.build({...common, entryPoints: [join(here, 'src/style.css')]});
  const parts = {
    '/*style*/': style.outputFiles[0].text.trim(),
    // Inside a script element nothing may look like its end.
    '/*script*/': script.outputFiles[0].text.trim().replaceAll('</script', '<\\/script'),
  };
  let html = readFileSync(join(here, 'src/page.html'), 'utf8');
  for (const [mark, text] of Object.entries(parts)) html = html.split(mark).join(text);
  return html;
}

/** Pieces of one line, since compilers differ on the longest string they take. */
function header(html) {
  const bytes = Buffer.from(html, 'utf8');
  const pieces = [];
  const most = 8000;
  for (let at = 0; at < bytes.length; at += most) {
    const text = bytes.subarray(at, at + most).toString('latin1');
    pieces.push('    std::string_view("' + text.replace(/[\\"?]/g, '\\$&').replace(/[^ -~]/g, octal) + `", ${text.length}),`);
  }
  return `// Written by report/build.mjs.
#pragma once
#include <string_view>
inline constexpr std::string_view report_page_parts[] = {
${pieces.join('\n')}
};
`;
}

const octal = (c) => '\\' + c.charCodeAt(0).toString(8).padStart(3, '0');

function argument(name) {
  const at = process.argv.indexOf(name);
  return at < 0 ? undefined : process.argv[at + 1];
}

function write(file, text) {
  mkdirSync(dirname(file), {recursive: true});
  writeFileSync(file, text);
}

try {
  const esbuild = await packages();
  if (!process.argv.includes('--check')) {
    const html = await page(esbuild);
    if (argument('--page')) write(argument('--page'), html);
    if (argument('--header')) write(argument('--header'), header(html));
  }
} catch (error) {
  console.error(error.message);
  process.exit(1);
}
