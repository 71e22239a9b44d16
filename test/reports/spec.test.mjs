// SPDX-License-Identifier: MIT
// Run by ctest with node --test; SOURCES is the folder of the built copy of reports/web, where the
// packages are.
import assert from 'node:assert/strict';
import {join} from 'node:path';
import {test} from 'node:test';
import {pathToFileURL} from 'node:url';

const source = (name) => import(pathToFileURL(join(process.env.SOURCES, 'src', name)).href);
const {boxPlot, colourOf, printOptions} = await source('spec.mjs');
const {stepAbove, stepBelow, yAxis} = await source('scale.mjs');
const {numberText, rateText, textWidth, wrapped} = await source('text.mjs');
const {svgText} = await source('picture.mjs');

function box(level, numbers, more = {}) {
  const [min, q1, median, q3, max] = numbers;
  return {level, trials: 10, n: 10, min, q1, median, q3, max, medianInterval: [q1, q3], good: 9, acceptable: 10,
    goodInterval: [0.6, 0.98], acceptableInterval: [0.72, 1], ...more};
}

function figureOf(series, levels, more = {}) {
  return {name: 'f', title: 'Translation error, f', xLabel: 'Cell size [m]', yLabel: 'Translation error [m]', unit: 'm',
    levels, good: 0.1, acceptable: 0.2, log: true, series: series.map((boxes, i) => ({series: i, boxes})), ...more};
}

function studyOf(...names) {
  return {series: names.map((name, colour) => ({name, method: name.split(',')[0], colour}))};
}

const numbers = [0.01, 0.02, 0.03, 0.05, 2];
const options = {width: 336, plotHeight: 190, fontSize: 10};

/** Every mark's rows are the same; what differs is which fields it draws. */
const rowsOf = (spec) => spec.data.values;

test('whiskers are minimum and maximum, the box the quartiles', () => {
  const spec = boxPlot(figureOf([[box(0, numbers)]], ['1']), studyOf('ndt'), options);
  const [row] = rowsOf(spec);
  assert.deepEqual([row.min, row.q1, row.median, row.q3, row.max], numbers);
  const rectangle = spec.layer.find((layer) => layer.mark.type === 'rect');
  assert.equal(rectangle.encoding.y.field, 'q1');
  assert.equal(rectangle.encoding.y2.field, 'q3');
  const whiskers = spec.layer.filter((layer) => layer.encoding.x?.field === 'x' && layer.encoding.y2);
  assert.deepEqual(whiskers.map((w) => [w.encoding.y.field, w.encoding.y2.field]), [['min', 'q1'], ['q3', 'max']]);
});

test('boxes of several methods stand side by side and do not touch', () => {
  const boxes = () => [box(0, numbers), box(1, numbers), box(2, numbers)];
  const spec = boxPlot(figureOf([boxes(), boxes(), boxes(), boxes()], ['1', '2', '3']), studyOf('a', 'b', 'c', 'd'), options);
  const sorted = [...rowsOf(spec)].sort((p, q) => p.left - q.left);
  for (let i = 1; i < sorted.length; ++i) assert.ok(sorted[i - 1].right < sorted[i].left);
  for (const level of [0, 1, 2]) {
    const near = sorted.filter((row) => Math.abs(row.x - level) < 0.5);
    assert.equal(near.length, 4);
    const mean = near.reduce((sum, row) => sum + row.x, 0) / 4;
    assert.ok(Math.abs(mean - level) < 1e-12, 'centred at the level');  // rounding
  }
});

test('a line joins the medians of settings, not those of methods', () => {
  const hasLine = (spec) => spec.layer.some((layer) => layer.mark.type === 'line');
  assert.ok(hasLine(boxPlot(figureOf([[box(0, numbers), box(1, numbers)]], ['1', '2']), studyOf('a'), options)));
  assert.ok(!hasLine(boxPlot(figureOf([[box(0, numbers)], [box(0, numbers)]], [''], {xLabel: ''}), studyOf('a', 'b'), options)));
  assert.ok(!hasLine(boxPlot(figureOf([[box(0, numbers)]], ['1']), studyOf('a'), options)));
});

test('limits are dashed lines with their values in the legend', () => {
  const limits = (figure) => boxPlot(figure, studyOf('a'), options).layer.find((layer) => layer.data)?.data.values;
  assert.deepEqual(limits(figureOf([[box(0, numbers)]], ['1'])).map((l) => [l.name, l.y]),
    [['good: 0.1 m', 0.1], ['acceptable: 0.2 m', 0.2]]);
  assert.equal(limits(figureOf([[box(0, numbers)]], ['1'], {good: 0, acceptable: 0})), undefined);
});

