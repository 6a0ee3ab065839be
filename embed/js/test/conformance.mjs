// A decoder as a program that speaks the protocol of conformance/README.md, over the WebAssembly module.
//   dapple conformance --decoder 'node embed/js/test/conformance.mjs' --batch
import { readFileSync, readSync, writeSync } from 'node:fs';

import { Buffer as Arrays, Decoder, DappleError, load } from '../dapple.js';

const [COMPLETE, REFUSED, NEED_INPUT, NOT_IMPLEMENTED] = [0, 1, 2, 89];

// ---- Texts ----

const bits = new DataView(new ArrayBuffer(4));
function float(value) {
    bits.setFloat32(0, value);
    return bits.getUint32(0).toString(16).padStart(8, '0');
}
const floats = (values) => Array.from(values, (value) => ` ${float(value)}`).join('');
const half = (value) => (value & 0xffff).toString(16).padStart(4, '0');
const hex = (value) => value.toString(16).padStart(16, '0');
const quoted = (text) =>
    `"${text.replace(/["\\]/g, '\\$&').replace(/[\0-\x1f\x7f]/g, (c) => `\\u${c.charCodeAt(0).toString(16).padStart(4, '0')}`)}"`;

// ---- XXH64 with seed 0 ----

const MASK = (1n << 64n) - 1n;
const [P1, P2, P3, P4, P5] = [
    11400714785074694791n, 14029467366897019727n, 1609587929392839161n, 9650029242287828579n, 2870177450012600261n,
];
const rotate = (value, count) => ((value << count) | (value >> (64n - count))) & MASK;
const round = (lane, word) => (rotate((lane + word * P2) & MASK, 31n) * P1) & MASK;

function xxh64(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    let at = 0;
    let hash = P5;
    if (bytes.length >= 32) {
        const lanes = [(P1 + P2) & MASK, P2, 0n, -P1 & MASK];
        for (; bytes.length - at >= 32; at += 32) {
            for (let i = 0; i < 4; i++) lanes[i] = round(lanes[i], view.getBigUint64(at + 8 * i, true));
        }
        hash = [1n, 7n, 12n, 18n].reduce((sum, count, i) => sum + rotate(lanes[i], count), 0n) & MASK;
        for (const lane of lanes) hash = ((hash ^ round(0n, lane)) * P1 + P4) & MASK;
    }
    hash = (hash + BigInt(bytes.length)) & MASK;
    for (; bytes.length - at >= 8; at += 8) {
        hash = (rotate(hash ^ round(0n, view.getBigUint64(at, true)), 27n) * P1 + P4) & MASK;
    }
    if (bytes.length - at >= 4) {
        hash = (rotate(hash ^ ((BigInt(view.getUint32(at, true)) * P1) & MASK), 23n) * P2 + P3) & MASK;
        at += 4;
    }
    for (; at < bytes.length; at++) hash = (rotate(hash ^ ((BigInt(bytes[at]) * P5) & MASK), 11n) * P1) & MASK;
    hash = ((hash ^ (hash >> 33n)) * P2) & MASK;
    hash = ((hash ^ (hash >> 29n)) * P3) & MASK;
    return hash ^ (hash >> 32n);
}

// ---- The dump (spec/dump.md) ----

const signals = ({ count, kinds, distances, share }) => `${count} ${kinds}${floats(distances)} ${float(share)}`;

const PARAMETERS = {
    points: (id, p) =>
        `grid ${id} ${p.dims.join(' ')} ${p.bucketCount} ${p.cellCapacity} ${p.positionBits},${p.normalBits},${p.aoBits} ` +
        `${float(p.cellEdge)} ${float(p.radius)}${floats(p.gridFromMesh)}`,
    probes: (id, p) =>
        `volume ${id} ${p.dims.join(' ')} ${p.exponent} ${p.visibilitySide} ${p.visibilitySteps.join(',')} ` +
        `${p.lumaSteps.map((luma, degree) => `${luma},${p.chromaSteps[degree]}`)}` +
        `${floats(p.spacing)} ${float(p.visibilityRange)}${floats(p.gridFromMesh)}`,
    vertices: (id, p) => `vertices ${id} ${p.count} ${p.bits} ${p.order} ${signals(p.signals)}`,
    instances: (id, p) => `instances ${id} ${p.count} ${p.exponent} ${p.step} ${signals(p.signals)}`,
    regions: (id, p) => `regions ${id} ${p.count} ${p.capacity} ${p.exponent} ${p.step} ${signals(p.signals)}`,
};

