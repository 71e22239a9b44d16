// SPDX-License-Identifier: MIT
// The tables of the page.

import {element} from './element.mjs';
import {colourOf} from './spec.mjs';
import {numberText, rateText} from './text.mjs';

/** Heads that begin a column of text, set flush left, come as [head]. */
function table(caption, heads, rows) {
  const headCell = (head) => element('th', {scope: 'col', ...(Array.isArray(head) && {class: 'name'})}, String(head));
  return element('table', {},
    element('caption', {}, caption),
    element('thead', {}, element('tr', {}, ...heads.map(headCell))),
    element('tbody', {}, ...rows));
}

function seriesCell(series) {
  const swatch = element('span', {class: 'swatch'});
  swatch.style.background = colourOf(series);
  return element('th', {scope: 'row', class: 'name'}, swatch, series.name);
}

const short = (value) => numberText(value, 3);
const cell = (text) => element('td', {}, text);

/** Levels by series: what each box of the figure shows. `methods` is the Set of those wanted. */
export function numbersTable(figure, study, methods, caption) {
  const boxes = figure.series.flatMap(({series, boxes: own}) => own.map((box) => ({series: study.series[series], box})));
  const shown = boxes.filter(({series}) => methods.has(series.method));
  shown.sort((a, b) => a.box.level - b.box.level);  // stable: series stay in their order
  const unit = figure.unit ? ` [${figure.unit}]` : '';
  const level = figure.xLabel ? [figure.xLabel] : [];
  const heads = [...level, ['Series'], 'n', `Minimum${unit}`, `Lower quartile${unit}`, `Median${unit}`,
    `95 % of median${unit}`, `Upper quartile${unit}`, `Maximum${unit}`, 'Good', 'Acceptable'];
  const rows = shown.map(({series, box}) => element('tr', {},
    ...level.map(() => cell(figure.levels[box.level])),
    seriesCell(series),
    cell(box.n === box.trials ? String(box.n) : `${box.n} of ${box.trials}`),
    ...(box.n > 0
      ? [short(box.min), short(box.q1), short(box.median),
          `${short(box.medianInterval[0])}–${short(box.medianInterval[1])}`,
          short(box.q3), short(box.max)]
      : Array(6).fill('–')).map(cell),
    cell(rateText(box.good, box.trials, box.goodInterval)),
    cell(rateText(box.acceptable, box.trials, box.acceptableInterval))));
  return table(`${caption} Rates with their 95 % intervals; n counts the trials that gave a value.`, heads, rows);
}

/** Settings of each series and how its trials ended. */
export function seriesTable(study) {
  const statuses = Object.keys(study.series[0].statuses)
    .filter((status) => study.series.some((series) => series.statuses[status] > 0));
  const named = study.series.some((series) => series.name !== series.method);
  const heads = [['Series'], ...(named ? [['Method']] : []), ['Settings other than the defaults'], 'Trials', ...statuses.map((s) => s.replaceAll('_', ' '))];
  const rows = study.series.map((series) => element('tr', {},
    seriesCell(series),
    ...(named ? [element('td', {class: 'name'}, series.method)] : []),
    element('td', {class: 'name'}, series.settings || 'none'),
    cell(String(series.trials)),
    ...statuses.map((status) => cell(String(series.statuses[status])))));
  return table('Series, their settings and how their trials ended.', heads, rows);
}

export function runsTable(runs) {
  const heads = [['Started'], ['Finished'], ['Version'], ['Command line'], ['Machine'], 'Threads'];
  const rows = runs.map((run) => element('tr', {},
    ...[run.started || '–', run.finished || 'not finished', run.version]
      .map((text) => element('td', {class: 'name short'}, text)),
    ...[run.commandLine, run.machine].map((text) => element('td', {class: 'name'}, text)),
    cell(String(run.threads))));
  return table(runs.length > 0 ? 'The invocations that made these results; times in UTC.' : 'No run is recorded.', heads, rows);
}
