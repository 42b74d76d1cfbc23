// Computes a run again: the model's C as WebAssembly, on a copy of the memory that serpentail made.
import { unzipped } from "../data.js";

const PAGE = 65536; // bytes of a page of memory
const POINTER = { int: "getInt32", long: "getInt32", pointer: "getUint32", real: "getFloat64" };

export class Engine {
  static async of(live) {
    const [module, image] = await Promise.all([live.module, live.image].map(unzipped));
    const { instance } = await WebAssembly.instantiate(module, { Math });
    return new Engine(live, instance.exports, image);
  }

  constructor(live, exports, image) {
    Object.assign(this, { live, exports, image });
    const { memory, __heap_base } = exports;
    if (__heap_base.value > live.base) throw new Error("the model's constants are too large");
    const pages = (live.base + image.length - memory.buffer.byteLength) / PAGE;
    if (pages > 0) memory.grow(Math.ceil(pages));
    this.buffer = memory.buffer;
    this.bytes = new Uint8Array(memory.buffer);
    this.view = new DataView(memory.buffer);
  }

  // Puts the run back to its start, as it was given.
  reset() {
    this.bytes.set(this.image, this.live.base);
  }

  // Advances the run to its end; returns the status of the C.
  advance() {
    return this.exports[`${this.live.prefix}_rollout`](this.live.run);
  }

  // Evaluates a function of the model on the first samples; nothing if the model lacks it.
  call(name, rows) {
    const call = this.live.calls[name];
    if (call === undefined) return;
    this.view.setUint32(call + 4, rows, true);
    this.exports[`${this.live.prefix}_batch_${name}`](call);
  }

  // A member of the run's record.
  member(name) {
    const [offset, kind] = this.live.members[name] ?? [];
    return kind && this.view[POINTER[kind]](this.live.run + offset, true);
  }

  reals(address, count) {
    return new Float64Array(this.buffer, address, count);
  }

  // An array of samples and its width; undefined if the model lacks it.
  array(name, rows) {
    const [address, width] = this.live.arrays[name] ?? [];
    return width && { data: this.reals(address, rows * width), width };
  }

  // The numbers of a parameter; undefined if the model lacks it.
  parameter(name) {
    const place = this.live.parameters[name];
    return place ? this.reals(...place) : this.live.values[name];
  }

  write(address, value) {
    this.view.setFloat64(address, value, true);
  }
}
