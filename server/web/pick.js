// SPDX-License-Identifier: Apache-2.0
// Which node is under the pointer: places by their distance on the screen, people by that of their
// figure, things with a box by the ray through it, rooms by their floor.
import {project} from './camera.js';
import {PERSON_HEIGHT, ROBOT_BOX} from './moving.js';
import {liftOf} from './show.js';

/** Pixels around an agent, and around a place: those stand close together before the floor. */
const AGENT_REACH = 24;
const PLACE_REACH = 8;
/** Half the width of a figure, metres. */
const FIGURE_WIDTH = 0.22;

/** A vector turned back by a quaternion. */
function turnedBack([x, y, z, w], v) {
  const tx = 2 * (-y * v[2] + z * v[1]);
  const ty = 2 * (-z * v[0] + x * v[2]);
  const tz = 2 * (-x * v[1] + y * v[0]);
  return [
    v[0] + w * tx - y * tz + z * ty, v[1] + w * ty - z * tx + x * tz,
    v[2] + w * tz - x * ty + y * tx,
  ];
}

/** How far along a ray a node's box begins; infinite if the ray misses it. */
function distanceToBox(ray, node, position) {
  const origin = turnedBack(node.orientation, ray.origin.map((v, i) => v - position[i]));
  const direction = turnedBack(node.orientation, ray.direction);
  let near = 0;
  let far = Infinity;
  for (let i = 0; i < 3; ++i) {
    const a = (node.box.min[i] - origin[i]) / direction[i];
    const b = (node.box.max[i] - origin[i]) / direction[i];
    near = Math.max(near, Math.min(a, b));
    far = Math.min(far, Math.max(a, b));
  }
  return near <= far ? near : Infinity;
}

const distanceTo = (ray, point) => Math.hypot(...point.map((v, i) => v - ray.origin[i]));

function isInOutline(outline, x, y) {
  let isIn = false;
  for (let i = 0, j = outline.length - 1; i < outline.length; j = i++) {
    const [xi, yi] = outline[i];
    const [xj, yj] = outline[j];
    if ((yi > y) !== (yj > y) && x < (xj - xi) * (y - yi) / (yj - yi) + xi) isIn = !isIn;
  }
  return isIn;
}

function distanceToFloor(ray, node, lift) {
  const distance = (node.zMin + lift - ray.origin[2]) / ray.direction[2];
  if (!(distance > 0)) return Infinity;
  const [x, y] = [0, 1].map((i) => ray.origin[i] + ray.direction[i] * distance);
  return isInOutline(node.outline, x, y) ? distance : Infinity;
}

/** How far a point of the picture is from the line between two others, pixels, and its depth. */
function nearestOnLine(at, a, b) {
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  const share = ((at.x - a.x) * dx + (at.y - a.y) * dy) / (dx * dx + dy * dy || 1);
  const on = Math.min(1, Math.max(0, share));
  return {away: Math.hypot(a.x + dx * on - at.x, a.y + dy * on - at.y),
          depth: 1 / ((1 - on) / a.depth + on / b.depth)};
}

/** Whether an agent, from its feet to its top, is at a point of the picture. */
function isAgentAt(node, foot, matrix, camera, at) {
  const top = node.kind === 'human' ? PERSON_HEIGHT : ROBOT_BOX.max[2];
  const [low, high] = [0, top].map(
      (up) => project(matrix, [foot[0], foot[1], foot[2] + up], at.width, at.height));
  if (!low || !high) return false;
  const {away, depth} = nearestOnLine(at, low, high);
  return away < Math.max(AGENT_REACH, FIGURE_WIDTH * camera.pixelsPerMetre(depth, at.height));
}

/**
 * The id of the node at a point of the picture; empty if there is none.
 * @param {{x: number, y: number, width: number, height: number}} at pixels
 */
export function pick(scene, show, camera, at) {
  const aspect = at.width / at.height;
  const ray = camera.ray(at.x / at.width * 2 - 1, 1 - at.y / at.height * 2, aspect);
  const matrix = camera.matrix(aspect);
  let best = {id: '', rank: 3, distance: Infinity};
  const offer = (id, rank, distance) => {
    if (distance === Infinity || rank > best.rank) return;
    if (rank < best.rank || distance < best.distance) best = {id, rank, distance};
  };
  for (const node of scene.nodes.values()) {
    if (show.hidden.has(node.group)) continue;
    if (node.group !== 'agents' && !scene.isValid(node, show.time)) continue;
    const lift = liftOf(scene, show, node);
    const place = scene.placeOf(node, show.time);
    if (node.outline.length >= 3) {
      offer(node.id, node.group === 'rooms' ? 2 : 3, distanceToFloor(ray, node, lift));
    } else if (place && node.box && node.group === 'objects') {
      offer(node.id, 1, distanceToBox(ray, node, [place[0], place[1], place[2] + lift]));
    } else if (place && node.group === 'agents') {
      const foot = scene.footOf(place);
      if (isAgentAt(node, foot, matrix, camera, at)) offer(node.id, 0, distanceTo(ray, foot));
    } else if (place && node.group !== 'structures') {
      const lifted = [place[0], place[1], place[2] + lift];
      const spot = project(matrix, lifted, at.width, at.height);
      const away = spot ? Math.hypot(spot.x - at.x, spot.y - at.y) : Infinity;
      if (away < PLACE_REACH) offer(node.id, 1, distanceTo(ray, lifted) + away / 100);
    }
  }
  return best.id;
}

/** Where the pointer's ray meets the floor, for zooming; null above the horizon. */
export function floorPoint(camera, at, height) {
  const ray = camera.ray(at.x / at.width * 2 - 1, 1 - at.y / at.height * 2, at.width / at.height);
  const distance = (height - ray.origin[2]) / ray.direction[2];
  if (!(distance > 0) || distance > camera.distance * 4) return null;
  return ray.origin.map((v, i) => v + ray.direction[i] * distance);
}
