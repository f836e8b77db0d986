// SPDX-License-Identifier: Apache-2.0
// What the viewer asks about a scene, all at its revision, in the scene's units.
import {CallError} from './rpc.js';
import {toNode} from './scene.js';
import {nsOf} from './time.js';

/** Relations of a node that are asked for. */
export const NEIGHBORS_MAX = 200;
const HITS_MAX = 1000;
const VERSIONS_MAX = 30;
const INSTANTS_MAX = 10000;
const CHANGES_A_PAGE = 1000;
/** How far predictions reach, how densely, and how many ways. */
const PREDICTION = {horizon_ns: '8000000000', period_ns: '400000000', path_count_max: 5};

/** Throws if a reply is of another map than the one that is shown, made anew under its name. */
export function checkIncarnation({map, stats}, header) {
  if (header.incarnation === stats.header.incarnation) return;
  throw new CallError('aborted', `the map "${map.name}" was replaced by another one of this name; ` +
                      'what is shown is no more in the store', 'MAP_REPLACED');
}

export class Questions {
  /**
   * @param {import('./rpc.js').Client} client
   * @param {import('./scene.js').Scene} scene
   * @param {AbortSignal} signal ends the calls when another scene is shown
   */
  constructor(client, scene, signal) {
    this.client = client;
    this.scene = scene;
    this.signal = signal;
  }

  #ask(method, request) {
    return this.#call(method, {read_at: {exact_revision: String(this.scene.revision)}, ...request});
  }

  /** Fails with MAP_REPLACED if the answer is of another map of the same name. */
  async #call(method, request) {
    const {name} = this.scene.map;
    const reply = await this.client.call(method, {map: name, ...request}, this.signal);
    checkIncarnation(this.scene, reply.header);
    return reply;
  }

  #ns(time) {
    return String(nsOf(time, this.scene.epoch));
  }

  /** The edges of a node, incoming and outgoing. */
  async neighbors(id) {
    const reply = await this.#ask('QueryService/GetNeighbors', {
      id, view: 'NODE_VIEW_BASIC', page_size: NEIGHBORS_MAX,
    });
    return reply.neighbors;
  }

  /** What was believed of a node, newest first: since which revision, and its names. */
  async versions(id) {
    const reply = await this.client.call('QueryService/ListNodeVersions', {
      map: this.scene.map.name, id, view: 'NODE_VIEW_BASIC', page_size: VERSIONS_MAX,
    }, this.signal);
    return reply.versions.map(({from_revision: from, node}) => ({
      from: Number(from), name: node.name, className: node.semantic_class?.name ?? '',
    }));
  }

  /** Ids of the room, place and building of an agent at a time; those that are known. */
  async where(agent, time) {
    const reply = await this.#ask('QueryService/LocateAgent', {agent, at_ns: this.#ns(time)});
    return [reply.room_id, reply.place_id, reply.building_id].filter(Boolean);
  }

  /** Positions of agents at a time: undefined in a gap, null outside of the track. */
  async positions(agents, time) {
    const positions = new Map();
    for (let i = 0; i < agents.length; i += INSTANTS_MAX) {
      const part = agents.slice(i, i + INSTANTS_MAX);
      const reply = await this.#ask('QueryService/BatchLocateAgents', {
        instants: part.map((agent) => ({agent, at_ns: this.#ns(time)})),
      });
      reply.results.forEach((result, k) => {
        const at = result.pose?.position;
        positions.set(part[k], result.status_code !== 0 ? null : at ? [at.x, at.y, at.z]
                                                                    : undefined);
      });
    }
    return positions;
  }

  /** A path from a point to a node: corners, length and least clearance in metres. */
  async path([x, y, z], node, time) {
    const reply = await this.#ask('QueryService/PlanPath', {
      from: {position: {x, y, z}}, to: {node}, at_ns: this.#ns(time),
    });
    return {corners: reply.polyline.map((point) => [point.x, point.y, point.z]),
            length: reply.length_m, clearance: reply.clearance_m_min};
  }

  /** Where an agent may go: ways with probabilities and spread, and goals where there are some. */
  async predict(agent, time) {
    const reply = await this.#ask('QueryService/PredictAgent', {
      agent, from_ns: this.#ns(time), ...PREDICTION,
    });
    return reply.paths.map(({probability, poses, goal_node_id: goal}) => ({
      probability, goal, points: poses.map(({position: p}) => [p.x, p.y, p.z]),
      covariances: poses.map(({covariance}) => covariance),
    }));
  }

  /** The id of a node that an id or a name stands for. */
  async idOf(word) {
    const reply = await this.#ask('QueryService/GetNode', {id: word, view: 'NODE_VIEW_BASIC'});
    return reply.node.id;
  }

  /** What a query finds, each with its ancestors, nearest first; and whether there is more. */
  async search(query, time) {
    const reply = await this.#ask('QueryService/SearchNodes', {
      query, at_ns: this.#ns(time), page_size: HITS_MAX,
    });
    const hits = reply.hits.map(({node, ancestor_ids: ancestors}) => ({
      id: node.id, name: node.name, className: node.semantic_class?.name ?? '', layer: node.layer,
      ancestors,
    }));
    return {hits, hasMore: reply.next_page_token !== ''};
  }

  /** What differs from another revision: id to "added", "removed", "changed"; removed nodes. */
  async diff(revision) {
    const states = new Map();
    const removed = [];
    let token = '';
    do {
      const reply = await this.#call('MapService/DiffRevisions', {
        from_revision: String(revision), to_revision: String(this.scene.revision),
        view: 'NODE_VIEW_FULL', page_size: CHANGES_A_PAGE, page_token: token,
      });
      for (const {type, before, after} of reply.nodes) {
        states.set((after ?? before).id, type.toLowerCase());
        if (type === 'REMOVED') removed.push(toNode(before, this.scene.epoch));
      }
      token = reply.next_page_token;
    } while (token);
    return {states, removed};
  }
}
