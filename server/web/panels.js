// SPDX-License-Identifier: Apache-2.0
// What stands beside the picture: the layers, what is selected, and the same facts as a table.
import {colorOfAgent, cssOf} from './colors.js';
import {element, link, make, metres, pair} from './dom.js';
import {NEIGHBORS_MAX} from './questions.js';
import {GROUPS} from './scene.js';
import {durationText, textOf} from './time.js';

const ROWS_MAX = 1000;

function swatch(rgb) {
  const made = make('span', {className: 'swatch'});
  made.style.background = cssOf(rgb);
  return made;
}

/**
 * The layers, and how they are shown.
 * @param {{changed: function(), explode: function(number)}} on `changed` is called after each
 *     change of `show`; `explode` sets how far layers are apart, from 0 to 1
 */
export function fillLayers(scene, show, on) {
  const rows = GROUPS.map((group, i) => {
    const box = make('input', {type: 'checkbox', checked: !show.hidden.has(group.name),
                               id: `layer-${group.name}`});
    box.onchange = () => {
      if (box.checked) show.hidden.delete(group.name);
      else show.hidden.add(group.name);
      on.changed();
    };
    const count = group.name === 'mesh' ? Number(scene.stats.mesh_block_count)
                                        : scene.of(group.name).length;
    return make('label', {className: 'row', title: `key ${i + 1}`}, box, swatch(group.color),
                group.title, make('span', {className: 'count'}, String(count)));
  });
  const explode = make('input', {type: 'range', id: 'explode', min: '0', max: '1', step: '0.01',
                                 value: String(show.explode)});
  explode.oninput = () => on.explode(Number(explode.value));
  const edges = make('input', {type: 'checkbox', id: 'edges', checked: show.hasEdges});
  edges.onchange = () => {
    show.hasEdges = edges.checked;
    on.changed();
  };
  const tail = make('input', {type: 'range', min: '0', max: '300', step: '5',
                              value: String(show.tail)});
  tail.oninput = () => {
    show.tail = Number(tail.value);
    on.changed();
  };
  const notes = scene.notes.map((text) => make('p', {}, text));
  element('layers').replaceChildren(
      ...rows, make('label', {className: 'row'}, edges, 'Edges'),
      make('label', {className: 'row'}, 'Layers apart', explode),
      make('label', {className: 'row'}, 'Trails', tail), ...notes);
}

/** Agents whose stay or position is a question of the time say where they are. */
function placeFacts(scene, show, node) {
  if (node.group !== 'agents') {
    const at = node.position;
    return at ? pair('position', at.map((v) => v.toFixed(2)).join(', ')) : [];
  }
  const track = scene.tracks.get(node.id);
  if (!track) return pair('track', 'none');
  const here = scene.agentAt(node.id, show.time);
  const where = !here ? 'outside of the track'
      : here.known ? here.position.map((v) => v.toFixed(2)).join(', ')
                   : 'in a gap of the track';
  return [...pair('position now', where),
          ...pair('seen', `${textOf(track.from, scene.map)} to ${textOf(track.to, scene.map)}`)];
}

/**
 * The inspector of a node.
 * @param {object[]} neighbors of GetNeighbors
 * @param {{select: function(string), path: function(), predict: function(),
 *     history: function()}} actions
 */
export function fillInspector(scene, show, neighbors, actions) {
  const panel = element('inspector');
  const node = scene?.nodes.get(show.selected);
  if (!node) {
    panel.replaceChildren(...(show.selected ? [make('h2', {}, show.selected),
                                               make('p', {id: 'answer'}, 'not in the picture')]
                                            : [make('p', {}, 'Click on something, or search.')]));
    return;
  }
  const facts = [
    ...pair('id', node.id), ...pair('kind', node.kind), ...pair('layer', node.layer),
    ...(node.className ? pair('class', node.className) : []), ...placeFacts(scene, show, node),
  ];
  if (node.box && node.box.max[0] > node.box.min[0]) {
    facts.push(...pair('size', [0, 1, 2].map((i) => metres(node.box.max[i] - node.box.min[i]))
                                   .join(' x ')));
  }
  if (Number.isFinite(node.from) || Number.isFinite(node.to)) {
    const [from, to] = [node.from, node.to].map((time) => textOf(time, scene.map));
    const isOpen = !Number.isFinite(node.to);
    facts.push(...pair('there', isOpen ? `since ${from}` : `${from} to ${to}`));
  }
  const relations = neighbors.map(({edge}) => {
    const isSource = edge.source === node.id;
    const other = isSource ? edge.target : edge.source;
    const there = link(scene.titleOf(other), () => actions.select(other));
    return isSource ? make('div', {}, `${edge.relation} `, there)
                    : make('div', {}, there, ` ${edge.relation} this`);
  });
  if (node.group === 'agents') facts.push(...pair('in', make('span', {id: 'where'})));
  const buttons = node.group === 'agents'
      ? [make('button', {type: 'button', onclick: actions.predict}, 'predict')]
      : [make('button', {type: 'button', onclick: actions.path}, 'path from the middle')];
  buttons.push(make('button', {type: 'button', onclick: actions.history}, 'history'));
  panel.replaceChildren(make('h2', {}, scene.titleOf(node.id)), make('dl', {}, ...facts),
                        make('div', {className: 'row'}, ...buttons), make('p', {id: 'answer'}),
                        make('h3', {}, neighbors.length < NEIGHBORS_MAX
                            ? 'Relations' : `The first ${NEIGHBORS_MAX} relations`), ...relations);
}

