// SPDX-License-Identifier: Apache-2.0
// Reads and writes protobuf's wire format, for the bulk messages: scenes, tracks and meshes, whose
// JSON would be many times as large. Field numbers are those of proto/dsg/v1.

const LENGTH_MAX = 64 << 20;

/** Walks the fields of a message. Throws on a cut or malformed message. */
export class Reader {
  /** @param {Uint8Array} bytes */
  constructor(bytes) {
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
    this.at = 0;
  }

  get isAtEnd() {
    return this.at >= this.bytes.length;
  }

  /** An unsigned number of at most 32 bits; of a longer one, its low 32 bits. */
  varint() {
    return Number(this.varint64() & 0xffffffffn);
  }

  /** A 64-bit number in two's complement, as an unsigned BigInt. */
  varint64() {
    let low = 0;
    let high = 0;
    for (let shift = 0; shift < 70; shift += 7) {
      if (this.isAtEnd) throw new RangeError('a number is cut off');
      const byte = this.bytes[this.at++];
      const bits = byte & 0x7f;
      if (shift < 28) {
        low |= bits << shift;
      } else if (shift === 28) {
        low |= bits << 28;
        high = bits >>> 4;
      } else {
        high |= bits << (shift - 32);
      }
      if (byte < 0x80) {
        return high === 0 ? BigInt(low >>> 0) : (BigInt(high >>> 0) << 32n) | BigInt(low >>> 0);
      }
    }
    throw new RangeError('a number is longer than ten bytes');
  }

  int64() {
    return BigInt.asIntN(64, this.varint64());
  }

  double() {
    this.#need(8);
    const value = this.view.getFloat64(this.at, true);
    this.at += 8;
    return value;
  }

  /** The bytes of a field of length type. */
  block() {
    const size = this.varint();
    if (size > LENGTH_MAX) throw new RangeError(`a field claims ${size} bytes`);
    this.#need(size);
    const bytes = this.bytes.subarray(this.at, this.at + size);
    this.at += size;
    return bytes;
  }

  /** Packed floats. */
  floats() {
    const bytes = this.block();
    if (bytes.length % 4 !== 0) throw new RangeError('packed floats are cut off');
    return new Float32Array(bytes.slice().buffer);
  }

  /**
   * Calls the function of each field's number; fields without one are passed over.
   * @param {Object<number, function(Reader): void>} fields
   */
  each(fields) {
    while (!this.isAtEnd) {
      const tag = this.varint();
      const field = fields[tag >>> 3];
      if (field) field(this);
      else this.#skip(tag & 7);
    }
  }

  #need(size) {
    if (this.at + size > this.bytes.length) throw new RangeError('a field is cut off');
  }

  #skip(type) {
    if (type === 0) this.varint64();
    else if (type === 1) this.#advance(8);
    else if (type === 2) this.block();
    else if (type === 5) this.#advance(4);
    else throw new RangeError(`no wire type ${type}`);
  }

  #advance(size) {
    this.#need(size);
    this.at += size;
  }
}

/** Writes a message field by field; what is left out has its default. */
export class Writer {
  #bytes = [];

  #varint(value) {
    let left = BigInt.asUintN(64, BigInt(value));
    while (left >= 0x80n) {
      this.#bytes.push(Number(left & 0x7fn) | 0x80);
      left >>= 7n;
    }
    this.#bytes.push(Number(left));
  }

  number(field, value) {
    this.#varint(field << 3);
    this.#varint(value);
    return this;
  }

  /** Eight bytes, lowest first. */
  fixed64(field, bits) {
    this.#varint((field << 3) | 1);
    for (let i = 0n; i < 64n; i += 8n) this.#bytes.push(Number(bits >> i & 0xffn));
    return this;
  }

  block(field, bytes) {
    this.#varint((field << 3) | 2);
    this.#varint(bytes.length);
    for (const byte of bytes) this.#bytes.push(byte);
    return this;
  }

  text(field, value) {
    return this.block(field, new TextEncoder().encode(value));
  }

  done() {
    return Uint8Array.from(this.#bytes);
  }
}