const CONTENT = {
    points(decoder, { id, parameters: p }, out) {
        const digits = (1 + 3 * p.positionBits + 2 * p.normalBits + p.aoBits) / 4;
        const buckets = decoder.array(Arrays.PointsBuckets);
        const cells = decoder.array(Arrays.PointsCells);
        for (let index = 0; index < p.bucketCount; index++) {
            const first = 8 * (p.firstBucket + index);
            const bucket = buckets.subarray(first, first + 8);
            if (bucket[0] === 0xffffffff) continue;
            out.push(`bucket ${id} ${index}`);
            for (const entry of bucket) {
                if (entry === 0xffffffff) break;
                const [key, ...points] = cells.subarray(8 * (p.firstCell + entry), 8 * (p.firstCell + entry + 1));
                const end = points.indexOf(0);
                const used = end < 0 ? points : points.slice(0, end);
                out.push(` ${key}:${used.map((point) => point.toString(16).padStart(digits, '0'))}`);
            }
            out.push('\n');
        }
    },
    probes(decoder, { id, parameters: p }, out) {
        const count = p.dims[0] * p.dims[1] * p.dims[2];
        const probes = decoder.probes(id, count);
        for (let index = 0; index < count; index++) {
            const [level, ...codes] = probes.subarray(28 * index, 28 * (index + 1));
            if (level) out.push(`probe ${id} ${index} ${level} ${codes.map(half)}\n`);
        }
        const texels = decoder.array(Arrays.ProbesTexels, id);
        const values = new Uint16Array(27 * count);
        for (let index = 0; index < count; index++) {
            for (let value = 0; value < 27; value++) {
                values[27 * index + value] = texels[4 * ((value >> 2) * count + index) + (value & 3)];
            }
        }
        out.push(`values ${id} ${hex(xxh64(new Uint8Array(values.buffer)))}\n`);
        const visibility = decoder.array(Arrays.ProbesVisibility, id);
        if (visibility.length) out.push(`visibility ${id} ${hex(xxh64(visibility))}\n`);
    },
    vertices(decoder, { id, parameters: p }, out) {
        const values = decoder.array(Arrays.VerticesValues);
        for (let index = 0; index < p.count; index++) {
            const first = p.firstValue + p.signals.count * index;
            const of = values.subarray(first, first + p.signals.count);
            if (of.some((value) => value !== 255)) out.push(`vertex ${id} ${index} ${of}\n`);
        }
    },
    instances(decoder, { id, parameters: p }, out) {
        const keys = decoder.array(Arrays.InstancesKeys, id);
        const values = decoder.array(Arrays.InstancesValues, id);
        keys.forEach((key, entry) => {
            out.push(`entry ${id} ${hex(key)}`);
            for (let signal = 0; signal < p.signals.count; signal++) {
                const first = 4 * (p.signals.count * entry + signal);
                out.push(` ${Array.from(values.subarray(first, first + 4), half)}`);
            }
            out.push('\n');
        });
    },
    regions(decoder, { id }, out) {
        const regions = decoder.array(Arrays.Regions, id);
        const words = new Uint32Array(regions.buffer, regions.byteOffset, regions.length);
        const pairs = decoder.array(Arrays.RegionsPairs, id);
        for (let at = 0; at < regions.length; at += 12) {
            const [first, form] = [words[at + 3], words[at + 7]];
            const [degree, count] = [(form >> 2) & 3, ((form >> 4) & 1) + 1];
            const centre = (form >> 5) & 1 ? ' - - -' : floats(regions.subarray(at + 8, at + 11));
            const coefficients = (1 + [0, 3, 6][form & 3]) * (degree + 1) ** 2 * count;
            const values = Array.from(pairs.subarray(2 * first, 2 * first + coefficients), half);
            out.push(`region ${id} ${at / 12} ${form & 3},${degree},${count}`);
            out.push(`${floats(regions.subarray(at, at + 3))}${floats(regions.subarray(at + 4, at + 7))}${centre} ${values}\n`);
        }
    },
};

function dump(decoder, event, out) {
    switch (event.kind) {
        case 'stream':
            out.push(`stream ${event.ticks} ${event.seconds}\n`);
            break;
        case 'group':
            out.push(`group ${event.group} ${event.digest ? `state ${event.digest}` : 'keyframes'}\n`);
            break;
        case 'frame':
            out.push(`frame ${event.number} ${event.tick} ${decoder.digest()}\n`);
            for (const track of decoder.tracks()) {
                const coding = track.model === 'points' ? 'cells' : track.coding ? 'packed' : 'raw';
                out.push(`track ${track.id} ${track.model} ${coding} ${track.space} ${hex(track.applicationId)} `);
                out.push(`${track.contentHash ?? '-'}${floats(track.aabbMin)}${floats(track.aabbMax)} ${quoted(track.path)}\n`);
                out.push(`${PARAMETERS[track.model](track.id, track.parameters)}\n`);
                if (track.worldFromGrid) out.push(`transform ${track.id}${floats(track.worldFromGrid)}\n`);
                CONTENT[track.model](decoder, track, out);
            }
            break;
        case 'end':
            out.push('end\n');
    }
}

