// SPDX-License-Identifier: MIT
// node build.mjs: bundles src/ into dist/page.js, dist/page.css and dist/render.mjs.

import {readdirSync, readFileSync, writeFileSync} from 'node:fs';

import {build} from 'esbuild';

/** The licences of the packages in a bundle, as their owners ask; each text once. */
function licences(metafile) {
  const texts = new Map();
  for (const file of Object.keys(metafile.inputs)) {
    const folder = file.match(/^.*node_modules\/(@[^/]+\/)?[^/]+/)?.[0];
    if (!folder) continue;
    const name = readdirSync(folder).find((entry) => /^licen[cs]e/i.test(entry));
    const {name: package_, license} = JSON.parse(readFileSync(`${folder}/package.json`, 'utf8'));
    const text = name ? readFileSync(`${folder}/${name}`, 'utf8').trim() : license;
    texts.set(text, (texts.get(text) ?? new Set()).add(package_));
  }
  return [...texts].map(([text, names]) => `${[...names].join(', ')}:\n\n${text}`).join('\n\n');
}

async function bundle(options) {
  const {metafile, outputFiles} = await build({
    bundle: true,
    minify: true,
    metafile: true,
    write: false,
    legalComments: 'none',  // they are in the licences
    logLevel: 'warning',
    ...options,
  });
  const notice = licences(metafile).replaceAll('*/', '* /').replaceAll('<', '(').replaceAll('>', ')');
  writeFileSync(options.outfile, outputFiles[0].text + (notice && `/*\n${notice}\n*/\n`));
}

await bundle({entryPoints: ['src/page.mjs'], outfile: 'dist/page.js', platform: 'browser', format: 'iife', target: 'es2022'});
await bundle({entryPoints: ['src/page.css'], outfile: 'dist/page.css', target: 'es2022'});
// Vega would measure text with the package "canvas", if it were installed; picture.mjs measures it.
await bundle({entryPoints: ['src/render.mjs'], outfile: 'dist/render.mjs', platform: 'node', format: 'esm', target: 'node18', external: ['canvas']});
