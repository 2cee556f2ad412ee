// The server's raw tiles: a header of 64 bytes, then each layer's rows from north to south, float32, NaN for nothing.
export const kHeader_bytes = 64;
const kMostCells = 1024 * 1024, kMostLayers = 16;

// ArrayBuffer -> {level, tx, ty, rows, cols, min: [x, y], cell_m, layers: [Float32Array]}. Throws on anything else.
export function parseRawTile(buffer) {
  if (buffer.byteLength < kHeader_bytes) throw new Error('a tile was cut short');
  const view = new DataView(buffer);
  if (String.fromCharCode(...new Uint8Array(buffer, 0, 8)) !== 'BTMSTILE') throw new Error('not a tile');
  if (view.getUint16(8, true) !== 1 || view.getUint16(12, true) !== 1) throw new Error('a tile of another version');
  const count = view.getUint16(10, true);
  const rows = view.getUint32(24, true), cols = view.getUint32(28, true);
  if (count > kMostLayers || rows * cols > kMostCells) throw new Error('a tile too large to be true');
  if (buffer.byteLength !== kHeader_bytes + count * rows * cols * 4) throw new Error('a tile was cut short');
  return {
    level: view.getUint16(14, true),
    tx: view.getInt32(16, true),
    ty: view.getInt32(20, true),
    rows,
    cols,
    min: [view.getFloat64(32, true), view.getFloat64(40, true)],
    cell_m: view.getFloat64(48, true),
    layers: Array.from({ length: count }, (_, i) => new Float32Array(buffer, kHeader_bytes + i * rows * cols * 4, rows * cols)),
  };
}
