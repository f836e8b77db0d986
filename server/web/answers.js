// SPDX-License-Identifier: Apache-2.0
// What somebody asks about the scene, and its answer on the page: a node, a search, a path, a
// prediction, a comparison. An answer that comes too late is dropped.
import {setPlaying} from './clock.js';
import {debounced, element, link, make, setText} from './dom.js';
import {fillHits, listenToHits, markHit} from './hits.js';
import {fillInspector} from './panels.js';
import {liftOf} from './show.js';
import {app, ask, changed, listen, tell} from './state.js';
import {textOf} from './time.js';
import {explain, isSaid} from './trouble.js';

/** How many revisions are offered to compare with. */
const DIFFS_MAX = 50;
/** How near somebody comes who flies to a thing that is not large, metres. */
const NEAR_M = 8;

const {show, camera} = app;
/** Of the selected node. */
let neighbors = [];
/** The last answer about it. */
let answer = [];

/** Shows what is known of a node; an empty id ends that. */
export async function select(id) {
  show.selected = id;
  [neighbors, answer] = [[], []];
  inspect();
  markHit(id);
  changed();
  if (!id) return;
  const asked = app.scene;
  if (!asked.nodes.has(id)) {
    await lookUp(id);
    return;
  }
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

/** Selects the node that is meant by a name, or says what is wrong with an id that is not shown. */
async function lookUp(word) {
  const asked = app.scene;
  try {
    const id = await ask().idOf(word);
    if (show.selected !== word || app.scene !== asked) return;
    if (asked.nodes.has(id)) await select(id);
    else sayAnswer('it is in the map, and not among the nodes that are drawn');
  } catch (error) {
    if (show.selected === word && app.scene === asked) sayAnswer(error);
  }
}

function inspect() {
  fillInspector(app.scene, show, neighbors, actions);
  putAnswer();
}

/** Says where the selected agent is at the time that is shown: its room, place and building. */
const locate = debounced(async () => {
  const [asked, agent, time] = [app.scene, show.selected, show.time];
  if (asked?.nodes.get(agent)?.group !== 'agents') return;
  let known = ['no room is known'];
  try {
    const ids = await ask().where(agent, time);
    const links = ids.map((id) => link(asked.titleOf(id), () => select(id)));
    if (ids.length) known = links.flatMap((one, i) => (i ? [', ', one] : [one]));
  } catch (error) {
    if (isSaid(error)) return;
    known = [error.message];
  }
  if (app.scene !== asked || show.selected !== agent || show.time !== time) return;
  // The inspector may have been filled anew meanwhile.
  const where = document.getElementById('where');
  if (where) setText(where, ...known);
}, 150);

/** An answer (a text, or texts and links), or why there is none, below the inspector's buttons. */
function sayAnswer(what) {
  if (what instanceof Error && isSaid(what)) return;
  answer = what instanceof Error ? [what.message] : [what].flat();
  putAnswer();
}

function putAnswer() {
  const into = document.getElementById('answer');
  if (into && answer.length) setText(into, ...answer);
}

/**
 * An action that asks about what is selected, and says what is answered or why nothing is.
 * @param {function(): Promise} question
 * @param {function(object)} words what is to be said of the reply
 */
const answering = (question, words) => async () => {
  const [asked, id] = [app.scene, show.selected];
  const isLate = () => app.scene !== asked || show.selected !== id;
  try {
    const reply = await question();
    if (!isLate()) sayAnswer(words(reply));
  } catch (error) {
    if (!isLate()) sayAnswer(error);
  }
};

const actions = {
  select,
  path: answering(() => ask().path(camera.target, show.selected, show.time), (path) => {
    show.path = path.corners;
    tell('redraw', false);
    return `path of ${path.length.toFixed(1)} m from the middle of the picture, clearance ` +
           `at least ${path.clearance.toFixed(2)} m`;
  }),
  history: answering(() => ask().versions(show.selected), (versions) => [
    'believed since ', ...versions.flatMap(({from, name, className}, i) => [
      i ? ', ' : '', link(`revision ${from}`, () => tell('open', app.map, from)),
      ` (${[name, className].filter(Boolean).join(', ') || 'without a name'})`,
    ]),
  ]),
  predict: answering(async () => {
    // What is predicted of a time is shown of no other one.
    setPlaying(false);
    const {time} = show;
    const ways = await ask().predict(show.selected, time);
    return show.time === time ? ways : [];
  }, (ways) => {
    show.predictions = ways;
    tell('redraw', false);
    return ways.map(
        ({probability, goal}) =>
            `${Math.round(probability * 100)} % ${goal ? `to ${app.scene.titleOf(goal)}` : 'on'}`)
        .join('; ');
  }),
};

/** Flies to what is selected. */
export function goTo() {
  const {scene} = app;
  const node = scene?.nodes.get(show.selected);
  const place = node && (scene.placeOf(node, show.time) ?? node.position);
  if (!place) return;
  camera.target = [place[0], place[1], place[2] + liftOf(scene, show, node)];
  const size = node.box ? Math.hypot(...node.box.max.map((v, i) => v - node.box.min[i])) : 0;
  camera.distance = Math.min(camera.distance, Math.max(NEAR_M, 2 * size));
  changed(false);
}

/** Selects a node, and flies to it. */
function visit(id) {
  select(id);
  goTo();
}

/** Takes away what was found. */
export function clearHits() {
  show.hits.clear();
  fillHits(app.scene, [], '', visit);
  setText(element('found'), '');
}

/** Marks and lists what a query finds at the time that is shown; an empty one ends that. */
export async function search(query) {
  const asked = app.scene;
  if (!asked) return;
  app.query = query;
  element('query').value = query;
  const found = element('found');
  setText(found, '');
  show.hits.clear();
  let [hits, count] = [[], ''];
  try {
    if (query) {
      const reply = await ask().search(query, show.time);
      if (app.scene !== asked || app.query !== query) return;
      hits = reply.hits;
      count = `${hits.length}${reply.hasMore ? ' and more' : ''} found`;
      show.hits = new Set(hits.map(({id}) => id));
      setText(found, `${count}, true at ${textOf(show.time, asked.map)}`);
    }
  } catch (error) {
    if (isSaid(error) || app.query !== query) return;
    setText(found, error.message);
  }
  fillHits(asked, hits, count, visit);
  if (hits.length === 1) await select(hits[0].id);
  markHit(show.selected);
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
  if (app.diff) setText(element('found'), '');
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
  listenToHits();
  listen('time', () => {
    if (show.predictions.length) {
      show.predictions = [];
      sayAnswer('');
    }
    if (app.query) searchAgain();
  });
  listen('positions', () => {
    if (show.selected) inspect();
    if (app.scene.nodes.get(show.selected)?.group === 'agents') locate();
  });
}
