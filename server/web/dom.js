// SPDX-License-Identifier: Apache-2.0
// Small helpers for the page. All text goes in as text, by `make` and `setText`: names come from
// logs, and are never markup.

/** Marks that turn the direction of what follows: they would make a name look like another one. */
const DIRECTION_MARKS = /[\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]/g;

/** A text as it is shown: marks of direction by their number, as [U+202E]. */
export function visible(text) {
  return text.replace(DIRECTION_MARKS, (mark) => {
    const number = mark.charCodeAt(0).toString(16).toUpperCase().padStart(4, '0');
    return `[U+${number}]`;
  });
}

/** Children as they go into an element: texts become visible ones. */
const shown = (children) => children.map(
    (child) => (typeof child === 'string' ? visible(child) : child));

/** @returns {HTMLElement} */
export function element(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no #${id}`);
  return found;
}

/**
 * A new element with children, which are elements or text.
 * @param {string} tag
 * @param {object} properties of the element, as className or onclick
 */
export function make(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...shown(children));
  return made;
}

/** Puts texts and elements into an element, instead of what it has. */
export function setText(into, ...children) {
  into.replaceChildren(...shown(children));
}

/** Text that leads somewhere. */
export function link(text, onclick) {
  return make('button', {className: 'link', type: 'button', onclick}, text);
}

/** A term and what is to be said of it, for a list of definitions. */
export function pair(term, ...value) {
  return [make('dt', {}, term), make('dd', {}, ...value)];
}

export function metres(value) {
  return `${value.toFixed(2)} m`;
}

/** At most so many characters of a text; what is left out is marked. */
export function shortened(text, most) {
  const characters = [...text];
  return characters.length > most ? `${characters.slice(0, most - 1).join('')}\u2026` : text;
}

/** Runs a function once the calls have stopped for a while. */
export function debounced(run, milliseconds) {
  let timer = 0;
  return () => {
    clearTimeout(timer);
    timer = setTimeout(run, milliseconds);
  };
}
