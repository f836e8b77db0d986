// SPDX-License-Identifier: Apache-2.0
// The bar that says how long a metre is in the picture.
import {element, setText} from './dom.js';

/** Longest bar, pixels. */
const LONGEST_PX = 120;

/** The longest of 1, 2, 5, 10, 20, ... (or 0.5, 0.2, ...) that is not longer than a length. */
function roundLength(longest) {
  const unit = 10 ** Math.floor(Math.log10(longest));
  // Powers of ten are not exact: 0.2 may be a little more than two tenths.
  const step = [5, 2, 1].find((one) => one * unit <= longest * (1 + 1e-9));
  return Number((step * unit).toPrecision(1));
}

/** Shows the bar; of a picture without a scale (0) none. */
export function drawScale(pixelsPerMetre) {
  const bar = element('scale');
  bar.hidden = !(pixelsPerMetre > 0);
  if (bar.hidden) return;
  const metres = roundLength(LONGEST_PX / pixelsPerMetre);
  bar.style.width = `${(metres * pixelsPerMetre).toFixed(1)}px`;
  setText(bar, `${metres} m`);
}
