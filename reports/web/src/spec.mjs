// SPDX-License-Identifier: MIT
// One figure of the report -> a Vega-Lite specification.
//
// Boxes are drawn from the quartiles and extremes that the program computed; nothing is computed from
// data here. Series stand side by side at each level of x, and a line joins their medians.

import {fontFamily, numberText, rateText, textWidth, wrapped} from './text.mjs';
import {yAxis} from './scale.mjs';

// Okabe & Ito, "Color Universal Design", 2008, in an order that starts with the strongest contrast;
// without yellow, which is too faint on white.
const palette = ['#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00', '#56B4E9', '#4D4D4D'];
const shapes = ['circle', 'square', 'triangle-up', 'diamond', 'triangle-down', 'cross', 'triangle-right'];
const ink = '#222222';
const pale = '#E3E3E3';

export const colourOf = (series) => palette[series.colour % palette.length];

// Beyond seven colours the shape still differs: it moves on by one in each round of the palette.
const shapeOf = (series) =>
  shapes[(series.colour + Math.floor(series.colour / palette.length)) % shapes.length];

/** The colour with three parts of white. */
function tint(colour) {
  const channel = (i) => Math.round(255 - (255 - parseInt(colour.slice(i, i + 2), 16)) / 4);
  return `rgb(${channel(1)},${channel(3)},${channel(5)})`;
}

/** Number of boxes that have something to draw. */
export function boxCount(figure) {
  return figure.series.reduce((sum, s) => sum + s.boxes.filter((b) => b.n > 0).length, 0);
}

/** What was measured at one level, in a line of text. */
function summary(name, level, box, unit) {
  const number = (value) => numberText(value) + (unit ? ' ' + unit : '');
  return (
    `${name}${level ? ' at ' + level : ''}: median ${number(box.median)}, quartiles ` +
    `${number(box.q1)} and ${number(box.q3)}, from ${number(box.min)} to ${number(box.max)}; ` +
    `good ${rateText(box.good, box.trials, box.goodInterval)} of ${box.trials}`
  );
}

/** Where the series and levels stand on x, in units of one level. */
function layOut(figure, shown, plotWidth) {
  const onX = !figure.xLabel;  // the series themselves are on x
  const levels = onX ? shown.map(({series}) => series.name) : figure.levels;
  const side = onX ? 1 : shown.length;
  const step = 0.84 / side;
  const unit = plotWidth / Math.max(levels.length, 1);
  // At most 13 px to each side: wider boxes look clumsy.
  const half = Math.min(0.4 * step, 13 / unit);
  const dodge = Math.min(step, (2.6 * 13) / unit);
  return {
    onX,
    levels,
    half,
    x: (level, k) => (onX ? k : level + (k - (side - 1) / 2) * dodge),
  };
}

function rows(figure, shown, place, lift) {
  return shown.flatMap(({series, boxes}, k) =>
    boxes
      .filter((box) => box.n > 0)
      .map((box) => {
        const x = place.x(box.level, k);
        return {
          series: series.name,
          x,
          left: x - place.half,
          right: x + place.half,
          capLeft: x - place.half / 2,
          capRight: x + place.half / 2,
          min: lift(box.min),
          q1: lift(box.q1),
          median: lift(box.median),
          q3: lift(box.q3),
          max: lift(box.max),
          colour: colourOf(series),
          tint: tint(colourOf(series)),
          summary: summary(series.name, place.onX ? '' : figure.levels[box.level], box, figure.unit),
        };
      }),
  );
}

/** Labels of x that fit beside each other: broken into lines, or upright where that does not do. */
function xLabels(place, plotWidth, fontSize) {
  if (!place.onX) return {labels: place.levels, lines: 1, angle: 0};
  const room = plotWidth / Math.max(place.levels.length, 1) - 8;
  const labels = place.levels.map((level) => wrapped(level, room, fontSize));
  const fits = labels.every((l) => l.length <= 4 && l.every((t) => textWidth(t, fontSize) <= room));
  if (fits) return {labels, lines: Math.max(1, ...labels.map((l) => l.length)), angle: 0};
  return {labels: place.levels, lines: 1, angle: -90};
}

