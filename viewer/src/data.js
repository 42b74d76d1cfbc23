// Unpacks the motions of a page, which serpentail packed as columns of floats with names.

// The bytes of a text: base64 of gzip.
export async function unzipped(text) {
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// A column is stored as four planes of bytes. They hold the differences between the bits of
// successive rows. Returns numbers row by row, and how many a row has.
export async function decoded(text, rows) {
  const planes = await unzipped(text);
  const count = planes.length / 4;
  if (count % rows) throw new Error("its data is damaged");
  const bits = new Uint32Array(count);
  for (let i = 0; i < count; i++) {
    let step = 0;
    for (let plane = 3; plane >= 0; plane--) step = step * 256 + planes[plane * count + i];
    bits[i] = (i % rows ? bits[i - 1] : 0) + step;
  }
  const columns = new Float32Array(bits.buffer);
  const width = count / rows;
  const data = columns.map((_, i) => columns[(i % width) * rows + Math.floor(i / width)]);
  return { data, width };
}

// One motion: its description (meta) and its samples.
export class Run {
  constructor(meta, columns) {
    Object.assign(this, meta);
    const { data } = columns.t;
    this.fill(
      Float64Array.from({ length: meta.rows }, (_, k) => data[2 * k] + data[2 * k + 1]),
      columns,
    );
  }

  // Takes other samples: times, and by name their numbers row by row (data) and how many each has.
  fill(times, columns) {
    Object.assign(this, { times, columns, rows: times.length });
  }

  static async of(meta) {
    const names = Object.keys(meta.arrays);
    const columns = await Promise.all(names.map((name) => decoded(meta.arrays[name], meta.rows)));
    return new Run(meta, Object.fromEntries(names.map((name, i) => [name, columns[i]])));
  }

  value(name, row, column) {
    const { data, width } = this.columns[name];
    return data[row * width + column];
  }

  // Copy point i of a row into a vector.
  point(name, row, i, vector) {
    return vector.set(
      this.value(name, row, 3 * i),
      this.value(name, row, 3 * i + 1),
      this.value(name, row, 3 * i + 2),
    );
  }

  // Return the last sample at or before t; before the first sample, return the first one.
  row(t) {
    let low = 0;
    let high = this.rows - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= t + 1e-9) low = middle;
      else high = middle - 1;
    }
    return low;
  }
}
