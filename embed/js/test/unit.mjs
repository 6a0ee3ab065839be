// Tests of the module in Node: `node --test embed/js/test/unit.mjs`.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { brotliCompressSync, constants } from 'node:zlib';

import { Buffer as Arrays, DappleError, Decoder, bufferKey, decode, load, validate } from '../dapple.js';

const file = (path) => new Uint8Array(readFileSync(new URL(path, import.meta.url)));
const stream = (name) => file(`../../../spec/examples/${name}.dapple`);
const STREAMS = ['points', 'probes', 'regions', 'vertices'];

/** Copies of all arrays, by key. */
function arrays(decoder) {
    const copies = new Map();
    for (const buffer of Object.values(Arrays)) {
        for (const { id } of decoder.tracks()) copies.set(bufferKey(buffer, id), decoder.array(buffer, id).slice());
    }
    return copies;
}

/** A device whose buffers are bytes, and which checks what WebGPU checks. */
function fakeDevice() {
    const device = {
        written: 0,
        createBuffer({ size }) {
            assert.equal(size % 4, 0);
            return { size, bytes: new Uint8Array(size), destroy() {} };
        },
        queue: {
            writeBuffer(buffer, offset, data, from = 0, size = data.length - from) {
                assert.ok(offset % 4 === 0 && size % 4 === 0 && offset + size <= buffer.size);
                buffer.bytes.set(data.subarray(from, from + size), offset);
                device.written += size;
            },
        },
    };
    return device;
}

await load();

test('uploads of dirty ranges give the arrays, after every frame', async () => {
    for (const name of STREAMS) {
        const decoder = new Decoder();
        const [device, buffers] = [fakeDevice(), new Map()];
        let frames = 0;
        for await (const event of decode(stream(name), decoder)) {
            if (event.kind !== 'frame') continue;
            frames++;
            decoder.upload(device, buffers);
            assert.deepEqual(decoder.dirty(), []);
            for (const [key, array] of arrays(decoder)) {
                const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
                const uploaded = buffers.get(key)?.bytes.subarray(0, bytes.length) ?? new Uint8Array();
                assert.deepEqual(uploaded, bytes, `${name}, ${key}`);
            }
        }
        assert.ok(frames > 0 && device.written > 0);
    }
});

test('events and digests do not depend on how a stream comes', async () => {
    const whole = stream('points');
    const summary = async (source) => {
        const events = [];
        for await (const { decoder, ...event } of decode(source)) events.push({ ...event, digest: decoder.digest() });
        return events;
    };
    const expected = await summary(whole);
    assert.equal(expected.at(-1).kind, 'end');
    const pieces = (size) => Array.from({ length: Math.ceil(whole.length / size) }, (_, i) => whole.slice(size * i, size * (i + 1)));
    assert.deepEqual(await summary(pieces(1)), expected);
    assert.deepEqual(await summary(ReadableStream.from(pieces(100))), expected);
    assert.deepEqual(await summary(new Response(whole)), expected);
    assert.deepEqual(await summary(whole.buffer.slice(0)), expected);
});

test('an error has details, and the last frame stays', async () => {
    const bytes = stream('points');
    bytes[bytes.length - 1] ^= 1;
    const decoder = new Decoder();
    const push = () => [...decoder.push(bytes)];
    assert.throws(push, (error) => {
        assert.ok(error instanceof DappleError);
        assert.deepEqual([error.id, error.layer, error.class], [1011, 'framing', 'Checksum']);
        assert.match(error.message, /^E1011 payload-checksum, at byte \d+: /);
        return error.offset > 0;
    });
    assert.ok(decoder.tracks().length > 0 && decoder.array(Arrays.PointsCells).length > 0);
    assert.throws(push, { id: 4011 });
    decoder.reset();
    assert.equal([...decoder.push(stream('points'))].at(-1).kind, 'end');
});

test('limits hold, and names that are none are refused', async () => {
    const { valid, error } = await validate(stream('points'), { tracks: 0 });
    assert.equal(valid, false);
    assert.deepEqual([error.id, error.limit, error.asked, error.allowed], [2013, 'tracks', 1, 0]);
    assert.throws(() => new Decoder({ memory: 1 }), TypeError);
    assert.throws(() => new Decoder().array(10), { id: 9001 });
    assert.throws(() => new Decoder().array(Arrays.Regions, 1), { id: 9003 });
});

test('bytes come in any view, and what is no bytes is refused', async () => {
    const bytes = stream('probes');
    const { buffer, byteOffset, byteLength } = bytes;
    const frames = async (input) => {
        let count = 0;
        for await (const { kind } of decode(input)) count += kind === 'frame';
        return count;
    };
    assert.equal(await frames(new DataView(buffer, byteOffset, byteLength)), 2);
    assert.equal(await frames(new Blob([bytes])), 2);
    assert.equal(await frames(new Response(bytes)), 2);
    await assert.rejects(frames(new Response(null, { status: 204 })), { id: 1019 });
    for (const input of [null, 7, 'text', {}]) await assert.rejects(frames(input), TypeError);
    assert.throws(() => [...new Decoder().push('text')], TypeError);
});

test('validate says what is wrong', async () => {
    assert.equal((await validate(stream('probes'))).frames, 2);
    assert.equal((await validate(stream('probes').subarray(0, -1))).error.id, 1019);
    assert.equal((await validate(new Uint8Array(20))).error.id, 1001);
});

test('a decoder gives its memory back to itself', () => {
    const decoder = new Decoder();
    const bytes = stream('points');
    const sizes = Array.from({ length: 50 }, () => {
        decoder.reset();
        for (const _ of decoder.push(bytes));
        return decoder.memoryBytes;
    });
    assert.equal(sizes[49], sizes[5]);
});

test('the module without zstd refuses records of zstd and no others', async () => {
    const module = await WebAssembly.compile(file('../dapple-without-zstd.wasm'));
    const whole = Decoder.module;
    Decoder.module = module;
    try {
        assert.deepEqual([...new Decoder().push(stream('probes'))].at(-1), { kind: 'end' });
        assert.throws(() => [...new Decoder().push(stream('points'))], { id: 1010, class: 'Unsupported', found: 2 });
    } finally {
        Decoder.module = whole;
    }
});

test('sizes are within those of the table in README.md', () => {
    const readme = readFileSync(new URL('../README.md', import.meta.url), 'utf8');
    const rows = [...readme.matchAll(/^\| `([a-z.-]+)` \| ([\d ]+) \| ([\d ]+) \|/gm)];
    assert.equal(rows.length, 3);
    for (const [, name, ...bounds] of rows) {
        const bytes = file(`../${name}`);
        const brotli = brotliCompressSync(bytes, {
            params: { [constants.BROTLI_PARAM_QUALITY]: 11, [constants.BROTLI_PARAM_SIZE_HINT]: bytes.length },
        });
        const [raw, packed] = bounds.map((bound) => Number(bound.replaceAll(' ', '')));
        console.log(`${name}: ${bytes.length} bytes, brotli ${brotli.length}`);
        assert.ok(bytes.length <= raw && brotli.length <= packed, `${name}: ${bytes.length}, ${brotli.length}`);
        // The table follows what becomes smaller, too.
        assert.ok(brotli.length > 0.9 * packed, `${name} is smaller than the table says`);
    }
});
