// node decode.js POINTS RECORD_BYTES <a.laz >records
// The points of a LAZ file as LAS records, in order. io/points/laz_child.cpp starts it.
"use strict";
const fs = require("fs");
const { createLazPerf } = require("laz-perf");

const kLot = 8192; // records written at once

function fail(message) {
  fs.writeSync(2, message);
  process.exit(1);
}

function readAll(lib) {
  const bytes = fs.fstatSync(0).size;
  const at = lib._malloc(bytes);
  if (at === 0) fail(`the decoder has no room for ${bytes} bytes; decompress the file to .las`);
  for (let done = 0; done < bytes; ) {
    const got = fs.readSync(0, lib.HEAPU8, at + done, bytes - done, done);
    if (got === 0) fail("the file became shorter");
    done += got;
  }
  return { at, bytes };
}

function write(bytes) {
  for (let done = 0; done < bytes.length; ) done += fs.writeSync(1, bytes, done);
}

async function main() {
  const [points, recordBytes] = process.argv.slice(2).map(Number);
  const lib = await createLazPerf({ print: () => {}, printErr: () => {} });
  const file = readAll(lib);
  const laz = new lib.LASZip();
  laz.open(file.at, file.bytes);
  if (laz.getCount() !== points || laz.getPointLength() !== recordBytes)
    fail(`the decoder sees ${laz.getCount()} points of ${laz.getPointLength()} bytes, expected ${points} of ${recordBytes}`);
  const lot = lib._malloc(kLot * recordBytes);
  for (let first = 0; first < points; first += kLot) {
    const n = Math.min(kLot, points - first);
    for (let i = 0; i < n; ++i) laz.getPoint(lot + i * recordBytes);
    write(lib.HEAPU8.subarray(lot, lot + n * recordBytes));
  }
}

main().catch((error) => fail(typeof error === "number" ? "its compressed data is damaged" : String(error.message ?? error)));
