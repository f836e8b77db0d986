// SPDX-License-Identifier: Apache-2.0
// Names over the picture, on a canvas of their own: the most telling first, none over another.
import {project} from './camera.js';
import {SELECTED, colorOfAgent, cssOf} from './colors.js';
import {shortened, visible} from './dom.js';
import {colorOfGroup} from './scene.js';
import {liftOf} from './show.js';

const LABELS_MAX = 80;
/** Letters of a name on the picture. */
export const LETTERS_MAX = 40;
const FONT_PX = 12;
/** Names of objects are left out from farther away, metres. */
const NEAR_M = 18;

/** Middle of an outline. */
export function middleOf(outline, z) {
  const sum = outline.reduce(([x, y], point) => [x + point[0], y + point[1]], [0, 0]);
  return [sum[0] / outline.length, sum[1] / outline.length, z];
}

/** Candidates in order: what is selected, the building, rooms, people, what was found, objects. */
function candidates(scene, show, isNear) {
  const order = {building: 1, rooms: 2, agents: 3, ...(isNear ? {objects: 5} : {})};
  const found = [];
  for (const node of scene.nodes.values()) {
    const rank = node.id === show.selected ? 0 : show.hits.has(node.id) ? 4 : order[node.group];
    if (rank === undefined || show.hidden.has(node.group)) continue;
    if (node.group !== 'agents' && !scene.isValid(node, show.time)) continue;
    found.push([rank, node]);
  }
  return found.sort((a, b) => a[0] - b[0]);
}

/** Draws the names; gives how many. */
export function drawLabels(canvas, scene, show, camera) {
  const context = canvas.getContext('2d');
  const {width, height} = canvas;
  const scale = window.devicePixelRatio || 1;
  context.clearRect(0, 0, width, height);
  if (!scene) return 0;
  context.font = `${FONT_PX * scale}px system-ui, "DejaVu Sans", sans-serif`;
  context.textBaseline = 'middle';
  context.textAlign = 'center';
  const matrix = camera.matrix(width / height);
  const taken = [];
  for (const [, node] of candidates(scene, show, camera.distance < NEAR_M)) {
    if (taken.length >= LABELS_MAX) break;
    const place = node.outline.length ? middleOf(node.outline, node.zMin)
                                      : scene.placeOf(node, show.time);
    if (!place) continue;
    const above = node.group === 'agents' ? 1.2 : node.box ? node.box.max[2] + 0.2 : 0.2;
    const spot = project(matrix, [place[0], place[1], place[2] + liftOf(scene, show, node) + above],
                         width, height);
    if (!spot || spot.x < 0 || spot.y < 0 || spot.x > width || spot.y > height) continue;
    const text = shortened(visible(scene.titleOf(node.id)), LETTERS_MAX);
    const half = context.measureText(text).width / 2 + 4 * scale;
    const tall = FONT_PX * 0.75 * scale;
    const area = [spot.x - half, spot.y - tall, spot.x + half, spot.y + tall];
    const overlaps = taken.some(
        (other) => area[0] < other[2] && other[0] < area[2] && area[1] < other[3] &&
                   other[1] < area[3]);
    if (overlaps) continue;
    taken.push(area);
    const color = node.group === 'agents' ? colorOfAgent(node.id) : colorOfGroup(node.group);
    context.fillStyle = 'rgba(16, 20, 26, 0.72)';
    context.fillRect(area[0], area[1], area[2] - area[0], area[3] - area[1]);
    context.fillStyle = cssOf(node.id === show.selected ? SELECTED : color);
    context.fillText(text, spot.x, spot.y);
  }
  return taken.length;
}
