// SPDX-License-Identifier: MIT
// Builds the report in the browser from the JSON beside this script. Text from the data becomes text
// nodes and attributes, never markup.

import {draw, svgText} from './picture.mjs';
import {boxPlot, printOptions} from './spec.mjs';
import {numbersTable, runsTable, seriesTable} from './tables.mjs';
import {element} from './element.mjs';
import {numberText} from './text.mjs';

const guide = [
  ['Box', 'from the lower to the upper quartile; the thick line with the mark is the median.'],
  ['Whiskers', 'reach to the smallest and the largest of all values: no value is left out as an outlier.'],
  ['Line', 'through the medians of successive settings.'],
  ['Good', 'a registration that converged within 0.10 m and 0.005 rad of the truth (dashed line in each figure); '
    + 'acceptable: within 0.20 m and 0.010 rad (dotted line). Both errors count: a good position with a bad '
    + 'rotation is not good.'],
  ['Rates', 'are of all trials, those that failed too, with the 95 % interval of Wilson.'],
  ['Time', 'is wall time of the whole registration, preparation of both clouds included.'],
];

function readingGuide() {
  const list = guide.map(([term, text]) => [element('dt', {}, term), element('dd', {}, text)]);
  return element('section', {class: 'guide'}, element('h2', {}, 'How to read the figures'), element('dl', {}, ...list.flat()));
}

/** "1 m" or "0.5 to 4 m". */
function range([low, high], unit) {
  return low === high ? `${numberText(low)} ${unit}` : `${numberText(low)} to ${numberText(high)} ${unit}`;
}

function listed(values, most) {
  const shown = values.slice(0, most).join(', ');
  return values.length > most ? `${shown} and ${values.length - most} more` : shown;
}

function facts(study) {
  const rows = [
    ['Trials', String(study.trials)],
    [study.pairs.length === 1 ? 'Pair of scans' : `${study.pairs.length} pairs of scans`, listed(study.pairs, 8)],
    ['Error of the start pose', `${range(study.initialTranslation, 'm')}, ${range(study.initialRotation, 'rad')}`],
    [study.seeds.length === 1 ? 'Seed' : 'Seeds', listed(study.seeds, 8)],
  ];
  const list = rows.map(([term, text]) => [element('dt', {}, term), element('dd', {}, text)]);
  return element('dl', {class: 'facts'}, ...list.flat());
}

/** A link that saves the figure as it would be printed. */
function saveButton(figure, study, methods) {
  const button = element('button', {type: 'button', class: 'save'}, 'Save as SVG');
  button.addEventListener('click', async () => {
    const svg = await svgText(boxPlot(figure, study, {methods: methods(), ...printOptions(figure)}));
    const link = element('a', {href: URL.createObjectURL(new Blob([svg], {type: 'image/svg+xml'})), download: `${figure.name}.svg`});
    link.click();
    URL.revokeObjectURL(link.href);
  });
  return button;
}

/** A figure with its table; `update` draws it anew for the methods chosen and the width at hand. */
function figurePart(figure, study, number, methods) {
  const canvas = element('div', {class: 'canvas'});
  const table = element('div', {class: 'scroll'});
  const caption = `Figure ${number}. ${figure.title}.`;
  const node = element('figure', {id: `figure-${number}`},
    canvas,
    element('figcaption', {}, element('strong', {}, caption + ' '), saveButton(figure, study, methods)),
    element('details', {}, element('summary', {}, 'Numbers'), table));
  let remove = () => {};
  const update = () => {
    const chosen = methods();
    table.replaceChildren(numbersTable(figure, study, chosen, caption));
    remove();
    canvas.replaceChildren();
    const width = Math.max(320, Math.min(960, Math.floor(canvas.clientWidth)));
    remove = draw(boxPlot(figure, study, {methods: chosen, title: false, width, plotHeight: 300, fontSize: 12}), canvas);
  };
  return {node, update};
}

/** One checkbox for each method, for all figures. */
function methodFilter(data, onChange) {
  const names = new Set(data.studies.flatMap((study) => study.series.map((series) => series.method)));
  const boxes = [...names].sort().map((method) => {
    const input = element('input', {type: 'checkbox', checked: ''});
    input.addEventListener('change', onChange);
    return {method, input, node: element('label', {}, input, method)};
  });
  const node = element('fieldset', {class: 'filter'}, element('legend', {}, 'Methods shown'), ...boxes.map((b) => b.node));
  return {node, methods: () => new Set(boxes.filter((b) => b.input.checked).map((b) => b.method))};
}

function studyPart(study, first, methods) {
  const parts = study.figures.map((figure, i) => figurePart(figure, study, first + i, methods));
  const messages = study.messages.length > 0
    ? [element('h3', {}, 'Errors reported'), element('ul', {class: 'messages'}, ...study.messages.map((m) => element('li', {}, m)))]
    : [];
  const node = element('section', {id: `study-${first}`, class: 'study'},
    element('h2', {}, study.name || 'Without a study'),
    ...(study.description ? [element('p', {class: 'description'}, study.description)] : []),
    facts(study),
    ...parts.map((part) => part.node),
    element('h3', {}, 'What was run'),
    element('div', {class: 'scroll'}, seriesTable(study)),
    ...messages);
  return {node, parts};
}

function contents(studies, firsts) {
  const items = studies.map((study, i) =>
    element('li', {}, element('a', {href: `#study-${firsts[i]}`}, study.name || 'Without a study'),
      ` – ${study.trials} trials, ${study.series.length} series`));
  return element('nav', {'aria-label': 'Studies'}, element('ul', {}, ...items));
}

function build(data, root) {
  const trials = data.studies.reduce((sum, study) => sum + study.trials, 0);
  root.replaceChildren(
    element('header', {},
      element('h1', {}, 'Scan registration report'),
      element('p', {}, trials === 0
        ? 'Nothing was run: the result files hold no trials.'
        : `${trials} registrations in ${data.studies.length} ${data.studies.length === 1 ? 'study' : 'studies'}.`)));
  const runs = element('section', {}, element('h2', {}, 'Runs'), element('div', {class: 'scroll'}, runsTable(data.runs)));
  if (trials === 0) {
    root.append(runs);
    return;
  }
  const all = [];
  // Figure by figure, so that the page answers meanwhile; a newer call takes over.
  let latest = 0;
  const redraw = async () => {
    const call = ++latest;
    for (const part of all) {
      part.update();
      await new Promise((resume) => setTimeout(resume));
      if (call !== latest) return;
    }
  };
  const filter = methodFilter(data, redraw);
  const firsts = [];
  const studies = data.studies.map((study) => {
    firsts.push(all.length + 1);
    const {node, parts} = studyPart(study, all.length + 1, filter.methods);
    all.push(...parts);
    return node;
  });
  root.append(readingGuide(), contents(data.studies, firsts), filter.node, ...studies, runs);

  let width = root.clientWidth;
  let waiting = 0;
  window.addEventListener('resize', () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => {
      if (root.clientWidth === width) return;
      width = root.clientWidth;
      redraw();
    }, 200);
  });
  // The numbers belong to the printed page.
  window.addEventListener('beforeprint', () => {
    for (const details of root.querySelectorAll('details')) details.open = true;
  });
  redraw();
}

build(JSON.parse(document.getElementById('report-data').textContent), document.getElementById('report'));
