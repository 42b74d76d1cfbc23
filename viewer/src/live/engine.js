// Computes a run again: the model's C as WebAssembly, on a copy of the memory that serpentail made.
import { unzipped } from "../data.js";

const PAGE = 65536; // bytes of a page of memory
const READ = { int: "getInt32", long: "getInt32", pointer: "getUint32", real: "getFloat64" };

export class Engine {
  static async of(live) {
    const [module, image] = await Promise.all([live.module, live.image].map(unzipped));
    const { instance } = await WebAssembly.instantiate(module, { Math });
    return new Engine(live, instance.exports, image);
  }

  constructor(live, exports, image) {
    Object.assign(this, { live, exports, image, memory: exports.memory });
    if (exports.__heap_base.value > live.base) throw new Error("the model is too large");
    const pages = (live.base + image.length - this.memory.buffer.byteLength) / PAGE;
    if (pages > 0) this.memory.grow(Math.ceil(pages));
    this.view = new DataView(this.memory.buffer);
    this.reset();
  }

  // Puts the run back to its start, as it was given; or all to what it was when it was kept.
  reset(image = this.image) {
    new Uint8Array(this.memory.buffer).set(image, this.live.base);
  }

  kept() {
    const { base } = this.live;
    return new Uint8Array(this.memory.buffer).slice(base, base + this.image.length);
  }

  // Advances the run to its end; returns the status of the C.
  advance() {
    return this.exports[`${this.live.prefix}_rollout`](this.live.run);
  }

  // Evaluates a function of the model on the first samples.
  call(name, rows) {
    this.view.setUint32(this.live.calls[name] + 4, rows, true);
    this.exports[`${this.live.prefix}_batch_${name}`](this.live.calls[name]);
  }

  // A member of the run's record.
  member(name) {
    const [offset, kind] = this.live.members[name];
    return this.view[READ[kind]](this.live.run + offset, true);
  }

  reals(address, count) {
    return new Float64Array(this.memory.buffer, address, count);
  }

  // An array of samples, row by row, and its width; undefined if the model lacks it.
  array(name, rows) {
    const [address, width] = this.live.arrays[name] ?? [];
    return width && { data: this.reals(address, rows * width), width };
  }

  // The numbers of a parameter; undefined if the model lacks it.
  parameter(name) {
    const place = this.live.parameters[name];
    return place ? this.reals(...place) : this.live.values[name];
  }
}
