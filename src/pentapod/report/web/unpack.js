// Arrays of the page: the other half of `pack.py`, which describes how they lie in the block.

async function inflated(base64) {
  const text = atob(base64.trim()), packed = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) packed[k] = text.charCodeAt(k);
  const plain = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(plain).arrayBuffer());
}

/** The arrays of a page by name, each as its columns or row by row. */
export class Arrays {
  static async of(base64, directory) { return new Arrays(base64.trim() ? await inflated(base64) : new Uint8Array(), directory); }

  constructor(bytes, directory) {
    this.bytes = bytes;
    this.directory = directory;
  }

  /** Whole numbers of one column: differences with their sign in the lowest bit, one plane of bytes after the other. */
  whole(name, column = 0) {
    const { at, rows, columns, size } = this.directory[name], { bytes } = this, plane = rows * columns;
    const out = new Uint32Array(rows), mask = size === 4 ? -1 : 0xffff;
    let value = 0, place = at + column * rows;
    for (let k = 0; k < rows; k++, place++) {
      let code = bytes[place] | (bytes[place + plane] << 8);
      if (size === 4) code |= (bytes[place + 2 * plane] << 16) | (bytes[place + 3 * plane] << 24);
      value = (value + ((code >>> 1) ^ -(code & 1))) & mask;
      out[k] = value;
    }
    return out;
  }

  /** Numbers of one column, in the unit that the page has; 0 stands for NaN. */
  column(name, column = 0) {
    const { low, step } = this.directory[name], whole = this.whole(name, column), out = new Float64Array(whole.length);
    for (let k = 0; k < out.length; k++) out[k] = whole[k] ? low[column] + step[column] * whole[k] : NaN;
    return out;
  }

  /** All columns. */
  columns(name) { return Array.from({ length: this.directory[name].columns }, (_, k) => this.column(name, k)); }

  /** Row by row, x y z x y z …; Kind: of the array. */
  rows(name, Kind = Float32Array) {
    const { rows, columns, low } = this.directory[name], out = new Kind(rows * columns);
    for (let c = 0; c < columns; c++) {
      const part = low ? this.column(name, c) : this.whole(name, c);
      for (let k = 0, at = c; k < rows; k++, at += columns) out[at] = part[k];
    }
    return out;
  }
}
