// SPDX-License-Identifier: Apache-2.0
// Calls of proto/dsg/v1 over the Connect protocol: unary calls in JSON, server streams in JSON or
// in protobuf's bytes.

/** Deadlines of a call and of a stream that ends by itself: slow links take long. */
const CALL_MS_MAX = 30000;
const STREAM_MS_MAX = 600000;

/** An answer that says no: the status, and why. */
export class CallError extends Error {
  /**
   * @param {string} code Connect's name of the status: "not_found", "unavailable", ...
   * @param {string} message
   * @param {string} reason of dsg.v1.ErrorDetail: "AGENT_UNKNOWN"; empty if there is none
   * @param {Object<string, string>} metadata of dsg.v1.ErrorDetail
   */
  constructor(code, message, reason = '', metadata = {}) {
    super(message);
    this.name = 'CallError';
    this.code = code;
    this.reason = reason;
    this.metadata = metadata;
  }

  /** The server is away, stopping or full: the same call may succeed later. */
  get mayPass() {
    return this.code === 'unavailable' || this.code === 'resource_exhausted';
  }
}

/** Connect's error object as a CallError. */
function toError(error) {
  const detail = (error.details ?? []).find((one) => one.type === 'dsg.v1.ErrorDetail');
  const debug = detail?.debug ?? {};
  return new CallError(error.code ?? 'unknown', error.message ?? 'the server gave no reason',
                       debug.reason ?? '', debug.metadata ?? {});
}

async function errorOf(response) {
  const text = await response.text();
  try {
    return toError(JSON.parse(text));
  } catch {
    return new CallError(response.status === 503 ? 'unavailable' : 'unknown',
                         `HTTP ${response.status}: ${text.slice(0, 200)}`);
  }
}

const broken = (error) => (error.name === 'AbortError' ? error
                           : new CallError('unavailable', 'the connection to the server broke'));

/** Splits a body into Connect's envelopes: [flags, bytes]. */
async function* envelopes(body) {
  const reader = body.getReader();
  let held = new Uint8Array(0);
  try {
    while (true) {
      const {done, value} = await reader.read().catch((error) => { throw broken(error); });
      if (done) break;
      const joined = new Uint8Array(held.length + value.length);
      joined.set(held);
      joined.set(value, held.length);
      held = joined;
      while (held.length >= 5) {
        const size = new DataView(held.buffer, held.byteOffset).getUint32(1);
        if (held.length < 5 + size) break;
        yield [held[0], held.subarray(5, 5 + size)];
        held = held.subarray(5 + size);
      }
    }
  } finally {
    reader.cancel().catch(() => {});
  }
}

export class Client {
  /** @param {string} token of the URL that dsg-server printed; empty if it wants none */
  constructor(token) {
    this.token = token;
  }

  /**
   * @param {string} method "QueryService/GetNode"
   * @param {object} request its message in JSON
   * @param {AbortSignal} [signal] cancels the call
   * @returns {Promise<object>} the reply in JSON: snake_case names, 64-bit numbers as strings
   */
  async call(method, request, signal) {
    const response = await this.#post(method, 'application/json', JSON.stringify(request), signal,
                                      CALL_MS_MAX);
    if (!response.ok) throw await errorOf(response);
    return response.json().catch((error) => { throw broken(error); });
  }

  /** The messages of a stream that lasts until the signal ends it, in JSON. */
  async* stream(method, request, signal) {
    const decoder = new TextDecoder();
    for await (const bytes of this.#messages(method, 'json', request, signal, 0)) {
      yield JSON.parse(decoder.decode(bytes));
    }
  }

  /**
   * The messages of a stream as protobuf's bytes. The request has no JSON form then: `encoded` is
   * the message's bytes.
   */
  bytes(method, encoded, signal) {
    return this.#messages(method, 'proto', encoded, signal, STREAM_MS_MAX);
  }

  async* #messages(method, codec, request, signal, msMax) {
    const payload =
        codec === 'json' ? new TextEncoder().encode(JSON.stringify(request)) : request;
    const body = new Uint8Array(5 + payload.length);
    new DataView(body.buffer).setUint32(1, payload.length);
    body.set(payload, 5);
    const response = await this.#post(method, `application/connect+${codec}`, body, signal, msMax);
    if (!response.ok) throw await errorOf(response);
    for await (const [flags, bytes] of envelopes(response.body)) {
      if ((flags & 2) === 0) {
        yield bytes;
        continue;
      }
      const end = JSON.parse(new TextDecoder().decode(bytes));
      if (end.error) throw toError(end.error);
      return;
    }
    throw new CallError('unavailable', 'the stream broke off');
  }

  async #post(method, type, body, signal, msMax) {
    const headers = {'Content-Type': type, 'Connect-Protocol-Version': '1'};
    if (msMax) headers['Connect-Timeout-Ms'] = String(msMax);
    if (this.token) headers.Authorization = `Bearer ${this.token}`;
    try {
      return await fetch(`/dsg.v1.${method}`, {
        method: 'POST', headers, body, signal, cache: 'no-store', credentials: 'omit',
        redirect: 'error',
      });
    } catch (error) {
      if (error.name === 'AbortError') throw error;
      throw new CallError('unavailable', 'the server does not answer');
    }
  }
}
