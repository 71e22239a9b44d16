// SPDX-License-Identifier: MIT
// The range and the ticks of the y axis.

const steps = [1, 2, 5, 10];

/** The largest of ..., 0.1, 0.2, 0.5, 1, 2, 5, ... that is not above `value` > 0. */
export function stepBelow(value) {
  const decade = 10 ** Math.floor(Math.log10(value));
  const step = steps.findLast((s) => s * decade <= value * (1 + 1e-9)) ?? 1;
  return Number((step * decade).toPrecision(1));
}

/** The smallest of them that is not below `value`. */
export function stepAbove(value) {
  const below = stepBelow(value);
  if (below >= value * (1 - 1e-9)) return below;
  const decade = 10 ** Math.floor(Math.log10(below) + 1e-9);
  const next = steps.find((s) => s * decade > below * (1 + 1e-9));
  return Number((next * decade).toPrecision(1));
}

/**
 * The y axis for `values` and `limits`: {type, domain, ticks, zero}.
 *
 * zero  on a logarithmic axis, where values of 0 are drawn: the lower edge, a tick of its own; else
 *       undefined
 */
export function yAxis(values, limits, logarithmic) {
  const positive = [...values, ...limits].filter((v) => v > 0);
  if (positive.length === 0) return {type: 'linear', domain: [0, 1], ticks: [0, 1]};
  const smallest = Math.min(...positive);
  const largest = Math.max(...positive);
  if (!logarithmic) return linearAxis(largest);

  const low = stepBelow(smallest / 1.05);  // a whisker shall not end on the frame
  const high = stepAbove(largest * 1.05);
  const decades = Math.log10(high / low);
  const factors = decades <= 2.5 ? [1, 2, 5] : [1];
  const ticks = [];
  for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); ++e)
    for (const factor of factors) {
      const tick = Number((factor * 10 ** e).toPrecision(1));
      if (tick >= low * (1 - 1e-9) && tick <= high * (1 + 1e-9)) ticks.push(tick);
    }
  if (values.every((v) => v > 0)) return {type: 'log', domain: [low, high], ticks};
  // A tenth of the height below the rest, so that "0" and the next label are apart.
  const zero = low / 10 ** Math.max(0.1 * decades, 0.1);
  return {type: 'log', domain: [zero, high], ticks: [zero, ...ticks.filter((t) => t >= low)], zero};
}

function linearAxis(largest) {
  const step = stepAbove(largest / 8);  // four to nine ticks
  const count = Math.ceil((largest * 1.02) / step);
  const ticks = [];
  for (let i = 0; i <= count; ++i) ticks.push(Number((i * step).toPrecision(12)));
  return {type: 'linear', domain: [0, ticks.at(-1)], ticks};
}
