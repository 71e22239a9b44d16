// SPDX-License-Identifier: MIT
// Widths of text and numbers as text.

export const fontFamily = 'Helvetica, Arial, "Liberation Sans", sans-serif';

// Advance widths of Helvetica in 1/1000 of the font size, for the characters 32 to 126 (Adobe's font
// metrics of the core 14 fonts). Arial and Liberation Sans have the same.
const widths = [
  278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556,
  556, 556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667, 611, 778,
  722, 278, 500, 667, 556, 833, 722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278,
  278, 278, 469, 556, 333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556,
  556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584,
];
const otherWidth = 1000;  // anything else: as wide as an ideograph, to be on the safe side

// The font that stands in where there is none of these, DejaVu Sans, is wider by 10 to 17 %
// (assumed); with it text shall not overlap either.
const margin = 1.17;

/** Room for a line of text, in the unit of `fontSize`. */
export function textWidth(text, fontSize) {
  let sum = 0;
  for (const character of String(text)) sum += widths[character.codePointAt(0) - 32] ?? otherWidth;
  return (margin * sum * fontSize) / 1000;
}

/** Breaks a text after blanks, commas and hyphens into lines of at most `width`; a part that is wider
 * stands alone on its line. */
export function wrapped(text, width, fontSize) {
  const lines = [];
  let line = '';
  for (const part of String(text).split(/(?<=[\s,\-_/])/)) {
    if (line && textWidth((line + part).trimEnd(), fontSize) > width) {
      lines.push(line.trimEnd());
      line = '';
    }
    line += part;
  }
  lines.push(line.trimEnd());
  return lines;
}

/** A number with `digits` significant digits, without needless zeros. */
export function numberText(value, digits = 4) {
  if (!Number.isFinite(value)) return '–';
  if (value !== 0 && (Math.abs(value) < 1e-4 || Math.abs(value) >= 1e6))
    return value.toExponential(digits - 1).replace(/\.?0+e/, 'e');
  return String(Number(value.toPrecision(digits)));
}

/** "97 % (91–99)" of a rate and its interval. */
export function rateText(count, trials, [low, high]) {
  if (trials === 0) return '–';
  const percent = (rate) => (100 * rate).toFixed(0);
  return `${percent(count / trials)} % (${percent(low)}–${percent(high)})`;
}