/** How many legend entries stand in a line of `width`, the lines being equally full. */
function legendColumns(names, width, fontSize) {
  const entry = Math.max(0, ...names.map((name) => textWidth(name, fontSize))) + 32;
  const most = Math.max(1, Math.floor(width / entry));
  return Math.ceil(names.length / Math.max(1, Math.ceil(names.length / most)));
}

function limitsOf(figure) {
  const unit = figure.unit ? ' ' + figure.unit : '';
  const limits = [];
  if (figure.good > 0) limits.push({name: `good: ${figure.good}${unit}`, y: figure.good, dash: [5, 3]});
  if (figure.acceptable > 0)
    limits.push({name: `acceptable: ${figure.acceptable}${unit}`, y: figure.acceptable, dash: [1.5, 2.5]});
  return limits;
}

const q = (field) => ({field, type: 'quantitative'});
const own = (field) => ({field, type: 'nominal', scale: null, legend: null});

/** Boxes from back to front: whiskers, caps, box, median, line through the medians, its points. */
function boxLayers(place, names, shown, legendLayout, fontSize) {
  const rule = (x, x2, y, y2, width) => ({
    mark: {type: 'rule', strokeWidth: width, strokeCap: 'butt'},
    encoding: {
      x: q(x),
      ...(x2 && {x2: {field: x2}}),
      y: q(y),
      ...(y2 && {y2: {field: y2}}),
      stroke: own('colour'),
    },
  });
  const layers = [
    rule('x', null, 'min', 'q1', 1),
    rule('x', null, 'q3', 'max', 1),
    rule('capLeft', 'capRight', 'min', null, 1),
    rule('capLeft', 'capRight', 'max', null, 1),
    {
      mark: {type: 'rect', strokeWidth: 1},
      encoding: {
        x: q('left'),
        x2: {field: 'right'},
        y: q('q1'),
        y2: {field: 'q3'},
        fill: own('tint'),
        stroke: own('colour'),
        tooltip: {field: 'summary', type: 'nominal'},
      },
    },
  ];
  if (!place.onX && place.levels.length > 1)
    layers.push({
      mark: {type: 'line', strokeWidth: 1},
      encoding: {x: q('x'), y: q('median'), stroke: own('colour'), detail: {field: 'series', type: 'nominal'}},
    });
  layers.push(rule('left', 'right', 'median', null, 2));
  const legend = place.onX
    ? null
    : {orient: 'top', title: null, ...legendLayout, symbolStrokeWidth: 0, symbolSize: 5 * fontSize};
  const encoding = (range) => ({field: 'series', type: 'nominal', scale: {domain: names, range}, sort: null, legend});
  layers.push({
    mark: {type: 'point', filled: true, opacity: 1, size: 2.2 * fontSize},
    encoding: {
      x: q('x'),
      y: q('median'),
      color: encoding(shown.map(({series}) => colourOf(series))),
      shape: encoding(shown.map(({series}) => shapeOf(series))),
      tooltip: {field: 'summary', type: 'nominal'},
    },
  });
  return layers;
}

function limitLayer(limits) {
  return {
    data: {values: limits},
    mark: {type: 'rule', strokeWidth: 1, color: ink},
    encoding: {
      y: q('y'),
      strokeDash: {
        field: 'name',
        type: 'nominal',
        sort: null,
        scale: {domain: limits.map((l) => l.name), range: limits.map((l) => l.dash)},
        legend: {orient: 'top', title: null, columns: limits.length, symbolType: 'stroke', symbolSize: 260},
      },
    },
  };
}

function config(fontSize) {
  return {
    font: fontFamily,
    background: 'white',
    view: {stroke: ink, strokeWidth: 0.8},
    axis: {
      labelFontSize: fontSize,
      titleFontSize: fontSize,
      titleFontWeight: 'normal',
      labelColor: ink,
      titleColor: ink,
      tickColor: ink,
      tickWidth: 0.8,
      tickSize: 4,
      domain: false,
      gridColor: pale,
      gridWidth: 0.6,
      titlePadding: 6,
    },
    title: {
      fontSize: fontSize + 1,
      fontWeight: 'bold',
      color: ink,
      anchor: 'start',
      frame: 'bounds',
      offset: 6,
    },
    legend: {
      labelFontSize: fontSize,
      labelColor: ink,
      labelLimit: 0,
      labelOffset: 4,
      symbolStrokeColor: ink,
      columnPadding: 16,
      rowPadding: 2,
      offset: 6,
      padding: 0,
      layout: {top: {anchor: 'start', direction: 'vertical', margin: 3}},
    },
  };
}