test('colours stay with the series when others are hidden', () => {
  const study = studyOf('a', 'b');
  const figure = figureOf([[box(0, numbers)], [box(0, numbers)]], ['1']);
  const all = rowsOf(boxPlot(figure, study, options));
  const one = rowsOf(boxPlot(figure, study, {...options, methods: new Set(['b'])}));
  assert.deepEqual(one.map((row) => row.series), ['b']);
  assert.equal(one[0].colour, all[1].colour);
  assert.equal(one[0].x, 0);
  assert.notEqual(colourOf(study.series[0]), colourOf(study.series[1]));
});

test('boxes without numbers are left out', () => {
  const spec = boxPlot(figureOf([[box(0, numbers, {n: 0})]], ['1']), studyOf('a'), options);
  assert.deepEqual(rowsOf(spec), []);
});

test('hostile names are data, never part of an expression', async () => {
  const name = "x']; alert(1); ['\"</svg><script>";
  const spec = boxPlot(figureOf([[box(0, numbers)], [box(0, numbers)]], [name], {xLabel: '', title: name}), studyOf(name, 'b'), options);
  const expressions = JSON.stringify(spec, (key, value) => (key === 'labelExpr' ? `EXPRESSION ${value}` : value))
    .match(/EXPRESSION [^"]*/g);
  assert.ok(expressions.length >= 2);
  for (const expression of expressions) assert.ok(!expression.includes('alert'));
  assert.ok(!(await svgText(spec)).includes('<script'));
});

test('the picture has the size stated, whatever is in it', async () => {
  const long = ['pcl-normal-distributions-transform', 'point-to-plane-icp-with-a-kd-tree', 'a', 'ndt-iterative-infinite-bounds'];
  const boxes = () => [box(0, numbers), box(1, numbers)];
  for (const figure of [
    figureOf([boxes(), boxes(), boxes(), boxes()], ['1', '2']),
    figureOf([[box(0, numbers)], [box(0, numbers)], [box(0, numbers)], [box(0, numbers)]], [''], {xLabel: ''}),
  ]) {
    const spec = boxPlot(figure, studyOf(...long), printOptions(figure));
    const svg = await svgText(spec);
    assert.match(svg, new RegExp(`width="${spec.width}" height="${spec.height}"`));
    const texts = [...svg.matchAll(/role-legend-label"[^>]*><text[^>]*>([^<]*)</g)].map((m) => m[1]);
    if (figure.xLabel) for (const name of long) assert.ok(texts.includes(name), name);
  }
});

test('logarithmic axes cover values and limits with steps of 1, 2 and 5', () => {
  const axis = yAxis([0.012, 0.5], [0.1], true);
  assert.deepEqual(axis.domain, [0.01, 1]);
  assert.deepEqual(axis.ticks, [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1]);
  assert.deepEqual(yAxis([0.0012, 3], [], true).ticks, [0.001, 0.01, 0.1, 1]);
  assert.equal(axis.zero, undefined);
});

test('zeros on a logarithmic axis are drawn on its edge, which is labelled so', () => {
  const figure = figureOf([[box(0, [0, 0.02, 0.03, 0.05, 2])]], ['1']);
  const spec = boxPlot(figure, studyOf('a'), options);
  const [edge] = spec.encoding.y.scale.domain;
  assert.equal(rowsOf(spec)[0].min, edge);
  assert.ok(edge > 0 && edge < 0.02);
  assert.equal(spec.params.find((p) => p.name === 'zero').value, edge);
  assert.ok(spec.encoding.y.axis.values.includes(edge));
});

test('linear axes begin at zero and end above the largest value', () => {
  const axis = yAxis([0.3, 0.64], [], false);
  assert.deepEqual(axis.domain, [0, 0.7]);
  assert.equal(axis.ticks.length, 8);
  assert.deepEqual(yAxis([], [], false).domain, [0, 1]);
  assert.deepEqual(yAxis([0, 0], [], true).domain, [0, 1]);
});

test('steps', () => {
  assert.deepEqual([0.0099, 0.01, 0.3, 7, 1000].map(stepBelow), [0.005, 0.01, 0.2, 5, 1000]);
  assert.deepEqual([0.0099, 0.01, 0.3, 7, 1000].map(stepAbove), [0.01, 0.01, 0.5, 10, 1000]);
});

test('numbers and rates as text', () => {
  assert.equal(numberText(0.0123456), '0.01235');
  assert.equal(numberText(0), '0');
  assert.equal(numberText(1.5e-7), '1.5e-7');
  assert.equal(numberText(NaN), '–');
  assert.equal(rateText(2, 5, [0.1176, 0.7693]), '40 % (12–77)');
  assert.equal(rateText(0, 0, [0, 1]), '–');
});

test('texts break where a line would be too wide', () => {
  assert.deepEqual(wrapped('ndt', 100, 10), ['ndt']);
  assert.deepEqual(wrapped('ndt-outer bounds', 1, 10), ['ndt-', 'outer', 'bounds']);
  assert.ok(textWidth('WWW', 10) > textWidth('iii', 10));
});