/** Everything that is shown, in words. */
export function fillTable(scene, show, select) {
  const rows = [];
  for (const group of GROUPS) {
    if (show.hidden.has(group.name)) continue;
    for (const node of scene.of(group.name)) {
      if (rows.length >= ROWS_MAX) break;
      if (group.name !== 'agents' && !scene.isValid(node, show.time)) continue;
      const place = scene.placeOf(node, show.time);
      if (group.name === 'agents' && !place) continue;
      const isKnown = group.name !== 'agents' || scene.agentAt(node.id, show.time).known;
      const where = !place ? '' : isKnown ? place.map((v) => v.toFixed(2)).join(', ')
                                          : 'in a gap of the track';
      const name = make('td', {}, swatch(group.name === 'agents' ? colorOfAgent(node.id)
                                                                 : group.color), ' ',
                        link(scene.titleOf(node.id), () => select(node.id)));
      rows.push(make('tr', {}, make('td', {}, node.id), name, make('td', {}, node.kind),
                     make('td', {}, node.className),
                     make('td', {}, where)));
    }
  }
  const titles = ['id', 'name', 'kind', 'class', 'position, m'];
  element('table').replaceChildren(
      make('p', {}, rows.length >= ROWS_MAX ? `the first ${ROWS_MAX}` : `${rows.length} things`),
      make('table', {}, make('tr', {}, ...titles.map((title) => make('th', {}, title))), ...rows));
}

/** People seen over the time, as bars behind the slider. */
export function drawHistogram(scene) {
  const canvas = element('histogram');
  const width = canvas.width = Math.max(1, canvas.clientWidth);
  const height = canvas.height = Math.max(1, canvas.clientHeight);
  const context = canvas.getContext('2d');
  const counts = scene.timeline;
  const most = Math.max(1, ...counts);
  context.fillStyle = '#e69f00';
  counts.forEach((count, i) => {
    const tall = count / most * height;
    context.fillRect(i * width / counts.length, height - tall, width / counts.length - 0.5, tall);
  });
}

const KEYS = [
  ['Space', 'play, stop'], [', .', 'a step of time back, forth'],
  ['[ ]', 'the revision before, after'], ['{ }', 'the tag before, after'],
  ['1 to 7', 'layers on and off'], ['x', 'layers apart'], ['d', 'compare with the revision before'],
  ['f', 'show everything'], ['/', 'search'],
  ['down, up', 'from the search through what was found; Enter goes there'], ['l', 'live'], ['t', 'table'],
  ['Escape', 'forget the selection and what was found'], ['drag', 'turn'],
  ['right drag, shift drag', 'move'], ['wheel', 'nearer, farther'],
  ['click, double click', 'select, go there'],
];

export function fillHelp() {
  const rows = KEYS.map(([key, what]) => make('tr', {}, make('td', {}, make('kbd', {}, key)),
                                              make('td', {}, what)));
  const close = make('button', {type: 'button'}, 'close');
  close.onclick = () => element('help').close();
  element('help').replaceChildren(make('h2', {}, 'Keys'), make('table', {}, ...rows), close);
}

/** The one sentence that says which picture this is. */
export function sentenceOf(scene, show, loading) {
  const age = scene.revision === scene.head ? '' : `, the newest is ${scene.head}`;
  const parts = [`${scene.map.name} as believed at revision ${scene.revision}${age}, ` +
                 `true at ${textOf(show.time, scene.map)}`];
  if (scene.end > scene.begin) parts.push(`poses over ${durationText(scene.end - scene.begin)}`);
  if (scene.isThinned && scene.exact.time !== show.time) parts.push('positions between samples');
  if (loading) parts.push(`loading ${loading}`);
  return `${parts.join('; ')}.`;
}
