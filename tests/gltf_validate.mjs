// Compares what the Khronos validator says of a glTF file and of a copy with baked values.
//
//   npm install gltf-validator      (in any folder above this one, or name it in NODE_PATH)
//   node tests/gltf_validate.mjs SOURCE COPY [SOURCE COPY]...
//
// Prints one line a pair and exits with 1 where a copy has an error that its source does not have.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";

const require = createRequire(join(process.cwd(), "package.json"));
const validator = require("gltf-validator");

// The report of a file: every message, and how many meshes there are.
async function validate(path) {
  const bytes = new Uint8Array(readFileSync(path));
  const report = await validator.validateBytes(bytes, {
    uri: path,
    maxIssues: 0,
    writeTimestamp: false,
    externalResourceFunction: async (uri) =>
      new Uint8Array(readFileSync(join(dirname(path), decodeURIComponent(uri)))),
  });
  return report;
}

// Errors by code. Those of meshes beyond `meshes` are of copies, which have what their originals have.
function errors(report, meshes) {
  const counts = new Map();
  for (const { code, severity, pointer } of report.issues.messages) {
    const mesh = /^\/meshes\/(\d+)/.exec(pointer ?? "");
    if (severity > 0) continue;
    const isCopy = mesh && Number(mesh[1]) >= meshes;
    counts.set(code, (counts.get(code) ?? 0) + (isCopy ? 0 : 1));
  }
  return counts;
}

function meshes(path) {
  const bytes = readFileSync(path);
  const isBinary = bytes.toString("latin1", 0, 4) === "glTF";
  const text = isBinary ? bytes.subarray(20, 20 + bytes.readUInt32LE(12)) : bytes;
  // Without a byte order mark and padding by NUL.
  const json = text.toString("utf8").replace(/^\uFEFF/, "").replace(/\0+$/, "");
  return (JSON.parse(json).meshes ?? []).length;
}

let failed = false;
const paths = process.argv.slice(2);
for (let i = 0; i + 1 < paths.length; i += 2) {
  const [source, copy] = [paths[i], paths[i + 1]];
  const reports = [await validate(source), await validate(copy)];
  const count = meshes(source);
  const before = errors(reports[0], count);
  const found = [];
  for (const [code, number] of errors(reports[1], count)) {
    if (number > (before.get(code) ?? 0) || !before.has(code)) {
      const message = reports[1].issues.messages.find((m) => m.code === code && m.severity === 0);
      found.push(`${code} x${number}: ${message.pointer}: ${message.message}`);
    }
  }
  const say = (r) => `${r.issues.numErrors} errors, ${r.issues.numWarnings} warnings`;
  console.log(`${found.length ? "FAILED" : "ok"} ${copy}: ${say(reports[1])} (source: ${say(reports[0])})`);
  for (const line of found) console.log(`  ${line}`);
  failed ||= found.length > 0;
}
process.exit(failed ? 1 : 0);
