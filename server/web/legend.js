// SPDX-License-Identifier: Apache-2.0
// What shapes and colours of the picture mean; those of layers stand beside their switches.
import {DIFF_COLORS, HIT, PATH, PREDICTION, SELECTED, cssOf} from './colors.js';
import {element, make} from './dom.js';
import {colorOfGroup} from './scene.js';

/** Shape of the mark (a class of style.css), colour, meaning. */
const MEANINGS = [
  ['dot', colorOfGroup('agents'), 'somebody; ten colours, which repeat'],
  ['ring', colorOfGroup('agents'), 'in a gap: where they were last'],
  ['band', colorOfGroup('agents'), 'their way; older is thinner'],
  ['box', colorOfGroup('objects'), 'the box of an object'],
  ['dot', colorOfGroup('places'), 'a place'],
  ['floor', colorOfGroup('rooms'), 'floor and height of a room'],
  ['line', colorOfGroup('rooms'), 'a relation'],
  ['box', SELECTED, 'selected'],
  ['box', HIT, 'found'],
  ['band', PATH, 'a path'],
  ['band', PREDICTION, 'where they may go; likelier is wider'],
  // Two standard deviations in the plane.
  ['ring', PREDICTION, 'where they are then: inside with 86 %'],
  ['box', DIFF_COLORS.added, 'added'],
  ['box', DIFF_COLORS.changed, 'changed'],
  ['box', DIFF_COLORS.same, 'the same'],
  ['floor', DIFF_COLORS.removed, 'edges of what was removed'],
];

export function fillLegend() {
  element('legend').append(...MEANINGS.map(([shape, color, meaning]) => {
    const mark = make('span', {className: `mark ${shape}`});
    mark.style.color = cssOf(color);
    return make('div', {className: 'row'}, mark, meaning);
  }));
}
