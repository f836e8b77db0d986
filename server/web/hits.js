// SPDX-License-Identifier: Apache-2.0
// The list of what a search has found.
import {element, link, make} from './dom.js';

/** A longer list is searched in other words. */
const LISTED_MAX = 200;

/** What is said of a node beside its name. */
function factsOf(scene, {className, layer, ancestors}) {
  const room = ancestors.find((id) => scene.nodes.get(id)?.group === 'rooms');
  return [className, layer, room && scene.titleOf(room)].filter(Boolean).join(', ');
}

/**
 * Lists hits; none takes the list away.
 * @param {{id: string, name: string, className: string, layer: string, ancestors: string[]}[]} hits
 * @param {string} count how many there are, in words
 * @param {function(string)} choose what a click does
 */
export function fillHits(scene, hits, count, choose) {
  const panel = element('hits');
  // A list that is made anew, of another time, does not take the keys away.
  const focused = panel.contains(document.activeElement) && document.activeElement.dataset.id;
  panel.hidden = hits.length === 0;
  const rows = hits.slice(0, LISTED_MAX).map((hit) => {
    const button = link(hit.name || scene.titleOf(hit.id), () => choose(hit.id));
    button.dataset.id = hit.id;
    return make('li', {}, button, make('span', {className: 'facts'}, ` ${factsOf(scene, hit)}`));
  });
  const rest = hits.length - rows.length;
  panel.replaceChildren(
      make('h3', {}, count), make('ul', {}, ...rows),
      ...(rest > 0 ? [make('p', {}, `and ${rest} more, which are marked in the picture`)] : []));
  rows.find((row) => row.firstChild.dataset.id === focused)?.firstChild.focus();
}

/** Marks the one that is selected. */
export function markHit(id) {
  for (const button of element('hits').querySelectorAll('button')) {
    if (button.dataset.id === id) button.setAttribute('aria-current', 'true');
    else button.removeAttribute('aria-current');
  }
}

/** Arrows go through the list, from the search into it and back. */
export function listenToHits() {
  const go = (event, to) => {
    if (!to) return;
    to.focus();
    event.preventDefault();
  };
  const buttons = () => [...element('hits').querySelectorAll('button')];
  element('query').addEventListener('keydown', (event) => {
    if (event.key === 'ArrowDown') go(event, buttons()[0]);
  });
  element('hits').addEventListener('keydown', (event) => {
    const all = buttons();
    const at = all.indexOf(document.activeElement);
    if (event.key === 'ArrowDown') go(event, all[at + 1]);
    if (event.key === 'ArrowUp') go(event, all[at - 1] ?? element('query'));
  });
}