/**
 * The specification of a figure.
 *
 * study      what the figure belongs to: its `series` name and colour the boxes
 * options    methods: a Set of those to show, or null for all; title: whether it is in the picture;
 *            width and plotHeight in px; fontSize
 * returns    a Vega-Lite specification whose picture is exactly spec.width by spec.height
 */
export function boxPlot(figure, study, {methods = null, title = true, width, plotHeight, fontSize}) {
  const shown = figure.series
    .map(({series, boxes}) => ({series: study.series[series], boxes}))
    .filter(({series}) => methods === null || methods.has(series.method));
  const names = shown.map(({series}) => series.name);
  const plotWidth = width - 5 * fontSize - 10;  // the y axis takes about five letters

  const limits = limitsOf(figure);
  const drawn = shown.flatMap(({boxes}) => boxes).filter((box) => box.n > 0);
  const axis = yAxis(
    drawn.flatMap((box) => [box.min, box.q1, box.median, box.q3, box.max]),
    limits.map((l) => l.y),
    figure.log,
  );
  const lift = (value) => (axis.type === 'log' && value <= 0 ? axis.zero : value);
  const place = layOut(figure, shown, plotWidth);
  const x = xLabels(place, plotWidth, fontSize);
  const columns = legendColumns(names, plotWidth, fontSize);

  const legendRows = (place.onX ? 0 : Math.ceil(names.length / columns)) + (limits.length > 0 ? 1 : 0);
  const longest = Math.max(0, ...place.levels.map((level) => textWidth(level, fontSize)));
  const labelHeight = x.angle === 0 ? x.lines * (fontSize + 2) : Math.min(longest, 14 * fontSize);
  const lineHeight = fontSize + 4;
  const height = Math.round(
    plotHeight + legendRows * lineHeight + labelHeight + (place.onX ? 0 : lineHeight + 4) + (title ? 2 : 1) * lineHeight,
  );

  return {
    $schema: 'https://vega.github.io/schema/vega-lite/v6.json',
    description: `${figure.title}: box plot of ${names.join('; ')}`,
    ...(title && {title: figure.title}),
    width,
    height,
    autosize: {type: 'fit', contains: 'padding'},
    padding: 4,
    config: config(fontSize),
    // Names reach the picture as data, never inside an expression.
    params: [
      {name: 'levels', value: x.labels},
      {name: 'zero', value: axis.zero ?? null},
    ],
    data: {values: rows(figure, shown, place, lift)},
    encoding: {
      x: {
        type: 'quantitative',
        scale: {domain: [-0.5, Math.max(place.levels.length, 1) - 0.5], nice: false, zero: false},
        axis: {
          values: place.levels.map((_, i) => i),
          labelExpr: 'levels[datum.value]',
          labelAngle: x.angle,
          labelAlign: x.angle === 0 ? 'center' : 'right',
          labelBaseline: x.angle === 0 ? 'top' : 'middle',
          labelLimit: x.angle === 0 ? 0 : 14 * fontSize,
          labelOverlap: !place.onX,
          title: figure.xLabel || null,
          grid: false,
        },
      },
      y: {
        type: 'quantitative',
        scale: {type: axis.type, domain: axis.domain, nice: false, ...(axis.type === 'linear' && {zero: false})},
        axis: {
          values: axis.ticks,
          labelExpr: "datum.value === zero ? '0' : format(datum.value, '~g')",
          labelOverlap: false,
          title: figure.yLabel + (axis.type === 'log' ? ', log scale' : ''),
          grid: true,
          minExtent: 4.2 * fontSize,  // so that the frames of a study's figures are in line
        },
      },
    },
    layer: [
      ...boxLayers(place, names, shown, {columns, labelLimit: plotWidth - 20}, fontSize),
      ...(limits.length > 0 ? [limitLayer(limits)] : []),
    ],
  };
}

/** Sizes for print: the columns of a two-column page are 3.5 and 7.125 inches wide (IEEE), at 96 px
 * per inch; 10 px are 7.5 points. */
export function printOptions(figure) {
  return {width: boxCount(figure) > 24 ? 684 : 336, plotHeight: 190, fontSize: 10};
}
