// SPDX-License-Identifier: MIT
// node render.mjs FIGURES.json FOLDER: writes 0.svg, 1.svg, ... in the order of the figures.

import {readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

import {svgText} from './picture.mjs';
import {boxPlot, printOptions} from './spec.mjs';

const [data, folder] = process.argv.slice(2);
const {studies} = JSON.parse(readFileSync(data, 'utf8'));
let count = 0;
for (const study of studies)
  for (const figure of study.figures)
    writeFileSync(join(folder, `${count++}.svg`), await svgText(boxPlot(figure, study, printOptions(figure))));
