// SPDX-License-Identifier: MIT
// A Vega-Lite specification -> a picture, by Vega.

import * as vega from 'vega';
import {compile} from 'vega-lite';

import {textWidth} from './text.mjs';

// Node.js cannot measure text. Vega asks with the font size in the item, as in its own functions.
if (typeof document === 'undefined')
  vega.textMetrics.width = (item, text) => textWidth(text ?? '', item.fontSize ?? 11);

function view(spec, options) {
  return new vega.View(vega.parse(compile(spec).spec), {logLevel: vega.Error, ...options});
}

/** The picture as the text of an SVG file. */
export async function svgText(spec) {
  const drawn = view(spec, {renderer: 'none'});
  const svg = await drawn.toSVG();
  drawn.finalize();
  return svg;
}

/** Draws into an element of the page; returns a function that removes it. */
export function draw(spec, element) {
  const drawn = view(spec, {renderer: 'svg', container: element});
  drawn.run();
  return () => drawn.finalize();
}