// ---- Requests ----

function push(decoder, bytes, pieces, out) {
    const size = pieces || bytes.length;
    for (let at = 0; at < bytes.length; at += size) {
        for (const event of decoder.push(bytes.subarray(at, at + size))) dump(decoder, event, out);
    }
}

function caught(run) {
    try {
        run();
    } catch (error) {
        if (error instanceof DappleError) return error;
        throw error;
    }
}

function stream(decoder, request, input, out) {
    let needsInput = false;
    const error = caught(() => {
        push(decoder, input, request.pieces, out);
        if (!request.partial) decoder.finish({ live: request.live });
        else needsInput = caught(() => decoder.finish()) !== undefined;
    });
    if (!error) return needsInput ? NEED_INPUT : COMPLETE;
    out.push(`${JSON.stringify({ layer: error.layer, id: error.id, offset: error.offset })}\n`);
    return REFUSED;
}

function session(decoder, request, script, out) {
    let kept = new Uint8Array();
    for (let at = 0; at < script.length; ) {
        const end = script.indexOf(10, at);
        const line = new TextDecoder().decode(script.subarray(at, end));
        at = end + 1;
        const before = decoder.position;
        let fed = new Uint8Array();
        const error = caught(() => {
            if (line.startsWith('push ')) {
                fed = script.subarray(at, at + Number(line.slice(5)));
                at += fed.length;
                push(decoder, fed, request.pieces, out);
            } else if (line === 'resume') {
                const resumed = decoder.resume();
                out.push(`resume ${resumed ? 'yes' : 'no'}\n`);
                if (resumed) {
                    [fed, kept] = [kept, fed];
                    push(decoder, fed, request.pieces, out);
                }
            } else if (line === 'reset') {
                decoder.reset();
                kept = new Uint8Array();
                out.push('reset\n');
            } else {
                decoder.finish({ live: line === 'finish-live' });
                out.push('finished\n');
            }
        });
        if (error) {
            // A push into a decoder that has stopped is lost; what it stopped in is not.
            if (fed.length && error.id !== 4011) kept = fed.subarray(decoder.position - before);
            out.push(`error ${error.layer} ${error.id} ${error.offset}\n`);
        }
    }
    return COMPLETE;
}

/** A decoder of the default limits is reset for each request: a WebAssembly memory takes long to make. */
let usual;

function decoderFor(limits) {
    if (Object.keys(limits).length) return new Decoder(limits);
    usual ??= new Decoder();
    usual.reset();
    return usual;
}

function answer(words, input, out) {
    const request = { limits: {}, pieces: 0 };
    while (words.length) {
        const word = words.shift();
        if (word === '--limit') {
            const [name, value] = words.shift().split('=');
            request.limits[name] = BigInt(value) > 0xffffffffn ? BigInt(value) : Number(value);
        } else if (word === '--pieces') request.pieces = Number(words.shift());
        else request[word.slice(2)] = true;
    }
    if (request.queries) return NOT_IMPLEMENTED;
    out.push('dapple-dump 1\n');
    const decoder = decoderFor(request.limits);
    return (request.session ? session : stream)(decoder, request, input, out);
}

function readPart() {
    const read = (size) => {
        const bytes = new Uint8Array(size);
        for (let at = 0; at < size; ) {
            const got = readSync(0, bytes, at, size - at);
            if (got === 0) return undefined;
            at += got;
        }
        return bytes;
    };
    const length = read(4);
    return length && read(new DataView(length.buffer).getUint32(0, true));
}

await load(new URL(`../${process.env.DAPPLE_WASM ?? 'dapple.wasm'}`, import.meta.url));
const [, , ...words] = process.argv;
if (words.includes('--batch')) {
    for (let part; (part = readPart()); ) {
        const out = [];
        const arguments_ = new TextDecoder().decode(part).split(' ').filter(Boolean);
        const status = answer(arguments_, readPart(), out);
        const text = new TextEncoder().encode(out.join(''));
        const bytes = new Uint8Array(5 + text.length);
        bytes[0] = status;
        new DataView(bytes.buffer).setUint32(1, text.length, true);
        bytes.set(text, 5);
        for (let at = 0; at < bytes.length; ) at += writeSync(1, bytes, at);
    }
} else {
    const out = [];
    const status = answer(words, new Uint8Array(readFileSync(0)), out);
    writeSync(1, out.join(''));
    process.exitCode = status;
}
