// SPDX-License-Identifier: Apache-2.0
// What is made anew for each picture: people and robots with their trails, and the path and the
// predictions that were asked for.
import {BACKGROUND, PATH, PREDICTION, SELECTED, colorOfAgent, lookOf, mixed} from './colors.js';
import {addBox, addFace, addFigure, cornersOf} from './shapes.js';

export const PERSON_HEIGHT = 1.7;
export const ROBOT_BOX = {min: [-0.25, -0.25, 0], max: [0.25, 0.25, 0.5]};
/** A crowd of more people is drawn as boxes. */
const FIGURES_MAX = 300;
/** Rings on the floor, metres: around somebody who is selected, and in a gap of a track. */
const SELECTED_RADIUS = 0.6;
const GAP_RADIUS = 0.35;
/** Widths in pixels. */
const RING_PX = 3;
const PATH_PX = 5;
const TRAIL_PX = {now: 4, oldest: 1.5};
/** Of a way and of its ellipses: what any has, and what is added for one that is certain. */
const WAY_PX = {any: 2, certain: 12};
const ELLIPSE_PX = {any: 0.75, certain: 3};
/** Every so many poses of a prediction have an ellipse. */
const ELLIPSE_EVERY = 10;
/** How far above the floor ways lie, metres. */
const ABOVE_FLOOR = 0.05;

/**
 * @param {{solid: import('./shapes.js').Vertices, ribbons: import('./ribbons.js').Pieces}} out
 */
export function addPeople(out, scene, show) {
  if (show.hidden.has('agents')) return;
  for (const node of scene.of('agents')) addAgent(out, scene, show, node);
}

function addAgent(out, scene, show, node) {
  const track = scene.tracks.get(node.id);
  if (!track) return;
  const [color] = lookOf(show, node, colorOfAgent(node.id));
  addTrail(out.ribbons, track, show, color);
  const here = scene.agentAt(node.id, show.time);
  if (!here) return;
  const foot = scene.footOf(here.position);
  const body = scene.bodies.time === show.time && scene.bodies.meshes.get(node.id);
  if (!here.known) {
    out.ribbons.addRing(foot, GAP_RADIUS, color, RING_PX);
  } else if (body) {
    for (let i = 0; i + 2 < body.faces.length; i += 3) {
      addFace(out.solid, ...cornersOf(body, i), color, 1);
    }
  } else if (node.kind === 'human' && scene.of('agents').length <= FIGURES_MAX) {
    addFigure(out.solid, foot, PERSON_HEIGHT, color, 1, 0);
  } else {
    addBox(out.solid, ROBOT_BOX, foot, [0, 0, 0, 1], color, 1, 0);
  }
  if (node.id === show.selected) out.ribbons.addRing(foot, SELECTED_RADIUS, SELECTED, RING_PX);
}

/** Where somebody was: the longer ago, the thinner and the darker. */
function addTrail(ribbons, track, show, color) {
  const begin = Math.max(0, track.indexAt(show.time - show.tail));
  const end = track.indexAt(show.time);
  for (let i = begin; i < end; ++i) {
    if (track.times[i] < show.time - show.tail) continue;
    if (track.gaps.has(i + 1)) continue;
    const age = (show.time - track.times[i]) / show.tail;
    ribbons.add(track.positions[i], track.positions[i + 1], mixed(color, BACKGROUND, 0.7 * age), 1,
                TRAIL_PX.now + (TRAIL_PX.oldest - TRAIL_PX.now) * age);
  }
}

/** A path, and ways that somebody may go: the more probable, the wider. */
export function addAnswers(ribbons, show) {
  ribbons.addWay(show.path, PATH, PATH_PX, ABOVE_FLOOR);
  // The most probable ones come first, and are drawn over the others.
  for (const {probability, points, covariances} of [...show.predictions].reverse()) {
    const width = ({any, certain}) => any + certain * probability;
    const color = mixed(BACKGROUND, PREDICTION, 0.5 + 0.5 * probability);
    for (let i = ELLIPSE_EVERY - 1; i < points.length; i += ELLIPSE_EVERY) {
      const axes = axesOf(covariances[i]);
      if (axes) ribbons.addEllipse(points[i], ...axes, color, width(ELLIPSE_PX));
    }
    ribbons.addWay(points, color, width(WAY_PX), ABOVE_FLOOR);
  }
}

/**
 * The half axes, in the plane, of the ellipse of two standard deviations; null without a spread.
 * @param {number[]} covariance upper triangle row by row, square metres
 */
export function axesOf([xx, xy, , yy]) {
  const middle = (xx + yy) / 2;
  const reach = Math.hypot((xx - yy) / 2, xy);
  const angle = Math.atan2(2 * xy, xx - yy) / 2;
  const [a, b] = [middle + reach, middle - reach].map((value) => 2 * Math.sqrt(Math.max(0, value)));
  if (!(a > 0)) return null;
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return [[a * c, a * s], [-b * s, b * c]];
}
