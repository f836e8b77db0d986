// SPDX-License-Identifier: Apache-2.0
// What somebody asks about the scene, and its answer on the page: a node, a search, a path, a
// prediction, a comparison. An answer that comes too late is dropped.
import {debounced, element, link, make, setText} from './dom.js';
import {fillInspector} from './panels.js';
import {app, ask, changed, listen, tell} from './state.js';
import {textOf} from './time.js';
import {explain, isSaid} from './trouble.js';

/** How many revisions are offered to compare with. */
const DIFFS_MAX = 50;

const {show, camera} = app;
/** Of the selected node. */
let neighbors = [];

/** Shows what is known of a node; an empty id ends that. */
export async function select(id) {
  show.selected = id;
  neighbors = [];
  inspect();
  changed();
  if (!id) return;
  const asked = app.scene;
  locate();
  try {
    const found = await ask().neighbors(id);
    if (show.selected !== id || app.scene !== asked) return;
    neighbors = found;
    inspect();
    locate();
    tell('changed');
  } catch (error) {
    sayAnswer(error);
  }
}

function inspect() {
  fillInspector(app.scene, show, neighbors, actions);
}

/** Says where the selected agent is at the time that is shown: its room, place and building. */
const locate = debounced(async () => {
  const [asked, agent, time] = [app.scene, show.selected, show.time];
  if (asked?.nodes.get(agent)?.group !== 'agents') return;
  let answer = ['no room is known'];
  try {
    const ids = await ask().where(agent, time);
    const links = ids.map((id) => link(asked.titleOf(id), () => select(id)));
    if (ids.length) answer = links.flatMap((one, i) => (i ? [', ', one] : [one]));
  } catch (error) {
    if (isSaid(error)) return;
    answer = [error.message];
  }
  if (app.scene !== asked || show.selected !== agent || show.time !== time) return;
  // The inspector may have been filled anew meanwhile.
  const where = document.getElementById('where');
  if (where) setText(where, ...answer);
}, 150);

/** An answer (a text, or texts and links), or why there is none, below the inspector's buttons. */
function sayAnswer(what) {
  if (what instanceof Error && isSaid(what)) return;
  const answer = document.getElementById('answer');
  if (answer) setText(answer, ...(what instanceof Error ? [what.message] : [what].flat()));
}

/** An action that says why there is no answer to it. */
const answering = (run) => () => run().catch(sayAnswer);

const actions = {
  select,
  path: answering(async () => {
    const path = await ask().path(camera.target, show.selected, show.time);
    show.path = path.corners;
    sayAnswer(`path of ${path.length.toFixed(1)} m from the middle of the picture, clearance ` +
              `at least ${path.clearance.toFixed(2)} m`);
    tell('redraw', false);
  }),
  history: answering(async () => {
    const versions = await ask().versions(show.selected);
    sayAnswer(['believed since ', ...versions.flatMap(({from, name, className}, i) => [
      i ? ', ' : '', link(`revision ${from}`, () => tell('open', app.map, from)),
      ` (${[name, className].filter(Boolean).join(', ') || 'without a name'})`,
    ])]);
  }),
  predict: answering(async () => {
    show.predictions = await ask().predict(show.selected, show.time);
    sayAnswer(show.predictions.map(
        ({probability, goal}) =>
            `${Math.round(probability * 100)} % ${goal ? `to ${app.scene.titleOf(goal)}` : 'on'}`)
        .join('; '));
    tell('redraw', false);
  }),
};

/** Flies to what is selected. */
export function goTo() {
  const node = app.scene?.nodes.get(show.selected);
  const place = node && (app.scene.placeOf(node, show.time) ?? node.position);
  if (!place) return;
  camera.target = [...place];
  camera.distance = Math.min(camera.distance, 8);
  changed(false);
}

/** Marks what a query finds at the time that is shown; an empty one ends that. */
export async function search(query) {
  if (!app.scene) return;
  app.query = query;
  element('query').value = query;
  show.hits.clear();
  const found = element('found');
  setText(found, '');
  try {
    if (query) {
      const {ids, hasMore} = await ask().search(query, show.time);
      show.hits = new Set(ids);
      setText(found, `${ids.length}${hasMore ? ' and more' : ''} found, ` +
                     `true at ${textOf(show.time, app.scene.map)}`);
      if (ids.length === 1) await select(ids[0]);
    }
  } catch (error) {
    if (isSaid(error)) return;
    setText(found, error.message);
  }
  changed();
}

/** A search is of a time: it is made again for another one. */
const searchAgain = debounced(() => app.query && search(app.query), 300);

/** Forgets the selection, and what was found and asked. */
export function forget() {
  [show.path, show.predictions] = [[], []];
  search('');
  select('');
}

/** Colours what differs from another revision; 0 ends it. */
export async function compare(revision) {
  // A revision does not differ from itself.
  app.diff = revision === app.scene.revision ? 0 : revision;
  show.diff = null;
  show.ghosts = [];
  element('diff').value = app.diff ? String(app.diff) : '';
  if (app.diff) {
    const {states, removed} = await ask().diff(revision);
    show.diff = states;
    show.ghosts = removed;
    const count = (name) => [...states.values()].filter((one) => one === name).length;
    setText(element('found'), `+${count('added')} -${count('removed')} ~${count('changed')} ` +
                              `since revision ${revision}`);
  }
  changed();
}

/** Offers tags and the newest revisions to compare with. */
export function fillDiffs() {
  const options = [make('option', {value: ''}, 'nothing')];
  for (const tag of app.tags) {
    options.push(make('option', {value: String(tag.revision)}, `${tag.name} (${tag.revision})`));
  }
  for (const {number} of app.revisions.slice(-DIFFS_MAX).reverse()) {
    options.push(make('option', {value: String(number)}, `revision ${number}`));
  }
  element('diff').replaceChildren(...options);
  element('diff').value = app.diff ? String(app.diff) : '';
}

/** Connects the search and the choice of a comparison. */
export function startAnswers() {
  element('search').onsubmit = (event) => {
    event.preventDefault();
    search(element('query').value.trim());
  };
  element('diff').onchange = () => compare(Number(element('diff').value)).catch(explain);
  listen('time', () => app.query && searchAgain());
  listen('positions', () => {
    if (show.selected) inspect();
    if (app.scene.nodes.get(show.selected)?.group === 'agents') locate();
  });
}
